"""Says when the wheels tell another way than the scans, by more than slip explains (R28)."""

from __future__ import annotations

import math
from collections import deque

from hw.geometry import Pose2, wrap

WINDOW = 1.0
"""Ways are compared over so long, s."""
SLIP_M, SLIP_SHARE = 0.08, 0.3
"""What slip explains: m, and a share of the way."""
SLIP_RAD, TURN_SHARE, TURN_PER_METRE = 0.05, 0.3, 0.15
"""What slip explains: rad, a share of the turn, and rad per m of the way."""
CLEARED = 10.0
"""Wheels that were wrong are right again after so long without a difference, s."""


class OdometryWatch:
    """Compares the ways of the last second; told of every healthy match."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, Pose2, Pose2]] = deque()
        self._wrong_ns: int | None = None

    @property
    def wrong(self) -> bool:
        """Did the ways differ lately?"""
        return self._wrong_ns is not None

    def moved_at_rest(self, stamp_ns: int) -> None:
        """The base was seen elsewhere while its wheels stood."""
        self._wrong_ns = stamp_ns

    def restart(self) -> None:
        """The base was found elsewhere: ways from before it tell nothing."""
        self._seen.clear()

    def see(self, stamp_ns: int, map_from_base: Pose2, odom_from_base: Pose2) -> None:
        """Where a scan and where the wheels say the base was at a stamp."""
        seen = self._seen
        if seen and stamp_ns <= seen[-1][0]:
            return
        seen.append((stamp_ns, map_from_base, odom_from_base))
        while len(seen) > 2 and seen[1][0] <= stamp_ns - WINDOW * 1e9:
            seen.popleft()
        _, first_map, first_odom = seen[0]
        true = first_map.inverse() @ map_from_base
        told = first_odom.inverse() @ odom_from_base
        if not _explained(true, told):
            self._wrong_ns = stamp_ns
        elif self._wrong_ns is not None and stamp_ns - self._wrong_ns > CLEARED * 1e9:
            self._wrong_ns = None


def _explained(true: Pose2, told: Pose2) -> bool:
    way = max(_length(true), _length(told))
    turn = max(abs(true.yaw), abs(told.yaw))
    aside = true.distance_to(told) - 0.5 * way * turn * SLIP_SHARE
    off = abs(wrap(true.yaw - told.yaw))
    fits = aside <= SLIP_M + SLIP_SHARE * way
    return fits and off <= SLIP_RAD + TURN_SHARE * turn + TURN_PER_METRE * way


def _length(pose: Pose2) -> float:
    return math.hypot(pose.x, pose.y)
