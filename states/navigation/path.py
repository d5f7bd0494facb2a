"""What a global planner finds: a line of points in the map that the robot's centre follows."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from hw.room import Point


@dataclass(frozen=True, slots=True)
class Path:
    """A way from the first point to the last, m, in the map.

    `radii[i]` is the radius of the bend from point i to point i + 1, infinite where the way is
    straight. Bends are drawn by tangents from outside, so the line never cuts them; `length`
    counts them as arcs, which is up to 0.03 % shorter than the line drawn.
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
