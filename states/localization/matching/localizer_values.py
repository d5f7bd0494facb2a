"""Parameters of a localizer: matching, particles, filter and trackers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from engine.files import Duration
from engine.files.declared import Range
from hw import PoseSigma, Twist2
from states.localization.matching.amcl import AmclValues
from states.localization.matching.scan_tracker import TrackerValues

_START, _REST = PoseSigma(1.0, 0.5), PoseSigma(0.002, 0.0005)
_VIVE, _FLOOR = PoseSigma(0.02, 0.015), PoseSigma(0.002, 0.0005)


@dataclass(frozen=True, slots=True)
class LocalizerValues:
    """Parameters of a localizer.

    `start_sigma`: standard deviations of the given start pose. A search begins after `patience`
    unhealthy matches in a row, or when less than a share `plain` of the beams (mean over about a
    second) is on walls, unless a search has confirmed the pose within the last `sure_for` s. The
    pose moves to a place found elsewhere by `elsewhere` scans in a row; after `lost_after` s
    without a fair match there is no pose. A standing base rests when its pose is known to
    `rest_sigma`, or after `rest_scans` scans; then one scan per `check` s is matched. Trackers
    correct the pose every `vive_period` s, or `vive_period_turning` s while it turns faster than
    `turning`, rad/s; `vive_sigma` is the error of one acquisition. `floor_sigma` is the error that
    no averaging removes.
    """

    matching: TrackerValues = field(default_factory=TrackerValues)
    particles: AmclValues = field(default_factory=AmclValues)
    start_sigma: PoseSigma = _START
    plain: Annotated[float, Range(0.0, 1.0)] = 0.6
    patience: Annotated[int, Range(1, 1000)] = 5
    elsewhere: Annotated[int, Range(1, 1000)] = 40
    sure_for: Annotated[Duration, Range(0.0, 600.0)] = 5.0
    lost_after: Annotated[Duration, Range(0.1, 60.0)] = 2.0
    rest_sigma: PoseSigma = _REST
    rest_scans: Annotated[int, Range(1, 1000)] = 25
    check: Annotated[Duration, Range(0.05, 60.0)] = 0.4
    vive_period: Annotated[Duration, Range(0.01, 60.0)] = 1.0
    vive_period_turning: Annotated[Duration, Range(0.01, 60.0)] = 0.1
    turning: float = 0.1
    vive_sigma: PoseSigma = _VIVE
    floor_sigma: PoseSigma = _FLOOR

    def tracker_period(self, velocity: Twist2) -> float:
        """Period at which trackers correct a base of this velocity, s (R30)."""
        turns = abs(velocity.wz) > self.turning
        return self.vive_period_turning if turns else self.vive_period
