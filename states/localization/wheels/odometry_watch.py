"""Detects wheels whose motion differs from the scans' by more than slip explains (R28)."""

from __future__ import annotations

import math
from collections import deque

from hw import Pose2, compiled, wrapped
from states.localization.wheels.steps import Planar, place_of, step
from states.localization.wheels.trail import Trail, TrailPast, at

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
        self._seen: deque[tuple[int, Planar, Planar]] = deque()
        self._wrong_ns: int | None = None
        self._contradictions = 0
        here, past = (0.0, 0.0, 0.0), Trail().past  # compile now, not in a tick
        _is_explained(here, here, here, here)
        _is_shifted(here, here, past, 0, 0)

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
        seen, (known, odom) = self._seen, at(trail.past, stamp_ns)
        if not known or (seen and stamp_ns <= seen[-1][0]):
            return
        place = place_of(map_from_base)
        seen.append((stamp_ns, place, odom))
        while len(seen) > 2 and seen[1][0] <= stamp_ns - WINDOW_NS:
            seen.popleft()
        first_ns, first_map, first_odom = seen[0]
        if _is_explained(first_map, place, first_odom, odom) or _is_shifted(
            first_map, place, trail.past, first_ns, stamp_ns
        ):
            self._contradictions = 0
            if self._wrong_ns is not None and stamp_ns - self._wrong_ns > CLEARED_NS:
                self._wrong_ns = None
            return
        self._contradictions += 1
        if self._contradictions >= CONTRADICTIONS:
            self._wrong_ns = stamp_ns


@compiled
def _is_explained(
    first_map: Planar, last_map: Planar, first_odom: Planar, last_odom: Planar
) -> bool:
    """True if the wheels have moved as the scans show, but for slip."""
    return _explained(step(first_map, last_map), step(first_odom, last_odom))


@compiled
def _is_shifted(
    first_map: Planar, last_map: Planar, past: TrailPast, first_ns: int, last_ns: int
) -> bool:
    """True if the wheels have moved alike at some other time: their clock is off."""
    by_scans = step(first_map, last_map)
    for shift_ns in SHIFTS_NS:
        since, first = at(past, first_ns + shift_ns)
        until, last = at(past, last_ns + shift_ns)
        if since and until and _explained(by_scans, step(first, last)):
            return True
    return False


@compiled
def _explained(by_scans: Planar, by_wheels: Planar) -> bool:
    distance = max(math.hypot(by_scans[0], by_scans[1]), math.hypot(by_wheels[0], by_wheels[1]))
    turn = max(abs(by_scans[2]), abs(by_wheels[2]))
    apart = math.hypot(by_wheels[0] - by_scans[0], by_wheels[1] - by_scans[1])
    # a turn that is off by this share, evenly along the way, moves its end by half the way times it
    aside = apart - 0.5 * distance * turn * SLIP_SHARE
    off = abs(wrapped(by_scans[2] - by_wheels[2]))
    fits = aside <= SLIP_M + SLIP_SHARE * distance + SLIP_PER_RADIAN * turn
    return fits and off <= SLIP_RAD + TURN_SHARE * turn + TURN_PER_METRE * distance
