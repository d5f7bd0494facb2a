"""The arm slows down for a person: what touches them closes slowly, and nobody waits in vain."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given as drawn_from, strategies as st

from hw.geometry import Pose2, wrap
from hw.samples import OLD_S
from states.arm import arm_separation as separation
from states.arm.arm_separation import SLOW, ArmPace, Brakes, Governor
from states.arm.kinematics.collision import Limb
from states.arm.planning.approach import TOUCH_SPEED
from states.arm.planning.planning import Plan
from states.arm.states import ParkArm, ReachDeep
from states.environment.environment import Environment
from tests.repeats import SHORT
from tests.states.arm.plain_separation import PlainGovernor
from tests.states.arm.stepping import (
    BASE,
    DEEP,
    HARMLESS,
    TICK_NS,
    USER,
    Scene,
    Stepping,
)


def governor(tuned: Environment, plan: Plan, *, granted: bool = True) -> Governor:
    made = Governor(
        tuned.workspace.arm, plan.trajectory, Brakes(16.0, 5.0), DEEP.flat(), granted=granted
    )
    made.expect(USER)
    return made


def seen(found: Governor, x: float, speed: float, until_ns: int = 300_000_000) -> None:
    """A person at (x, 4) at `until_ns`, who has walked there with this speed towards the rover."""
    for k in range(10, -1, -1):
        stamp = until_ns - k * TICK_NS
        found.add_user_pose(stamp, Pose2(x - speed * k * TICK_NS * 1e-9, 4.0))


def pace(found: Governor, now_ns: int, since: float = 0.6) -> ArmPace:
    given = found.pace(now_ns, since, 1.0, BASE)
    assert given is not None
    return given


@pytest.mark.requirement(45, 51)
def test_nobody_slows_the_arm_and_neither_does_somebody_far_away(
    tuned: Environment, reach: Plan
) -> None:
    alone = governor(tuned, reach)
    assert alone.pace(0, 0.5, 0.03, BASE) is None
    seen(alone, 3.0, 0.0)
    assert pace(alone, 300_000_000).share == 1.0


@pytest.mark.requirement(51)
def test_the_nearer_and_the_faster_the_slower_the_arm_but_never_slower_than_a_touch_may_be(
    tuned: Environment, reach: Plan
) -> None:
    shares = []
    for x, speed in ((4.6, 0.0), (5.0, 0.0), (5.0, 0.7), (5.2, 1.4), (5.6, 1.4)):
        found = governor(tuned, reach)
        seen(found, x, speed)
        given = pace(found, 300_000_000)
        shares.append(given.share)
        assert given.share > 0.0
    assert shares == sorted(shares, reverse=True)
    assert shares[0] == 1.0
    assert shares[-1] < 0.5


@pytest.mark.requirement(51)
def test_at_the_pace_given_the_arm_stands_before_the_gap_is_used_up_or_is_slow(
    tuned: Environment, reach: Plan
) -> None:
    """The formula of the module, evaluated by itself for what the governor reports."""
    rng = np.random.default_rng(4)
    braked = 0
    for _ in range(300):
        found, since = governor(tuned, reach), rng.uniform(0.0, reach.trajectory.duration)
        x, speed = rng.uniform(5.0, 5.6), rng.choice([0.0, 0.5, 1.0, 1.4])
        seen(found, x, speed)
        given = pace(found, 300_000_000 + int(rng.uniform(0, 0.1e9)), since)
        assert 0.0 < given.share <= 1.0
        if given.share < 1.0 and given.needed <= given.separation + 1e-9:
            braked += 1
    assert braked > 10


@pytest.mark.requirement(51, 149)
def test_an_old_pose_is_of_somebody_who_may_have_set_off(tuned: Environment, reach: Plan) -> None:
    found = governor(tuned, reach)
    seen(found, 5.0, 0.0)
    fresh = pace(found, 300_000_000)
    old = pace(found, 300_000_000 + round(1.1 * OLD_S * 1e9))
    assert old.share < fresh.share


@pytest.mark.requirement(51, 149)
def test_a_late_pose_of_somebody_who_walks_evenly_changes_nothing(
    tuned: Environment, reach: Plan
) -> None:
    """Also where they walk past: from where they were seen the arm would close more slowly."""
    rng = np.random.default_rng(6)
    for _ in range(40):
        at = Pose2(rng.uniform(4.6, 5.4), rng.uniform(3.5, 4.5))
        way, speed = rng.uniform(-math.pi, math.pi), rng.uniform(0.3, 1.4)
        vx, vy = speed * math.cos(way), speed * math.sin(way)
        since, given = rng.uniform(0.0, reach.trajectory.duration), []
        for late_ns in (0, 60_000_000, 130_000_000):
            found = governor(tuned, reach)
            for k in range(10, -1, -1):
                ago = (late_ns + k * TICK_NS) * 1e-9
                body = Pose2(at.x - vx * ago, at.y - vy * ago)
                found.add_user_pose(1_000_000_000 - round(ago * 1e9), body)
            given.append(pace(found, 1_000_000_000, since))
        assert given[1] == pytest.approx(given[0], abs=1e-6)
        assert given[2] == pytest.approx(given[0], abs=1e-6)


@pytest.mark.requirement(51)
def test_the_arm_speeds_up_no_faster_than_its_profile_says(tuned: Environment, reach: Plan) -> None:
    found = governor(tuned, reach)
    seen(found, 5.6, 1.4)
    slow = found.pace(300_000_000, 0.6, 0.033, BASE)
    for k in range(1, 12):
        found.add_user_pose(300_000_000 + k * TICK_NS, Pose2(3.0, 4.0))
    after = found.pace(300_000_000 + 11 * TICK_NS, 0.6, 0.033, BASE)
    assert slow is not None
    assert after is not None
    fastest = np.abs(reach.trajectory.at(np.array([0.6]))[1]).max()
    assert after.share == pytest.approx(slow.share + 0.033 * 5.0 / fastest, abs=1e-6)


def test_the_arm_slows_down_for_what_lies_ahead_of_it(
    tuned: Environment, reach: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    def shares() -> list[float]:
        found = []
        for since in np.arange(0.0, 1.4, 0.05):
            given = governor(tuned, reach)
            seen(given, 5.4, 1.4)
            found.append(pace(given, 300_000_000, float(since)).share)
        return found

    ahead = shares()
    monkeypatch.setattr(separation, "AHEAD_S", np.zeros(3))
    at_once = shares()
    assert all(a <= b for a, b in zip(ahead, at_once, strict=True))
    assert min(a - b for a, b in zip(ahead, at_once, strict=True)) < -0.05


def test_what_lies_ahead_may_be_as_much_faster_as_can_be_braked_until_then(
    tuned: Environment, reach: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The pace there, and what 16 rad/s2 take off the fastest joint beyond the reaction time."""

    def share(since: float, ahead: float) -> float:
        monkeypatch.setattr(separation, "AHEAD_S", np.array((ahead,)))
        given = governor(tuned, reach)
        seen(given, 5.5, 1.4)
        return pace(given, 300_000_000, since).share

    eased = 0
    for since in np.arange(0.0, 1.2, 0.1):
        there = float(since) + 0.15
        fastest = np.abs(reach.trajectory.at(np.array([there]))[1]).max()
        wanted = min(1.0, share(there, 0.0) + 0.05 * 16.0 / fastest)
        assert share(float(since), 0.15) == pytest.approx(wanted, abs=1e-9)
        eased += share(there, 0.0) < wanted < 1.0
    assert eased > 2


@pytest.mark.requirement(51)
@pytest.mark.parametrize("turn", [0.5, -2.0])
def test_the_pace_does_not_depend_on_the_frame_of_the_map(
    tuned: Environment, reach: Plan, turn: float
) -> None:
    map_from_other = Pose2(3.0, -2.0, turn)
    for way in (-0.7, 0.4, 1.5):
        given = []
        for moved in (Pose2(0.0, 0.0), map_from_other):
            found = governor(tuned, reach)
            for k in range(11):
                ago = 0.1 * (10 - k) / 3.0
                x, y = 5.2 - 1.4 * ago * math.cos(way), 4.1 - 1.4 * ago * math.sin(way)
                found.add_user_pose(k * TICK_NS, moved @ Pose2(x, y))
            given.append(found.pace(11 * TICK_NS, 0.4, 1.0, moved @ BASE))
        assert given[0] is not None
        assert given[1] == pytest.approx(given[0], abs=1e-9)
        assert given[0].needed > 0.05


def test_on_the_line_to_a_person_who_stands_the_prop_is_not_slowed(
    tuned: Environment, reach: Plan
) -> None:
    line = reach.trajectory.duration - 0.25
    asked, unasked = governor(tuned, reach), governor(tuned, reach, granted=False)
    for found in (asked, unasked):
        seen(found, 5.38, 0.0)  # the cylinder reaches beyond the DEEP
    assert pace(asked, 300_000_000, line).share == 1.0
    assert pace(unasked, 300_000_000, line).share == pytest.approx(SLOW / TOUCH_SPEED, abs=0.01)


# ---- whole moves, beside somebody who steps in


def stepped_in(
    environment: Environment, context: Any, phase: str, speed: float, seed: int
) -> float | None:
    """How fast the part closes that touches somebody who steps in; None if nothing does."""
    rng = np.random.default_rng([seed, round(10 * speed)])
    person = Stepping(
        speed, rng.uniform(-1.2, 1.2), int(rng.uniform(0, 0.133e9)), np.random.default_rng(seed)
    )
    way = rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0])
    base = Pose2(
        DEEP.x + math.cos(way), DEEP.y + math.sin(way), wrap(way + math.pi + rng.uniform(-0.1, 0.1))
    )
    deep = replace(DEEP, z=rng.uniform(0.5, 1.5))
    scene = Scene(environment, context, person, base)
    if phase == "reach":
        person.since_ns = int(rng.uniform(0.0, 1.7e9))
        scene.run(ReachDeep().run(scene.ctx, deep=deep), 3.5)
    else:
        outcome, _ = scene.run(ReachDeep().run(scene.ctx, deep=deep), 5.0, watch=False)
        assert outcome == "reached"
        person.since_ns = scene.now + int(rng.uniform(0.0, 1.3e9))
        scene.run(ParkArm().run(scene.ctx), 3.5)
    return scene.touched


@pytest.mark.requirement(45, 51)
@pytest.mark.parametrize("phase", ["reach", "fold"])
@pytest.mark.parametrize("speed", [0.5, 1.0, 1.4])
@pytest.mark.parametrize("count", [8, pytest.param(50 if SHORT else 200, marks=pytest.mark.slow)])
def test_what_touches_somebody_who_steps_in_closes_slowly(
    tuned: Environment, context: Any, phase: str, speed: float, count: int
) -> None:
    for seed in range(count):
        touched = stepped_in(tuned, context, phase, speed, seed)
        assert touched is None or touched <= HARMLESS


@pytest.mark.slow
def test_without_the_governor_some_of_them_are_hit(tuned: Environment, context: Any) -> None:
    """So that the test above can fail."""
    unpaced = replace(tuned, governor=False)
    found = (stepped_in(unpaced, context, "reach", 1.4, seed) for seed in range(40))
    assert any((touched or 0.0) > 1.5 * HARMLESS for touched in found)


@pytest.mark.requirement(45)
def test_a_person_who_sways_is_served_as_soon_as_one_who_stands(
    tuned: Environment, context: Any
) -> None:
    times = []
    for sway in (0.0, 0.05):
        person = Stepping(0.0, 0.0, 60_000_000, np.random.default_rng(5))
        person.at = lambda now, a=sway: (  # type: ignore[method-assign]
            USER.x + a * math.sin(2.0 * now * 1e-9), USER.y
        )  # fmt: skip
        scene = Scene(tuned, context, person, BASE)
        outcome, took = scene.run(ReachDeep().run(scene.ctx, deep=DEEP), 6.0)
        assert outcome == "reached"
        times.append(took)
    assert times[1] - times[0] <= 0.1


# ---- the compiled rule against the plain one


def drawn_limbs(rng: np.random.Generator) -> tuple[Limb | None, ...]:
    """Head and arms around the person's place, any of them untracked."""

    def drawn(radius: float, ball: bool) -> Limb | None:
        start, end = (tuple(rng.normal((5.0, 4.0, 1.3), 0.4).tolist()) for _ in range(2))
        return None if rng.random() < 0.4 else Limb(start, start if ball else end, radius)

    return drawn(0.15, True), drawn(0.05, False), drawn(0.05, False)


@drawn_from(seed=st.integers(0, 2**32 - 1), granted=st.booleans(), limbs=st.booleans())
def test_the_compiled_rule_is_the_plain_one_to_the_last_bit(
    tuned: Environment, reach: Plan, seed: int, granted: bool, limbs: bool
) -> None:
    """Of persons who stand, walk, jump or are seen late, and of rovers turned in any way."""
    rng = np.random.default_rng(seed)
    made = tuned.workspace.arm, reach.trajectory, Brakes(16.0, 5.0), DEEP.flat()
    unsure = rng.choice([0.0, 0.02])
    pair = [one(*made, granted=granted, unsure=unsure) for one in (Governor, PlainGovernor)]
    x, y, yaw = rng.normal((4.0, 4.0, 0.0), (0.3, 0.3, 2.0))
    at, way = rng.normal((5.0, 4.0), 0.5), rng.normal(0.0, rng.choice([0.0, 0.02]), 2)
    now, since = 0, rng.uniform(0.0, reach.trajectory.duration)
    for _ in range(20):
        now += int(rng.choice([TICK_NS, TICK_NS // 2, 5 * TICK_NS], p=[0.8, 0.1, 0.1]))
        at += way
        seen, stamp = drawn_limbs(rng) if limbs else (), now - int(rng.integers(0, TICK_NS))
        given = []
        heard = rng.random() < 0.9
        for one in pair:
            if heard:
                one.add_user_pose(stamp, Pose2(*at.tolist()), seen)
            given.append(one.pace(now, float(since), 0.033, Pose2(x, y, wrap(yaw))))
        assert given[0] == given[1]
        since += 0.033
