"""Drives through several goals, on the simulated base."""

from __future__ import annotations

from typing import Any

import pytest

from engine.interfaces import interface
from hw.geometry import Pose2
from states.environment.environment import Environment
from states.navigation.drive import NO_PATH_S
from states.navigation.states import DriveThrough, DriveTo
from tests.states.navigation.test_states_navigation import HZ, START, NoWay, Rig

GOALS = (Pose2(5.0, 2.0, 0.0), Pose2(8.0, 3.0, 1.2), Pose2(8.0, 6.0, 1.57))


def driven(rig: Rig, run: Any, take_step: Any, seconds: float) -> tuple[str | None, list[Any]]:
    """The outcome within a time, and pose and speed in every tick."""
    outcome, course = None, []
    for _ in range(round(seconds * HZ)):
        outcome = rig.tick(run, take_step)
        course.append((rig.base.pose, rig.base.twist.speed))
        if outcome is not None:
            break
    return outcome, course


def test_it_has_what_drive_to_has() -> None:
    through, to = interface(DriveThrough), interface(DriveTo)

    assert (through.outcomes, through.reads, through.commands) == (
        to.outcomes, to.reads, to.commands,
    )  # fmt: skip
    assert {**to.parameters, "passing": through.parameters["passing"]} == through.parameters


def test_it_passes_all_goals_without_a_stop_and_stands_at_the_last(
    environment: Environment, context: Any, take_step: Any
) -> None:
    rig = Rig(environment, context)
    outcome, course = driven(rig, DriveThrough(passing=0.5).run(rig.ctx, GOALS), take_step, 20)

    assert outcome == "arrived"
    assert rig.base.pose.distance_to(GOALS[-1]) <= environment.navigation.chase.tolerance
    assert rig.base.pose.yaw == pytest.approx(1.57, abs=environment.navigation.chase.yaw_tolerance)
    passed = [min(range(len(course)), key=lambda n: course[n][0].distance_to(g)) for g in GOALS]
    assert passed == sorted(passed)
    assert all(course[n][0].distance_to(g) <= 0.5 for n, g in zip(passed, GOALS, strict=True))
    assert min(speed for _, speed in course[HZ : passed[1]]) > 0.7


def test_it_takes_less_time_than_driving_to_each(
    environment: Environment, context: Any, take_step: Any
) -> None:
    rig, alone = Rig(environment, context), Rig(environment, context)
    driven(rig, DriveThrough().run(rig.ctx, GOALS), take_step, 20)
    for goal in GOALS:
        assert driven(alone, DriveTo().run(alone.ctx, goal), take_step, 20)[0] == "arrived"

    assert rig.n < alone.n - HZ


def test_through_one_goal_is_to_it(environment: Environment, context: Any, take_step: Any) -> None:
    through, to = Rig(environment, context), Rig(environment, context)

    _, one = driven(through, DriveThrough().run(through.ctx, GOALS[1:2]), take_step, 20)
    _, other = driven(to, DriveTo().run(to.ctx, GOALS[1]), take_step, 20)

    assert one == other


def test_through_nothing_it_has_arrived_and_commands_nothing(
    environment: Environment, context: Any, take_step: Any
) -> None:
    rig = Rig(environment, context)
    rig.ctx.parts.clear()

    assert take_step(DriveThrough().run(rig.ctx, ())) == "arrived"


@pytest.mark.parametrize("passing", [0.0, 0.01, 50.0])
def test_whatever_passing_is_it_ends_at_the_last_goal(
    environment: Environment, context: Any, take_step: Any, passing: float
) -> None:
    rig = Rig(environment, context)
    goals = (GOALS[0], GOALS[0], START, *GOALS[1:])

    outcome, _ = driven(rig, DriveThrough(passing=passing).run(rig.ctx, goals), take_step, 40)

    assert outcome == "arrived"
    assert rig.base.pose.distance_to(GOALS[-1]) <= environment.navigation.chase.tolerance


def test_a_goal_in_between_that_cannot_be_reached_ends_it(
    environment: Environment, context: Any, take_step: Any
) -> None:
    rig = Rig(environment, context)
    goals = (GOALS[0], Pose2(0.2, 0.2), GOALS[2])

    outcome, course = driven(rig, DriveThrough().run(rig.ctx, goals), take_step, 20)

    assert outcome == "no_path"
    assert course[-1][0].distance_to(GOALS[0]) < 1.0


def test_a_way_that_is_gone_counts_across_goals(
    environment: Environment, context: Any, take_step: Any
) -> None:
    """Whether the goal before or this one has had no path: after a second it has failed."""
    rig = Rig(environment, context)
    rig.ctx.values["chase.planner"] = NoWay(environment)
    goals = (Pose2(2.3, 2.0), GOALS[0])

    outcome, course = driven(rig, DriveThrough().run(rig.ctx, goals), take_step, 5)

    assert outcome == "no_path"
    assert len(course) == pytest.approx(NO_PATH_S * HZ, abs=2)


def test_a_robot_that_does_not_move_is_stuck_and_one_without_pose_lost(
    environment: Environment, context: Any, take_step: Any
) -> None:
    rig = Rig(environment, context)
    rig.base.braked = True
    assert driven(rig, DriveThrough().run(rig.ctx, GOALS), take_step, 4)[0] == "stuck"

    run = DriveThrough().run(rig.ctx, GOALS)
    rig.tick(run, take_step)
    rig.ctx.values["base.pose"] = None
    assert take_step(run) == "lost"


def test_for_a_touch_the_chain_is_told_each_goal_and_in_the_end_none(
    environment: Environment, context: Any, take_step: Any
) -> None:
    rig = Rig(environment, context)
    grants: list[Pose2 | None] = []
    rig.guard.grant = grants.append  # type: ignore[method-assign]

    driven(rig, DriveThrough("haptic").run(rig.ctx, GOALS), take_step, 20)

    assert grants == [*GOALS, None]
