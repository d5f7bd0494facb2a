"""Tracking that sees what cannot be: the robot keeps its limits and touches nothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from cobodeck.loop.loop import Loop
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from hw.geometry import Pose2
from hw.people.user import open_user
from hw.samples import Sample, UserPose

SECOND = 10**9
NOTHING = math.nan
BEHAVIOURS = ("chase", "haptic", "escape", "inform")


class Misseen:
    """A person whom tracking takes for somewhere else for a while; they are where they are."""

    def __init__(self, person: Any, change: Callable[[int, UserPose], UserPose | None]) -> None:
        self.person, self.change = person, change

    def __getattr__(self, name: str) -> Any:
        return getattr(self.person, name)

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:
        self.person.step(now_ns, robot, informed)
        sample = self.person.measured
        if sample is not None:
            seen = self.change(now_ns, sample.value)
            self.person.measured = None if seen is None else Sample(*sample[:2], seen)


def shifted(dx: float, dy: float = 0.0) -> Callable[[UserPose], UserPose]:
    def shift(pose: UserPose) -> UserPose:
        body = pose.body
        return UserPose(Pose2(body.x + dx, body.y + dy, body.yaw), pose.head_yaw)

    return shift


def during(start_s: float, end_s: float, every: int, change: Callable[[UserPose], UserPose]) -> Any:
    """The change in every so-manieth tick from start to end."""
    seen = [0]

    def changed(now_ns: int, pose: UserPose) -> UserPose:
        seen[0] += 1
        inside = start_s * SECOND <= now_ns < end_s * SECOND
        return change(pose) if inside and seen[0] % every == 0 else pose

    return changed


@pytest.fixture
def loop_of(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Loop]:
    def make(profile: str, change: Any) -> Loop:
        monkeypatch.setattr(
            "cobodeck.run.build_run.open_user", lambda *given: Misseen(open_user(*given), change)
        )
        return stage(open_setup(None, "lab_a", profile), Options("cornering"))

    return make


def run_and_watch(loop: Loop, seconds: float) -> list[str]:
    """Run; the behaviours in order. Speed and its growth stay within the limits in every tick.

    Ticks are at whole nanoseconds.
    """
    period, before = 1.0 / loop.grid.hz + 1e-9, loop.plant.base.twist.speed
    most = 1.0 if loop.plant.guard.chain.limits.governor else 1.5  # m/s2, tuned and paper
    for _ in range(round(seconds * loop.grid.hz)):
        assert loop.tick() is None
        speed = loop.plant.base.twist.speed
        assert speed <= 2.5 + 1e-9
        assert speed - before <= most * period + 1e-9
        before = speed
    assert loop.plant.collisions.wall_hits == 0
    return [
        r.subject for r in loop.wired.run.trace if r.kind == "enter" and r.subject in BEHAVIOURS
    ]


@pytest.mark.requirement(50)
@pytest.mark.parametrize("profile", ["paper", "tuned"])
@pytest.mark.parametrize(
    "change",
    [
        pytest.param(during(6, 6.04, 1, shifted(3.0)), id="3 m off once"),
        pytest.param(during(6, 7, 1, shifted(0.0, -3.0)), id="3 m off for a second"),
        pytest.param(during(3, 30, 7, shifted(-3.0)), id="3 m off every seventh tick"),
        pytest.param(during(3, 30, 2, shifted(3.0, 3.0)), id="to and fro"),
        pytest.param(during(6, 9, 1, shifted(40.0)), id="outside of the room"),
    ],
)
@pytest.mark.few(4)
def test_a_user_who_seems_to_jump_makes_no_violent_motion(
    loop_of: Callable[..., Loop], profile: str, change: Any
) -> None:
    run_and_watch(loop_of(profile, change), 30)


def nan_x(pose: UserPose) -> UserPose:
    return UserPose(Pose2(NOTHING, pose.body.y, pose.body.yaw), pose.head_yaw)


def infinite_y(pose: UserPose) -> UserPose:
    return UserPose(Pose2(pose.body.x, math.inf, pose.body.yaw), pose.head_yaw)


def nan_head(pose: UserPose) -> UserPose:
    return UserPose(pose.body, NOTHING)


@pytest.mark.parametrize("profile", ["paper", "tuned"])
@pytest.mark.parametrize("change", [nan_x, infinite_y, nan_head])
def test_a_pose_that_is_no_number_is_no_pose_and_the_user_is_lost(
    loop_of: Callable[..., Loop], profile: str, change: Callable[[UserPose], UserPose]
) -> None:
    """NaN is in no zone by comparison; taken for a pose it would switch Escape off."""
    loop = loop_of(profile, during(4.0, 6.0, 1, change))

    behaviours = run_and_watch(loop, 4.3)

    assert behaviours[-1] == "inform"
    assert loop.plant.informed
    run_and_watch(loop, 1.5)
    assert loop.plant.base.twist.speed == 0.0


def test_single_poses_that_are_no_numbers_change_nothing_but_the_age(
    loop_of: Callable[..., Loop],
) -> None:
    loop = loop_of("tuned", during(0.5, 20.0, 3, nan_x))

    assert "inform" not in run_and_watch(loop, 20)
