"""Stamped poses in order, bounded, and looked up between their stamps.

Trails of odometry, tracks for simulated sensors, walks of people and true poses of logs are
histories of this kind. They differ in how a pose between two others is found, and in what is there
beyond the ends: nothing (`at`), the pose at that end (`held`), or the line through the last poses
(`extended`).
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable
from typing import Generic, TypeVar

from hw.geometry import Pose2, displacement_of, velocity_of, wrap

P = TypeVar("P")
ALWAYS = 1 << 63
"""Longer than any history, ns."""
_SPARE = 256
"""Number of forgotten poses that are freed at once."""


class PoseHistory(Generic[P]):
    """Poses by rising stamps, ns; `between(a, b, share)` gives the one at this share of the way.

    A pose is a `Pose2`, or what else `between` takes. Kept are the poses of the last `kept_ns` and
    the one before them, so that this whole span is known. `newest` is the newest pose with its
    stamp, None while there is none.
    """

    __slots__ = ("_between", "_first", "_kept_ns", "_rows", "newest")

    def __init__(
        self,
        between: Callable[[P, P, float], P],
        kept_ns: int = ALWAYS,
        poses: Iterable[tuple[int, P]] = (),
    ) -> None:
        self._between, self._kept_ns = between, kept_ns
        self._rows: list[tuple[int, P]] = []
        self.clear()
        for stamp_ns, pose in poses:
            self.insert(stamp_ns, pose)

    @property
    def oldest_ns(self) -> int:
        """The oldest known instant, ns; there must be a pose."""
        return self._rows[self._first][0]

    def clear(self) -> None:
        """Forget all poses."""
        self.newest: tuple[int, P] | None = None
        self._first = 0
        self._rows.clear()

    def insert(self, stamp_ns: int, pose: P) -> None:
        """Add a pose, a late one in its place; one of the same stamp is replaced."""
        rows, row = self._rows, (stamp_ns, pose)
        if rows and stamp_ns <= rows[-1][0]:
            self._put_late(row)
            return
        rows.append(row)
        self.newest = row
        first, oldest = self._first, stamp_ns - self._kept_ns
        while rows[first][0] < oldest and rows[first + 1][0] < oldest:
            first += 1
        self._first = first
        if first >= _SPARE:
            del rows[:first]
            self._first = 0

    def _put_late(self, row: tuple[int, P]) -> None:
        rows = self._rows
        n = bisect_left(rows, row[:1], self._first)
        if rows[n][0] == row[0]:
            rows[n] = row
        else:
            rows.insert(n, row)
        self.newest = rows[-1]

    def at(self, stamp_ns: int, longest_ns: int = ALWAYS) -> P | None:
        """The pose at a stamp; None beyond the ends, and in gaps longer than this, ns."""
        if self.newest is None or stamp_ns > self.newest[0]:
            return None
        rows = self._rows
        n = bisect_left(rows, (stamp_ns,), self._first)  # a shorter tuple is before longer ones
        until, after = rows[n]
        if until == stamp_ns:
            return after
        if n == self._first:
            return None
        since, before = rows[n - 1]
        if until - since > longest_ns:
            return None
        return self._between(before, after, (stamp_ns - since) / (until - since))

    def held(self, stamp_ns: int) -> P:
        """Like `at`, but beyond the ends the pose at that end; there must be a pose."""
        last, pose = self._rows[-1]
        if stamp_ns >= last:
            return pose
        found = self.at(stamp_ns)
        return self._rows[self._first][1] if found is None else found

    def extended(self, stamp_ns: int, over_ns: int = 0) -> P:
        """Like `held`, but after the newest pose along the line through it and an earlier one.

        That is the oldest within `over_ns`, or else the one before the newest: with close poses
        noise would dominate.
        """
        rows, (last, pose) = self._rows, self._rows[-1]
        if stamp_ns <= last or len(rows) == 1:
            return self.held(stamp_ns)
        start = min(bisect_left(rows, (last - over_ns,), self._first), len(rows) - 2)
        since, before = rows[start]
        return self._between(before, pose, (stamp_ns - since) / (last - since))

    def inside(self, start_ns: int, end_ns: int) -> list[tuple[int, P]]:
        """The poses after a stamp and before another, with their stamps."""
        rows = self._rows
        low = bisect_left(rows, (start_ns + 1,), self._first)
        return rows[low : bisect_left(rows, (end_ns,), low)]


def wrapped(a: Pose2, b: Pose2, share: float) -> Pose2:
    """Like `Pose2.between`, but the yaw is wrapped."""
    pose = a.between(b, share)
    return Pose2(pose.x, pose.y, wrap(pose.yaw))


def along_arc(a: Pose2, b: Pose2, share: float) -> Pose2:
    """On the arc from a to b that a constant velocity in the moving frame draws."""
    return a @ displacement_of(velocity_of(a.inverse() @ b, 1.0), share)
