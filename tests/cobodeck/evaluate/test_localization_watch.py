"""Estimates of the robot's pose are judged by where it truly was at their stamps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import pytest

from behaviors.signal_table import ESTIMATE
from cobodeck.evaluate.localization import LocalizationWatch
from engine.signals.board import Board
from engine.signals.signal_kinds import Estimated, Measured, declare
from hw.geometry import Pose2
from hw.samples import PoseSigma
from hw.truth import Truth
from states.localization.estimates import PoseEstimate

TICK = 33_333_333
SIGMA = PoseSigma(0.01, 0.01)


class Given:
    """Hands on what it is given."""

    def __init__(self):
        self._value = None

    def update(self, _signal, sample):
        self._value = sample.value

    def value(self):
        return self._value


@dataclass
class Rig:
    """A robot that drives along x at 1.5 m/s, and what it takes its pose to be."""

    truth: Truth = field(default_factory=Truth)
    now: int = 0
    yaw: float = 0.0

    def __post_init__(self):
        signals = (Measured("given"), Estimated(ESTIMATE, ("given",), Given))
        self.board = Board(declare(signals))
        self.watch = LocalizationWatch(self, self.board)

    def tick(self, estimate=None, stamp=None, *, speed=1.5, arm=False):
        self.now += TICK
        x = 0.0 if self.truth.base is None else self.truth.base.x
        self.truth = Truth(base=Pose2(x + speed * TICK * 1e-9, 0.0, self.yaw), arm_moving=arm)
        if estimate is not None:
            self.board.put("given", estimate, self.now if stamp is None else stamp)
        self.watch.watch(self.now)
        self.board.begin(self.now)

    @property
    def report(self):
        return self.watch.report()


def test_an_estimate_of_the_past_is_compared_with_the_past():
    rig = Rig()
    for _ in range(4):
        rig.tick()
    between = rig.now - TICK // 2
    there = rig.truth.base.x - 1.5 * (TICK // 2) * 1e-9
    rig.tick(PoseEstimate(Pose2(there, 0.03, 0.02), SIGMA), between)
    rig.tick()
    assert rig.report["rmse_m"] == pytest.approx(0.03, abs=1e-6)
    assert rig.report["rmse_rad"] == pytest.approx(0.02)
    assert rig.report["max_m"] == rig.report["p95_m"] == pytest.approx(0.03, abs=1e-6)


def test_one_estimate_counts_once_and_silence_is_time_without():
    rig = Rig()
    for _ in range(10):
        rig.tick()
    assert rig.report["unknown_s"] == pytest.approx(10 * TICK * 1e-9)
    assert rig.report["rmse_m"] is None
    assert rig.report["within_3_sigma"] is None
    rig.tick(PoseEstimate(rig.truth.base, SIGMA), rig.now)
    for _ in range(5):
        rig.tick()
    assert len(rig.watch._errors[0]) == 1
    assert rig.report["unknown_s"] == pytest.approx(11 * TICK * 1e-9)


def test_errors_while_reaching_count_apart():
    rig = Rig()
    rig.tick(speed=0.0)
    for k in range(20):
        off = Pose2(rig.truth.base.x + 0.001 * k, 0.0)
        rig.tick(PoseEstimate(off, SIGMA), rig.now, speed=0.0, arm=k >= 10)
    rig.tick(speed=0.0, arm=True)
    assert rig.report["reaching_p95_m"] == pytest.approx(0.019)
    assert rig.report["rmse_m"] == pytest.approx(
        math.sqrt(sum((0.001 * k) ** 2 for k in range(20)) / 20)
    )
    assert rig.report["within_3_sigma"] == 1.0
    drives = Rig()
    for _ in range(3):
        drives.tick(arm=True)
    drives.tick(PoseEstimate(drives.truth.base, SIGMA), drives.now, arm=True)
    drives.tick(arm=True)
    assert drives.report["reaching_p95_m"] is None


def test_what_was_claimed_is_held_against_what_was():
    rig = Rig()
    rig.tick(speed=0.0)
    for off in (0.0, 0.029, 0.031, 1.0):
        rig.tick(PoseEstimate(Pose2(rig.truth.base.x, off), SIGMA), rig.now, speed=0.0)
    rig.tick(speed=0.0)
    assert rig.report["within_3_sigma"] == 0.5


def test_an_estimate_on_the_other_side_of_half_a_turn_is_a_little_off():
    rig = Rig(yaw=3.13)
    rig.tick(speed=0.0)
    rig.tick(PoseEstimate(Pose2(rig.truth.base.x, 0.0, -3.13), SIGMA), rig.now, speed=0.0)
    rig.tick(speed=0.0)
    assert rig.report["max_rad"] == pytest.approx(2.0 * (math.pi - 3.13))
