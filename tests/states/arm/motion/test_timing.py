from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hw.model.robot import MotionLimits
from states.arm.kinematics.kinematics import forward, jacobian
from states.arm.motion.joint_path import JointPath
from states.arm.motion.timing import line_durations, time_path
from states.arm.motion.trajectory import SlowZone
from tests.repeats import examples


def sampled(trajectory, n=3001):
    """Times inside a trajectory, knots included, and joints with both derivatives there."""
    t = np.union1d(np.linspace(0, trajectory.duration, n), trajectory.times)[1:-1]
    return t, *trajectory.at(t)


def tool_speed(arm, q, v):
    return np.linalg.norm((jacobian(arm, q)[:, :3] @ v[..., None])[..., 0], axis=1)


@st.composite
def paths(draw):
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    n = draw(st.integers(2, 5))
    points = rng.uniform(-2, 2, (n, 6)) * draw(st.sampled_from([0.001, 0.1, 1.0]))
    if n > 2 and draw(st.booleans()):  # a way back almost along the way there
        points[2] = points[0] + rng.normal(size=6) * 1e-3
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    cut = draw(st.sampled_from([0.0, 0.05, 0.6]))
    return JointPath.through(points, [min(cut, *lengths[i : i + 2] / 2) for i in range(n - 2)])


limits = st.builds(
    MotionLimits,
    arm_acceleration=st.sampled_from([1.0, 5.0]),
    tool_speed=st.sampled_from([math.inf, 1.0, 0.25]),
)


@pytest.mark.requirement(45, 50)
@settings(deadline=None, max_examples=examples(150))
@given(path=paths(), limit=limits)
def test_limits_of_joints_and_tool_are_never_exceeded(arm, path, limit):
    trajectory = time_path(arm, path, limit)
    _, q, v, a = sampled(trajectory)
    assert (np.abs(v) <= arm.max_speed * (1 + 1e-9)).all()
    assert (np.abs(a) <= limit.arm_acceleration * (1 + 1e-6)).all()
    assert (tool_speed(arm, q, v) <= limit.tool_speed * (1 + 1e-4)).all()


@pytest.mark.requirement(45)
def test_in_a_zone_the_tool_is_slow_from_its_edge_on_however_long_the_line(arm):
    rng = np.random.default_rng(8)
    for _ in range(40):
        start, goal = rng.uniform(-2.5, 2.5, (2, 6))
        x, y, z = forward(arm, goal)[:3, 3]
        zone = SlowZone(x, y, z, 0.115, 0.25)
        limit = MotionLimits(arm_acceleration=5.0, tool_speed=1.0)
        trajectory = time_path(arm, JointPath.through([start, goal]), limit, zone)
        _, q, v, _ = sampled(trajectory)
        near = np.linalg.norm(forward(arm, q)[:, :3, 3] - (x, y, z), axis=1) < 0.114
        assert tool_speed(arm, q, v)[near].max() <= 0.25 * (1 + 1e-3)


@pytest.mark.requirement(45)
@settings(deadline=None, max_examples=examples(100))
@given(path=paths(), limit=limits)
def test_velocity_and_acceleration_are_the_derivatives_of_the_joints(arm, path, limit):
    trajectory = time_path(arm, path, limit)
    t = np.linspace(0, trajectory.duration, 200)[1:-1]
    h = 1e-5 * trajectory.duration
    t = t[np.abs(t[:, None] - trajectory.times).min(axis=1) > 2 * h]
    (before, v0, _), (_, v, a), (after, v1, _) = (trajectory.at(t + d) for d in (-h, 0, h))
    scale = np.abs(v).max(initial=1e-9)
    assert (after - before) / (2 * h) == pytest.approx(v, abs=1e-4 * scale)
    assert (v1 - v0) / (2 * h) == pytest.approx(a, abs=1e-3 * np.abs(a).max(initial=1e-9))


@pytest.mark.requirement(45)
@settings(deadline=None, max_examples=60)
@given(path=paths(), limit=limits)
def test_a_trajectory_starts_and_ends_at_rest_where_the_path_does(arm, path, limit):
    trajectory = time_path(arm, path, limit)
    q, v, a = trajectory.at(np.array([-1.0, 0.0, trajectory.duration, trajectory.duration + 9]))
    assert q[0] == pytest.approx(path.start)
    assert q[-1] == pytest.approx(path.goal)
    assert not v.any()
    assert not a.any()


def trapezoid(steps, speed, gain):
    """Duration of a straight joint line by the school formula, joint by joint."""
    slowest = 0.0
    for step, v, a in zip(np.abs(steps), speed, gain, strict=True):
        slowest = max(slowest, step / v + v / a if step > v * v / a else 2 * math.sqrt(step / a))
    return slowest


@pytest.mark.requirement(45)
@settings(deadline=None, max_examples=examples(100))
@given(seed=st.integers(0, 10_000), gain=st.sampled_from([1.0, 5.0]))
def test_a_line_takes_the_time_of_its_trapezoid(arm, seed, gain):
    a, b = np.random.default_rng(seed).uniform(-3, 3, (2, 6))
    limit = MotionLimits(arm_acceleration=gain)
    found = time_path(arm, JointPath.through([a, b]), limit).duration
    # one joint alone may do with less: all share the tightest rate and the tightest gain
    assert found >= trapezoid(b - a, arm.max_speed, [gain] * 6) - 1e-9
    assert found == pytest.approx(line_durations(arm, a, b[None], limit)[0], rel=1e-12)


@pytest.mark.requirement(45)
def test_a_turn_of_the_shoulder_is_as_fast_as_the_tool_limit_allows(arm):
    start = np.array([0.0, -0.3, 0.2, -1.0, 1.0, 0.0])
    goal = start + np.array([2.0, 0, 0, 0, 0, 0])
    radius = math.hypot(*forward(arm, start)[:2, 3])
    limit = MotionLimits(arm_acceleration=5.0, tool_speed=1.0)
    found = time_path(arm, JointPath.through([start, goal]), limit).duration
    assert found == pytest.approx(2.0 * radius + 1.0 / (5.0 * radius), rel=3e-3)


@pytest.mark.requirement(45)
def test_the_general_timing_agrees_with_the_trapezoid_where_the_tool_may_be_fast(arm, sets):
    for a, b in zip(sets.anywhere(50), sets.anywhere(50), strict=True):
        path = JointPath.through([a, b])
        exact = time_path(arm, path, MotionLimits(arm_acceleration=5.0)).duration
        general = time_path(arm, path, MotionLimits(arm_acceleration=5.0, tool_speed=1e6)).duration
        assert exact <= general + 1e-12
        assert general <= exact * 1.002


@pytest.mark.requirement(45)
def test_a_rounded_corner_is_faster_than_a_stop_and_a_sharp_one_stops(arm, sets):
    limit = MotionLimits(arm_acceleration=5.0)
    for _ in range(20):
        points = sets.anywhere(3)
        sharp = time_path(arm, JointPath.through(points), limit)
        smooth = time_path(arm, JointPath.through(points, [0.4]), limit)
        assert smooth.duration < sharp.duration
        at_corner = np.isclose(sharp.places, np.linalg.norm(points[1] - points[0]))
        assert sharp.rates[at_corner].tolist() == [0.0]


@pytest.mark.requirement(45)
@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 10_000),
    n=st.integers(2, 4),
    jerk=st.sampled_from([10.0, 50.0]),
    tool=st.sampled_from([math.inf, 1.0]),
)
def test_a_jerk_limit_is_kept_on_straight_lines(arm, seed, n, jerk, tool):
    points = np.random.default_rng(seed).uniform(-2, 2, (n, 6))
    limit = MotionLimits(arm_acceleration=5.0, tool_speed=tool, arm_jerk=jerk)
    trajectory = time_path(arm, JointPath.through(points), limit)
    t = np.linspace(0, trajectory.duration, 4001)
    q, v, a = trajectory.at(t)
    change = np.abs(np.diff(a, axis=0)) / (t[1] - t[0])
    assert change.max() <= jerk * 1.01
    assert (np.abs(v) <= arm.max_speed * (1 + 1e-9)).all()
    assert (np.abs(a) <= limit.arm_acceleration * (1 + 1e-9)).all()
    assert (tool_speed(arm, q, v) <= tool * (1 + 1e-4)).all()
    assert q[-1] == pytest.approx(points[-1], abs=1e-9)
    unlimited = time_path(
        arm, JointPath.through(points), MotionLimits(arm_acceleration=5.0, tool_speed=tool)
    )
    assert trajectory.duration > unlimited.duration


@pytest.mark.requirement(45)
@pytest.mark.parametrize("seed", [0, 1, 2, 3, 5, 6])
def test_a_jerk_limit_is_kept_inside_rounded_corners_too(arm, seed):
    """Where a line meets a corner the acceleration jumps; its rate of change elsewhere is bounded.

    To 3 %: the limit is checked at a thousand times, the test looks at twenty thousand.
    """
    points = np.random.default_rng(seed).uniform(-2, 2, (4, 6))
    path = JointPath.through(points, [0.6, 0.6])
    trajectory = time_path(arm, path, MotionLimits(arm_acceleration=5.0, arm_jerk=20.0))
    t = np.linspace(0, trajectory.duration, 20_001)
    pieces = np.searchsorted(path.knots, trajectory.along(t)[0])
    _, _, a = trajectory.at(t)
    change = np.abs(np.diff(a, axis=0)).max(axis=1) / (t[1] - t[0])
    assert change[pieces[1:] == pieces[:-1]].max() <= 20.0 * 1.03


def test_a_path_of_one_point_takes_no_time(arm):
    trajectory = time_path(
        arm, JointPath.through([np.zeros(6)]), MotionLimits(arm_acceleration=5.0)
    )
    q, v, _ = trajectory.at(np.array([0.0, 1.0]))
    assert trajectory.duration == 0.0
    assert not q.any()
    assert not v.any()
    for limit in (
        MotionLimits(arm_acceleration=5.0),
        MotionLimits(arm_acceleration=5.0, tool_speed=1.0),
    ):
        assert line_durations(arm, np.zeros(6), np.zeros((1, 6)), limit).tolist() == [0.0]


@pytest.mark.requirement(43)
def test_the_times_that_lines_are_compared_by_are_close_to_those_of_their_trajectories(arm, sets):
    limit = MotionLimits(arm_acceleration=5.0, tool_speed=1.0)
    start, goals = sets.anywhere(1)[0], sets.anywhere(40)
    compared = line_durations(arm, start, goals, limit)
    exact = [time_path(arm, JointPath.through([start, goal]), limit).duration for goal in goals]
    assert compared == pytest.approx(exact, rel=0.04)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"arm_acceleration": 0.0}, "arm_acceleration is"),
        ({"tool_speed": math.nan}, "tool_speed is nan"),
        ({"arm_jerk": -1.0}, "arm_jerk is"),
    ],
)
def test_limits_that_are_none_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        MotionLimits(**arguments)
