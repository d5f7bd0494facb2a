"""The prop comes along the DEEP's own axis, past head and hands, and goes back the same way."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from behaviors.profile.profile import load_profile
from hw.geometry import Pose2, Pose3, wrap
from hw.model.calibration import load_calibration
from hw.model.robot import load_robot
from hw.samples import UserPose
from hw.scene.room import Room
from states.arm.arm_situation import ARM_RADIUS, HEAD_RADIUS, ArmSituation, person_obstacles
from states.arm.kinematics import newton
from states.arm.kinematics.collision import outline
from states.arm.kinematics.inverse_kinematics import inverse, inverse_near
from states.arm.kinematics.kinematics import forward
from states.arm.planning import approach
from states.arm.planning.approach import STEEPEST, rungs, tool_lines
from states.arm.planning.planning import NoPlan, Plan, Query, ended, in_turn
from states.arm.workspace import CLOSE, Workspace
from states.environment.environment import Environment

ROBOT = load_robot("rbkairos_ur10")
HALL = Room(outer=((0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (0.0, 8.0)))
STEP_S = 0.002


def drawn(rng: np.random.Generator, parked: tuple[float, ...]) -> tuple[ArmSituation, Pose3]:
    """A user with head and a hand at the DEEP, and the rover up to 0.2 m off a pose before it."""
    user = Pose2(5.0, 4.0, rng.uniform(-math.pi, math.pi))
    deep = Pose3.from_yaw(*user.transform(0.85, 0.0), rng.uniform(0.5, 1.5), user.yaw)
    way = user.yaw + rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0])
    off, around = rng.uniform(0.0, 0.2), rng.uniform(0.0, 6.3)
    base = Pose2(
        deep.x + 0.95 * math.cos(way) + off * math.cos(around),
        deep.y + 0.95 * math.sin(way) + off * math.sin(around),
        wrap(way + math.pi + rng.uniform(-0.1, 0.1)),
    )
    head, hand = (*user.transform(0.05, 0.0), 1.65), deep.transform(-0.03, 0.0, 0.0)
    side = {"left_hand": hand} if rng.uniform() < 0.5 else {"right_hand": hand}
    return ArmSituation(base, user, parked, head=head, **side), deep


def served(rng: np.random.Generator, workspace: Workspace) -> tuple[ArmSituation, Pose3]:
    """Like `drawn`, again if the DEEP is out of reach: high up, with the rover 1.1 m away."""
    tries = (drawn(rng, workspace.parked) for _ in range(10))
    return next(found for found in tries if workspace.missed(*found) < 1e-6)


def planned(workspace: Workspace, situation: ArmSituation, deep: Pose3) -> Plan:
    found = ended(in_turn(workspace.reaching(situation, deep)))
    assert isinstance(found, Plan)
    return found


def tool_path(screws, base: Pose2, plan: Plan) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Tool in the map by other kinematics: positions (n, 3), orientations (n, 3, 3); True (n,) on
    the line to the DEEP.
    """
    trajectory = plan.trajectory
    times = np.append(np.arange(0.0, trajectory.duration, STEP_S), trajectory.duration)
    placed = screws.tcp(trajectory.at(times)[0])
    turn = Rotation.from_euler("z", base.yaw).as_matrix()
    points = placed[:, :3, 3] @ turn.T + (base.x, base.y, 0.0)
    return points, turn @ placed[:, :3, :3], trajectory.along(times)[0] >= plan.lands


@pytest.mark.requirement(44, 47)
@pytest.mark.parametrize("count", [25, pytest.param(300, marks=pytest.mark.slow)])
def test_the_prop_comes_slowly_and_straight_from_the_side_of_the_surface(
    tuned: Environment, screws, count: int
) -> None:
    rng = np.random.default_rng(21)
    for _ in range(count):
        situation, deep = served(rng, tuned.workspace)
        plan = planned(tuned.workspace, situation, deep)
        points, turns, on_line = tool_path(screws, situation.base, plan)
        seen = np.array([deep.inverse().transform(*point) for point in points])
        away = np.linalg.norm(seen, axis=1)
        speed = np.linalg.norm(np.diff(points, axis=0), axis=1) / STEP_S

        assert plan.line >= 0.05 - 1e-9
        assert speed[away[1:] < 0.1].max() <= 0.2505
        assert seen[away < 0.3, 0].min() >= -0.02  # never from the person's side
        assert np.abs(seen[on_line, 1:]).max() < 2e-4
        assert seen[on_line, 0][0] == pytest.approx(plan.line, abs=1e-3)
        assert (np.diff(seen[on_line, 0]) <= 1e-9).all()
        level = Rotation.from_quat([deep.qx, deep.qy, deep.qz, deep.qw]).as_matrix()
        assert np.abs(turns[on_line] - level).max() < 1e-6
        assert away[-1] <= 1e-6


@pytest.mark.requirement(43, 45)
def test_nothing_of_the_arm_touches_head_or_forearm_on_the_way(tuned: Environment) -> None:
    rng = np.random.default_rng(22)
    solid = tuned.workspace.arm
    for _ in range(15):
        situation, deep = served(rng, tuned.workspace)
        plan = planned(tuned.workspace, situation, deep)
        hand = np.array(situation.left_hand or situation.right_hand)
        shoulder = np.array(situation.shoulder(1.0 if situation.left_hand else -1.0))
        forearm = shoulder + np.linspace(0.0, 1.0, 20)[:, None] * (hand - shoulder)
        forearm = forearm[np.linalg.norm(forearm - hand, axis=1) > 0.1]
        kept = [(forearm, ARM_RADIUS), (np.array([situation.head]), HEAD_RADIUS)]
        joints = plan.trajectory.at(np.arange(0.0, plan.trajectory.duration, 0.01))[0]
        for q in joints:
            ends, radii = outline(solid, q)
            for points, radius in kept:
                for x, y, z in points:
                    seen = np.array((*situation.base.inverse().transform(x, y), z))
                    start, way = ends[:, 0], ends[:, 1] - ends[:, 0]
                    square = np.maximum((way * way).sum(axis=1), 1e-12)
                    along = np.clip(((seen - start) * way).sum(axis=1) / square, 0.0, 1.0)
                    gap = np.linalg.norm(seen - start - along[:, None] * way, axis=1) - radii
                    assert gap.min() > radius - 1e-3


@pytest.mark.requirement(45)
def test_every_end_of_a_capsule_keeps_the_speed_limit(tuned: Environment) -> None:
    rng = np.random.default_rng(23)
    solid, most = tuned.workspace.arm, 0.0
    for _ in range(25):
        situation, deep = served(rng, tuned.workspace)
        trajectory = planned(tuned.workspace, situation, deep).trajectory
        joints, speeds, gains = trajectory.at(np.arange(0.0, trajectory.duration, 0.004))
        ends = np.array([outline(solid, q)[0].reshape(-1, 3) for q in joints])
        most = max(most, np.linalg.norm(np.diff(ends, axis=0), axis=2).max() / 0.004)
        assert np.abs(speeds).max() <= max(ROBOT.arm.max_speed) + 1e-9
        assert np.abs(gains).max() <= 5.0 * (1.0 + 1e-6)
    assert 0.95 < most <= 1.002


@pytest.mark.requirement(47)
def test_the_fold_begins_with_the_line_backwards(tuned: Environment, screws) -> None:
    situation, deep = served(np.random.default_rng(24), tuned.workspace)
    reached = planned(tuned.workspace, situation, deep).trajectory.path.goal
    back = ended(in_turn(tuned.workspace.parking(replace(situation, joints=tuple(reached)))))
    assert isinstance(back, Plan)
    assert back.leads == pytest.approx(0.12)
    points, _, _ = tool_path(screws, situation.base, back)
    seen = np.array([deep.inverse().transform(*point) for point in points])
    near = np.linalg.norm(seen, axis=1) < 0.1
    speed = np.linalg.norm(np.diff(points, axis=0), axis=1) / STEP_S
    assert speed[near[1:]].max() <= 0.2505
    assert np.abs(seen[near, 1:]).max() < 2e-4
    assert back.trajectory.path.goal == pytest.approx(tuned.workspace.parked, abs=1e-9)


@pytest.mark.requirement(44)
def test_an_arm_that_does_not_point_at_the_user_folds_at_once(tuned: Environment) -> None:
    situation, _ = served(np.random.default_rng(25), tuned.workspace)
    beside = replace(situation, joints=(-2.0, -1.4, -1.6, -2.0, -1.5, 0.3))
    away = replace(beside, user=Pose2(1.0, 1.0), left_hand=None, right_hand=None, head=None)
    found = ended(in_turn(tuned.workspace.parking(away)))
    assert isinstance(found, Plan)
    assert found.leads == 0.0


@pytest.mark.requirement(43)
def test_the_line_gets_shorter_where_there_is_less_room_and_the_plan_says_so(
    tuned: Environment,
) -> None:
    """Low DEEPs: the stand-offs farther out are too near to the bumper."""
    lengths, told = set(), set()
    rng = np.random.default_rng(26)
    for _ in range(60):
        situation, deep = served(rng, tuned.workspace)
        low = Pose3(deep.x, deep.y, rng.uniform(0.28, 0.42), deep.qx, deep.qy, deep.qz, deep.qw)
        found = ended(in_turn(tuned.workspace.reaching(situation, low)))
        if isinstance(found, Plan):
            lengths.add(round(found.line, 2))
            told.add(tuned.workspace.detour(found))
    assert {0.12, 0.08} <= lengths or {0.12, 0.05} <= lengths
    assert 0.0 in lengths
    assert None in told
    assert "no line to the DEEP is free: the prop comes straight to it, slowly" in told
    assert any(text and "cm only" in text for text in told)


def test_a_profile_without_an_approach_goes_straight(tuned: Environment) -> None:
    paper = load_profile("paper").environment(HALL, ROBOT)
    situation, deep = served(np.random.default_rng(27), paper.workspace)
    queries = list(paper.workspace.reaching(situation, deep))
    assert len(queries) == 1
    assert not queries[0].ways_in
    assert queries[0].slow is None


def test_a_tool_that_is_there_already_corrects_without_going_out(tuned: Environment) -> None:
    situation, deep = served(np.random.default_rng(28), tuned.workspace)
    reached = planned(tuned.workspace, situation, deep).trajectory.path.goal
    there = replace(situation, joints=tuple(reached))
    moved = Pose3(deep.x + 0.01, deep.y, deep.z, deep.qx, deep.qy, deep.qz, deep.qw)
    plan = planned(tuned.workspace, there, moved)
    assert plan.line == 0.0
    assert plan.trajectory.duration < 0.5
    assert CLOSE == 0.05


def test_a_line_ends_before_it_gets_steep(arm) -> None:
    """Lines of random poses: slopes stay below the limit, and some lines are cut short."""
    rng = np.random.default_rng(29)
    short = 0
    for _ in range(60):
        deep = np.eye(4)
        deep[:3, :3] = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
        deep[:3, 3] = rng.uniform(-0.6, 0.6), rng.uniform(-0.6, 0.6), rng.uniform(0.3, 1.6)
        for line in tool_lines(arm, inverse(arm, deep).branches(), 0.12):
            assert np.abs(line.steep).max() <= STEEPEST
            short += not rungs(line, [0.12])
    assert short > 20


def test_goals_and_lines_of_a_calibrated_chain_take_bounded_work(
    arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Newton steps that are allowed, also for poses at the border of reach; one takes 0.6 us."""
    arm, taken = arm.calibrated(load_calibration()), [0]

    def counted(arm, seeds, targets, steps=newton.STEPS):
        taken[0] += len(seeds) * steps
        return descended(arm, seeds, targets, steps)

    descended, most = newton.descended, {"goals": 0, "near": 0, "lines": 0}
    monkeypatch.setattr(newton, "descended", counted)
    monkeypatch.setattr(approach, "descended", counted)
    rng = np.random.default_rng(30)
    for k in range(16):
        joints = rng.uniform(-3.0, 3.0, 6)
        joints[2] = rng.normal(0.0, 0.01) if k % 2 else joints[2]  # stretched
        deep = forward(arm, joints)
        away = deep[:3, 3] - (0.0, 0.0, 0.6)
        deep[:3, 3] += away / np.linalg.norm(away) * rng.uniform(0.0, 0.012) * (k % 2)
        goals = inverse(arm, deep).branches()
        most["goals"], taken[0] = max(most["goals"], taken[0]), 0
        inverse_near(arm, deep)
        most["near"], taken[0] = max(most["near"], taken[0]), 0
        tool_lines(arm, goals, 0.12)
        most["lines"], taken[0] = max(most["lines"], taken[0]), 0
    assert 0 < most["lines"] <= 960
    assert 400 < most["goals"] <= 8400
    assert 400 < most["near"] <= 6000


def test_the_lines_of_a_calibrated_chain_are_straight(arm) -> None:
    arm = arm.calibrated(load_calibration())
    deep = np.eye(4)
    deep[:3, :3] = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]
    deep[:3, 3] = 0.95, 0.1, 1.1
    for line in tool_lines(arm, inverse(arm, deep).branches(), 0.12):
        assert rungs(line, [0.12])
        s = np.linspace(0.0, 0.12, 50)
        turn, place = Rotation.from_euler("z", np.full((50, 1), math.pi)), np.zeros((50, 3))
        place[:, 2] = 0.511
        for joint, angle in zip(load_calibration(), line.outwards(0.12).at(s)[0].T, strict=True):
            place = place + turn.apply(joint.xyz)
            turn = turn * Rotation.from_euler("xyz", joint.rpy)
            turn = turn * Rotation.from_euler("z", angle[:, None])
        point = place + turn.apply([0.0, 0.0, 0.15])
        assert point == pytest.approx(deep[:3, 3] + np.outer(s, deep[:3, 0]), abs=1e-4)


@pytest.mark.requirement(43)
def test_the_arm_of_a_person_ends_before_the_deep_on_the_line_and_is_thicker_before(
    tuned: Environment,
) -> None:
    situation, deep = served(np.random.default_rng(30), tuned.workspace)
    hand = situation.left_hand or situation.right_hand
    at = (deep.x, deep.y, deep.z)
    before, on_line = (person_obstacles(situation, deep, length) for length in (0.12, None))
    first, bare = before.limbs[1], on_line.limbs[1]
    assert (first.end, first.radius) == (hand, 0.10)
    assert math.dist(bare.end, at) == pytest.approx(0.10, abs=1e-9)
    assert bare.radius == ARM_RADIUS
    assert before.walls == on_line.walls == ()
    ball = before.limbs[2]
    assert math.dist(ball.start, at) == pytest.approx(0.25)
    assert ball.radius == pytest.approx(0.33)
    short = person_obstacles(situation, deep, 0.05)
    assert [limb.radius for limb in short.limbs] == [HEAD_RADIUS + 0.10, pytest.approx(0.04)]
    ends = [deep.flat().inverse().transform(*short.walls[0][i : i + 2]) for i in (0, 2)]
    assert ends == [pytest.approx((-0.02, side * 0.3)) for side in (1.0, -1.0)]
    raised = Pose3(*at, *Rotation.from_euler("y", -70, degrees=True).as_quat())
    above = person_obstacles(situation, raised, 0.05)
    assert above.walls == ()
    assert above.limbs[2].radius == pytest.approx(0.26)


def test_an_arm_ends_where_it_first_comes_near_the_deep_wherever_it_begins() -> None:
    """Against points along it; also from a shoulder inside the ball, and past the DEEP."""
    rng, deep = np.random.default_rng(12), Pose3(0.0, 0.0, 1.2)
    share = np.linspace(0.0, 1.0, 4_001)[:, None]
    cut = 0
    for _ in range(100):
        body = Pose2(*rng.uniform(-0.4, 0.4, 2), rng.uniform(-3.0, 3.0))
        x, y, z = rng.uniform((-0.15, -0.15, 1.05), (0.15, 0.15, 1.35)).tolist()
        situation = ArmSituation(Pose2(1.0, 0.0), body, (0.0,) * 6, left_hand=(x, y, z))
        (limb,) = person_obstacles(situation, deep).limbs
        way = np.array(limb.start) + share * (np.array((x, y, z)) - limb.start)
        near = np.linalg.norm(way - (0.0, 0.0, 1.2), axis=1) <= 0.10
        begins_outside = not near[0] and near.any()
        end = way[near.argmax()] if begins_outside else way[-1]
        assert np.linalg.norm(end - limb.end) <= 1e-3
        cut += begins_outside
    assert 5 < cut < 95


@pytest.mark.requirement(44)
def test_a_low_deep_is_not_met_from_the_persons_side_either(tuned: Environment, screws) -> None:
    """Beside the bumper, where lines are short or there is none."""
    rng = np.random.default_rng(31)
    without = 0
    for _ in range(40):
        situation, deep = served(rng, tuned.workspace)
        low = Pose3(deep.x, deep.y, rng.uniform(0.28, 0.42), deep.qx, deep.qy, deep.qz, deep.qw)
        x, y = low.flat().transform(rng.uniform(0.8, 0.9), rng.uniform(-0.1, 0.1))
        before = replace(
            situation, base=Pose2(x, y, wrap(low.yaw + math.pi)), left_hand=None, right_hand=None
        )
        found = ended(in_turn(tuned.workspace.reaching(before, low)))
        if not isinstance(found, Plan):
            continue
        without += found.line < 0.12
        points, _, _ = tool_path(screws, before.base, found)
        seen = np.array([low.inverse().transform(*point) for point in points])
        away = np.linalg.norm(seen, axis=1)
        speed = np.linalg.norm(np.diff(points, axis=0), axis=1) / STEP_S
        assert seen[away < 0.3, 0].min() >= -0.02
        assert speed[away[1:] < 0.1].max() <= 0.2505
    assert without > 0


def test_heads_and_hands_are_taken_from_what_is_measured() -> None:
    user = Pose2(1.0, 2.0, 0.0)
    seen = UserPose(user, 0.0, head=Pose3(1.1, 2.0, 1.7), right_hand=Pose3(1.5, 1.9, 1.2))
    found = ArmSituation.of(Pose2(3.0, 2.0), seen, (0.0,) * 6)
    assert (found.head, found.left_hand, found.right_hand) == (
        (1.1, 2.0, 1.7), None, (1.5, 1.9, 1.2),
    )  # fmt: skip
    assert found.shoulder(-1.0) == pytest.approx((1.0, 1.81, 1.45))
    raised = replace(found, right_hand=(1.5, 1.9, 1.25))
    assert not found.is_like(raised, 0.01, 0.01)
    assert found.is_like(replace(found, right_hand=(1.5, 1.9, 1.21)), 0.01, 0.01)
    assert not found.is_like(replace(found, right_hand=None), 0.01, 0.01)


def test_of_several_queries_the_first_with_a_plan_counts_and_the_last_is_the_last_resort(
    tuned: Environment,
) -> None:
    situation, deep = served(np.random.default_rng(31), tuned.workspace)
    queries = list(tuned.workspace.reaching(situation, deep))
    assert [q.ways_in[0].distance if q.ways_in else 0.0 for q in queries] == [
        0.12, 0.08, 0.05, 0.0, 0.0,
    ]  # fmt: skip
    nowhere: Query = replace(queries[0], goals=np.zeros((0, 6)), ways_in=())
    found = ended(in_turn([nowhere, *queries[1:]]))
    assert isinstance(found, Plan)
    assert found.line == pytest.approx(0.08)
    assert isinstance(ended(in_turn([nowhere, nowhere])), NoPlan)
    assert isinstance(ended(in_turn([])), NoPlan)


@pytest.mark.requirement(44)
@pytest.mark.parametrize("which", [1, 2, 3])
def test_the_tool_is_slow_near_the_deep_on_its_way_to_a_near_stand_off_as_well(
    tuned: Environment, screws, which: int
) -> None:
    rng, passed = np.random.default_rng(32), 0
    for _ in range(8):
        situation, deep = served(rng, tuned.workspace)
        query = list(tuned.workspace.reaching(situation, deep))[which]
        plan = ended(in_turn([query]))
        if not isinstance(plan, Plan):
            continue
        points, _, on_line = tool_path(screws, situation.base, plan)
        away = np.linalg.norm(points - (deep.x, deep.y, deep.z), axis=1)
        speed = np.linalg.norm(np.diff(points, axis=0), axis=1) / STEP_S
        before = ~on_line[1:] & (away[1:] < 0.1)
        passed += bool(before.sum() > 5)
        assert speed[before].max(initial=0.0) <= 0.2505
    assert passed > 3
