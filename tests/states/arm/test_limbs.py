"""Head and hands beside the arm: what meets a hand closes slowly, and a hand that waits is met."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hw.geometry import Pose2, Pose3, wrap
from hw.samples import UserPose
from states.arm.arm_separation import Brakes, Governor
from states.arm.arm_situation import ARM_RADIUS, ArmSituation, person_obstacles
from states.arm.kinematics.collision import Limb
from states.arm.kinematics.kinematics import forward
from states.arm.planning.planning import Plan, ended, in_turn
from states.arm.separation_kernels import Pair, allowed, needed, slow_share, turned
from states.arm.states import ParkArm, ReachDeep
from states.environment.environment import Environment
from tests.repeats import fewer
from tests.states.arm import plain_separation
from tests.states.arm.plain_separation import PlainGovernor
from tests.states.arm.stepping import (
    BASE,
    DEEP,
    HARMLESS,
    USER,
    Reaching,
    Scene,
    Stepping,
)


def place(rng: np.random.Generator) -> tuple[Pose2, Pose3]:
    """Where the base stands beside a DEEP of some height."""
    way = rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0])
    x, y = DEEP.x + math.cos(way), DEEP.y + math.sin(way)
    base = Pose2(x, y, wrap(way + math.pi + rng.uniform(-0.1, 0.1)))
    return base, replace(DEEP, z=rng.uniform(0.5, 1.5))


def hand_that_comes(
    environment: Environment, context: Any, phase: str, speed: float, seed: int
) -> float | None:
    """How fast the arm closes where a hand that leaves the DEEP for the tool meets it; None: never.

    The hand sets off at some instant of reach or fold, at once at full speed.
    """
    rng = np.random.default_rng([seed, round(10 * speed)])
    late_ns = int(rng.uniform(0, 0.133e9))
    base, deep = place(rng)
    hand, noise = (deep.x, deep.y, deep.z), np.random.default_rng(seed)
    person = Reaching(speed, 0.0, late_ns, noise, hand=hand)
    scene = Scene(environment, context, person, base)
    if phase == "reach":
        person.since_ns = int(rng.uniform(0.0, 1.9e9))
        scene.run(ReachDeep().run(scene.ctx, deep=deep), 4.0)
    else:
        outcome, _ = scene.run(ReachDeep().run(scene.ctx, deep=deep), 8.0, watch=False)
        assert outcome == "reached"
        person.since_ns = scene.now + int(rng.uniform(0.0, 1.3e9))
        scene.run(ParkArm().run(scene.ctx), 3.5)
    return scene.met


@pytest.mark.slow
@pytest.mark.requirement(45, 51)
@pytest.mark.parametrize("phase", ["reach", "fold"])
@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_what_meets_a_hand_that_comes_for_the_tool_closes_slowly(
    tuned: Environment, context: Any, phase: str, speed: float
) -> None:
    met = [hand_that_comes(tuned, context, phase, speed, seed) for seed in fewer(range(200), of=16)]
    assert sum(closing is not None for closing in met) > 0.25 * len(met)
    assert max(closing or 0.0 for closing in met) <= HARMLESS


HIT = [(0.5, 19), (1.0, 2), (2.0, 12)]
"""Hands that an arm without the governor hits hard."""


@pytest.mark.few(1)
@pytest.mark.requirement(45, 51)
@pytest.mark.parametrize(("speed", "seed"), HIT)
def test_hands_that_would_be_hit_are_touched_slowly(
    tuned: Environment, context: Any, speed: float, seed: int
) -> None:
    met = hand_that_comes(tuned, context, "reach", speed, seed)
    assert met is not None
    assert met <= HARMLESS


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "seed"), HIT)
def test_without_the_governor_they_are_hit(
    tuned: Environment, context: Any, speed: float, seed: int
) -> None:
    met = hand_that_comes(replace(tuned, governor=False), context, "reach", speed, seed)
    assert met is not None
    assert met > 1.5 * HARMLESS


@pytest.mark.requirement(45)
def test_a_hand_that_waits_at_the_deep_is_met(tuned: Environment, context: Any) -> None:
    hand, noise = (DEEP.x, DEEP.y, DEEP.z), np.random.default_rng(3)
    person = Reaching(0.0, 0.0, 20_000_000, noise, hand=hand)
    scene = Scene(tuned, context, person, BASE)
    outcome, took = scene.run(ReachDeep().run(scene.ctx, deep=DEEP), 6.0)
    assert outcome == "reached"
    assert took < 2.12  # 1.47 without a hand
    assert scene.met is not None
    assert scene.met <= HARMLESS


@pytest.mark.requirement(51, 149)
def test_somebody_who_is_known_only_after_the_plan_is_kept_from(
    tuned: Environment, reach: Plan
) -> None:
    """From the first tick: there is a governor before there is anybody."""
    nobody = ArmSituation(BASE, None, tuned.workspace.parked)
    found = tuned.workspace.governor_of(reach, nobody, DEEP)
    assert found is not None
    assert found.pace(0, 0.6, 0.033, BASE) is None
    known = tuned.workspace.governor_of(reach, replace(nobody, user=USER), DEEP)
    assert known is not None
    for one in (found, known):
        for k in range(4):
            one.add_user_pose(k * 33_333_333, Pose2(USER.x + 0.05 * k, USER.y))
    first, second = (one.pace(100_000_000, 0.5, 0.033, BASE) for one in (found, known))
    assert first == second
    assert first is not None
    assert first.share < 1.0


@pytest.mark.slow
@pytest.mark.requirement(51, 149)
@pytest.mark.parametrize("speed", [0.5, 1.0, 1.4])
def test_what_touches_somebody_who_appears_during_the_reach_closes_slowly(
    tuned: Environment, context: Any, speed: float
) -> None:
    for seed in fewer(range(80)):
        rng = np.random.default_rng([seed, 7])
        person = Stepping(
            speed, rng.uniform(-1.2, 1.2), int(rng.uniform(0, 0.133e9)), rng,
            since_ns=int(rng.uniform(0.0, 1.7e9)), known_ns=int(rng.uniform(1, 0.3e9)),
        )  # fmt: skip
        base, deep = place(rng)
        scene = Scene(tuned, context, person, base)
        scene.run(ReachDeep().run(scene.ctx, deep=deep), 3.5)
        assert scene.touched is None or scene.touched <= HARMLESS


def test_head_and_arms_that_are_tracked_are_limbs() -> None:
    hand = Pose3(5.8, 4.0, 1.2)
    seen = UserPose(USER, 0.0, head=Pose3(5.1, 4.0, 1.7), right_hand=hand)
    head, left, right = ArmSituation.of(BASE, seen, (0.0,) * 6).limbs()
    assert left is None
    assert head == Limb((5.1, 4.0, 1.7), (5.1, 4.0, 1.7), 0.15)
    assert right == Limb((5.0, 3.81, 1.45), (5.8, 4.0, 1.2), ARM_RADIUS)
    assert ArmSituation.of(BASE, UserPose(USER, 0.0), (0.0,) * 6).limbs() == ()
    assert ArmSituation.of(BASE, None, (0.0,) * 6).limbs() == ()


@pytest.mark.requirement(51, 149)
def test_a_hand_that_is_not_tracked_any_more_may_be_anywhere_around_where_it_was_seen(
    tuned: Environment, reach: Plan
) -> None:
    """Of the limbs each counts by its own age: one that is seen does not replace another."""
    here, there = (
        Limb((USER.x, y, 1.4), (5.95, y, 1.2), ARM_RADIUS) for y in (4.0, 5.5)
    )  # one beside the way, one far off
    situation, tick = ArmSituation(BASE, USER, (0.0,) * 6), 33_333_333
    lost, kept = (tuned.workspace.governor_of(reach, situation, DEEP) for _ in range(2))
    assert lost is not None
    assert kept is not None
    shares = []
    for k in range(40):
        lost.add_user_pose(
            k * tick, USER, (None, here if k < 8 else None, there if k >= 8 else None)
        )
        kept.add_user_pose(k * tick, USER, (None, here, None))
        paces = [one.pace(k * tick, 0.3, 0.033, BASE) for one in (lost, kept)]
        shares.append([0.0 if pace is None else pace.share for pace in paces])
    assert 0.0 < shares[-1][1] < 0.9
    assert all(of_lost <= of_kept for of_lost, of_kept in shares)
    assert shares[-1][0] < 0.5 * shares[-1][1]


@pytest.mark.requirement(51)
def test_the_nearer_and_the_older_a_hand_the_slower_the_arm(
    tuned: Environment, reach: Plan
) -> None:
    def share(hand: float, age: float = 0.0, unsure: float = 0.0) -> float:
        found = tuned.workspace.governor_of(
            reach, ArmSituation(BASE, USER, (0.0,) * 6), DEEP, unsure
        )
        assert found is not None
        limb = Limb((USER.x, 3.81, 1.4), (hand, 4.0, 1.2), ARM_RADIUS)
        for k in range(4):
            found.add_user_pose(k * 33_333_333, USER, (limb,))
        given = found.pace(100_000_000 + round(age * 1e9), 0.45, 0.0, BASE)
        assert given is not None
        return given.share

    assert share(5.2) == 1.0
    assert share(5.2) > share(5.8) > share(5.9)
    assert share(5.8) > share(5.8, age=0.05) > 0.0
    assert share(5.8) > share(5.8, unsure=0.03)


@pytest.mark.requirement(51)
def test_the_arm_is_slow_once_the_gap_is_used_up_and_not_before() -> None:
    """Against a hand that comes and an arm that brakes, in small steps."""
    rng = np.random.default_rng(10)
    between = 0
    for _ in range(60):
        gap, closing, coming = rng.uniform(0.05, 0.6), rng.uniform(0.3, 1.2), rng.uniform(0.5, 2.0)
        stopping, late, lag = rng.uniform(0.02, 0.2), rng.uniform(0.05, 0.2), rng.uniform(0.0, 0.05)
        slow = slow_share(0.25, closing)
        one = Pair(gap, closing, coming, stopping, 0.0, late, lag, 0.03, slow, slow)
        share = allowed(one)
        rate, used, step = share, coming * late + share * closing * lag, 1e-5
        while rate * closing > 0.25:
            used += (coming + rate * closing) * step
            rate -= step / stopping
        slowed = share * closing > 0.25 + 1e-9
        assert not slowed or used <= gap - 0.03 + 1e-3
        if slowed and share < 1.0:
            between += 1
            assert used == pytest.approx(gap - 0.03, abs=1e-3)
            assert needed(one, share) == pytest.approx(gap, abs=1e-9)
    assert between > 10


@pytest.mark.requirement(51)
def test_a_hand_that_has_gone_along_a_link_meets_none_of_its_points_fast(
    tuned: Environment,
) -> None:
    """Seen beside one end of the forearm, the hand may be at the faster one by now."""
    from states.arm.kinematics.collision import outline

    workspace, since, capsule = tuned.workspace, 0.8, 10
    base, deep = Pose2(6.438, 3.322, 2.232), replace(DEEP, z=0.774)
    nobody = ArmSituation(base, USER, workspace.parked)
    plan = ended(in_turn(workspace.reaching(nobody, deep)))
    assert isinstance(plan, Plan)
    q, v, _ = plan.trajectory.at(np.array([since]))
    ends, later = (outline(workspace.arm, q[0] + v[0] * t)[0][capsule] for t in (0.0, 1e-6))
    speeds = np.linalg.norm((later - ends) * 1e6, axis=1)
    assert speeds.max() > 1.05 * speeds.mean()
    seen, beside = ends[0] + 0.8 * (ends[1] - ends[0]), np.cross((0.0, 0.0, 1.0), ends[1] - ends[0])
    beside *= 0.13 / np.linalg.norm(beside)
    shoulder, hand = (
        (*base.transform(p[0], p[1]), float(p[2])) for p in (seen + 5.0 * beside, seen + beside)
    )
    found = workspace.governor_of(plan, nobody, deep)
    assert found is not None
    for k in range(16):  # a person who is known to stand
        found.add_user_pose(k * 33_333_333, USER, (Limb(shoulder, hand, ARM_RADIUS),))
    given = found.pace(600_000_000, since, 0.0, base)
    assert given is not None
    assert given.share * speeds.max() <= 1.02 * HARMLESS


@pytest.mark.requirement(51)
def test_the_gap_to_a_hand_counts_where_the_arm_is_before_it_can_slow_down(
    tuned: Environment, reach: Plan
) -> None:
    """A hand straight ahead of the tool, which gets 4 cm nearer in 50 ms."""
    arm = tuned.workspace.arm
    tool, ahead = (forward(arm, q)[:3, 3] for q in reach.trajectory.at(np.array([0.4, 0.45]))[0])
    way = (ahead - tool) / np.linalg.norm(ahead - tool)
    hand, shoulder = (
        (*BASE.transform(p[0], p[1]), float(p[2])) for p in (tool + 0.3 * way, tool + 0.8 * way)
    )
    found = tuned.workspace.governor_of(reach, ArmSituation(BASE, USER, (0.0,) * 6), DEEP)
    assert found is not None
    found.add_user_pose(0, USER, (Limb(shoulder, hand, ARM_RADIUS),))
    given = found.pace(0, 0.4, 0.0, BASE)
    assert given is not None
    assert given.share < 1.0
    gone = float(np.linalg.norm(ahead - tool))
    assert gone > 0.03
    assert given.separation < 0.3 - ARM_RADIUS - gone + 0.01


@pytest.mark.requirement(51)
def test_a_hand_beside_the_way_of_the_tool_may_come_into_it(
    tuned: Environment, reach: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The arm does not close on where it was seen, but may on where it has gone by now.

    The plain rule shows what the pace would be without that.
    """
    arm = tuned.workspace.arm
    q = reach.trajectory.at(np.array([0.4, 0.401]))[0]
    tool, ahead = (forward(arm, joints)[:3, 3] for joints in q)
    beside = np.cross(ahead - tool, (0.0, 0.0, 1.0))
    beside /= np.linalg.norm(beside)

    def share(away: float, kind: type[Governor | PlainGovernor] = Governor) -> float:
        found = kind(arm, reach.trajectory, Brakes(16.0, 5.0), DEEP.flat(), granted=True)
        found.expect(USER)
        hand, shoulder = (tool + off * beside for off in (away, away + 0.5))
        ends = [(*BASE.transform(p[0], p[1]), float(p[2])) for p in (shoulder, hand)]
        for k in range(4):
            found.add_user_pose(k * 33_333_333, USER, (Limb(*ends, ARM_RADIUS),))
        given = found.pace(100_000_000, 0.4, 0.0, BASE)
        assert given is not None
        return given.share

    near, far = share(0.25), share(0.7)
    monkeypatch.setattr(plain_separation, "turned", lambda closing, *_: np.maximum(closing, 0.0))
    assert near < share(0.25, PlainGovernor) - 0.05
    assert far == share(0.7, PlainGovernor) == 1.0


def test_a_limb_within_its_gap_stays_an_obstacle_and_one_that_is_touched_does_not(
    tuned: Environment, reach: Plan
) -> None:
    """The other hand is kept in both cases."""
    workspace, joints = tuned.workspace, tuple(reach.trajectory.at(np.array([0.5]))[0][0].tolist())
    tool = workspace.checker(ArmSituation(BASE, None, joints))
    clear = tool.clearance(joints)[0]
    assert clear > 0.02
    beside, (x, y, z) = replace(DEEP, y=4.6), _outermost(tuned, joints)
    for away, kept in ((0.08, 2), (0.0, 1)):
        seen = UserPose(
            USER, 0.0, left_hand=Pose3(5.0, 4.6, 1.0), right_hand=Pose3(x - away, y, z)
        )  # fmt: skip
        situation = ArmSituation.of(BASE, seen, joints)
        full = person_obstacles(situation, beside, 0.12)
        assert len(full.limbs) == 3  # with the ball behind the DEEP
        found = workspace.checker(situation, beside, 0.12)
        assert len(found.around.limbs) == kept
        assert found.clearance(joints)[0] > 0.0


def _outermost(tuned: Environment, joints: tuple[float, ...]) -> tuple[float, float, float]:
    """The point of the arm nearest to the person, in the map."""
    from states.arm.kinematics.collision import outline

    ends, radii = outline(tuned.workspace.arm, joints)
    x, y, z = max(ends.reshape(-1, 3), key=lambda p: p[0])
    x += radii[ends.reshape(-1, 3)[:, 0].argmax() // 2]
    return (*BASE.transform(float(x), float(y)), float(z))


def test_how_limbs_are_approached_agrees_with_points_and_differences(
    tuned: Environment, reach: Plan
) -> None:
    """Sampled axes, and positions a microsecond apart."""
    from states.arm.kinematics.collision import outline
    from states.arm.kinematics.kernels import approaching_limbs

    rng, body = np.random.default_rng(8), tuned.workspace.arm.solid
    s = np.linspace(0.0, 1.0, 151)[:, None]
    for since in (0.3, 0.7):
        q, v, _ = reach.trajectory.at(np.array([since]))
        limbs = rng.uniform((0.3, -0.4, 0.8), (1.2, 0.4, 1.4), (3, 2, 3))
        limbs[2, 1] = limbs[2, 0]
        k = len(body.links) - body.first
        distance, closing, speed, along = np.empty((4, 1, k, 3))
        approaching_limbs(body, body.first, q, v, limbs, distance, closing, speed, along)
        ends, later = (outline(tuned.workspace.arm, q[0] + v[0] * t)[0] for t in (0.0, 1e-6))
        for i, j in np.ndindex(k, 3):
            (a, b), (c, d) = ends[body.first + i], later[body.first + i]
            there, limb = a + s * (b - a), limbs[j, 0] + s * (limbs[j, 1] - limbs[j, 0])
            away = np.linalg.norm(there[:, None] - limb, axis=2)
            n, m = np.unravel_index(away.argmin(), away.shape)
            assert distance[0, i, j] == pytest.approx(away[n, m], abs=5e-3)
            moved = ((c + s * (d - c)) - there)[n] * 1e6
            towards = (limb[m] - there[n]) / away[n, m]
            assert closing[0, i, j] == pytest.approx(moved @ towards, abs=0.06)
            assert speed[0, i, j] == pytest.approx(np.linalg.norm(moved), abs=0.03)


def test_a_hand_that_has_gone_elsewhere_is_closed_on_by_the_worst_of_its_directions() -> None:
    """Against all directions within the cone, drawn; off both sides of a right angle."""
    rng = np.random.default_rng(9)
    for _ in range(200):
        speed, angle, off = rng.uniform(0.0, 2.0), rng.uniform(0.0, math.pi), rng.uniform(0.0, 1.3)
        most = turned(speed * math.cos(angle), speed, off)
        turns = np.linspace(-1.0, 1.0, 2001) * (math.asin(off) if off < 1.0 else math.pi)
        assert most == pytest.approx(max(0.0, (speed * np.cos(angle + turns)).max()), abs=1e-5)
    assert turned(1.0 + 1e-16, 1.0, 0.0) == 1.0
    assert turned(-1.0, 1.0 - 1e-16, 0.0) == 0.0
