"""The last seconds of wheel odometry: poses by stamp, velocities, and whether the wheels stand.

The poses are rows of one array, (n, 3): x, y in m and yaw in rad. Their stamps, ns, are in another:
those of a wall clock have no exact float64. Known are the poses from `first` to before `end`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hw import Pose2, Twist2, compiled, wrapped
from states.localization.wheels.steps import Planar, composed, pace, step, way
from states.maps import Array

REMEMBERED_NS = 4_000_000_000
"""Length of the trail, ns."""
FASTEST_M, FASTEST_RAD = 20.0, 30.0
"""No base moves faster than this, m/s and rad/s."""
BUNCHED_M = 3.0
"""Largest step between poses whose stamps are too close, m; a longer one is a reset of odometry."""
STILL_M, STILL_RAD = 1e-3, 1e-3
"""Wheels stand while they stay within this, m and rad, of where they stopped."""
_ROOM = 1024
"""Rows for which there is room at first."""
TrailPast = tuple[NDArray[np.int64], Array, int, int, Array]
"""Stamps, rows, the first and the end; the newest velocity and where the wheels stopped, (6,)."""


class Trail:
    """odom_from_base by stamp; poses whose stamp is not newer are ignored.

    `stamp_ns` is that of the newest pose, `standing` the time since the wheels last moved, s, and
    `resets` the number of times that odometry began anew.
    """

    def __init__(self) -> None:
        self.stamp_ns: int | None = None
        self.standing = 0.0
        self.resets = 0
        self._stood_ns = 0
        self.past: TrailPast = np.zeros(_ROOM, np.int64), np.zeros((_ROOM, 3)), 0, 0, np.zeros(6)

    @property
    def pose(self) -> Pose2 | None:
        """The newest odom_from_base."""
        _, rows, _, end, _ = self.past
        return None if self.stamp_ns is None else Pose2(*rows[end - 1].tolist())

    def add_odometry(self, stamp_ns: int, odom_from_base: Pose2) -> bool:
        """Add a pose; False if it is not newer than the last. A reset of odometry starts over."""
        if self.stamp_ns is not None and stamp_ns <= self.stamp_ns:
            return False
        if self.past[3] == len(self.past[0]):
            self._make_room()
        stamps, rows, _, end, newest = self.past
        stamps[end], rows[end, 0] = stamp_ns, odom_from_base.x
        rows[end, 1], rows[end, 2] = odom_from_base.y, odom_from_base.yaw
        first, jumped, stays = _added(self.past)
        self.past = stamps, rows, first, end + 1, newest
        self.resets += jumped
        if not stays:
            self._stood_ns = stamp_ns
        self.stamp_ns, self.standing = stamp_ns, (stamp_ns - self._stood_ns) * 1e-9
        return True

    def at(self, stamp_ns: int) -> Pose2 | None:
        """odom_from_base at a stamp, interpolated linearly; None before the trail.

        After the newest pose the base is assumed to keep its velocity.
        """
        known, place = at(self.past, stamp_ns)
        return Pose2(*place) if known else None

    def velocity(self, first_ns: int, last_ns: int) -> Twist2:
        """Mean velocity between two stamps, in the base frame; the last one where unknown."""
        return Twist2(*_mean_velocity(self.past, first_ns, last_ns))

    def last_velocity(self) -> Twist2:
        """Velocity between the newest two poses."""
        return Twist2(*self.past[4][:3].tolist())

    def _make_room(self) -> None:
        """Move what is known to the start of arrays of twice its length, or more."""
        stamps, rows, first, end, newest = self.past
        known, room = end - first, max(_ROOM, 2 * (end - first))
        later, more = np.zeros(room, np.int64), np.zeros((room, 3))
        later[:known], more[:known] = stamps[first:end], rows[first:end]
        self.past = later, more, 0, known, newest


@compiled
def _place(rows: Array, n: int) -> Planar:
    return rows[n, 0], rows[n, 1], rows[n, 2]


@compiled
def _added(past: TrailPast) -> tuple[int, bool, bool]:
    """Take the pose in the row at the end: the first row then, whether it jumped, and stood."""
    stamps, rows, first, end, newest = past
    place = _place(rows, end)
    velocity, known = (0.0, 0.0, 0.0), end > first
    jumped = stays = False
    if known:
        last, time = _place(rows, end - 1), (stamps[end] - stamps[end - 1]) * 1e-9
        # a step alone says it: many loggers write stamps in bunches, milliseconds apart
        far = math.hypot(place[0] - last[0], place[1] - last[1])
        jumped = far > BUNCHED_M + FASTEST_M * time
        if not jumped:
            velocity = pace(step(last, place), time)
            fast = not math.hypot(velocity[0], velocity[1]) < FASTEST_M
            if fast or not abs(velocity[2]) < FASTEST_RAD:
                velocity = newest[0], newest[1], newest[2]
            stays = math.hypot(place[0] - newest[3], place[1] - newest[4]) < STILL_M
            stays = stays and abs(wrapped(place[2] - newest[5])) < STILL_RAD
    newest[0], newest[1], newest[2] = velocity
    if not stays:
        newest[3], newest[4], newest[5] = place
    first = end if jumped else first
    oldest = stamps[end] - REMEMBERED_NS
    while first < end and stamps[first + 1] < oldest:
        first += 1
    return first, jumped, stays


@compiled
def at(past: TrailPast, stamp_ns: int) -> tuple[bool, Planar]:
    """Whether odom_from_base is known at a stamp, and what it is; see `Trail.at`."""
    stamps, rows, first, end, newest = past
    if end == first:
        return False, (0.0, 0.0, 0.0)
    n = end - 1
    if stamp_ns >= stamps[n]:
        velocity, time = (newest[0], newest[1], newest[2]), (stamp_ns - stamps[n]) * 1e-9
        return True, composed(_place(rows, n), way(velocity, time))
    n = first + int(np.searchsorted(stamps[first:n], stamp_ns))
    if stamps[n] == stamp_ns or n == first:
        return bool(stamps[n] == stamp_ns), _place(rows, n)
    a, b = _place(rows, n - 1), _place(rows, n)
    share = (stamp_ns - stamps[n - 1]) / (stamps[n] - stamps[n - 1])
    x, y = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
    return True, (x, y, a[2] + share * wrapped(b[2] - a[2]))


@compiled
def _mean_velocity(past: TrailPast, first_ns: int, last_ns: int) -> Planar:
    (since, first), (until, last), newest = at(past, first_ns), at(past, last_ns), past[4]
    if not (since and until) or last_ns <= first_ns:
        return newest[0], newest[1], newest[2]
    return pace(step(first, last), (last_ns - first_ns) * 1e-9)
