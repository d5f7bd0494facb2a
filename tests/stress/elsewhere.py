"""The same experiment elsewhere: moved, turned, later, wound up by whole turns, in few digits.

What a subject is told goes through an `Elsewhere`, and what it answers comes back through it. So
all answers are those of home but for rounding, whatever the subject computes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from hw.geometry import Pose2, Twist2, wrap
from hw.scene.room import Point, Ring, Room
from states.maps.distance import Array

ROUNDING = 2.0**-53
"""Half the distance from 1 to the next float64: the relative error of one operation."""
SINGLE = 2.0**-24
"""The same of float32."""
SIZE = 20.0
"""Coordinates at home are below this, m."""


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """Where, when and how it is told: `x`, `y`, m, and `turn`, rad, are elsewhere_from_home."""

    x: float = 0.0
    y: float = 0.0
    turn: float = 0.0
    since_ns: int = 0
    windings: int = 0
    """Whole turns that are added to every yaw."""
    single: bool = False
    """All numbers are rounded to float32."""

    def __str__(self) -> str:
        parts = {
            "at": f"{self.x:g},{self.y:g}" if self.x or self.y else "",
            "turned": f"{self.turn:.16g}" if self.turn else "",
            "since": f"{self.since_ns}" if self.since_ns else "",
            "wound": f"{self.windings}" if self.windings else "",
            "single": "float32" if self.single else "",
        }
        return "_".join(f"{name}={text}" for name, text in parts.items() if text) or "home"

    @property
    def error(self) -> float:
        """The error of what is told, m or rad."""
        far = SIZE + math.hypot(self.x, self.y)
        wound = 2.0 * math.pi * abs(self.windings)
        return (SINGLE if self.single else ROUNDING) * (far + wound)

    # what is told

    def number(self, value: float) -> float:
        return float(np.float32(value)) if self.single else value

    def yaw(self, yaw: float) -> float:
        return self.number(wrap(yaw + self.turn) + 2.0 * math.pi * self.windings)

    def vector(self, x: float, y: float) -> Point:
        c, s = math.cos(self.turn), math.sin(self.turn)
        return self.number(c * x - s * y), self.number(s * x + c * y)

    def point(self, x: float, y: float) -> Point:
        c, s = math.cos(self.turn), math.sin(self.turn)
        return self.number(self.x + (c * x - s * y)), self.number(self.y + (s * x + c * y))

    def pose(self, x: float, y: float, yaw: float = 0.0) -> Pose2:
        return Pose2(*self.point(x, y), self.yaw(yaw))

    def twist(self, vx: float, vy: float, wz: float = 0.0) -> Twist2:
        """A velocity along the axes of the map."""
        return Twist2(*self.vector(vx, vy), self.number(wz))

    def ring(self, ring: Iterable[Point]) -> Ring:
        return tuple(self.point(x, y) for x, y in ring)

    def room(self, room: Room) -> Room:
        walls, columns = (tuple(map(self.ring, rings)) for rings in (room.walls, room.columns))
        return Room(self.ring(room.outer), walls, columns)

    def points(self, points: Iterable[Sequence[float]]) -> Array:
        return np.array([self.point(x, y) for x, y in points])

    def ns(self, seconds: float) -> int:
        return self.since_ns + round(seconds * 1e9)

    # what is answered

    def home_point(self, x: float, y: float) -> list[float]:
        c, s = math.cos(self.turn), math.sin(self.turn)
        dx, dy = float(x) - self.x, float(y) - self.y
        return [c * dx + s * dy, c * dy - s * dx]

    def home_vector(self, x: float, y: float) -> list[float]:
        c, s = math.cos(self.turn), math.sin(self.turn)
        return [c * x + s * y, c * y - s * x]

    def home_yaw(self, yaw: float) -> list[float]:
        """As cosine and sine, so that whole turns do not count."""
        return [math.cos(yaw - self.turn), math.sin(yaw - self.turn)]

    def home_pose(self, pose: Pose2) -> list[float]:
        return [*self.home_point(pose.x, pose.y), *self.home_yaw(pose.yaw)]

    def home_twist(self, twist: Twist2) -> list[float]:
        return [*self.home_vector(twist.vx, twist.vy), twist.wz]

    def home_covariance(self, covariance: Array) -> list[float]:
        """Of x, y and maybe yaw."""
        n = len(covariance)
        turn = np.eye(n)
        c, s = math.cos(self.turn), math.sin(self.turn)
        turn[:2, :2] = [[c, s], [-s, c]]
        return (turn @ covariance @ turn.T).ravel().tolist()


HOME = Elsewhere()
