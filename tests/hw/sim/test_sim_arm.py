import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hw.model.robot import load_robot
from hw.samples import ArmState
from hw.sim.sim_arm import STOPPED, JointCourse, PacedCourse, SimArm

ROBOT = load_robot("rbkairos_ur10")
ARM, PARKED = ROBOT.arm, ROBOT.parked
TICK = 1e9 / 30
ZERO = (0.0,) * 6

joints = st.tuples(*[st.floats(low, high) for low, high in zip(ARM.lower, ARM.upper, strict=True)])


def run(arm, ticks, start=0):
    states = []
    for n in range(start, start + ticks):
        arm.advance(round((n + 1) * TICK))
        states.append(arm.state)
    return states


def straight(start, goal, seconds=0.0):
    """A course in an even joint line, no faster than the joints can, in seconds or more."""
    pairs = zip(start, goal, ARM.max_speed, strict=True)
    fastest = max(abs(b - a) / v for a, b, v in pairs)
    return [(0.0, start), (max(fastest, seconds, 1e-6), goal)]


def follow(arm, goal, seconds=0.0):
    return arm.follow(straight(arm.state.joints, goal, seconds))


@pytest.mark.requirement(45, 50)
@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(joints, st.integers(1, 60)), min_size=1, max_size=4))
def test_joint_speeds_and_the_brakes_never_exceed_the_limits(moves):
    arm, n, states = SimArm(ARM, PARKED), 0, [SimArm(ARM, PARKED).state]
    for goal, ticks in moves:
        follow(arm, goal)
        states += run(arm, ticks, n)
        n += ticks
    dt = 1 / 30 + 1e-9
    for before, after in itertools.pairwise(states):
        for i in range(6):
            assert abs(after.velocities[i]) <= ARM.max_speed[i] * (1 + 1e-9)
            assert abs(after.joints[i] - before.joints[i]) <= ARM.max_speed[i] * dt * (1 + 1e-9)
            slower = abs(before.velocities[i]) - abs(after.velocities[i])
            if after.moving:
                assert slower <= ARM.stop_deceleration * dt * (1 + 1e-6)


@pytest.mark.requirement(45)
@settings(deadline=None, max_examples=60)
@given(joints, st.integers(1, 40))
def test_a_stop_brings_the_arm_to_rest_within_a_fifth_of_a_second(goal, ticks):
    arm = SimArm(ARM, PARKED)
    follow(arm, goal)
    run(arm, ticks)
    arm.stop()
    states = run(arm, 10, ticks)
    assert not states[6].moving
    assert states[6].joints == states[9].joints


@pytest.mark.requirement(45)
@pytest.mark.parametrize("share", [0.3, 1.0])
def test_an_arm_that_brakes_does_not_speed_up_again_for_a_pace(share):
    arm = SimArm(ARM, ZERO)
    follow(arm, (2.0, 1.0, 0.5, 0.0, 0.0, -1.0), 2.0)
    run(arm, 30)
    arm.stop()
    arm.pace(share)
    before, *states = [arm.state, *run(arm, 3, 30)]
    for after in states:
        assert abs(after.velocities[0]) < abs(before.velocities[0]) or not after.moving
        before = after
    assert not before.moving


def test_the_arm_is_where_its_course_says_and_ends_at_its_goal():
    arm = SimArm(ARM, ZERO)
    goal = (2.0, 1.0, 0.5, 0.0, 0.0, -1.0)
    assert follow(arm, goal, 2.0) == 1
    for n, state in enumerate(run(arm, 59), start=1):
        assert state.joints == pytest.approx([n / 60 * angle for angle in goal])
        assert state.velocities == pytest.approx([0.5 * angle for angle in goal])
        assert (state.moving, state.course, state.refused) == (True, 1, None)
    assert run(arm, 2, 59)[-1] == ArmState(goal, ZERO, course=1)


def test_a_course_through_corners_is_followed_corner_by_corner():
    arm = SimArm(ARM, ZERO)
    points = [(0.0, ZERO), (1.0, (1.0, *ZERO[1:])), (2.0, (1.0, 0.5, *ZERO[2:]))]
    arm.follow(points)
    states = run(arm, 61)
    assert states[14].velocities == (pytest.approx(1.0), *ZERO[1:])
    assert states[44].velocities == (0.0, pytest.approx(0.5), *ZERO[2:])
    assert states[-1].joints == points[-1][1]


@pytest.mark.parametrize("tiny", [5e-324, 1e-200, 1e-13])
def test_a_course_too_short_for_arithmetic_is_over_at_once(tiny):
    arm = SimArm(ARM, ZERO)
    follow(arm, (0.0, 0.0, 0.0, 0.0, 0.0, tiny))
    assert not run(arm, 1)[-1].moving


def test_a_course_of_one_point_is_taken_and_moves_nothing():
    arm = SimArm(ARM, ZERO)
    assert arm.follow([(0.0, ZERO)]) == 1
    assert run(arm, 1)[-1] == ArmState(ZERO, ZERO, course=1)


def test_a_new_course_in_mid_move_is_refused_and_brakes_the_old_one():
    arm = SimArm(ARM, ZERO)
    follow(arm, (3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    run(arm, 20)
    assert follow(arm, (0.0, 2.0, 0.0, 0.0, 0.0, 0.0)) == 2
    states = run(arm, 10, 20)
    assert (states[0].moving, states[0].course, states[0].refused) == (True, 2, "the arm moves")
    assert not states[6].moving
    assert all(state.joints[1] == 0.0 for state in states)


def test_a_course_that_begins_elsewhere_is_refused_with_the_distance():
    arm = SimArm(ARM, ZERO)
    start = (0.0, 0.0, 0.0, 0.0, -0.25, 0.0)
    assert arm.follow([(0.0, start), (1.0, ZERO)]) == 1
    state = run(arm, 1)[-1]
    assert state == ArmState(ZERO, ZERO, False, 1, "the arm stands 0.250 rad from its start")


@pytest.mark.requirement(48)
def test_a_braked_arm_breaks_its_course_off_and_refuses_another():
    arm = SimArm(ARM, ZERO)
    follow(arm, (3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    run(arm, 20)
    arm.braked = True
    states = run(arm, 10, 20)
    assert (states[0].course, states[0].refused) == (1, STOPPED)
    assert not states[-1].moving
    assert follow(arm, ZERO) == 2
    assert run(arm, 1, 30)[-1].refused == STOPPED
    arm.braked = False
    assert follow(arm, ZERO) == 3
    assert run(arm, 1, 31)[-1].refused is None


def test_a_stop_that_was_asked_for_is_no_refusal():
    arm = SimArm(ARM, ZERO)
    follow(arm, (3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    run(arm, 20)
    arm.stop()
    assert [state.refused for state in run(arm, 10, 20)] == [None] * 10


def test_the_step_does_not_matter():
    ends = []
    for parts in (1, 7):
        arm = SimArm(ARM, ZERO)
        follow(arm, (2.0, 1.0, 0.5, 0.0, 0.0, 0.0))
        for n in range(20 * parts):
            arm.advance(round((n + 1) * TICK / parts))
        ends.append(arm.state)
    assert ends[0].joints == pytest.approx(ends[1].joints, abs=1e-9)
    assert ends[0].velocities == pytest.approx(ends[1].velocities, abs=1e-9)


@settings(deadline=None)
@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.2, 20.0), st.floats(0.0, 3.0))
def test_the_way_along_a_course_is_the_integral_of_its_rate(before, rate, slope, after):
    course = JointCourse((0.0, 1e3), (ZERO, (1.0, *ZERO[1:])))
    paced = PacedCourse(course, 10**9, 0.5, before, rate, slope)
    times = np.linspace(0.0, after, 4001)
    rates = before + np.clip(rate - before, -slope * times, slope * times)
    way = 0.5 * (rates[1:] + rates[:-1]) @ np.diff(times)
    assert paced.at(10**9 + round(after * 1e9)) == pytest.approx((0.5 + way, rates[-1]), abs=1e-5)
