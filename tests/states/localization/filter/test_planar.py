"""Is the planar filter right about where the base is, and about how sure it is?

The truth is driven by a simulation that shares no code with the filter.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import chi2

from hw.geometry import Pose2, Twist2
from states.localization.filter.measurement_sources import (
    Measurement,
    MeasurementSource,
    ProcessNoise,
)
from states.localization.filter.planar import SLIPPING, PlanarFilter, planar_config

MS = 1_000_000
WHEELS = MeasurementSource("wheels", ("vx", "vy", "wz"))
SCAN = MeasurementSource("scan", ("x", "y", "yaw"))
VIVE = MeasurementSource("vive", ("x", "y", "yaw"), yields_to=("scan",))
WHEEL_SIGMA, SCAN_SIGMA = (0.02, 0.02, 0.02), (0.015, 0.015, 0.004)


class Moment(NamedTuple):
    ms: int
    place: complex
    yaw: float
    velocity: complex  # of the wheels, in the body
    rate: float


def wander(chance: np.random.Generator, noise: ProcessNoise, seconds: float) -> Iterator[Moment]:
    """A body of white accelerations that slips as `noise` says, in steps of 4 ms."""
    dt = 4e-3
    second, metre, radian = (
        np.array(v) for v in (noise.per_second, noise.per_metre, noise.per_radian)
    )
    place, yaw = complex(*chance.normal(size=2)), float(chance.uniform(-4, 4))
    velocity, rate = complex(*(0.5 * chance.normal(size=2))), float(0.5 * chance.normal())
    draws = chance.normal(size=(round(seconds / dt), 6))
    for step, draw in enumerate(draws):
        yield Moment(4 * step, place, yaw, velocity, rate)
        spread = np.sqrt(dt * (second + abs(velocity) * metre + abs(rate) * radian)) * draw
        heading = cmath.exp(1j * (yaw + 0.5 * rate * dt))
        place += heading * (velocity * dt + complex(spread[0], spread[1]))
        yaw += rate * dt + spread[2]
        velocity += complex(spread[3], spread[4])
        rate += spread[5]


def seen(moment: Moment, chance: np.random.Generator) -> Iterator[Measurement]:
    """Wheels at 50 Hz, scans at 12.5 Hz."""
    if moment.ms % 20 == 0:
        told = (moment.velocity.real, moment.velocity.imag, moment.rate)
        yield measured(moment.ms, "wheels", told, WHEEL_SIGMA, chance)
    if moment.ms % 80 == 0:
        told = (moment.place.real, moment.place.imag, moment.yaw)
        yield measured(moment.ms, "scan", told, SCAN_SIGMA, chance)


def measured(ms, source, values, sigma, chance) -> Measurement:
    noisy = np.array(values) + np.array(sigma) * chance.normal(size=len(values))
    return Measurement(ms * MS, source, noisy, np.square(sigma))


def miss(f: PlanarFilter, moment: Moment) -> np.ndarray:
    mean = f.mean
    return np.array(
        [
            mean[0] - moment.place.real,
            mean[1] - moment.place.imag,
            math.remainder(mean[2] - moment.yaw, 2 * math.pi),
            mean[3] - moment.velocity.real,
            mean[4] - moment.velocity.imag,
            mean[5] - moment.rate,
        ]
    )


GENTLE = ProcessNoise(
    per_second=(1e-6, 1e-6, 1e-7, 0.05, 0.05, 0.05),
    per_metre=(1e-3, 5e-4, 5e-4, 0.0, 0.0, 0.0),
    per_radian=(5e-4, 5e-4, 1e-3, 0.0, 0.0, 0.0),
)


@pytest.mark.parametrize("late", [False, True])
@pytest.mark.few(1)
def test_the_covariance_is_honest(late: bool) -> None:
    """NEES of 120 runs inside the 95 % band of chi2 with 6 degrees of freedom, at 6 of 8 times."""
    runs, times = 120, [round(1000 * t) for t in (0.32, 0.56, 0.8, 1.04, 1.28, 1.52, 1.76, 2.0)]
    sums = dict.fromkeys(times, 0.0)
    for run in range(runs):
        chance = np.random.default_rng((17, run, late))
        f = PlanarFilter(
            planar_config(replace(WHEELS, gate=None), replace(SCAN, gate=None), noise=GENTLE)
        )
        waiting: list[Measurement] = []
        for moment in wander(chance, GENTLE, 2.01):
            for m in seen(moment, chance):
                if late and m.source == "scan" and m.stamp_ns > 0:
                    waiting.append(m)
                else:
                    f.correct(m)
            if moment.ms in sums:
                while waiting:
                    f.correct(waiting.pop())
                e = miss(f, moment)
                sums[moment.ms] += e @ np.linalg.solve(f.covariance, e)
    for share, least in ((0.95, 6), (0.999, 8)):
        low, high = chi2.ppf((0.5 - share / 2, 0.5 + share / 2), 6 * runs) / runs
        assert sum(low <= total / runs <= high for total in sums.values()) >= least


def test_gates_pass_the_share_they_are_told_to() -> None:
    """Three in a thousand right measurements are refused at 0.997, five in a hundred at 0.95."""
    refused, taken = 0, 0
    for run in range(20):
        chance = np.random.default_rng((19, run))
        f = PlanarFilter(planar_config(WHEELS, replace(SCAN, gate=0.95), noise=GENTLE))
        for moment in wander(chance, GENTLE, 4.0):
            for m in seen(moment, chance):
                f.correct(m)
        refused += f.counts["scan", "rejected"]
        taken += f.counts["scan", "accepted"]
    assert 0.03 < refused / (refused + taken) < 0.075


def test_a_velocity_that_changes_between_samples_leaves_no_lag() -> None:
    """From 0 to 1.5 m/s in half a second by wheels at 20 Hz: a held velocity would lose 3.75 cm."""
    f = PlanarFilter(planar_config(WHEELS, SCAN))
    f.correct(Measurement(0, "scan", (0.0, 0.0, 0.0), (1e-8,) * 3))
    for ms in range(0, 1001, 50):
        v = min(3.0 * ms / 1000, 1.5)
        f.correct(Measurement(ms * MS, "wheels", (v, 0.0, 0.0), (1e-6,) * 3))
    assert f.pose.x == pytest.approx(0.375 + 0.75, abs=2e-3)
    assert f.twist.vx == pytest.approx(1.5, abs=1e-3)
    assert isinstance(f.twist, Twist2)
    assert isinstance(f.pose, Pose2)


class Matcher:
    """Scan matches whose errors stay alike for 0.3 s, as those of real matchers do."""

    def __init__(self, sigma: tuple[float, ...], chance: np.random.Generator) -> None:
        self.sigma, self.chance = np.array(sigma), chance
        self.error = self.sigma * chance.normal(size=3)
        self.keep = math.exp(-0.08 / 0.3)

    def match(self, moment: Moment) -> np.ndarray:
        fresh = math.sqrt(1.0 - self.keep**2) * self.sigma * self.chance.normal(size=3)
        self.error = self.keep * self.error + fresh
        return np.array([moment.place.real, moment.place.imag, moment.yaw]) + self.error


def slipping_drive(seed: int, seconds: float) -> Iterator[Moment]:
    """Stop and go with turns; wheels tell 6 % more than the body goes while it speeds up or slows.

    This slip is one-sided and stays for as long as the acceleration, unlike the filter's noise.
    """
    chance = np.random.default_rng(seed)
    place, yaw, velocity, rate = 0j, 0.0, 0j, 0.0
    goal, turning = 0j, 0.0
    for ms in range(round(seconds * 1000)):
        if ms % 1500 == 0:
            goal = cmath.rect(chance.uniform(0.0, 1.5), chance.uniform(-math.pi, math.pi))
            turning = float(chance.uniform(-1, 1))
        step = goal - velocity
        velocity += step if abs(step) < 2e-3 else 2e-3 * step / abs(step)
        rate += min(max(turning - rate, -2e-3), 2e-3)
        slip = 0.94 if abs(step) >= 2e-3 else 1.0
        yield Moment(ms, place, yaw, velocity, rate)
        place += slip * velocity * cmath.exp(1j * yaw) * 1e-3
        yaw += slip * rate * 1e-3


@pytest.mark.parametrize("seed", range(4))
def test_fused_poses_are_no_worse_than_the_matches_though_their_errors_stay_alike(seed) -> None:
    chance = np.random.default_rng((23, seed))
    matcher = Matcher((0.01, 0.01, 0.004), chance)
    f = PlanarFilter(planar_config(WHEELS, replace(SCAN, correlation=0.3)))
    fused, matched = [], []
    for moment in slipping_drive(seed, 20.0):
        if moment.ms % 20 == 0:
            told = (moment.velocity.real, moment.velocity.imag, moment.rate)
            f.correct(measured(moment.ms, "wheels", told, WHEEL_SIGMA, chance))
        if moment.ms % 80 == 0:
            pose = matcher.match(moment)
            f.correct(Measurement(moment.ms * MS, "scan", pose, (1e-4, 1e-4, 1.6e-5)))
            matched.append(abs(complex(pose[0], pose[1]) - moment.place) ** 2)
            if moment.ms > 1000:
                e = miss(f, moment)[:3]
                fused.append(
                    (e[0] ** 2 + e[1] ** 2, e @ np.linalg.solve(f.covariance[:3, :3], e) / 3)
                )
    squares, nees = np.mean(fused, axis=0)
    assert squares <= np.mean(matched)
    assert nees < 1.5
    assert f.counts["scan", "reacquired"] == 0


def test_trackers_with_drop_outs_and_jumps_stay_within_the_matches() -> None:
    """Jumps of 15 to 47 mm and 1.5 degrees at each re-acquisition, told with a sigma of 4 mm."""
    worst = 0.0
    for seed in range(4):
        chance = np.random.default_rng((29, seed))
        matcher = Matcher((0.01, 0.01, 0.004), chance)
        f = PlanarFilter(planar_config(WHEELS, replace(SCAN, correlation=0.3), VIVE))
        jump, off = np.zeros(3), 0.0
        for moment in slipping_drive(seed + 50, 20.0):
            if moment.ms % 5000 == 0:
                turn = chance.uniform(-1, 1) * math.radians(1.5)
                away = cmath.rect(chance.uniform(0.015, 0.047), chance.uniform(0, 7))
                jump = np.array([away.real, away.imag, turn])
            if moment.ms % 20 == 0:
                told = (moment.velocity.real, moment.velocity.imag, moment.rate)
                f.correct(measured(moment.ms, "wheels", told, WHEEL_SIGMA, chance))
            if moment.ms % 80 == 0:
                pose = matcher.match(moment)
                f.correct(Measurement(moment.ms * MS, "scan", pose, (1e-4, 1e-4, 1.6e-5)))
                off = abs(complex(pose[0], pose[1]) - moment.place)
            if moment.ms % 100 == 0 and moment.ms % 5000 < 3500:
                told = jump + np.array([moment.place.real, moment.place.imag, moment.yaw])
                f.correct(measured(moment.ms, "vive", told, (0.004, 0.004, 0.004), chance))
            if moment.ms % 20 == 0:
                e = miss(f, moment)
                worst = max(worst, math.hypot(e[0], e[1]) - off)
    assert worst < 0.06


def test_after_a_kidnap_the_matches_are_believed_again() -> None:
    f = PlanarFilter(planar_config(WHEELS, SCAN))
    for ms in range(0, 4000, 20):
        f.correct(Measurement(ms * MS, "wheels", (0.0, 0.0, 0.0), (1e-4,) * 3))
        if ms % 80 == 0:
            pose = (0.0, 0.0, 0.0) if ms < 2000 else (5.0, 1.0, 3.1)
            f.correct(Measurement(ms * MS, "scan", pose, (1e-4,) * 3))
    assert f.counts["scan", "reacquired"] == 1
    assert f.pose.distance_to(Pose2(5.0, 1.0)) < 2e-3
    assert f.pose.yaw == pytest.approx(3.1, abs=2e-3)


def test_slip_comes_with_motion_alone() -> None:
    """Standing, odometry keeps the pose; after 1 m it is as uncertain as SLIPPING says."""
    spread = {}
    for speed in (0.0, 1.0):
        f = PlanarFilter(planar_config(WHEELS, SCAN))
        f.correct(Measurement(0, "scan", (0.0, 0.0, 0.0), (1e-8,) * 3))
        for ms in range(0, 1001, 20):
            f.correct(Measurement(ms * MS, "wheels", (speed, 0.0, 0.0), (1e-6,) * 3))
        spread[speed] = np.sqrt(np.diag(f.covariance[:3, :3]))
    assert spread[0.0][0] < 2e-3
    assert spread[1.0][0] == pytest.approx(math.sqrt(SLIPPING.per_metre[0]), rel=0.1)
    assert spread[1.0][2] == pytest.approx(math.sqrt(SLIPPING.per_metre[2]), rel=0.1)
