"""What a global planner finds: a polyline in the map for the robot's centre."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from hw.room import Point


@dataclass(frozen=True, slots=True)
class Path:
    """A path from the first point to the last, m, in the map.

    `radii[i]` is the radius of the bend from point i to point i + 1, infinite on straights. Bends
    are drawn by their tangents, from outside; `length` counts the arcs themselves, which are up to
    0.03 % shorter than the polyline.
    """

    points: tuple[Point, ...]
    radii: tuple[float, ...]
    length: float

    @classmethod
    def of_points(cls, points: Sequence[Point]) -> Path:
        """A path of straight legs with corners between them."""
        legs = list(itertools.pairwise(points))
        length = math.fsum(math.dist(a, b) for a, b in legs)
        return cls(tuple(points), (math.inf,) * len(legs), length)
