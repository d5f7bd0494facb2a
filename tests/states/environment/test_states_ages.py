"""Poses by their age: used, taken on and slower, not used (R149)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from cobodeck.loop.loop import Loop
from cobodeck.loop.wiring import wire
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from engine.machine.node import LeafNode
from hw.geometry import Pose2, Twist2
from hw.safety.guarded import GuardedBase
from hw.safety.limits import SafetyLimits
from hw.samples import Sample, UserPose
from hw.sim.sim_base import SimBase
from states.environment import extrapolated_state
from states.environment.environment import Environment
from states.navigation.states import DriveTo

HERE = Pose2(3.0, 4.0, math.pi / 2)
AHEAD = Twist2(1.0, 0.0, 0.5)
USER = UserPose(Pose2(6.0, 4.0, 3.0), -3.0)
WALK = Twist2(-1.0, 0.5, 1.0)


def seen(context: Any, **old: float) -> Any:
    values = {"base.pose": HERE, "base.twist": AHEAD, "user.pose": USER, "user.velocity": WALK}
    ctx = context(values)
    ctx.ages = {name.replace("_", "."): age for name, age in old.items()}
    return ctx


@pytest.mark.requirement(149)
@pytest.mark.parametrize("age", [0.0, 0.03, 0.05])
def test_poses_up_to_50_ms_old_are_used_as_they_are(context: Any, age: float) -> None:
    ctx = seen(context, user_pose=age, base_pose=age)

    assert extrapolated_state.user(ctx) == (USER, WALK, 1.0)
    assert extrapolated_state.robot(ctx) == (HERE, AHEAD, 1.0)


@pytest.mark.requirement(149)
def test_older_poses_are_taken_on_with_the_velocity_in_the_map(context: Any) -> None:
    ctx = seen(context, user_pose=0.1, base_pose=0.08)
    user, robot = extrapolated_state.user(ctx), extrapolated_state.robot(ctx)
    assert user is not None
    assert robot is not None
    (person, _, slowed), (pose, _, share) = user, robot

    assert (person.body.x, person.body.y) == pytest.approx((5.9, 4.05))
    assert person.body.yaw == pytest.approx(3.1)
    assert person.head_yaw == pytest.approx(-2.9)
    assert (pose.x, pose.y) == pytest.approx((3.0, 4.08))
    assert pose.yaw == pytest.approx(math.pi / 2 + 0.04)
    assert (slowed, share) == pytest.approx((0.5, 0.7))


@pytest.mark.requirement(149)
@pytest.mark.parametrize(
    ("age", "share"), [(0.0, 1.0), (0.05, 1.0), (0.075, 0.75), (0.1, 0.5), (0.15, 0.0), (1.0, 0.0)]
)
def test_the_share_of_the_speed_falls_to_nothing_at_150_ms(age: float, share: float) -> None:
    assert extrapolated_state.share_at(age) == pytest.approx(share)


@pytest.mark.requirement(149)
def test_the_older_of_both_decides_how_fast_a_drive_is(context: Any) -> None:
    for old in ({"user_pose": 0.1}, {"base_pose": 0.1}, {"base_twist": 0.1, "user_pose": 0.06}):
        now = extrapolated_state.around(seen(context, **old))
        assert now is not None
        assert now.share == pytest.approx(0.5)


@pytest.mark.requirement(149)
def test_an_old_sample_is_lost_but_a_user_never_seen_is_absent(context: Any) -> None:
    lost = {"user.pose": "base.pose", "base.pose": "user.pose", "base.twist": "user.pose"}
    for name in lost:
        ctx = seen(context)
        ctx.values[name] = None
        ctx.age = lambda signal, name=name: 0.2 if signal == name else 0.0
        assert extrapolated_state.around(ctx) is None
    ctx = seen(context)
    del ctx.values["user.pose"], ctx.values["user.velocity"]
    assert extrapolated_state.around(ctx) == (HERE, AHEAD, None, (0.0, 0.0), 1.0)


@pytest.mark.requirement(149)
@pytest.mark.parametrize(("age", "fastest"), [(0.04, 1.5), (0.1, 0.75), (0.14, 0.15), (0.16, None)])
def test_a_drive_by_old_poses_of_the_base_is_slower_or_lost(
    environment: Environment, context: Any, take_step: Any, age: float, fastest: float | None
) -> None:
    base = SimBase(environment.robot, environment.limits, Pose2(2.0, 2.0))
    limits = replace(SafetyLimits.of(environment.robot, environment.limits), watched=False)
    guard, past = GuardedBase(base, limits), []
    ctx = context({"environment": environment}, {"base": guard})
    run, outcome, speeds, late = DriveTo("chase").run(ctx, Pose2(8.0, 2.0)), None, [0.0], 0
    for n in range(0, 60_000, 10):  # ms
        base.advance(n * 1_000_000)
        past.append((base.pose, base.twist))
        late = max(0, len(past) - 1 - round(100 * age))
        speeds.append(base.twist.speed)
        if n % 30 == 0:
            ctx.now = n * 1_000_000
            known = age <= extrapolated_state.OLD_S
            ctx.values |= {"base.pose": past[late][0] if known else None}
            ctx.values |= {"base.twist": past[late][1] if known else None}
            ctx.ages = {"base.pose": age, "base.twist": age}
            outcome = take_step(run)
            guard.tick(n * 1_000_000)
        if outcome is not None:
            break

    if fastest is None:
        assert (outcome, max(speeds)) == ("lost", 0.0)
    else:
        assert outcome == "arrived"
        assert max(speeds) == pytest.approx(fastest, abs=0.03)
        assert base.pose.distance_to(Pose2(8.0, 2.0)) < 0.1


# ---- delayed trackers, in the loop


class Delayed:
    """Trackers whose poses arrive some ticks late, with the stamps they were taken at."""

    signals = ("user.pose",)

    def __init__(self, trackers: Any, ticks: int) -> None:
        self.trackers, self.waiting = trackers, [[]] * ticks

    def samples(self, now_ns: int) -> list[Sample]:
        self.waiting.append(list(self.trackers.samples(now_ns)))
        return self.waiting.pop(0)


def delayed_loop(ticks: int, profile: str) -> Loop:
    setup = open_setup("chase", "study", profile)
    loop = stage(setup, Options())
    parts = loop.plant.parts
    loop.wired = wire(setup, {**parts, "trackers": Delayed(parts["trackers"], ticks)})
    return loop


def watch(loop: Loop, seconds: float, each: Callable[[], None]) -> None:
    while loop.ticks < seconds * loop.grid.hz and loop.tick() is None:
        each()


@pytest.mark.requirement(149)
@pytest.mark.parametrize(("ticks", "fastest"), [(0, 1.5), (1, 1.5), (3, 0.75)])
def test_a_chase_by_late_poses_of_the_user_is_slower(ticks: int, fastest: float) -> None:
    loop = delayed_loop(ticks, "paper")
    speeds: list[float] = []

    watch(loop, 25.0, lambda: speeds.append(loop.plant.base.twist.speed))

    assert max(speeds) <= fastest + 0.001
    assert max(speeds) > 0.9 * min(fastest, 1.2)
    assert loop.wired.run.outcome == "haptic_request"


@pytest.mark.requirement(149)
def test_poses_that_get_old_between_two_ticks_keep_the_base_standing_and_it_says_why() -> None:
    loop = delayed_loop(4, "paper")
    speeds: list[float] = []
    reasons: set[str | None] = set()

    def look() -> None:
        speeds.append(loop.plant.base.twist.speed)
        reasons.add(loop.plant.guard.refusal)

    watch(loop, 25.0, look)

    assert max(speeds) == 0.0
    assert reasons == {None, "pose of the user is old"}


@pytest.mark.requirement(149)
def test_with_poses_of_the_user_that_are_too_late_nothing_drives() -> None:
    loop = delayed_loop(5, "paper")
    speeds: list[float] = []

    watch(loop, 25.0, lambda: speeds.append(loop.plant.base.twist.speed))

    assert loop.wired.run.outcome == "user_lost"
    assert max(speeds, default=0.0) == 0.0


@pytest.mark.requirement(149)
def test_what_decisions_go_by_is_where_the_user_is_now() -> None:
    loop = delayed_loop(3, "tuned")
    monitor = loop.wired.run.nodes["follow/wait/far"]
    assert isinstance(monitor, LeafNode)
    taken, raw = [], []

    def compare() -> None:
        now, sample = extrapolated_state.user(monitor.context), monitor.context.sample("user.pose")
        body = loop.plant.person.body
        if now is not None and now[1] is not None and now[1].speed > 0.9:
            assert sample is not None
            taken.append(now[0].body.distance_to(body))
            raw.append(sample.value.body.distance_to(body))

    watch(loop, 60.0, compare)

    assert len(taken) > 100
    assert sum(taken) < 0.4 * sum(raw)
