"""Walls of the virtual world that can be touched."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hw.geometry import Pose2, wrap
from hw.scene.room import Point, distance_to_segment

TOUCH_HEIGHT = 1.5
"""Height at which a surface is touched if it reaches that high, m above the floor (R132)."""


@dataclass(frozen=True, slots=True)
class Surface:
    """An upright wall of the virtual world over a line on the floor, from `low` to `high`, m."""

    start: Point
    end: Point
    low: float = 0.0
    high: float = 2.0

    @property
    def touching_height(self) -> float:
        """Height of a touch, m above the floor: TOUCH_HEIGHT, clamped to the surface."""
        return min(max(TOUCH_HEIGHT, self.low), self.high)

    def distance(self, x: float, y: float) -> float:
        """Distance of a point of the floor to the line, m."""
        return distance_to_segment(x, y, (*self.start, *self.end))

    def seen_from(self, view: Pose2) -> Point | None:
        """The point where the view ray meets the line; None if it does not."""
        ax, ay = view.inverse().transform(*self.start)
        bx, by = view.inverse().transform(*self.end)
        if ay == by or (ay > 0.0) == (by > 0.0):
            return None
        ahead = ax - ay * (bx - ax) / (by - ay)
        return view.transform(ahead, 0.0) if ahead > 0.0 else None

    def angle_from(self, view: Pose2) -> float:
        """Angle between the view and the surface's normal, rad in [0, pi/2]."""
        along = math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])
        return abs(math.pi / 2.0 - abs(wrap(view.yaw - along)))
