"""The way by the wheels: between two words from them, behind the newest, and through a restart."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hw.geometry import STILL, Pose2, Twist2, displacement_of, velocity_of
from states.localization.wheels.gyro import Gyro
from states.localization.wheels.odometry_watch import OdometryWatch
from states.localization.wheels.trail import Trail
from tests.states.localization.world import arc

S = 1_000_000_000
RATES = st.floats(-2.0, 2.0)


@given(RATES, RATES, st.floats(-3.0, 3.0), st.floats(1e-6, 1.0))
def test_a_steady_velocity_leads_along_an_arc_and_back_to_itself(vx, vy, wz, time):
    way = displacement_of(Twist2(vx, vy, wz), time)
    exact = arc(np.array([vx, vy, wz]) * time)
    assert (way.x, way.y, way.yaw) == pytest.approx((exact.x, exact.y, exact.yaw), abs=1e-9)
    back = velocity_of(way, time)
    assert (back.vx, back.vy, back.wz) == pytest.approx((vx, vy, wz), abs=1e-6)


def test_between_two_poses_behind_the_newest_and_before_all():
    trail = Trail()
    assert trail.at(0) is None
    trail.add_odometry(0, Pose2(0.0, 0.0))
    trail.add_odometry(S, Pose2(1.0, 0.0, 0.0))
    assert trail.at(S // 4) == Pose2(0.25, 0.0)
    assert trail.at(S) == Pose2(1.0, 0.0)
    assert trail.at(2 * S) == Pose2(2.0, 0.0)
    assert trail.at(-1) is None
    assert trail.velocity(0, S // 2) == Twist2(1.0)
    assert trail.velocity(-S, S) == trail.last_velocity() == Twist2(1.0)


def test_what_is_not_newer_is_left_out_and_the_old_is_forgotten():
    trail = Trail()
    for k in range(100):
        assert trail.add_odometry(k * S // 10, Pose2(0.1 * k, 0.0))
    assert not trail.add_odometry(99 * S // 10, Pose2(50.0, 0.0))
    assert not trail.add_odometry(S, Pose2(50.0, 0.0))
    assert trail.pose == Pose2(0.1 * 99, 0.0)
    assert trail.at(5 * S) is None
    assert trail.at(6 * S) is not None


def test_a_driver_that_begins_to_count_anew_moves_nobody():
    trail = Trail()
    trail.add_odometry(0, Pose2(50.0, 0.0))
    trail.add_odometry(S // 50, Pose2(50.01, 0.0))
    trail.add_odometry(2 * S // 50, Pose2(0.0, 0.0))
    assert trail.last_velocity() == STILL
    assert trail.at(0) is None


def test_it_knows_for_how_long_the_wheels_have_stood():
    trail = Trail()
    assert trail.standing == 0.0
    trail.add_odometry(0, Pose2(0.0, 0.0))
    trail.add_odometry(S, Pose2(0.5, 0.0))
    assert trail.standing == 0.0
    trail.add_odometry(2 * S, Pose2(0.5, 0.0))
    assert trail.standing == 1.0
    trail.add_odometry(3 * S, Pose2(0.5, 0.0, 0.02))
    assert trail.standing == 0.0


def test_the_bias_of_the_gyroscope_is_learnt_while_the_wheels_stand():
    gyro = Gyro()
    rng = np.random.default_rng(0)
    for k in range(500):
        gyro.add_reading(k * S // 100, 0.02 + rng.normal(0.0, 0.003), standing=True)
    assert gyro.bias == pytest.approx(0.02, abs=1e-3)
    gyro.pop_mean_rate(5 * S)
    for k in range(500, 510):
        gyro.add_reading(k * S // 100, 1.02, standing=False)
    assert gyro.pop_mean_rate(510 * S // 100) == pytest.approx(1.0, abs=2e-3)
    assert gyro.pop_mean_rate(511 * S // 100) is None


def test_a_gyroscope_that_fell_silent_is_not_asked():
    gyro = Gyro()
    gyro.add_reading(0, 0.5, standing=False)
    assert gyro.pop_mean_rate(S) is None


def watched(told, true=(0.05, 0.0, 0.02), steps=60):
    """Wheels that tell one way per 40 ms while scans tell another; after how many is it wrong?"""
    watch, trail = OdometryWatch(), Trail()
    here, wheels = Pose2(3.0, 2.0, 1.0), Pose2(0.0, 0.0)
    for k in range(steps):
        trail.add_odometry(k * S // 25, wheels)
        watch.add_match(k * S // 25, here, trail)
        if watch.wrong:
            return k
        here, wheels = here @ Pose2(*true), wheels @ Pose2(*told)
    return None


@pytest.mark.parametrize(
    "told", [(0.05, 0.0, 0.02), (0.055, 0.004, 0.021), (0.045, -0.005, 0.018), (0.05, 0.0, 0.025)]
)
def test_slip_is_no_fault_of_the_wheels(told):
    assert watched(told) is None


@pytest.mark.parametrize(
    "told",
    [(0.0, 0.0, 0.0), (0.1, 0.0, 0.02), (-0.05, 0.0, 0.02), (0.0, 0.05, 0.02), (0.05, 0.0, -0.02)],
    ids=["dead", "double", "backwards", "sideways", "mirrored"],
)
def test_wheels_that_are_wrong_are_told_within_a_second(told):
    assert watched(told) <= 25


def test_wheels_are_right_again_after_ten_seconds_without_a_difference():
    watch, trail = OdometryWatch(), Trail()
    watch.moved_at_rest(0)
    for k in range(1, 300):
        trail.add_odometry(k * S // 25, Pose2(0.04 * k, 0.0))
        watch.add_match(k * S // 25, Pose2(0.04 * k, 0.0), trail)
        assert watch.wrong == (k <= 250)


def test_angles_over_the_turn_are_no_difference():
    watch, trail = OdometryWatch(), Trail()
    for k in range(400):
        yaw = 0.04 * k
        trail.add_odometry(k * S // 25, Pose2(1.0, 0.0, math.remainder(yaw, 2.0 * math.pi)))
        turned = math.remainder(yaw + 3.0, 2.0 * math.pi)
        watch.add_match(k * S // 25, Pose2(0.0, 0.0, turned), trail)
        assert not watch.wrong


def test_a_single_wrong_match_is_no_fault_of_the_wheels():
    watch, trail = OdometryWatch(), Trail()
    for k in range(100):
        trail.add_odometry(k * S // 2, Pose2(0.5 * k, 0.0))
        watch.add_match(k * S // 2, Pose2(0.5 * k, 1.0 if k % 7 == 3 else 0.0), trail)
        assert not watch.wrong


@pytest.mark.parametrize("late", [-0.2, 0.2])
def test_wheels_whose_clock_is_off_are_not_wrong(late):
    watch, trail = OdometryWatch(), Trail()

    def turning(time):
        return Pose2(0.0, 0.0, math.remainder(1.5 * (1.0 - math.cos(time)), 2.0 * math.pi))

    for k in range(400):
        time = k / 25.0
        trail.add_odometry(k * S // 25, turning(time - late))
        watch.add_match(k * S // 25, turning(time), trail)
        assert not watch.wrong


def test_stamps_in_bunches_are_no_reset():
    trail = Trail()
    for k in range(100):
        stamp = (k // 5) * S // 2 + k % 5 * 1_000_000
        assert trail.add_odometry(stamp, Pose2(0.1 * k, 0.0))
    assert trail.resets == 0
    assert abs(trail.last_velocity().vx) < 20.0


def test_the_newest_two_poses_are_kept_however_old():
    trail = Trail()
    trail.add_odometry(0, Pose2(0.0, 0.0))
    trail.add_odometry(30 * S, Pose2(6.0, 0.0))
    assert trail.at(15 * S) == Pose2(3.0, 0.0)


@pytest.mark.parametrize(("first", "last"), [(3.1, -3.1), (-3.1, 3.1), (0.1, -0.1)])
def test_between_two_poses_it_turns_by_the_shorter_way(first, last):
    trail = Trail()
    trail.add_odometry(0, Pose2(0.0, 0.0, first))
    trail.add_odometry(S, Pose2(0.0, 0.0, last))
    middle = 0.0 if abs(first) < 1.0 else math.pi
    assert math.remainder(trail.at(S // 2).yaw - middle, math.tau) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_half_a_turn_between_two_scans_is_the_same_on_either_side_of_pi(way):
    """By the wheels a little less than half a turn in 2 s, by the scans a little more."""
    watch, trail = OdometryWatch(), Trail()
    for k in range(101):
        yaw = math.remainder(way * 3.12 * k / 100, math.tau)
        trail.add_odometry(k * S // 50, Pose2(0.0, 0.0, yaw))
    watch.add_match(0, Pose2(0.0, 0.0, 0.0), trail)
    watch.add_match(2 * S, Pose2(0.0, 0.0, math.remainder(way * 3.16, math.tau)), trail)
    assert not watch.contradicted


@given(st.floats(-0.09, 0.09), st.lists(st.floats(0.01, 10.0), min_size=1, max_size=5))
def test_the_bias_approaches_the_reading_and_never_goes_beyond_it(rate, pauses):
    gyro, now, left = Gyro(), 0, 1.0
    gyro.add_reading(now, rate, True)
    for pause in pauses:
        now += round(pause * S)
        gyro.add_reading(now, rate, True)
        left *= math.exp(-pause)
        assert gyro.bias == pytest.approx(rate * (1.0 - left), abs=1e-9)
