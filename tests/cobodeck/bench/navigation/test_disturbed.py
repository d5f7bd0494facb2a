"""Drives by estimated poses: little time is lost, and the user's disc is kept."""

from __future__ import annotations

import math
from statistics import fmean

import pytest

from cobodeck.bench.navigation.disturbed import (
    CASES,
    WALKERS,
    WALKS,
    Disturbance,
    DisturbedCase,
    drive_disturbed,
)
from cobodeck.bench.navigation.drive_trials import OPEN_ROOM, TRIALS, Trial, drive
from hw.geometry import STILL, Pose2, Twist2
from hw.scene.room import Disc
from states.navigation.exact.visibility import ExactPlanner
from states.navigation.local.local_planner import LocalPlanner
from states.navigation.planner_interfaces import Limits, Tolerance
from states.navigation.planners import LOCAL_PLANNERS

FREE = ExactPlanner(OPEN_ROOM, inflation_radius=0.5)
HELD_BACK = range(100, 112)
"""Nothing was tuned on these seeds."""


def driver(name: str, latency: float = 0.0) -> LocalPlanner:
    return LOCAL_PLANNERS[name](FREE, Limits(), Tolerance(), latency=latency)


def check(name: str, case: DisturbedCase, seeds: range, hz: float) -> None:
    over = []
    for trial in TRIALS:
        for seed in seeds:
            result = drive_disturbed(driver(name), trial, case.disturbance, seed, hz)
            assert case.held(result), (trial.name, seed, result)
            over.append(100.0 * (result.time / trial.least_time - 1.0))
    assert fmean(over) <= case.over


@pytest.mark.requirement(50, 52, 146)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_drives_by_estimated_poses_are_fast_and_keep_off_the_user(case: DisturbedCase) -> None:
    check("profile", case, HELD_BACK[:1], 30.0)


@pytest.mark.requirement(50, 52, 146)
@pytest.mark.slow
def test_teb_is_as_good_under_everything_at_once() -> None:
    check("teb", CASES[3], HELD_BACK[:1], 30.0)


@pytest.mark.slow
@pytest.mark.requirement(50, 52, 146)
@pytest.mark.parametrize("hz", [30.0, 50.0])
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
@pytest.mark.parametrize("name", list(LOCAL_PLANNERS))
def test_drives_by_estimated_poses_on_seeds_held_back(
    name: str, case: DisturbedCase, hz: float
) -> None:
    noisy = case.disturbance.sigma > 0.0
    check(name, case, HELD_BACK[:4] if noisy else HELD_BACK[:1], hz)


def check_walks(name: str, case: DisturbedCase, seeds: range) -> None:
    for walk in WALKS:
        for seed in seeds:
            result = drive_disturbed(
                driver(name), walk.trial, case.disturbance, seed, walking=walk.walking, window=0.3
            )
            assert case.held(result), (walk.name, seed, result)
            assert result.time <= 20.0


@pytest.mark.requirement(51, 52)
@pytest.mark.parametrize("case", WALKERS, ids=lambda case: case.name)
@pytest.mark.few(1)
def test_drives_beside_walkers_of_estimated_velocity_keep_off_them(case: DisturbedCase) -> None:
    check_walks("profile", case, range(1))


@pytest.mark.slow
@pytest.mark.requirement(51, 52)
@pytest.mark.parametrize("case", WALKERS, ids=lambda case: case.name)
@pytest.mark.parametrize("name", list(LOCAL_PLANNERS))
def test_drives_beside_walkers_on_seeds_held_back(name: str, case: DisturbedCase) -> None:
    check_walks(name, case, range(101, 104))


@pytest.mark.requirement(51, 52)
def test_teb_lets_who_walks_across_pass_as_profile_does() -> None:
    across = WALKS[0]
    first, second = (
        drive_disturbed(
            driver(name), across.trial, Disturbance(), 0, walking=across.walking, window=0.3
        )
        for name in ("profile", "teb")
    )
    assert second.intrusion <= 0.0
    assert second.intrusion == pytest.approx(first.intrusion, abs=0.02)


@pytest.mark.parametrize("name", list(LOCAL_PLANNERS))
@pytest.mark.parametrize("trial", TRIALS, ids=lambda trial: trial.name)
def test_nothing_disturbed_is_the_ideal_drive(name: str, trial: Trial) -> None:
    ideal = drive(driver(name), trial, 1.0 / 30.0)
    found = drive_disturbed(driver(name), trial, Disturbance(), 0)
    assert found.time == pytest.approx(ideal.time, abs=1.01 / 30.0)
    assert found.intrusion == pytest.approx(ideal.intrusion, abs=0.01)
    assert found.acceleration <= 1.0 + 1e-6


def test_what_is_commanded_is_smooth_under_noise() -> None:
    noise = Disturbance(white=0.01)
    results = [drive_disturbed(driver("profile"), trial, noise, 3) for trial in TRIALS]
    assert max(result.acceleration for result in results) <= 1.2


def test_the_same_seed_gives_the_same_bits_and_another_one_others() -> None:
    noise = Disturbance(white=0.01, drift=0.01)
    once, again, other = (
        drive_disturbed(driver("profile"), TRIALS[2], noise, seed) for seed in (7, 7, 8)
    )
    assert once == again
    assert once != other


def test_noise_of_one_source_is_the_same_whatever_else_is_on() -> None:
    quiet, loud = Disturbance(white=0.01), Disturbance(white=0.01, drift=1e-12, jump=1e-12)
    first, second = (
        drive_disturbed(driver("profile"), TRIALS[1], noise, 5) for noise in (quiet, loud)
    )
    assert first.intrusion == pytest.approx(second.intrusion, abs=1e-6)


@pytest.mark.parametrize("sigma", [0.0, 0.005, 0.01])
def test_the_margin_to_the_user_is_one_centimetre_and_three_sigma(sigma: float) -> None:
    """Past a user who stands beside the straight way, seen without noise."""
    trial = Trial("past", Pose2(-3.0, 0.6), Pose2(3.0, 0.6), Disc(0.0, 0.0, 1.0), 6.0)
    go, pose, dt, least = driver("profile"), trial.start, 1.0 / 30.0, math.inf
    go.go_to(trial.goal)
    now = STILL
    for _ in range(400):
        command = go.command(pose, now, trial.user, dt, sigma=sigma)
        if go.status == "arrived":
            break
        pose = Pose2(
            pose.x + 0.5 * (now.vx + command.vx) * dt, pose.y + 0.5 * (now.vy + command.vy) * dt
        )
        now = Twist2(command.vx, command.vy)
        least = min(least, math.hypot(pose.x, pose.y) - 1.0)
    assert least == pytest.approx(0.01 + 3.0 * sigma, abs=0.003)


def held_back_for_a_second(told: bool) -> LocalPlanner:
    """A planner whose commands something halves for a second; is it told?"""
    go, pose, now, dt, left = driver("profile"), Pose2(-5.0, 5.0), STILL, 1.0 / 30.0, None
    go.go_to(Pose2(5.0, 5.0))
    for cycle in range(90):
        command = go.command(pose, now, None, dt, admitted=left if told else None)
        left = None
        if 30 <= cycle < 60:
            command = left = Twist2(0.85 * now.vx, 0.85 * now.vy)
        pose = Pose2(pose.x + 0.5 * (now.vx + command.vx) * dt, pose.y)
        now = command
    return go


def test_what_was_taken_away_on_the_way_is_not_taken_for_a_late_base() -> None:
    assert held_back_for_a_second(told=True).delay == pytest.approx(0.0, abs=1e-6)
    assert held_back_for_a_second(told=False).delay > 0.02
