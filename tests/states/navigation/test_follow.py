"""The robot follows a person, on the simulated base."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from hw.geometry import Pose2, Twist2
from hw.samples import UserPose
from states.environment.environment import Environment
from states.navigation.beside_user import place_at
from states.navigation.drive import NO_PATH_S
from states.navigation.states import FIRST_POSE_S, Follow
from tests.repeats import examples
from tests.states.navigation.test_states_navigation import HZ, NARROW, NoWay, Rig

Walk = Callable[[float], Pose2]


def standing(x: float, y: float) -> Walk:
    return lambda _: Pose2(x, y)


class Followed:
    """A person on a walk, and the robot that follows them."""

    def __init__(self, environment: Environment, context: Any, state: Follow) -> None:
        self.rig = Rig(environment, context)
        self.run = state.run(self.rig.ctx)
        self.away: list[float] = []

    def during(self, walk: Walk, take_step: Any, seconds: float) -> str | None:
        for tick in range(round(seconds * HZ)):
            body, then = walk(tick / HZ), walk((tick + 1) / HZ)
            self.rig.ctx.values["user.pose"] = UserPose(body, body.yaw)
            velocity = Twist2((then.x - body.x) * HZ, (then.y - body.y) * HZ)
            self.rig.ctx.values["user.velocity"] = velocity
            outcome = self.rig.tick(self.run, take_step)
            self.away.append(self.rig.base.pose.distance_to(body))
            if outcome is not None:
                return str(outcome)
        return None


def test_it_comes_up_to_its_distance_faces_the_user_and_stands(
    environment: Environment, context: Any, take_step: Any
) -> None:
    followed = Followed(environment, context, Follow(distance=2.0))

    assert followed.during(standing(7.0, 5.0), take_step, 12) is None

    base = followed.rig.base
    assert followed.away[-1] == pytest.approx(2.0, abs=environment.navigation.chase.tolerance)
    assert base.twist.speed == 0.0
    to_user = math.atan2(5.0 - base.pose.y, 7.0 - base.pose.x)
    assert base.pose.yaw == pytest.approx(to_user, abs=0.2)


def test_it_keeps_up_with_a_walker_and_comes_no_nearer(
    environment: Environment, context: Any, take_step: Any
) -> None:
    followed = Followed(environment, context, Follow(distance=2.0))

    def walk(t: float) -> Pose2:
        return Pose2(min(8.0, 4.0 + 0.8 * t), 2.0 + max(0.0, min(4.0, 0.8 * t - 4.0)))

    assert followed.during(walk, take_step, 20) is None

    assert max(followed.away[HZ:]) < 3.2
    assert min(followed.away[HZ:]) > 1.9
    assert followed.away[-1] == pytest.approx(2.0, abs=0.06)


def test_it_rests_until_the_user_is_farther_away_by_the_slack(
    environment: Environment, context: Any, take_step: Any
) -> None:
    followed = Followed(environment, context, Follow(distance=2.0, slack=0.5))
    followed.during(standing(6.0, 2.0), take_step, 8)
    rests = followed.rig.base.pose

    assert followed.during(standing(6.35, 2.0), take_step, 3) is None
    assert followed.rig.base.pose == rests
    assert followed.during(standing(5.2, 2.0), take_step, 3) is None
    assert followed.rig.base.pose == rests

    followed.during(standing(6.8, 2.0), take_step, 5)
    assert followed.away[-1] == pytest.approx(2.0, abs=0.06)


def test_it_keeps_chases_distance_even_if_less_is_asked_for(
    environment: Environment, context: Any, take_step: Any
) -> None:
    followed = Followed(environment, context, Follow(distance=0.2))

    followed.during(standing(7.0, 4.0), take_step, 10)

    chase = environment.navigation.chase
    assert min(followed.away) > chase.user_radius
    assert followed.away[-1] == pytest.approx(chase.user_radius, abs=0.15)


def test_it_follows_around_a_wall(environment: Environment, context: Any, take_step: Any) -> None:
    wide = replace(NARROW, walls=(((4.5, 0.0), (5.5, 0.0), (5.5, 4.0), (4.5, 4.0)),))
    followed = Followed(replace(environment, room=wide), context, Follow(distance=2.0))

    assert followed.during(standing(8.0, 2.0), take_step, 15) is None

    assert followed.away[-1] == pytest.approx(2.0, abs=0.06)
    assert followed.rig.base.pose.x > 5.5


def test_without_a_path_to_the_user_it_waits_a_second_and_stops(
    environment: Environment, context: Any, take_step: Any
) -> None:
    followed = Followed(environment, context, Follow())
    followed.during(standing(8.0, 5.0), take_step, 1)
    followed.rig.ctx.values["chase.planner"] = NoWay(environment)

    assert followed.during(standing(8.0, 5.0), take_step, NO_PATH_S - 0.1) is None
    assert followed.during(standing(8.0, 5.0), take_step, 0.3) == "no_path"


@pytest.mark.parametrize("lost", ["base.pose", "user.pose", "chase.planner"])
def test_it_is_lost_without_poses_or_scans(
    environment: Environment, context: Any, take_step: Any, lost: str
) -> None:
    followed = Followed(environment, context, Follow())
    followed.during(standing(8.0, 5.0), take_step, 1)

    followed.rig.ctx.values[lost] = None

    assert take_step(followed.run) == "lost"


def test_it_waits_for_the_first_pose_of_the_user(
    environment: Environment, context: Any, take_step: Any
) -> None:
    rig = Rig(environment, context)
    run, outcome = Follow().run(rig.ctx), None
    while outcome is None:
        outcome = rig.tick(run, take_step)

    assert outcome == "lost"
    assert rig.n / HZ == pytest.approx(FIRST_POSE_S, abs=0.1)


def test_whatever_ends_it_stops_the_base(
    environment: Environment, context: Any, take_step: Any
) -> None:
    followed = Followed(environment, context, Follow())
    followed.during(standing(8.0, 5.0), take_step, 2)
    assert followed.rig.base.twist.speed > 0.3

    followed.run.close()
    followed.rig.guard.tick(2 * 10**9)
    followed.rig.base.advance(5 * 10**9)

    assert followed.rig.base.twist.speed == 0.0


@given(start=st.tuples(st.floats(-9, 9), st.floats(-9, 9)), near=st.floats(0.5, 4.0))
@settings(deadline=None, max_examples=100)
def test_the_place_on_a_straight_way_is_as_near_as_asked_for(
    start: tuple[float, float], near: float
) -> None:
    found = place_at([start, (0.0, 0.0)], (0.0, 0.0), near)

    expected = min(near, math.hypot(*start))
    assert math.hypot(*found) == pytest.approx(expected, abs=1e-6)


@given(
    user=st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0)),
    around=st.floats(-math.pi, math.pi),
    near=st.floats(0.1, 4.0),
    before=st.floats(0.01, 10.0),
)
@settings(deadline=None, max_examples=examples(200))
def test_a_way_that_only_touches_the_circle_ends_there(
    user: tuple[float, float], around: float, near: float, before: float
) -> None:
    """The end is the foot of the perpendicular, so that rounding may leave no root."""
    c, s = math.cos(around), math.sin(around)
    end = user[0] + near * c, user[1] + near * s
    start = end[0] - before * s, end[1] + before * c

    found = place_at([start, end], user, math.dist(end, user))

    assert math.dist(found, end) < 1e-5 * (1.0 + before)
