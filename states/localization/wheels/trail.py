"""Odometry poses of the last seconds: interpolated, extrapolated, and the velocities between."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque

from hw import STILL, Pose2, Twist2, wrap

REMEMBERED = 4.0
"""Length of the trail, s; the newest two poses are kept in any case."""
FASTEST_M, FASTEST_RAD = 20.0, 30.0
"""No base moves faster than this, m/s and rad/s."""
BUNCHED_M = 3.0
"""Largest step between poses whose stamps are too close, m; a longer one is a reset of odometry."""
STILL_M, STILL_RAD = 1e-3, 1e-3
"""Wheels stand while they stay within this, m and rad, of where they stopped."""


class Trail:
    """odom_from_base by stamp; poses whose stamp is not newer are ignored."""

    def __init__(self) -> None:
        self._stamps: deque[int] = deque()
        self._poses: deque[Pose2] = deque()
        self._stood_ns = 0
        self._stood_at: Pose2 | None = None
        self._velocity = STILL
        self.resets = 0

    @property
    def stamp_ns(self) -> int | None:
        """Stamp of the newest pose."""
        return self._stamps[-1] if self._stamps else None

    @property
    def pose(self) -> Pose2 | None:
        """The newest odom_from_base."""
        return self._poses[-1] if self._poses else None

    @property
    def standing(self) -> float:
        """Time since the wheels last moved, s."""
        return (self._stamps[-1] - self._stood_ns) * 1e-9 if self._stamps else 0.0

    def put(self, stamp_ns: int, odom_from_base: Pose2) -> bool:
        """Add a pose; False if it is not newer than the last. A reset of odometry starts over."""
        if self._stamps and stamp_ns <= self._stamps[-1]:
            return False
        if self._has_jumped(stamp_ns, odom_from_base):
            self._stamps.clear()
            self._poses.clear()
            self._stood_at = None
            self.resets += 1
        self._velocity = self._velocity_to(stamp_ns, odom_from_base)
        self._stamps.append(stamp_ns)
        self._poses.append(odom_from_base)
        while len(self._stamps) > 2 and self._stamps[1] < stamp_ns - REMEMBERED * 1e9:
            self._stamps.popleft()
            self._poses.popleft()
        stood = self._stood_at
        if stood is None or not stood.is_near(odom_from_base, STILL_M, STILL_RAD):
            self._stood_at, self._stood_ns = odom_from_base, stamp_ns
        return True

    def _has_jumped(self, stamp_ns: int, odom_from_base: Pose2) -> bool:
        # a step alone says it: many loggers write stamps in bunches, milliseconds apart
        if not self._stamps:
            return False
        time = (stamp_ns - self._stamps[-1]) * 1e-9
        return self._poses[-1].distance_to(odom_from_base) > BUNCHED_M + FASTEST_M * time

    def at(self, stamp_ns: int) -> Pose2 | None:
        """odom_from_base at a stamp, interpolated linearly; None before the trail.

        After the newest pose the base is assumed to keep its velocity.
        """
        stamps = self._stamps
        if not stamps or stamp_ns < stamps[0]:
            return None
        if stamp_ns >= stamps[-1]:
            ahead = (stamp_ns - stamps[-1]) * 1e-9
            return self._poses[-1] @ displacement_of(self.last_velocity(), ahead)
        after = bisect_left(stamps, stamp_ns)
        if stamps[after] == stamp_ns:
            return self._poses[after]
        before = after - 1
        share = (stamp_ns - stamps[before]) / (stamps[after] - stamps[before])
        return self._poses[before].between(self._poses[after], share)

    def velocity(self, first_ns: int, last_ns: int) -> Twist2:
        """Mean velocity between two stamps, in the base frame; the last one where unknown."""
        first, last = self.at(first_ns), self.at(last_ns)
        if first is None or last is None or last_ns <= first_ns:
            return self.last_velocity()
        return velocity_of(first.inverse() @ last, (last_ns - first_ns) * 1e-9)

    def last_velocity(self) -> Twist2:
        """Velocity between the newest two poses."""
        return self._velocity

    def _velocity_to(self, stamp_ns: int, odom_from_base: Pose2) -> Twist2:
        if not self._stamps:
            return STILL
        moved = self._poses[-1].inverse() @ odom_from_base
        velocity = velocity_of(moved, (stamp_ns - self._stamps[-1]) * 1e-9)
        speed = math.hypot(velocity.vx, velocity.vy)
        possible = speed < FASTEST_M and abs(velocity.wz) < FASTEST_RAD
        return velocity if possible else self._velocity


def displacement_of(velocity: Twist2, time: float) -> Pose2:
    """Displacement by a constant velocity in the moving frame, over `time` s: an arc.

    The integral of R(wz s) (vx, vy): (a -b; b a) (vx, vy) time, with a = sin(t)/t and b = (1 -
    cos(t))/t for the turn t.
    """
    turn = velocity.wz * time
    if abs(turn) < 1e-9:
        along, across = 1.0, 0.5 * turn
    else:
        along, across = math.sin(turn) / turn, 2.0 * math.sin(0.5 * turn) ** 2 / turn
    x, y = velocity.vx * time, velocity.vy * time
    return Pose2(along * x - across * y, across * x + along * y, wrap(turn))


def velocity_of(moved: Pose2, time: float) -> Twist2:
    """The constant velocity in the moving frame that gives this displacement in `time` s.

    Inverts `displacement_of`: (h cot h, h; -h, h cot h) / time with h half the turn.
    """
    half = 0.5 * moved.yaw
    along = 1.0 - half * half / 3.0 if abs(half) < 1e-4 else half / math.tan(half)
    x, y = along * moved.x + half * moved.y, along * moved.y - half * moved.x
    return Twist2(x / time, y / time, moved.yaw / time)
