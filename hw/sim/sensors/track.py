"""Past poses of a body, for sensors that look back when they are sampled.

Between two recorded instants it is assumed to move straight and to turn uniformly. The base records
each cycle of its loop (dt = 10 ms), so with an acceleration a the error is at most a dt^2 / 8: 0.04
mm at 3 m/s2.

They are rows of one array, (n, 4): stamp in ns (exact up to 2^53 ns, 104 days), x, y in the map
(m), and the yaw, not wrapped (rad), so that it can be interpolated.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from hw.geometry import Pose2
from hw.jit import compiled, example, wrapped

Rows = NDArray[np.float64]
PastPoses = tuple[Rows, int, int]
"""Rows of poses, the first that is known, and the one after the newest."""
TrackPose = tuple[float, float, float]
"""x, y in the map (m) and the yaw, not wrapped (rad)."""
KEPT_NS = 5_000_000_000
"""Longest look back, ns; sensors look back over a second and their delay at most."""
_ROOM = 2048
"""Rows for which there is room at first."""


class Track:
    """Poses at rising times, the newest `KEPT_NS` and the one before them; see the module."""

    __slots__ = ("past",)

    def __init__(self, start: Pose2) -> None:
        rows: Rows = np.zeros((_ROOM, 4))
        rows[0, 1:] = start.x, start.y, start.yaw
        self.past: PastPoses = rows, 0, 1

    def note(self, now_ns: int, pose: Pose2) -> None:
        """Record the pose at now_ns, which does not go back; the last one of an instant counts."""
        self.extend((now_ns,), ((pose.x, pose.y, pose.yaw),))

    def extend(self, stamps: Sequence[int], places: Iterable[Sequence[float]]) -> None:
        """Record places (x, y, yaw) at these stamps, ns."""
        for now_ns, (x, y, yaw) in zip(stamps, places, strict=True):
            if self.past[2] == len(self.past[0]):
                self._make_room()
            self.past = self.past[0], *noted(self.past, now_ns, x, y, yaw)

    def held(self, stamp_ns: int) -> TrackPose:
        """The pose at a stamp; beyond the ends the one at that end."""
        return held(self.past, stamp_ns)

    def _make_room(self) -> None:
        """Move what is known to the start of an array of twice its length, or more."""
        rows, first, end = self.past
        known = rows[first:end]
        more = np.zeros((max(_ROOM, 2 * len(known)), 4))
        more[: len(known)] = known
        self.past = more, 0, len(known)


@compiled
def noted(past: PastPoses, now_ns: int, x: float, y: float, yaw: float) -> tuple[int, int]:
    """Add a pose after the newest, in place; there must be room. Returns the new ends."""
    rows, first, end = past
    last = rows[end - 1]
    yaw = last[3] + wrapped(yaw - last[3])
    still = x == last[1] and y == last[2] and yaw == last[3]
    if end > 1:
        before = rows[end - 2]
        still = still and x == before[1] and y == before[2] and yaw == before[3]
    if now_ns <= last[0] or (still and end > 1):
        end -= 1  # the last of an instant counts; who stands on takes no room
    rows[end, 0], rows[end, 1], rows[end, 2], rows[end, 3] = max(last[0], now_ns), x, y, yaw
    oldest = now_ns - KEPT_NS
    while first + 1 < end and rows[first + 1, 0] < oldest:
        first += 1
    return first, end + 1


@compiled
def held(past: PastPoses, stamp_ns: int) -> TrackPose:
    """The pose of a track at a stamp; beyond the ends the one at that end."""
    rows, first, end = past
    n = end - 1
    if stamp_ns >= rows[n, 0]:
        return rows[n, 1], rows[n, 2], rows[n, 3]
    n = first + int(np.searchsorted(rows[first:n, 0], stamp_ns))
    if rows[n, 0] == stamp_ns or n == first:
        return rows[n, 1], rows[n, 2], rows[n, 3]
    a, b = rows[n - 1], rows[n]
    share = (stamp_ns - a[0]) / (b[0] - a[0])
    return (
        a[1] + share * (b[1] - a[1]),
        a[2] + share * (b[2] - a[2]),
        a[3] + share * (b[3] - a[3]),
    )


@compiled
def knots(past: PastPoses, start_ns: int, end_ns: int) -> Rows:
    """(n, 4): s after start_ns, x, y, yaw, from start to end; linear in between, n >= 2."""
    rows, first, end = past
    low = end
    while low > first and rows[low - 1, 0] > start_ns:
        low -= 1
    high = low
    while high < end and rows[high, 0] < end_ns:
        high += 1
    found = np.empty((high - low + 2, 4))
    found[0, 0], found[-1, 0] = 0.0, (end_ns - start_ns) * 1e-9
    found[0, 1], found[0, 2], found[0, 3] = held(past, start_ns)
    found[-1, 1], found[-1, 2], found[-1, 3] = held(past, end_ns)
    for n in range(low, high):
        found[n - low + 1, 0] = (rows[n, 0] - start_ns) * 1e-9
        found[n - low + 1, 1:] = rows[n, 1:]
    return found


@example
def _example() -> None:
    past = np.zeros((2, 4)), 0, 1
    noted(past, 1, 0.0, 0.0, 0.0)
    held(past, 1)
