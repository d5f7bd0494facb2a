"""Detects wheels whose motion differs from the scans' by more than slip explains (R28)."""

from __future__ import annotations

import math
from collections import deque

from hw.geometry import Pose2, wrap

WINDOW = 1.0
"""Time over which motions are compared, s."""
SLIP_M, SLIP_SHARE = 0.08, 0.3
"""Difference explained by slip: m, plus a share of the distance."""
SLIP_RAD, TURN_SHARE, TURN_PER_METRE = 0.05, 0.3, 0.15
"""Difference explained by slip: rad, plus a share of the turn, plus rad per m of distance."""
CLEARED = 10.0
"""Time without a difference after which wheels are believed again, s."""


class OdometryWatch:
    """Compares the motion of the last second by wheels and by scans, at every healthy match."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, Pose2, Pose2]] = deque()
        self._wrong_ns: int | None = None

    @property
    def wrong(self) -> bool:
        """True if the motions have differed within the last `CLEARED` s."""
        return self._wrong_ns is not None

    def moved_at_rest(self, stamp_ns: int) -> None:
        """Note that the base was seen elsewhere while its wheels stood."""
        self._wrong_ns = stamp_ns

    def restart(self) -> None:
        """Forget earlier motion: the base was found elsewhere."""
        self._seen.clear()

    def see(self, stamp_ns: int, map_from_base: Pose2, odom_from_base: Pose2) -> None:
        """Take the pose by a scan and by the wheels at one stamp."""
        seen = self._seen
        if seen and stamp_ns <= seen[-1][0]:
            return
        seen.append((stamp_ns, map_from_base, odom_from_base))
        while len(seen) > 2 and seen[1][0] <= stamp_ns - WINDOW * 1e9:
            seen.popleft()
        _, first_map, first_odom = seen[0]
        by_scans = first_map.inverse() @ map_from_base
        by_wheels = first_odom.inverse() @ odom_from_base
        if not _explained(by_scans, by_wheels):
            self._wrong_ns = stamp_ns
        elif self._wrong_ns is not None and stamp_ns - self._wrong_ns > CLEARED * 1e9:
            self._wrong_ns = None


def _explained(by_scans: Pose2, by_wheels: Pose2) -> bool:
    distance = max(_length(by_scans), _length(by_wheels))
    turn = max(abs(by_scans.yaw), abs(by_wheels.yaw))
    # a turn that is off by this share, evenly along the way, moves its end by half the way times it
    aside = by_scans.distance_to(by_wheels) - 0.5 * distance * turn * SLIP_SHARE
    off = abs(wrap(by_scans.yaw - by_wheels.yaw))
    fits = aside <= SLIP_M + SLIP_SHARE * distance
    return fits and off <= SLIP_RAD + TURN_SHARE * turn + TURN_PER_METRE * distance


def _length(pose: Pose2) -> float:
    return math.hypot(pose.x, pose.y)
