"""Moments made of what is known tick by tick."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings, strategies as st

from cobodeck.shapes.moment import TRAIL_S, Moment, MomentTrail
from hw.geometry import STILL, Pose2, Pose3
from hw.samples import UserPose
from hw.truth import Truth
from tests.repeats import examples

TICK_NS = 33_333_333


def test_without_any_instant_nothing_is_known() -> None:
    assert MomentTrail().moment() == Moment()


def test_a_moment_is_that_of_the_last_instant() -> None:
    trail, deep = MomentTrail(), Pose3.from_yaw(1.0, 2.0, 1.2, 0.0)
    trail.add(0, Truth(Pose2(0.0, 0.0)))
    trail.add(TICK_NS, Truth(Pose2(1.0, 2.0, 0.5), (0.0,) * 6, False, Pose2(3.0, 3.0, 1.0), 0.0,
                             deep, head_turn=3.0))  # fmt: skip

    moment = trail.moment()

    assert moment.robot == Pose2(1.0, 2.0, 0.5)
    assert moment.user == UserPose(Pose2(3.0, 3.0, 1.0), 4.0 - 2.0 * math.pi)
    assert (moment.deep, moment.joints, moment.at_s) == (deep, (0.0,) * 6, TICK_NS * 1e-9)
    assert moment.robot_trail == ((0.0, 0.0), (1.0, 2.0))
    assert moment.user_trail == ((3.0, 3.0),)
    assert moment.velocity == STILL


def test_what_is_lost_is_not_shown_where_it_was() -> None:
    trail = MomentTrail()
    trail.add(0, Truth(Pose2(0.0, 0.0), body=Pose2(1.0, 1.0)))
    trail.add(TICK_NS, Truth(Pose2(0.0, 0.0)))

    assert trail.moment().user is None
    assert trail.moment().user_trail == ((1.0, 1.0),)


def test_a_long_trail_has_no_more_points_than_wanted_and_ends_where_the_robot_is() -> None:
    trail = MomentTrail(lasting_s=5.0, apart_m=0.1)
    for n in range(301):
        trail.add(n * TICK_NS, Truth(Pose2(n * 0.013, 0.0)))

    found = [x for x, _ in trail.moment().robot_trail]

    assert found[-1] == 300 * 0.013
    assert all(0.1 <= b - a <= 0.1 + 0.013 for a, b in pairwise(found))
    assert 150 * 0.013 <= found[0] <= 150 * 0.013 + 0.12


@given(st.integers(1, 300), st.floats(-1.5, 1.5), st.floats(-1.0, 1.0))
@settings(max_examples=examples(20, least=5), deadline=None)
@pytest.mark.requirement(134)
def test_velocities_and_trails_are_those_of_the_motion(
    count: int, speed: float, turn: float
) -> None:
    trail, step = MomentTrail(), TICK_NS * 1e-9
    robot = Pose2(1.0, 1.0, 0.3)
    for n in range(count + 1):
        trail.add(n * TICK_NS, Truth(robot, body=Pose2(n * step * speed, 0.0, n * step * turn)))
        robot @= Pose2(speed * step, 0.0, turn * step)

    moment = trail.moment()

    assert (moment.twist.vx, moment.twist.vy) == pytest.approx((speed, 0.0), abs=1e-9)
    assert moment.twist.wz == pytest.approx(turn, abs=1e-9)
    assert moment.velocity.vx == pytest.approx(speed, abs=1e-9)
    assert moment.velocity.wz == pytest.approx(turn, abs=1e-9)
    kept = min(count, math.floor(TRAIL_S / step + 1e-6)) + 1
    assert len(moment.robot_trail) == len(moment.user_trail) == kept
