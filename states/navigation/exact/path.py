"""What a global planner finds: a polyline in the map for the robot's centre."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hw.scene import Point


@dataclass(frozen=True, eq=False)
class Path:
    """A path from the first point to the last, in the map; m.

    `line` is (n, 3): x, y and the radius of the bend to the next point, infinite on straights and
    at the end; it is never changed. Bends are drawn by their tangents, from outside; `length`
    counts the arcs themselves, which are up to 0.03 % shorter than the polyline.
    """

    line: NDArray[np.float64]
    length: float

    @cached_property
    def points(self) -> tuple[Point, ...]:
        """The points of the polyline."""
        return tuple((x, y) for x, y, _ in self.line.tolist())

    @cached_property
    def radii(self) -> tuple[float, ...]:
        """The radius of the bend from each point but the last to the next."""
        return tuple(self.line[:-1, 2].tolist())

    @classmethod
    def straight(cls, start: Point, end: Point) -> Path:
        """The path of one leg."""
        line = np.array(((start[0], start[1], math.inf), (end[0], end[1], math.inf)))
        return cls(line, math.dist(start, end))

    @classmethod
    def of_points(cls, points: Sequence[Point]) -> Path:
        """A path of straight legs with corners between them."""
        length = math.fsum(math.dist(a, b) for a, b in itertools.pairwise(points))
        return cls(np.array([(x, y, math.inf) for x, y in points]), length)
