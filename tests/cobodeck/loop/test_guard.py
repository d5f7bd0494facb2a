"""What stands between a run and its wheels, whatever the profile (R48-R52, R149)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import pytest

from behaviors.profile.profile import load_profile
from cobodeck.loop.loop import Loop
from cobodeck.loop.wiring import guarded, wire
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from hw.geometry import STILL
from hw.safety.guarded import GuardedBase
from hw.sim.sim_base import SimBase

MS = 1_000_000


def staged(profile: str, mock: bool = False, **plant: float) -> Loop:
    chart = {"paper": "paper_chase", "tuned": "chase"}[profile]
    setup = open_setup(chart, "study", profile)
    if plant:
        changed = dataclasses.replace(setup.profile.plant, **plant)
        setup = dataclasses.replace(
            setup, profile=dataclasses.replace(setup.profile, plant=changed)
        )
    return stage(setup, Options(mock=mock))


def until(loop: Loop, reached: Callable[[], bool], timeout_s: float = 60.0) -> None:
    while not reached():
        assert loop.now_ns < timeout_s * 1e9
        loop.tick()


@pytest.mark.requirement(48, 149)
@pytest.mark.parametrize("mock", [False, True])
@pytest.mark.parametrize("latency", [0.0, 0.02])
@pytest.mark.parametrize("profile", ["paper", "tuned"])
def test_an_engine_that_dies_while_driving_leaves_a_zero_command_within_a_tenth_of_a_second(
    profile: str, latency: float, mock: bool
) -> None:
    loop = staged(profile, mock, latency=latency)
    base = loop.plant.base
    until(loop, lambda: base.twist.speed >= 0.9)
    cycles, died = loop.plant.guard.chain.cycles.reader(), loop.now_ns
    cycles.read_new()

    for n in range(1, 90):
        loop.plant.advance(died + 30 * MS + n * 10 * MS)
        loop.wired.inlet.poll(loop.plant.now_ns)

    first = next(record for record in cycles.read_new() if record.admitted == STILL)
    assert first.reasons == ("command is old",)
    assert first.stamp_ns - died <= 100 * MS
    assert base.twist == STILL


@pytest.mark.requirement(50, 52)
@pytest.mark.parametrize("mock", [False, True])
@pytest.mark.parametrize("profile", ["paper", "tuned"])
def test_a_profile_switches_the_separation_step_and_nothing_else(profile: str, mock: bool) -> None:
    loop = staged(profile, mock)
    limits, motion = loop.plant.guard.chain.limits, load_profile(profile).robot
    assert limits.governor is (profile == "tuned")
    assert limits.watched
    assert (limits.yaw_rate, limits.overlap) == (motion.base_yaw_rate, 0.0)
    assert limits.command_age == 0.08


@pytest.mark.requirement(48, 149)
@pytest.mark.parametrize("profile", ["paper", "tuned"])
def test_what_the_base_hears_of_is_measured_though_no_state_asks_for_it(profile: str) -> None:
    loop = staged(profile)
    given = {name for part in loop.wired.inlet.sources.values() for name in part.signals}
    heard = {"user.pose", "vr.haptic_request", "stop.engaged", "arm.joints"}
    assert set(loop.plant.guard.hears) == heard
    assert heard <= given


def test_wheels_without_a_guard_are_not_run() -> None:
    setup = open_setup("chase", "study")
    loop = stage(setup, Options())
    wheels = SimBase(setup.robot, setup.profile.robot.limits, loop.plant.base.pose)
    parts = {**loop.plant.parts, "base": wheels}
    with pytest.raises(TypeError, match=r"SimBase; wrap it in hw\.safety\.guarded\.GuardedBase"):
        guarded(parts)
    assert isinstance(guarded(loop.plant.parts), GuardedBase)
    assert guarded({}) is None
    assert wire(setup, loop.plant.parts).base is loop.plant.guard
