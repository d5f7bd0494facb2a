"""Localization errors of a run: its pose estimates against the truth, tick by tick."""

from __future__ import annotations

import math
from array import array
from collections import Counter, deque
from typing import Any, TypeAlias

from behaviors import ESTIMATE
from cobodeck.evaluate.metrics import PoseSource
from engine.signals import Board, EstimatedSlot, compute
from hw import Pose2, Truth, wrap
from hw.motion import PoseHistory
from states.localization import LocalizationEstimator, Localizes, PoseEstimate

Errors: TypeAlias = "array[float]"
"""As plain doubles: a day at 30 Hz has 2.6 million of each."""
KEPT_NS = 1_000_000_000
"""Time for which the truth is kept, ns, because estimates refer to the past."""
WAITING = 32
"""Number of estimates that wait for the truth."""
STILL_M = 1e-4
"""A base that moves less than this in a tick counts as standing, m."""


class LocalizationWatch:
    """Compares each estimate with the true pose at its stamp; call `watch` once per tick.

    Errors while the base stands and the arm moves are also reported separately, as `reaching`:
    they shift the prop.
    """

    def __init__(self, plant: PoseSource, board: Board) -> None:
        slot = board.slots[ESTIMATE]
        assert isinstance(slot, EstimatedSlot)
        self._plant, self._slot = plant, slot
        estimator = slot.estimator
        self._localizer: Localizes | None = (
            estimator.localizer if isinstance(estimator, LocalizationEstimator) else None
        )
        self._truths = PoseHistory(Pose2.between, KEPT_NS)
        self._before: tuple[int, Pose2] | None = None
        self._stamp: int | None = None
        self._waiting: deque[tuple[int, PoseEstimate]] = deque(maxlen=WAITING)
        self._now = 0
        self._errors = array("d"), array("d")
        self._reaching = array("d"), array("d")
        self._within = 0
        self._unknown_ns = 0
        self._status_ns: Counter[str] = Counter()
        self._drift: str | None = None

    def watch(self, now_ns: int) -> None:
        """Take the truth and the newest estimate of a tick."""
        truth, elapsed = self._plant.truth, now_ns - self._now
        self._now = now_ns
        if truth is None or truth.base is None:
            return
        known_ns = getattr(self._plant, "truth_ns", None)  # a world in another process lags behind
        true_ns = now_ns if known_ns is None else known_ns
        self._before = self._truths.newest
        self._truths.insert(true_ns, truth.base)
        compute(self._slot)
        sample = self._slot.newest
        self._listen(elapsed)
        if sample is None:
            self._unknown_ns += elapsed
            return
        if sample.stamp != self._stamp:
            self._stamp = sample.stamp
            self._waiting.append((sample.stamp, sample.value))
        while self._waiting and self._waiting[0][0] <= true_ns:
            stamp, estimate = self._waiting.popleft()
            true = self._truths.at(stamp)
            if true is not None:
                self._compare(estimate, true, truth)

    def report(self) -> dict[str, Any]:
        """Errors of position, m, and yaw, rad; None where nothing was compared."""
        offs, turns = self._errors
        reaching_offs, reaching_turns = self._reaching
        return {
            "rmse_m": _rms(offs),
            "p95_m": _p95(offs),
            "max_m": max(offs, default=None),
            "rmse_rad": _rms(turns),
            "max_rad": max(turns, default=None),
            "reaching_p95_m": _p95(reaching_offs),
            "reaching_p95_rad": _p95(reaching_turns),
            "within_3_sigma": self._within / len(offs) if offs else None,
            "unknown_s": self._unknown_ns / 1e9,
            "status_s": {name: ns / 1e9 for name, ns in sorted(self._status_ns.items())},
            "drift": self._drift,
        }

    def _listen(self, elapsed: int) -> None:
        """Take status and drift from the localizer."""
        localizer = self._localizer
        if localizer is not None:
            self._status_ns[localizer.status] += elapsed
            drift = localizer.drift
            self._drift = self._drift if drift is None else str(drift)

    def _compare(self, estimate: PoseEstimate, true: Pose2, truth: Truth) -> None:
        off = estimate.pose.distance_to(true)
        turned = abs(wrap(estimate.pose.yaw - true.yaw))
        sigma = estimate.sigma
        self._note(self._errors, off, turned)
        self._within += off <= 3.0 * sigma.position and turned <= 3.0 * sigma.yaw
        if truth.arm_moving and self._stands(truth):
            self._note(self._reaching, off, turned)

    @staticmethod
    def _note(errors: tuple[Errors, Errors], off: float, turned: float) -> None:
        errors[0].append(off)
        errors[1].append(turned)

    def _stands(self, truth: Truth) -> bool:
        before, now = self._before, truth.base
        return before is not None and now is not None and before[1].distance_to(now) < STILL_M


def _rms(values: Errors) -> float | None:
    return math.sqrt(math.fsum(v * v for v in values) / len(values)) if values else None


def _p95(values: Errors) -> float | None:
    return sorted(values)[math.ceil(0.95 * len(values)) - 1] if values else None
