"""Drift of the tracking's frame since its calibration, watched while the robot drives.

A restart of the tracking can shift its frame by centimetres and turn it by 0.9 degrees; a base
station that was knocked does so slowly. The pose by trackers and the pose by scanners then differ
permanently, which the gate of a filter does not show.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Literal

from hw import Pose2, TrackerPose, wrap
from hw.model import Tracking
from states.localization.wheels.tracker_feed import TrackerFeed

MOVED = (0.05, math.radians(0.8))
"""Differences above these are reported while driving, m and rad; smaller ones may be a tracker's
bias at the border of its coverage."""
COMPARED = 0.2
"""Period at which trackers are compared with the estimate, s."""
LEAST = 8
"""Least number of comparisons in each half of the window for a verdict."""

_Difference = tuple[int, float, float, float]


@dataclass(frozen=True, slots=True)
class Drift:
    """A difference between trackers and scanners, m and rad, and since when, ns.

    `jump`: more than half of it arose within the window; `drift`: it grew more slowly, or was there
    from the beginning.
    """

    kind: Literal["jump", "drift"]
    offset: float
    turn: float
    since_ns: int

    def __str__(self) -> str:
        size = f"{1e3 * self.offset:.0f} mm and {math.degrees(self.turn):.2f} degrees"
        return f"trackers and scanners differ by {size} ({self.kind}): calibrate anew"


class DriftWatch:
    """Compares two poses of the base, and reports a difference above the limits.

    Medians over both halves of a window are used, so that outliers and noise of either side do not
    count. A drift stays reported until the newer half is within the limits.
    """

    def __init__(
        self, offset: float = 0.02, turn: float = math.radians(0.5), window: float = 4.0
    ) -> None:
        self._limits = (offset, turn)
        self._half_ns = round(0.5e9 * window)
        self._differences: deque[_Difference] = deque()
        self._found: Drift | None = None

    def update(self, stamp_ns: int, by_trackers: Pose2, by_scanners: Pose2) -> Drift | None:
        """Take map_from_base by both, of the same stamp; the drift, or None within the limits.

        Needs four comparisons a second or more. Stamps that do not increase are ignored; after a
        gap as long as the window it starts over.
        """
        differences = self._differences
        if differences and stamp_ns <= differences[-1][0]:
            return self._found
        differences.append(
            (
                stamp_ns,
                by_trackers.x - by_scanners.x,
                by_trackers.y - by_scanners.y,
                wrap(by_trackers.yaw - by_scanners.yaw),
            )
        )
        while stamp_ns - differences[0][0] > 2 * self._half_ns:
            differences.popleft()
        newer = [d for d in differences if stamp_ns - d[0] < self._half_ns]
        older = [d for d in differences if stamp_ns - d[0] >= self._half_ns]
        if min(len(newer), len(older)) < LEAST:
            return self._found
        self._found = self._judged(_medians(older), _medians(newer), newer[0][0])
        return self._found

    def _judged(self, before: Sequence[float], now: Sequence[float], since_ns: int) -> Drift | None:
        size = self._size(now)
        if size <= 1.0:
            return None
        offset, turn = math.hypot(now[0], now[1]), abs(now[2])
        if self._found is not None:
            return Drift(self._found.kind, offset, turn, self._found.since_ns)
        change = self._size([b - a for a, b in zip(before, now, strict=True)])
        return Drift("jump" if change > 0.5 * size else "drift", offset, turn, since_ns)

    def _size(self, difference: Sequence[float]) -> float:
        """Size of a difference in units of the limits."""
        offset, turn = self._limits
        x, y, yaw = difference
        return max(math.hypot(x, y) / offset, abs(yaw) / turn)


class TrackerComparison:
    """Compares trackers with the estimate of a localizer; `drift` is what it has found."""

    def __init__(self, tracking: Tracking) -> None:
        self._feed = TrackerFeed(tracking)
        self._watch = DriftWatch(*MOVED)
        self.drift: Drift | None = None

    def is_due(self, stamp_ns: int, seen: TrackerPose) -> bool:
        """Take a tracker pose; True if a comparison is due and two trackers are in view."""
        pose = self._feed.add_tracker_pose(stamp_ns, seen, COMPARED)
        return pose is not None and len(self._feed.each) >= 2

    def update(self, stamp_ns: int, known: Pose2) -> None:
        """Compare the trackers in view with map_from_base at this stamp.

        Only the best tracker is used: a tracker that was lost and came back is off by itself, while
        a tracking frame that has moved puts all of them off.
        """
        best = min(self._feed.each, key=lambda pose: _apart(known, pose))
        self.drift = self._watch.update(stamp_ns, best, known)


def _apart(one: Pose2, other: Pose2) -> float:
    """Difference of two poses in units of `MOVED`."""
    return max(one.distance_to(other) / MOVED[0], abs(wrap(one.yaw - other.yaw)) / MOVED[1])


def _medians(differences: list[_Difference]) -> list[float]:
    return [median(d[axis] for d in differences) for axis in (1, 2, 3)]
