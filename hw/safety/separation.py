"""The gap between robot and user, the closing speed of a velocity, and the track of the user.

Gaps are from the footprint to the user's cylinder; m, s, m/s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from hw.geometry import Twist2
from hw.motion import Motion

QUICK, STEADY = 0.1, 0.3
"""Windows over which the user's speed is estimated, s."""
_FAR = 1e4
"""Poses farther than this from the origin of the map are refused, m."""
_TOUCH = 1e-9
"""Below this distance, m, the normal of the nearest side replaces the direction to the user."""


class Nearness(NamedTuple):
    """The user relative to the footprint, in the base frame.

    `gap`: free distance, m, below 0 in a touch. `nx`, `ny`: unit vector from the nearest point of
    the footprint to the user. `lever`: m; a rotation of w rad/s closes the gap by w * lever m/s.
    """

    gap: float
    nx: float
    ny: float
    lever: float

    def closing(self, twist: Twist2) -> float:
        """Closing speed of this velocity (base frame), m/s; parts that open the gap count as 0."""
        toward = self.nx * twist.vx + self.ny * twist.vy
        turning = self.lever * twist.wz
        return (toward if toward > 0.0 else 0.0) + (turning if turning > 0.0 else 0.0)

    def held_back(self, twist: Twist2, allowed: float, holonomic: bool = True) -> Twist2:
        """The velocity with its closing parts scaled down to this closing speed, m/s.

        Returns the same object if it closes no faster. The component towards the user and a closing
        rotation are scaled by one share; a base that is not holonomic keeps its heading and slows.
        """
        closing = self.closing(twist)
        if closing <= allowed:
            return twist
        left = allowed / closing
        vx, vy, wz = twist.vx, twist.vy, twist.wz
        if self.lever * wz > 0.0:
            wz *= left
        toward = self.nx * vx + self.ny * vy
        if toward <= 0.0:
            return Twist2(vx, vy, wz)
        if not holonomic:
            return Twist2(left * vx, left * vy, wz)
        taken = (1.0 - left) * toward
        return Twist2(vx - taken * self.nx, vy - taken * self.ny, wz)


def nearness(half_length: float, half_width: float, x: float, y: float, radius: float) -> Nearness:
    """The nearness of a cylinder about (x, y), base frame, to the rectangle about the origin.

    The nearest point q of the footprint moves with (vx - wz qy, vy + wz qx) as the base moves.
    Its component along the normal n is nx vx + ny vy + wz (qx ny - qy nx): that is the rate at
    which the gap shrinks, and qx ny - qy nx the lever. With the cylinder's centre inside the
    rectangle, q lies on the nearest side.
    """
    qx = x if abs(x) < half_length else math.copysign(half_length, x)
    qy = y if abs(y) < half_width else math.copysign(half_width, y)
    dx, dy = x - qx, y - qy
    distance = math.hypot(dx, dy)
    if distance > _TOUCH:
        nx, ny = dx / distance, dy / distance
    elif half_width - abs(y) <= half_length - abs(x):
        nx, ny = 0.0, math.copysign(1.0, y)
        qy, distance = ny * half_width, abs(y) - half_width
    else:
        nx, ny = math.copysign(1.0, x), 0.0
        qx, distance = nx * half_length, abs(x) - half_length
    return Nearness(distance - radius, nx, ny, qx * ny - qy * nx)


class UserTrack:
    """Where the user was last seen, and how fast they were; the newest pose replaces the others.

    `x`, `y` in the map and `stamp_ns` are those of the newest pose (None before the first). `speed`
    is the greater of the speeds over the last 0.1 s, which reacts at once to a user who sets off,
    and 0.3 s; `steady` is that over 0.3 s alone, which noise does not raise above standing. m/s,
    None while unknown. A stamp may be `ahead` s ahead of our clock.
    """

    __slots__ = ("_ahead_ns", "_quick", "_steady", "speed", "stamp_ns", "steady", "x", "y")

    def __init__(self, ahead: float = 0.02) -> None:
        self._ahead_ns = round(ahead * 1e9)
        self.x = self.y = 0.0
        self.stamp_ns: int | None = None
        self.speed: float | None = None
        self.steady: float | None = None
        self._quick, self._steady = Motion(QUICK), Motion(STEADY)

    def age_s(self, now_ns: int) -> float:
        """Age of the newest pose, s; infinite before the first, negative if it is ahead of now."""
        return math.inf if self.stamp_ns is None else (now_ns - self.stamp_ns) / 1e9

    def leap(self, span_ns: int) -> None:
        """Pass over poses equal to those of the last 0.3 s, at the same rhythm, for so long, ns."""
        if self.stamp_ns is not None:
            self.stamp_ns += span_ns
        self._quick.leap(span_ns)
        self._steady.leap(span_ns)

    def add_position(self, now_ns: int, stamp_ns: int, x: float, y: float) -> bool:
        """Take a pose that arrived now; False if out of range, not newer, or from the future."""
        newest = self.stamp_ns
        if not (abs(x) < _FAR and abs(y) < _FAR) or stamp_ns > now_ns + self._ahead_ns:
            return False
        stamp_ns = min(stamp_ns, now_ns)
        if newest is not None and stamp_ns <= newest:
            return False
        self.x, self.y, self.stamp_ns = x, y, stamp_ns
        self._quick.add_pose(stamp_ns, x, y)
        self._steady.add_pose(stamp_ns, x, y)
        quick, steady = self._quick.velocity, self._steady.velocity
        self.steady = None if steady is None else steady.speed
        if quick is None or steady is None:
            self.speed = None
        else:
            self.speed = max(quick.speed, steady.speed)
        return True
