"""Odometry poses of the last seconds: interpolated, extrapolated, and the velocities between."""

from __future__ import annotations

import math

from hw import STILL, Pose2, Twist2, displacement_of, velocity_of
from hw.motion import PoseHistory

REMEMBERED_NS = 4_000_000_000
"""Length of the trail, ns."""
FASTEST_M, FASTEST_RAD = 20.0, 30.0
"""No base moves faster than this, m/s and rad/s."""
BUNCHED_M = 3.0
"""Largest step between poses whose stamps are too close, m; a longer one is a reset of odometry."""
STILL_M, STILL_RAD = 1e-3, 1e-3
"""Wheels stand while they stay within this, m and rad, of where they stopped."""


class Trail:
    """odom_from_base by stamp; poses whose stamp is not newer are ignored."""

    def __init__(self) -> None:
        self._past = PoseHistory(Pose2.between, REMEMBERED_NS)
        self._stood_ns = 0
        self._stood_at: Pose2 | None = None
        self._velocity = STILL
        self.resets = 0

    @property
    def stamp_ns(self) -> int | None:
        """Stamp of the newest pose."""
        return None if self._past.newest is None else self._past.newest[0]

    @property
    def pose(self) -> Pose2 | None:
        """The newest odom_from_base."""
        return None if self._past.newest is None else self._past.newest[1]

    @property
    def standing(self) -> float:
        """Time since the wheels last moved, s."""
        newest = self._past.newest
        return 0.0 if newest is None else (newest[0] - self._stood_ns) * 1e-9

    def add_odometry(self, stamp_ns: int, odom_from_base: Pose2) -> bool:
        """Add a pose; False if it is not newer than the last. A reset of odometry starts over."""
        past = self._past
        if past.newest is not None and stamp_ns <= past.newest[0]:
            return False
        if self._has_jumped(stamp_ns, odom_from_base):
            past.clear()
            self._stood_at = None
            self.resets += 1
        self._velocity = self._velocity_to(stamp_ns, odom_from_base)
        past.insert(stamp_ns, odom_from_base)
        stood = self._stood_at
        if stood is None or not stood.is_near(odom_from_base, STILL_M, STILL_RAD):
            self._stood_at, self._stood_ns = odom_from_base, stamp_ns
        return True

    def _has_jumped(self, stamp_ns: int, odom_from_base: Pose2) -> bool:
        # a step alone says it: many loggers write stamps in bunches, milliseconds apart
        if self._past.newest is None:
            return False
        last_ns, last = self._past.newest
        time = (stamp_ns - last_ns) * 1e-9
        return last.distance_to(odom_from_base) > BUNCHED_M + FASTEST_M * time

    def at(self, stamp_ns: int) -> Pose2 | None:
        """odom_from_base at a stamp, interpolated linearly; None before the trail.

        After the newest pose the base is assumed to keep its velocity.
        """
        if self._past.newest is None:
            return None
        last_ns, last = self._past.newest
        if stamp_ns < last_ns:
            return self._past.at(stamp_ns)
        return last @ displacement_of(self._velocity, (stamp_ns - last_ns) * 1e-9)

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
        if self._past.newest is None:
            return STILL
        last_ns, last = self._past.newest
        velocity = velocity_of(last.inverse() @ odom_from_base, (stamp_ns - last_ns) * 1e-9)
        speed = math.hypot(velocity.vx, velocity.vy)
        possible = speed < FASTEST_M and abs(velocity.wz) < FASTEST_RAD
        return velocity if possible else self._velocity
