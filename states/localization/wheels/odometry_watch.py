"""Detects wheels whose motion differs from the scans' by more than slip explains (R28)."""

from __future__ import annotations

import math
from collections import deque

from hw import Pose2, wrap
from states.localization.wheels.trail import Trail

WINDOW_NS = 1_000_000_000
"""Time over which motions are compared, ns; two scans farther apart than that are compared, too."""
SLIP_M, SLIP_SHARE, SLIP_PER_RADIAN = 0.08, 0.3, 0.1
"""Difference explained by slip: m, plus a share of the distance, plus m per rad of the turn."""
SLIP_RAD, TURN_SHARE, TURN_PER_METRE = 0.05, 0.3, 0.15
"""Difference explained by slip: rad, plus a share of the turn, plus rad per m of distance."""
CONTRADICTIONS = 3
"""Differences in a row that make wheels wrong: a single one is more likely a wrong match."""
CLEARED_NS = 10_000_000_000
"""Time without disagreement until the wheels are trusted again, ns."""
SHIFTS_NS = (-125_000_000, 125_000_000, -250_000_000, 250_000_000)
"""Offsets of the wheels' clock that do not count as a disagreement, ns."""


class OdometryWatch:
    """Compares the motion of the last second by wheels and by scans, at every healthy match."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, Pose2, Pose2]] = deque()
        self._wrong_ns: int | None = None
        self._contradictions = 0

    @property
    def wrong(self) -> bool:
        """True if the motions have differed within the last `CLEARED_NS`."""
        return self._wrong_ns is not None

    @property
    def contradicted(self) -> bool:
        """True if the newest motions differed."""
        return self._contradictions > 0

    def moved_at_rest(self, stamp_ns: int) -> None:
        """Note that the base was seen elsewhere while its wheels stood."""
        self._wrong_ns = stamp_ns

    def restart(self) -> None:
        """Forget earlier motion: the base was found elsewhere."""
        self._seen.clear()
        self._contradictions = 0

    def add_match(self, stamp_ns: int, map_from_base: Pose2, trail: Trail) -> None:
        """Take the pose by a scan, and the wheels' poses up to then."""
        seen, odom_from_base = self._seen, trail.at(stamp_ns)
        if odom_from_base is None or (seen and stamp_ns <= seen[-1][0]):
            return
        seen.append((stamp_ns, map_from_base, odom_from_base))
        while len(seen) > 2 and seen[1][0] <= stamp_ns - WINDOW_NS:
            seen.popleft()
        first_ns, first_map, first_odom = seen[0]
        by_scans = first_map.inverse() @ map_from_base
        by_wheels = first_odom.inverse() @ odom_from_base
        if _explained(by_scans, by_wheels) or _is_shifted(by_scans, trail, first_ns, stamp_ns):
            self._contradictions = 0
            if self._wrong_ns is not None and stamp_ns - self._wrong_ns > CLEARED_NS:
                self._wrong_ns = None
            return
        self._contradictions += 1
        if self._contradictions >= CONTRADICTIONS:
            self._wrong_ns = stamp_ns


def _is_shifted(by_scans: Pose2, trail: Trail, first_ns: int, last_ns: int) -> bool:
    """True if the wheels have moved alike at some other time: their clock is off."""
    for shift_ns in SHIFTS_NS:
        first, last = trail.at(first_ns + shift_ns), trail.at(last_ns + shift_ns)
        if first is None or last is None:
            continue
        if _explained(by_scans, first.inverse() @ last):
            return True
    return False


def _explained(by_scans: Pose2, by_wheels: Pose2) -> bool:
    distance = max(_length(by_scans), _length(by_wheels))
    turn = max(abs(by_scans.yaw), abs(by_wheels.yaw))
    # a turn that is off by this share, evenly along the way, moves its end by half the way times it
    aside = by_scans.distance_to(by_wheels) - 0.5 * distance * turn * SLIP_SHARE
    off = abs(wrap(by_scans.yaw - by_wheels.yaw))
    fits = aside <= SLIP_M + SLIP_SHARE * distance + SLIP_PER_RADIAN * turn
    return fits and off <= SLIP_RAD + TURN_SHARE * turn + TURN_PER_METRE * distance


def _length(pose: Pose2) -> float:
    return math.hypot(pose.x, pose.y)
