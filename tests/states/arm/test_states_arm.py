"""States that move the arm, on the simulated arm."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from importlib.util import find_spec
from typing import Any, cast

import numpy as np
import pytest

from hw.geometry import Pose2, Pose3
from hw.model.robot import load_robot
from hw.samples import EXACT, PoseSigma, UserPose
from hw.sim.sim_arm import SimArm
from states.arm.arm_situation import ArmSituation
from states.arm.description.robot_arm import manipulator_of
from states.arm.following import MOVED, TURNED, Frame
from states.arm.kinematics.kinematics import forward
from states.arm.planning.planning import PLANNERS, Planning, Query
from states.arm.states import (
    HoldProp,
    MoveArmJoints,
    MoveArmTo,
    ParkArm,
    ReachDeep,
    Solver,
)
from states.arm.workspace import Workspace
from states.environment.environment import Environment

HZ = 30
BASE = Pose2(5.0, 4.0, 0.5)
CHAIN = manipulator_of(load_robot("rbkairos_ur10"))


def deep_at(environment: Environment, height: float, base: Pose2 = BASE) -> Pose3:
    """A metre ahead of the robot, whose user looks back at it."""
    x, y = base.transform(1.0, 0.0)
    return Pose3.from_yaw(x, y, height, base.yaw + math.pi)


def in_rover(base: Pose2, map_from_deep: Pose3) -> Pose3:
    """rover_from_deep of a DEEP of the map."""
    return Pose3.from_yaw(base.x, base.y, 0.0, base.yaw).inverse() @ map_from_deep


class Move:
    def __init__(self, environment: Environment, context: Any, state: Any, **inputs: Any) -> None:
        self.arm = SimArm(environment.robot.arm, environment.robot.parked)
        values = {
            "environment": environment,
            "base.pose": BASE,
            "base.pose_sigma": EXACT,
            "arm.joints": self.arm.state,
        }
        self.ctx = context(values, {"arm": self.arm})
        self.run = state.run(self.ctx, **inputs)
        self.tick = 0

    def until_end(self, take_step: Any, seconds: float) -> str | None:
        for _ in range(round(seconds * HZ)):
            now, self.tick = self.tick * 10**9 // HZ, self.tick + 1
            self.arm.advance(now)
            self.ctx.now, self.ctx.values["arm.joints"] = now, self.arm.state
            outcome = take_step(self.run)
            if outcome is not None:
                return str(outcome)
        return None


@pytest.mark.requirement(46, 87)
def test_a_parked_arm_is_parked_at_once(
    environment: Environment, context: Any, take_step: Any
) -> None:
    assert take_step(Move(environment, context, ParkArm()).run) == "parked"


@pytest.mark.requirement(46, 47)
def test_an_arm_that_is_out_is_folded(
    environment: Environment, context: Any, take_step: Any
) -> None:
    move = Move(environment, context, ParkArm())
    move.arm = SimArm(environment.robot.arm, (0.0, -1.5, 1.0, 0.0, 1.5, 0.0))
    move.ctx.parts["arm"], move.ctx.values["arm.joints"] = move.arm, move.arm.state

    assert move.until_end(take_step, 10) == "parked"
    assert move.arm.state.joints == pytest.approx(environment.robot.parked, abs=0.01)


def test_a_reach_waits_until_the_robot_knows_where_it_stands(
    environment: Environment, context: Any, take_step: Any
) -> None:
    deep = deep_at(environment, 1.0)
    for unsure in (PoseSigma(0.0101, 0.001), PoseSigma(0.001, 0.0051), None):
        move = Move(environment, context, ReachDeep(settle=2.0), deep=deep)
        parked = move.arm.state.joints
        move.ctx.values["base.pose_sigma"] = unsure
        assert move.until_end(take_step, 1.9) is None
        assert move.arm.state.joints == parked
        move.ctx.values["base.pose_sigma"] = PoseSigma(0.01, 0.005)
        assert move.until_end(take_step, 10) == "reached"


def test_a_reach_is_refused_by_a_robot_that_does_not_find_out_where_it_stands(
    environment: Environment, context: Any, take_step: Any
) -> None:
    move = Move(environment, context, ReachDeep(settle=2.0), deep=deep_at(environment, 1.0))
    parked = move.arm.state.joints
    move.ctx.values["base.pose_sigma"] = PoseSigma(0.03, 0.001)
    assert move.until_end(take_step, 2.2) == "failed"
    assert move.arm.state.joints == parked


@pytest.mark.requirement(44, 80, 84, 132)
@pytest.mark.parametrize("height", [0.7, 1.0, 1.5])
@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (-0.1, 0.15, 0.08)])
def test_the_prop_reaches_the_deep_wherever_the_base_stands_in_its_tolerance(
    environment: Environment,
    context: Any,
    take_step: Any,
    height: float,
    offset: tuple[float, float, float],
) -> None:
    deep = deep_at(environment, height)
    move = Move(environment, context, ReachDeep(), deep=deep)
    stands = BASE @ Pose2(*offset)
    move.ctx.values["base.pose"] = stands

    assert move.until_end(take_step, 10) == "reached"

    reached = forward(
        manipulator_of(load_robot("rbkairos_ur10")),
        np.array(move.arm.state.joints),
    )
    wanted = in_rover(stands, deep)
    assert math.dist(reached[:3, 3], (wanted.x, wanted.y, wanted.z)) <= 0.02
    axis = wanted.transform(1.0, 0.0, 0.0)
    ahead = [axis[i] - (wanted.x, wanted.y, wanted.z)[i] for i in range(3)]
    assert math.acos(min(1.0, float(np.dot(reached[:3, 0], ahead)))) <= 0.1


@pytest.mark.requirement(82)
def test_a_deep_out_of_reach_has_no_solution(
    environment: Environment, context: Any, take_step: Any
) -> None:
    far = Pose3.from_yaw(9.0, 4.0, 1.5, 0.0)

    run = Move(environment, context, ReachDeep(), deep=far).run

    told = re.fullmatch(r"the DEEP is (\d\.\d\d\d) m out of reach", next(run))
    assert told is not None
    assert 4.0 - 1.184 - 0.5 < float(told[1]) < 4.0  # stretched arm, wrist and prop
    assert take_step(run) == "no_solution"


@pytest.mark.requirement(84)
@pytest.mark.parametrize("frame", ["map", "rover", "user"])
def test_a_deep_may_be_given_in_any_frame_that_is_known(
    environment: Environment, context: Any, take_step: Any, frame: Frame
) -> None:
    user, deep = Pose2(6.9, 5.0, BASE.yaw + math.pi), deep_at(environment, 1.2)
    origin = {"map": Pose2(0.0, 0.0), "rover": BASE, "user": user}[frame]
    seen = Pose3.from_yaw(origin.x, origin.y, 0.0, origin.yaw).inverse() @ deep
    move = Move(environment, context, ReachDeep(frame=frame), deep=seen)
    move.ctx.values["user.pose"] = UserPose(user, user.yaw)

    assert move.until_end(take_step, 10) == "reached"

    reached = forward(
        manipulator_of(load_robot("rbkairos_ur10")),
        np.array(move.arm.state.joints),
    )
    wanted = in_rover(BASE, deep)
    assert math.dist(reached[:3, 3], (wanted.x, wanted.y, wanted.z)) <= 0.005


def test_a_deep_of_a_user_whom_nobody_sees_is_nowhere(
    environment: Environment, context: Any, take_step: Any
) -> None:
    move = Move(environment, context, ReachDeep(frame="user"), deep=Pose3(0.8, 0.0, 1.2))

    assert take_step(move.run) == "failed"


@pytest.mark.requirement(43)
@pytest.mark.parametrize("solver", ["lines_first", "rrt_connect", "ompl"])
def test_the_planner_goes_by_its_name(
    environment: Environment,
    context: Any,
    take_step: Any,
    solver: Solver,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if solver == "ompl" and find_spec("ompl") is None:
        with pytest.raises(ValueError, match="needs the package ompl"):
            ReachDeep(solver=solver)
        return
    real, asked = PLANNERS[solver], []

    def noted(query: Query) -> Planning:
        asked.append(query)
        return real(query)

    monkeypatch.setitem(cast("dict[str, Any]", PLANNERS), solver, noted)
    move = Move(environment, context, ReachDeep(solver=solver), deep=deep_at(environment, 1.2))

    assert move.until_end(take_step, 10) == "reached"
    assert asked


@pytest.mark.parametrize(
    ("base", "user"),
    [
        (Pose2(5.02, 4.0, 0.5), None),
        (Pose2(5.0, 4.0, 0.52), None),
        (BASE, Pose2(6.9, 5.0)),
        (BASE, Pose2(7.0, 5.0)),
    ],
)
def test_a_base_that_has_moved_or_turned_and_a_user_make_another_look(
    base: Pose2, user: Pose2 | None
) -> None:
    seen = None if user is None or user.x == 6.9 else Pose2(6.9, 5.0)
    before = ArmSituation(BASE, seen, (0.0,) * 6)

    assert before.is_like(before, MOVED, TURNED)
    assert not ArmSituation(base, user, (0.0,) * 6).is_like(before, MOVED, TURNED)


@pytest.mark.requirement(43, 47)
@pytest.mark.parametrize("turn", [0.0, 0.02, -0.02])
def test_the_way_of_the_arm_is_looked_at_again_when_the_base_has_turned(
    environment: Environment,
    context: Any,
    take_step: Any,
    turn: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looked = []
    monkeypatch.setattr(Workspace, "is_free", lambda *given: looked.append(given) or True)
    move = Move(environment, context, ReachDeep(), deep=deep_at(environment, 1.2))
    move.until_end(take_step, 0.5)
    looked.clear()

    move.ctx.values["base.pose"] = Pose2(BASE.x, BASE.y, BASE.yaw + turn)
    move.until_end(take_step, 0.1)

    assert len(looked) == (turn != 0.0)


@pytest.mark.requirement(45, 71)
def test_whatever_ends_a_move_brakes_the_arm(
    environment: Environment, context: Any, take_step: Any
) -> None:
    move = Move(environment, context, ReachDeep(), deep=deep_at(environment, 1.2))
    move.until_end(take_step, 0.5)
    assert move.arm.state.moving

    move.run.close()
    move.arm.advance(10**9)

    assert not move.arm.state.moving
    assert move.arm.state.joints != pytest.approx(environment.robot.parked, abs=0.01)


@pytest.mark.requirement(48)
def test_a_pulled_stop_line_fails_the_move(
    environment: Environment, context: Any, take_step: Any
) -> None:
    move = Move(environment, context, ReachDeep(), deep=deep_at(environment, 1.2))
    move.until_end(take_step, 0.5)
    move.ctx.values["stop.engaged"] = "bumper"

    assert take_step(move.run) == "failed"


def test_a_course_that_the_arm_refuses_fails_the_move_at_once_and_says_why(
    environment: Environment, context: Any, take_step: Any
) -> None:
    move = Move(environment, context, ReachDeep(), deep=deep_at(environment, 1.2))
    move.arm.braked = True
    notes = []

    def noted(run: Any) -> Any:
        try:
            notes.append(next(run))
        except StopIteration as end:
            return end.value
        return None

    assert move.until_end(noted, 2) == "failed"
    assert notes[-1] == "the stop line is pulled"
    assert move.tick < HZ


class SlowArm(SimArm):
    """An arm whose own controller runs at half its speed."""

    def advance(self, until_ns: int) -> None:
        super().advance(until_ns // 2)
        self.state = replace(self.state, scaling=0.5)


def test_an_arm_that_runs_at_half_its_speed_is_waited_for(
    environment: Environment, context: Any, take_step: Any
) -> None:
    quick = Move(environment, context, ReachDeep(), deep=deep_at(environment, 1.2))
    assert quick.until_end(take_step, 20) == "reached"
    move = Move(environment, context, ReachDeep(), deep=deep_at(environment, 1.2))
    move.arm = SlowArm(environment.robot.arm, environment.robot.parked)
    move.ctx.parts["arm"] = move.arm

    assert move.until_end(take_step, 20) == "reached"
    assert move.tick > quick.tick + 0.5 * HZ


class StuckArm(SlowArm):
    """An arm whose controller says that it runs, and hardly does."""

    def advance(self, until_ns: int) -> None:
        super().advance(until_ns // 500)
        self.state = replace(self.state, scaling=0.001)


def test_an_arm_that_hardly_runs_fails_after_twenty_times_its_time(
    environment: Environment, context: Any, take_step: Any
) -> None:
    move = Move(environment, context, ReachDeep(), deep=deep_at(environment, 1.2))
    move.arm = StuckArm(environment.robot.arm, environment.robot.parked)
    move.ctx.parts["arm"] = move.arm

    assert move.until_end(take_step, 60) == "failed"
    assert 20 * HZ < move.tick < 60 * HZ


@pytest.mark.parametrize("at_start", [True, False])
def test_an_arm_whose_own_safety_system_stops_it_fails_the_move_and_says_so(
    environment: Environment, context: Any, take_step: Any, at_start: bool
) -> None:
    move = Move(environment, context, ReachDeep(), deep=deep_at(environment, 1.2))
    if not at_start:
        move.until_end(take_step, 0.5)
        assert move.arm.state.moving
    move.ctx.values["arm.joints"] = replace(move.arm.state, mode="protective_stop")

    assert next(move.run) == "the arm: protective stop"
    assert take_step(move.run) == "failed"


def tool_of(move: Move) -> np.ndarray:
    """rover_from_tcp where the arm is now, (4, 4)."""
    return forward(CHAIN, np.array(move.arm.state.joints))


DOWN = Pose3.written(0.8, 0.1, 0.9, pitch=-math.pi / 2)
"""Ahead of the robot, pointing straight down; in its own frame."""


@pytest.mark.requirement(43, 84)
@pytest.mark.parametrize("frame", ["map", "rover", "user"])
def test_the_tool_moves_to_a_pose_of_any_frame(
    environment: Environment, context: Any, take_step: Any, frame: Frame
) -> None:
    user = Pose2(7.5, 5.5, 0.3)
    origin = {"map": Pose2(0.0, 0.0), "rover": BASE, "user": user}[frame]
    goal = origin.upright().inverse() @ BASE.upright() @ DOWN
    move = Move(environment, context, MoveArmTo(frame=frame), goal=goal)
    move.ctx.values["user.pose"] = UserPose(user, user.yaw)

    assert move.until_end(take_step, 20) == "arrived"

    reached = tool_of(move)
    assert reached[:3, 3] == pytest.approx((0.8, 0.1, 0.9), abs=0.003)
    assert -reached[:3, 0] == pytest.approx((0.0, 0.0, -1.0), abs=0.01)


def test_a_tool_that_is_there_arrives_at_once(
    environment: Environment, context: Any, take_step: Any
) -> None:
    move = Move(environment, context, MoveArmTo(frame="rover"), goal=DOWN)
    assert move.until_end(take_step, 20) == "arrived"
    there = move.arm.state.joints
    move.run, begun = MoveArmTo(frame="rover").run(move.ctx, goal=DOWN), move.tick

    assert move.until_end(take_step, 1) == "arrived"
    assert move.tick - begun < 5
    assert move.arm.state.joints == pytest.approx(there, abs=0.002)


def test_a_goal_of_the_map_waits_for_a_certain_base_and_one_of_the_rover_does_not(
    environment: Environment, context: Any, take_step: Any
) -> None:
    for frame, outcome in (("rover", "arrived"), ("map", "failed")):
        goal = DOWN if frame == "rover" else BASE.upright() @ DOWN
        move = Move(environment, context, MoveArmTo(frame=frame), goal=goal)  # type: ignore[arg-type]
        move.ctx.values["base.pose_sigma"] = PoseSigma(0.03, 0.001)
        assert move.until_end(take_step, 20) == outcome


def test_a_goal_out_of_reach_has_no_solution(
    environment: Environment, context: Any, take_step: Any
) -> None:
    run = Move(environment, context, MoveArmTo(frame="rover"), goal=Pose3(2.5, 0.0, 1.0)).run

    told = re.fullmatch(r"the goal is (\d\.\d\d\d) m out of reach", next(run))
    assert told is not None
    assert 0.5 < float(told[1]) < 2.0
    assert take_step(run) == "no_solution"


@pytest.mark.requirement(43)
def test_a_person_or_a_wall_at_the_goal_blocks_it(
    environment: Environment, context: Any, take_step: Any
) -> None:
    move = Move(environment, context, MoveArmTo(frame="rover"), goal=DOWN)
    there = Pose2(*BASE.transform(0.8, 0.0))
    move.ctx.values["user.pose"] = UserPose(there, 0.0)
    assert move.until_end(take_step, 20) == "blocked"

    at_the_wall = Pose2(9.3, 4.0, 0.0)  # 70 cm before it
    move = Move(environment, context, MoveArmTo(frame="rover"), goal=DOWN)
    move.ctx.values["base.pose"] = at_the_wall
    assert move.until_end(take_step, 20) == "blocked"


def test_an_arm_that_touches_a_person_is_blocked_and_parks(
    environment: Environment, context: Any, take_step: Any
) -> None:
    out = Move(environment, context, MoveArmTo(frame="rover"), goal=DOWN)
    assert out.until_end(take_step, 20) == "arrived"
    touched = UserPose(Pose2(*BASE.transform(1.2, 0.0)), 0.0)
    for state, outcome in (
        (MoveArmJoints(environment.robot.parked), "blocked"),
        (ParkArm(), "parked"),
    ):
        move = Move(environment, context, state)
        move.arm = SimArm(environment.robot.arm, out.arm.state.joints)
        move.ctx.parts["arm"], move.ctx.values["arm.joints"] = move.arm, move.arm.state
        move.ctx.values["user.pose"] = touched
        assert move.until_end(take_step, 30) == outcome


@pytest.mark.requirement(43, 47)
def test_the_joints_move_to_given_angles(
    environment: Environment, context: Any, take_step: Any
) -> None:
    up = (0.0, -1.57, 0.1, -1.57, 0.2, 0.3)
    move = Move(environment, context, MoveArmJoints(up))

    assert move.until_end(take_step, 20) == "arrived"
    assert move.arm.state.joints == pytest.approx(up, abs=0.002)


@pytest.mark.parametrize(
    ("joints", "message"),
    [((0.0,) * 5, "5 joint angles; it has 6 joints"), ((7.0, *(0.0,) * 5), "joint 0 at 7.0 rad")],
)
def test_joints_that_the_arm_does_not_have_are_an_error(
    environment: Environment, context: Any, joints: tuple[float, ...], message: str
) -> None:
    move = Move(environment, context, MoveArmJoints(joints))

    with pytest.raises(ValueError, match=message):
        next(move.run)


@pytest.mark.requirement(48)
def test_a_pulled_stop_line_fails_general_moves_too(
    environment: Environment, context: Any, take_step: Any
) -> None:
    for state, inputs in (
        (MoveArmTo(frame="rover"), {"goal": DOWN}),
        (MoveArmJoints((0.0, -1.57, 0.1, -1.57, 0.2, 0.3)), {}),
    ):
        move = Move(environment, context, state, **inputs)
        move.until_end(take_step, 0.5)
        assert move.arm.state.moving
        move.ctx.values["stop.engaged"] = "bumper"
        assert take_step(move.run) == "failed"


def test_holding_goes_on_until_it_is_ended(
    environment: Environment, context: Any, take_step: Any
) -> None:
    move = Move(environment, context, HoldProp())

    assert move.until_end(take_step, 5) is None
