"""How near the robot comes to the person: while they walk, and on drives to who waits for the prop.

A close drive is told by geometry, not by the chart: while the person stands, the outline comes
nearer to them than CLOSE_M. Drives that keep 1.6 m between the centres come to 0.37 m with a
corner; those that go round behind a person in a narrow place come to less than 0.2 m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from statistics import fmean
from typing import Any

from cobodeck.evaluate.figures import MOVING
from hw import USER_RADIUS, Pose2, Truth, wrap
from hw.model import Footprint
from hw.sim.contact import Sweep, gap, swept_gap

CLOSE_M = 0.35
"""A drive that comes nearer than this to a standing person is a close one, m."""
BESIDE_M = 0.4
"""Time nearer than this is told, m."""
STEP_M, STEPS = 0.5, 1000
"""Robot and person move by less than STEP_M between two instants, m; so many steps are kept."""
PAUSE_NS = 500_000_000
"""A drive is over once the base has stood for longer than this, ns."""


@dataclass(slots=True)
class ObservedDrive:
    """A motion of the base: when it was first and last seen to move, ns.

    `beside_ns`: time within BESIDE_M of a standing person; `least_gap` to them, m, if within it.
    """

    begin_ns: int
    end_ns: int
    beside_ns: int = 0
    least_gap: float = math.inf

    @property
    def taken_s(self) -> float:
        """How long it took, s."""
        return (self.end_ns - self.begin_ns) / 1e9


@dataclass(slots=True)
class DriveWatch:
    """Follows the base while a request waits.

    `still`: a base that stands moves and turns by no more than this, m and rad. `stood` is the
    last pose in which it was seen, at `moved_ns` at the earliest; both from `begin` on.
    """

    footprint: Footprint | None = None
    still: float = 0.0
    stood: Pose2 | None = None
    moved_ns: int = 0
    drives: list[ObservedDrive] = field(default_factory=list)
    _rests: bool = True
    _beside: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        if self.footprint is not None:
            self._beside = BESIDE_M + USER_RADIUS + self.footprint.half_diagonal

    def begin(self, now_ns: int, base: Pose2 | None) -> None:
        """A request begins to wait."""
        self.stood, self.moved_ns, self._rests = base, now_ns, True

    def watch(self, now_ns: int, truth: Truth, base: Pose2) -> None:
        """The base is at `base`, which may differ from `stood`."""
        stood = self.stood
        if (
            stood is not None
            and base.distance_to(stood) <= self.still
            and abs(wrap(base.yaw - stood.yaw)) <= self.still
        ):
            return
        if self._rests or now_ns - self.moved_ns > PAUSE_NS:
            self.drives.append(ObservedDrive(now_ns, now_ns))
        self.stood, self.moved_ns, self._rests = base, now_ns, False
        self._add(self.drives[-1], now_ns, truth, base)

    def _add(self, drive: ObservedDrive, now_ns: int, truth: Truth, base: Pose2) -> None:
        lasted, drive.end_ns = now_ns - drive.end_ns, now_ns
        body, footprint = truth.body, self.footprint
        if body is None or footprint is None or truth.speed > MOVING:
            return
        if base.distance_to(body) > self._beside:
            return
        apart = gap(footprint, base, body.x, body.y)
        drive.least_gap = min(drive.least_gap, apart)
        if apart < BESIDE_M:
            drive.beside_ns += lasted

    def report(self) -> dict[str, Any]:
        """The close drives: their number, mean time, and mean time within BESIDE_M, s."""
        if self.footprint is None:
            return dict.fromkeys(("number", "mean_s", "below_0_4_m_s"))
        close = [drive for drive in self.drives if drive.least_gap < CLOSE_M]
        return {
            "number": len(close),
            "mean_s": fmean(drive.taken_s for drive in close) if close else None,
            "below_0_4_m_s": fmean(drive.beside_ns / 1e9 for drive in close) if close else None,
        }


@dataclass(slots=True)
class WalkingGap:
    """The least gap of the outline and a person who walks, swept from instant to instant.

    Steps that may have the least one are kept, and looked at when it is asked for. The outline
    has a disc of half its width inside, and lies in one of half its diagonal, so that distances of
    centres tell which: those of `below` or more, m, are too far.
    """

    outline: Footprint
    below: float = math.inf
    _least: float = math.inf
    _steps: list[tuple[Sweep, Sweep]] = field(default_factory=list)
    _reach: float = field(init=False)
    _spread: float = field(init=False)

    def __post_init__(self) -> None:
        corner = self.outline.half_diagonal
        self._reach = corner + USER_RADIUS + STEP_M
        self._spread = corner - self.outline.half_width + STEP_M

    def watch(self, robot: Sweep, person: Sweep, distance: float) -> None:
        """Both have moved from their first pose to their second, `distance` apart at the end, m."""
        self._steps.append((robot, person))
        below = distance + self._spread
        if self._reach < below < self.below:
            self.below = below
        if len(self._steps) > STEPS:
            self._look()

    def _look(self) -> None:
        for robot, person in self._steps:
            self._least = min(self._least, swept_gap(self.outline, robot, person))
        self._steps.clear()
        self.below = min(self.below, max(0.0, self._least) + self._reach)

    @property
    def least(self) -> float | None:
        """The least gap so far, m, at most 0 in contact; None if nobody has walked."""
        self._look()
        return None if self._least == math.inf else self._least
