"""Mecanum wheels: rates and velocities are exact inverses; ways, slip and brakes."""

import math

import pytest
from hypothesis import given, strategies as st

from hw.drivers.can.mecanum import Mecanum, Reckoning, along, filled
from hw.geometry import Pose2, Twist2
from hw.model.robot import load_robot

WHEELS = Mecanum.of(load_robot("rbkairos_ur10").base)
ENDLESS = Mecanum(WHEELS.radius, WHEELS.lever, math.inf)
numbers = st.floats(-3.0, 3.0)
twists = st.builds(Twist2, numbers, numbers, numbers)
rolling = twists.map(ENDLESS.rates)
QUANTUM = 1e-4


def test_rates_of_plain_motions_by_hand():
    ahead = 1.0 / 0.127
    turn = (0.2225 + 0.2045) / 0.127
    assert WHEELS.rates(Twist2(1.0)) == pytest.approx((ahead, ahead, ahead, ahead))
    assert WHEELS.rates(Twist2(0.0, 1.0)) == pytest.approx((-ahead, ahead, ahead, -ahead))
    assert WHEELS.rates(Twist2(0.0, 0.0, 1.0)) == pytest.approx((-turn, turn, -turn, turn))


@given(twists)
def test_the_velocity_of_its_rates_is_the_velocity(velocity):
    found = ENDLESS.velocity(ENDLESS.rates(velocity))
    for one, other in zip(
        (found.vx, found.vy, found.wz), (velocity.vx, velocity.vy, velocity.wz), strict=True
    ):
        assert one == pytest.approx(other, abs=1e-12)


@given(twists)
def test_wheels_that_cannot_follow_are_slower_by_one_share(velocity):
    wanted, found = ENDLESS.rates(velocity), WHEELS.rates(velocity)
    assert max(map(abs, found)) <= WHEELS.max_rate * (1 + 1e-12)
    share = min(1.0, WHEELS.max_rate / max(*map(abs, wanted), 1e-9))
    assert found == pytest.approx([share * rate for rate in wanted], abs=1e-9)


@given(rolling, st.integers(0, 3), st.floats(-20.0, 20.0))
def test_rolling_wheels_do_not_slip_and_one_that_lies_is_seen_by_half(rates, place, off):
    assert WHEELS.slip(rates) == pytest.approx(0.0, abs=1e-9)
    lying = list(rates)
    lying[place] += off
    assert abs(WHEELS.slip(tuple(lying))) == pytest.approx(0.5 * WHEELS.radius * abs(off), abs=1e-9)


@given(rolling, st.integers(0, 3))
def test_three_wheels_tell_the_fourth(rates, place):
    known = [None if n == place else rate for n, rate in enumerate(rates)]
    assert filled(known) == pytest.approx(rates, abs=1e-9)


def test_two_wheels_tell_nothing_of_the_others():
    assert filled([1.0, None, None, 1.0]) is None


@given(twists, st.floats(0.001, 0.5))
def test_the_way_is_that_of_many_short_steps(velocity, span):
    pose = Pose2(0.3, -0.2, 1.0)
    short = pose
    for _ in range(200):
        middle = short.yaw + 0.5 * velocity.wz * span / 200
        step = velocity.rotated(middle)
        short = Pose2(
            short.x + step.vx * span / 200,
            short.y + step.vy * span / 200,
            short.yaw + velocity.wz * span / 200,
        )
    found = along(pose, velocity, span)
    assert found.distance_to(short) < 1e-4
    assert found.yaw == pytest.approx(short.yaw, abs=1e-9)


@given(twists, st.floats(0.0, 0.1))
def test_there_and_back_is_where_it_was(velocity, span):
    pose = Pose2(1.0, 2.0, 0.5)
    back = Twist2(-velocity.vx, -velocity.vy, -velocity.wz)
    found = along(along(pose, velocity, span), back, span)
    assert found.distance_to(pose) < 1e-9


@given(st.floats(0.0, math.tau), st.floats(0.01, 3.0), st.floats(0.5, 5.0))
def test_braking_wheels_stand_no_later_than_the_base_is_to(direction, speed, deceleration):
    velocity = Twist2(speed * math.cos(direction), speed * math.sin(direction))
    fastest = max(map(abs, ENDLESS.rates(velocity)))
    assert fastest / ENDLESS.brakes(deceleration) <= speed / deceleration + 1e-9


def test_the_velocity_is_as_sure_as_the_wheels_agree():
    reckoning = Reckoning(WHEELS, QUANTUM)
    sure = reckoning.move(WHEELS.rates(Twist2(0.5)), 0.01).sigma
    assert sure == pytest.approx(
        (0.5 * QUANTUM * WHEELS.radius / math.sqrt(12),) * 2
        + (0.5 * QUANTUM * WHEELS.radius / math.sqrt(12) / WHEELS.lever,)
    )
    a, b, c, d = WHEELS.rates(Twist2(0.5))
    for _ in range(300):
        unsure = reckoning.move((a + 1.0, b, c, d), 0.01).sigma
    assert unsure[0] == pytest.approx(0.25 * WHEELS.radius, rel=0.01)
    assert unsure[2] == pytest.approx(0.25 * WHEELS.radius / WHEELS.lever, rel=0.01)
