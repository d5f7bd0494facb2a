import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hw.robot import MotionLimits, load_robot
from hw.sim.arm import SimArm

ARM = load_robot("rbkairos_ur10").arm
LIMITS = MotionLimits(arm_acceleration=5.0)
TICK = 1e9 / 30
ZERO = (0.0,) * 6

joints = st.tuples(*[st.floats(low, high) for low, high in zip(ARM.lower, ARM.upper, strict=True)])


def run(arm, ticks, start=0):
    states = []
    for n in range(start, start + ticks):
        arm.advance(round((n + 1) * TICK))
        states.append(arm.state)
    return states


def arrival(arm, ticks=600):
    return next(n + 1 for n, state in enumerate(run(arm, ticks)) if not state.moving)


@pytest.mark.requirement(45, 50)
@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(joints, st.integers(1, 60)), min_size=1, max_size=4))
def test_joint_speeds_and_accelerations_never_exceed_the_limits(moves):
    arm, n, states = SimArm(ARM, LIMITS), 0, [SimArm(ARM, LIMITS).state]
    for goal, ticks in moves:
        arm.move_to(goal)
        states += run(arm, ticks, n)
        n += ticks
    dt = 1 / 30 + 1e-9
    for before, after in itertools.pairwise(states):
        for i in range(6):
            assert abs(after.velocities[i]) <= ARM.max_speed[i] * (1 + 1e-9)
            assert abs(after.joints[i] - before.joints[i]) <= ARM.max_speed[i] * dt * (1 + 1e-9)
            change = abs(after.velocities[i] - before.velocities[i])
            assert change <= ARM.stop_deceleration * dt * (1 + 1e-6)


@settings(deadline=None, max_examples=60)
@given(joints)
def test_an_undisturbed_move_keeps_the_acceleration_and_ends_at_its_goal(goal):
    arm = SimArm(ARM, LIMITS)
    arm.move_to(goal)
    states = run(arm, 400)
    assert states[-1].joints == pytest.approx(goal, abs=1e-12)
    assert not states[-1].moving
    for before, after in itertools.pairwise(states):
        for a, b in zip(before.velocities, after.velocities, strict=True):
            assert abs(b - a) <= 5.0 / 30 * (1 + 1e-6)


@settings(deadline=None, max_examples=60)
@given(joints, joints)
def test_a_move_takes_the_time_of_its_slowest_joint(start, goal):
    arm = SimArm(ARM, LIMITS, start)

    def alone(d, v):
        return 2 * math.sqrt(d / 5.0) if d < v * v / 5.0 else d / v + v / 5.0

    slowest = max(alone(abs(b - a), v) for a, b, v in zip(start, goal, ARM.max_speed, strict=True))
    arm.move_to(goal)
    # joints share one profile, so another joint's speed limit may cost a little more
    assert slowest * 30 - 1e-6 <= arrival(arm) <= 1.6 * slowest * 30 + 2


@pytest.mark.parametrize("tiny", [5e-324, 1e-200, 1e-13])
def test_a_move_too_short_for_arithmetic_is_over_at_once(tiny):
    arm = SimArm(ARM, LIMITS, ZERO)
    arm.move_to((0.0, 0.0, 0.0, 0.0, 0.0, tiny))
    assert not run(arm, 1)[-1].moving


def test_a_single_joint_move_is_a_trapezoid():
    arm = SimArm(ARM, LIMITS, ZERO)
    arm.move_to((3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    v = ARM.max_speed[0]
    whole = 3.0 / v + v / 5.0
    for n, state in enumerate(run(arm, 80), start=1):
        t = n / 30
        if t < v / 5.0:
            assert state.joints[0] == pytest.approx(0.5 * 5.0 * t * t, abs=1e-6)
        elif t < whole - v / 5.0:
            assert state.velocities[0] == pytest.approx(v)
        elif t > whole:
            assert state.joints[0] == 3.0
            assert state.velocities == ZERO


def test_a_longer_duration_slows_the_whole_move_down():
    arm = SimArm(ARM, LIMITS, ZERO)
    arm.move_to((1.0,) * 6, duration_s=4.0)
    assert arrival(arm) == 120
    quick = SimArm(ARM, LIMITS, ZERO)
    quick.move_to((1.0,) * 6, duration_s=0.01)
    assert arrival(quick) == pytest.approx(30 * 2 * math.sqrt(1.0 / 5.0), abs=1)


@pytest.mark.requirement(45)
@settings(deadline=None, max_examples=60)
@given(joints, st.integers(1, 40))
def test_a_stop_brings_the_arm_to_rest_within_a_fifth_of_a_second(goal, ticks):
    arm = SimArm(ARM, LIMITS)
    arm.move_to(goal)
    run(arm, ticks)
    arm.stop()
    states = run(arm, 10, ticks)
    assert not states[6].moving
    assert states[6].joints == states[9].joints


def test_a_new_goal_in_mid_move_brakes_first_and_arrives():
    arm = SimArm(ARM, LIMITS, ZERO)
    arm.move_to((3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    run(arm, 20)
    arm.move_to((0.0, 2.0, 0.0, 0.0, 0.0, 0.0))
    states = run(arm, 120, 20)
    assert states[-1].joints == pytest.approx((0.0, 2.0, 0.0, 0.0, 0.0, 0.0), abs=1e-12)
    still = [s for s in states if abs(s.velocities[0]) < 1.3 and s.velocities[1] == 0.0]
    assert still
    assert all(state.velocities[1] == 0.0 for state in states[:2])


def test_the_step_does_not_matter():
    ends = []
    for parts in (1, 7):
        arm = SimArm(ARM, LIMITS, ZERO)
        arm.move_to((2.0, 1.0, 0.5, 0.0, 0.0, 0.0))
        for n in range(20 * parts):
            arm.advance(round((n + 1) * TICK / parts))
        ends.append(arm.state)
    assert ends[0].joints == pytest.approx(ends[1].joints, abs=1e-9)
    assert ends[0].velocities == pytest.approx(ends[1].velocities, abs=1e-9)
