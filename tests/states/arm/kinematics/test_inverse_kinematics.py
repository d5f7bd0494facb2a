from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from hw.model import inverted
from hw.model.calibration import load_calibration
from states.arm.kinematics.inverse_kinematics import (
    forward_all,
    inverse,
    inverse_near,
    nearest_copies,
)
from states.arm.kinematics.kinematics import deviation, forward
from tests.repeats import fewer


def turned(q):
    """The same directions in (-pi, pi]."""
    return q - 2 * np.pi * np.round(q / (2 * np.pi))


def errors(screws, solutions, targets):
    """Position and rotation errors of every branch, by the screw arm."""
    n = len(targets)
    reached = screws.tcp(solutions.joints.reshape(-1, 6)).reshape(n, 8, 4, 4)
    distance, angle = deviation(reached, targets[:, None])
    return distance[solutions.valid], angle[solutions.valid]


@pytest.mark.requirement(43)
@pytest.mark.parametrize(
    ("kind", "count"), [("anywhere", 10000), ("wrist", 2000), ("elbow", 2000), ("shoulder", 2000)]
)
def test_every_reachable_pose_is_solved_exactly_also_at_singularities(
    arm, screws, sets, kind, count
):
    targets = screws.tcp(getattr(sets, kind)(count))
    found = inverse(arm, targets)
    distance, angle = errors(screws, found, targets)
    assert found.valid.any(axis=1).all()
    assert distance.max() <= 1e-9
    assert angle.max() <= 1e-9
    assert np.median(distance) <= 1e-12
    assert np.median(angle) <= 1e-12


@pytest.mark.requirement(43)
def test_poses_with_several_singularities_at_once_are_solved(arm, screws, sets):
    straight_up = np.array([[0, -np.pi / 2, 0, -np.pi / 2, 0, 0]])
    both = sets.shoulder(500)
    both[:, 4] = sets.rng.choice([0, np.pi], 500) + sets.offsets(500)
    stretched = sets.wrist(500)
    stretched[:, 2] = sets.offsets(500)
    right_angles = sets.rng.choice([0, np.pi / 2, -np.pi / 2, np.pi, -np.pi], (3000, 6))
    for q in (straight_up, both, stretched, right_angles):
        targets = screws.tcp(q)
        found = inverse(arm, targets)
        distance, angle = errors(screws, found, targets)
        assert found.valid.any(axis=1).all()
        assert max(distance.max(), angle.max()) <= 1e-9


@pytest.mark.requirement(43)
@pytest.mark.parametrize("kind", ["anywhere", "elbow", "shoulder"])
def test_the_joints_a_pose_came_from_are_among_the_branches(arm, sets, kind):
    q = getattr(sets, kind)(2000)
    found = inverse(arm, forward(arm, q))
    gap = np.abs(turned(found.joints - q[:, None])).max(axis=2)
    # at a singularity two branches meet, and an error of 1e-16 moves them apart by its root
    assert ((gap < 1e-5) & found.valid).any(axis=1).all()


@pytest.mark.requirement(43)
@pytest.mark.slow
def test_no_branch_is_missed_that_a_numeric_search_finds(arm, screws, sets):
    targets = screws.tcp(sets.anywhere(12))
    found = inverse(arm, targets)
    for i, target in enumerate(targets):
        searched = newton_search(screws, target, sets.rng)
        closed = found.branches(i)
        for q in searched:
            assert np.abs(turned(closed - q)).max(axis=1).min() < 1e-6
        assert len(searched) == len(closed)


def newton_search(screws, target, rng, starts=300):
    """Distinct joints that reach a pose, from many random starts with numeric derivatives."""

    def miss(q):
        reached = screws.tcp(q)
        return np.concatenate([(reached - target)[:, :3, :4].reshape(len(q), 12)], axis=1)

    q, h = rng.uniform(-np.pi, np.pi, (starts, 6)), 1e-6
    for _ in range(60):
        slope = np.stack(
            [(miss(q + h * e) - miss(q - h * e)) / (2 * h) for e in np.eye(6)], axis=-1
        )
        transposed = np.swapaxes(slope, 1, 2)
        damped = transposed @ slope + 1e-9 * np.eye(6)
        step = np.linalg.solve(damped, -transposed @ miss(q)[..., None])[..., 0]
        q = q + step / np.maximum(1.0, np.linalg.norm(step, axis=1))[:, None]
    q = turned(q[np.abs(miss(q)).max(axis=1) < 1e-8])
    distinct: list[np.ndarray] = []
    for row in q:
        if all(np.abs(turned(row - other)).max() > 1e-4 for other in distinct):
            distinct.append(row)
    return distinct


@pytest.mark.requirement(43)
def test_another_closed_form_finds_the_same_branches(arm, sets):
    other = pytest.importorskip("ur_analytic_ik", reason="needs the extra 'arm-peers'").ur10
    targets = forward(arm, sets.anywhere(2000))
    found = inverse(arm, targets)
    flanges = inverted(arm.base) @ targets @ inverted(arm.tip)
    for i, flange in enumerate(flanges):
        theirs = np.array(other.inverse_kinematics(flange)).reshape(-1, 6)
        ours = found.branches(i)
        assert len(theirs) == len(ours)
        for joints in theirs:
            assert np.abs(turned(ours - joints)).max(axis=1).min() < 1e-5


@pytest.mark.requirement(43)
def test_targets_rounded_to_single_precision_are_solved(arm, screws, sets):
    targets = screws.tcp(sets.anywhere(10000))
    found = inverse(arm, targets.astype(np.float32))
    assert found.valid.any(axis=1).mean() >= 0.999
    reached = forward_all(arm, found.joints)
    distance, angle = deviation(reached, targets[:, None])
    assert max(distance[found.valid].max(), angle[found.valid].max()) < 1e-6


@pytest.mark.requirement(43)
@pytest.mark.parametrize(
    "kind", ["wrist", "elbow", "shoulder", "stretched", "folded", "straight", "over"]
)
def test_singular_poses_rounded_to_single_precision_are_solved_within_the_rounding(
    arm, screws, sets, kind
):
    """Stretched or folded elbow, shoulder and wrist singular at once, exactly and nearly."""
    if kind in ("wrist", "elbow", "shoulder"):
        q = getattr(sets, kind)(500)
    else:
        q = sets.shoulder(500) if kind == "over" else sets.wrist(500)
        q[:, 4] = q[:, 4] if kind != "straight" else sets.rng.choice([0, np.pi], 500)
        q[:, 2] = sets.offsets(500) + (np.pi if kind == "folded" else 0.0)
    q[0] = -0.681256, 0.032898, 0.000132, -1.526827, 0.0, -1.364927
    targets = screws.tcp(q).astype(np.float32).astype(float)
    found, near = inverse(arm, targets), inverse_near(arm, targets)
    distance, angle = errors(screws, found, targets)
    assert found.valid.any(axis=1).all()
    assert max(distance.max(), angle.max()) <= 1e-6
    nearest = np.maximum(near.position_error, near.rotation_error).min(axis=1)
    assert nearest.max() <= 1e-6


@pytest.mark.requirement(43)
@pytest.mark.parametrize("off", [-1e-4, -1e-7, -1e-9, 0.0, 1e-9, 1e-7, 1e-4])
def test_on_both_sides_of_the_shoulders_axis_there_are_numbers(arm, screws, off):
    """A wrist nearer to the axis than d4 is met as nearly as it can be."""
    rng = np.random.default_rng(4)
    flange = inverted(arm.base) @ screws.tcp(rng.uniform(-3, 3, (200, 6))) @ inverted(arm.tip)
    wrist = flange[:, :3, 3] - arm.dh[5] * flange[:, :3, 2]
    side = wrist[:, :2] / np.linalg.norm(wrist[:, :2], axis=1)[:, None]
    flange[:, :2, 3] += (arm.dh[3] + off) * side - wrist[:, :2]
    near = inverse_near(arm, arm.base @ flange @ arm.tip)
    assert np.isfinite(near.joints).all()
    short = near.position_error.min(axis=1)
    assert short.min() == pytest.approx(max(-off, 0.0), abs=1e-9)
    assert np.sort(short)[50] <= max(-off, 0.0) + 1e-9


@pytest.mark.requirement(43, 44)
def test_a_pose_out_of_reach_is_met_up_to_the_gap_and_the_gap_is_told(arm, screws, sets):
    targets, gap = beyond_reach(screws, sets, 2000)
    near = inverse_near(arm, targets)
    best = near.position_error.argmin(axis=1)
    row = np.arange(len(best))
    assert (near.position_error[row, best] <= gap + 1e-12).all()
    reached = screws.tcp(near.joints[row, best])
    distance, angle = deviation(reached, targets)
    assert distance == pytest.approx(near.position_error[row, best], abs=1e-12)
    assert max(angle.max(), near.rotation_error[row, best].max()) <= 1e-12


def beyond_reach(screws, sets, n):
    """Stretched arms moved on by 1 to 50 mm along themselves, and by how much."""
    q = sets.anywhere(n)
    q[:, 2] = 0.0
    c1, s1, c2, s2 = np.cos(q[:, 0]), np.sin(q[:, 0]), np.cos(q[:, 1]), np.sin(q[:, 1])
    gap = sets.rng.uniform(1e-3, 5e-2, n)
    targets = screws.tcp(q)
    # the rover sees the arm's own frame turned by half a turn
    targets[:, :3, 3] += gap[:, None] * np.stack([c1 * c2, s1 * c2, -s2], axis=1)
    return targets, gap


@pytest.mark.requirement(43)
def test_poses_far_away_have_no_solution(arm, sets):
    targets = forward(arm, sets.anywhere(100))
    targets[:, 0, 3] += 4.0
    assert not inverse(arm, targets).valid.any()
    assert inverse_near(arm, targets).position_error.min() > 1.0


@pytest.mark.requirement(44)
@pytest.mark.parametrize(("gap", "accepted"), [(0.0199, True), (0.0201, False)])
def test_what_is_near_enough_is_the_callers_choice(arm, screws, gap, accepted):
    stretched_ahead = np.array([[0.3, -0.4, 0.0, -np.pi / 2, np.pi / 2, 0.0]])
    target = screws.tcp(stretched_ahead)
    target[0, :3, 3] += gap * np.array([np.cos(0.3), np.sin(0.3), np.tan(0.4)]) * np.cos(0.4)
    near = inverse_near(arm, target)
    assert not inverse(arm, target).valid.any()
    assert near.within(0.02, 0.1).valid.any() == accepted


@pytest.mark.requirement(43)
@pytest.mark.parametrize("count", [100, pytest.param(300, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", ["anywhere", "wrist", "elbow", "shoulder"])
def test_a_calibrated_arm_is_solved_as_exactly(arm, sets, kind, count):
    arm = arm.calibrated(load_calibration())
    targets = forward(arm, getattr(sets, kind)(count))
    found = inverse(arm, targets)
    distance, angle = deviation(forward_all(arm, found.joints), targets[:, None])
    assert found.valid.any(axis=1).all()
    assert distance[found.valid].max() <= 1e-9
    assert angle[found.valid].max() <= 1e-9


def test_the_nominal_solution_misses_by_millimetres_on_the_calibrated_arm(arm, sets):
    real = arm.calibrated(load_calibration())
    targets = forward(arm, sets.anywhere(1000))
    found = inverse(arm, targets)
    distance, _ = deviation(forward_all(real, found.joints), targets[:, None])
    assert 2e-3 < np.median(distance[found.valid]) < 6e-3


def test_nearest_copies_stay_within_the_limits_and_within_half_a_turn(arm, sets):
    found = inverse(arm, forward(arm, sets.anywhere(300)))
    near = sets.rng.uniform(arm.lower, arm.upper)
    copies = nearest_copies(arm, found.joints, near)[found.valid]
    assert (copies >= arm.lower).all()
    assert (copies <= arm.upper).all()
    assert turned(copies - found.joints[found.valid]) == pytest.approx(0.0, abs=1e-12)
    half = np.pi + 1e-12
    free = (near > arm.lower + half) & (near < arm.upper - half)
    assert np.abs(copies - near)[:, free].max() <= half


def test_a_joint_at_its_limit_keeps_its_limit(arm):
    at_limits = np.array([2, -2, 1, 2, -2, 2]) * np.pi
    assert np.array_equal(nearest_copies(arm, turned(at_limits), at_limits), at_limits)


def test_branches_outside_the_joint_limits_are_left_out(arm, sets):
    joints = {name: replace(j, lower=-1.0, upper=1.0) for name, j in arm.shape.joints.items()}
    narrow = replace(arm, shape=replace(arm.shape, joints=joints))
    targets = forward(arm, sets.anywhere(500))
    every, kept = inverse(arm, targets), inverse(narrow, targets)
    inside = (np.abs(every.joints) <= 1.0).all(axis=2) & every.valid
    assert np.array_equal(kept.valid, inside)
    assert np.isinf(inverse_near(narrow, targets).position_error).any()


@settings(deadline=None, max_examples=300)
@given(
    st.lists(st.floats(-math.pi, math.pi), min_size=6, max_size=6),
    st.sampled_from([0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6]),
    st.integers(0, 2),
)
def test_targets_of_any_size_give_numbers_and_no_warning(arm, q, scale, axis):
    target = forward(arm, np.array(q))
    target[axis, 3] += scale
    near = inverse_near(arm, target)
    assert np.isfinite(near.joints).all()
    solved = inverse(arm, target)
    distance, _ = deviation(forward_all(arm, solved.joints), target[None, None])
    exact = distance[solved.valid] <= 1e-9
    assert exact.all() or (not exact.any() and (distance[solved.valid] <= 1e-6).all())


@pytest.mark.requirement(43)
@pytest.mark.parametrize("scale", [1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6])
def test_poses_of_any_scale_give_numbers_whether_reached_or_not(arm, sets, scale):
    targets = forward(arm, sets.anywhere(5000))
    targets[:, :3, 3] *= scale
    near, found = inverse_near(arm, targets), inverse(arm, targets)
    assert np.isfinite(near.joints).all()
    assert np.isfinite(near.position_error[:, 0]).all()
    reached = forward_all(arm, found.joints)
    distance, angle = deviation(reached, targets[:, None])
    assert distance[found.valid].max(initial=0.0) <= 1e-9
    assert angle[found.valid].max(initial=0.0) <= 1e-9
    assert found.valid.any() == (scale <= 1.0)


@pytest.mark.requirement(43)
def test_joints_at_whole_and_half_turns_are_found_again(arm, screws, sets):
    q = sets.rng.choice([-2, -1, 0, 1, 2], (3000, 6)) * np.pi
    q[:, 2] = np.clip(q[:, 2], -np.pi, np.pi)
    targets = screws.tcp(q)
    found = inverse(arm, targets)
    distance, angle = errors(screws, found, targets)
    assert found.valid.any(axis=1).all()
    assert max(distance.max(), angle.max()) <= 1e-9
    for joints, near in zip(found.joints, q, strict=True):
        copies = nearest_copies(arm, joints, near)
        assert (copies >= arm.lower).all()
        assert (copies <= arm.upper).all()


@pytest.mark.slow
@pytest.mark.requirement(43)
def test_a_million_random_poses(arm, screws, sets):
    for _ in fewer(range(20)):
        targets = screws.tcp(sets.anywhere(50_000))
        found = inverse(arm, targets)
        distance, angle = errors(screws, found, targets)
        assert found.valid.any(axis=1).all()
        assert max(distance.max(), angle.max()) <= 1e-9


def test_targets_of_another_shape_are_refused(arm):
    with pytest.raises(ValueError, match=r"\(4, 4\) or \(n, 4, 4\) is needed"):
        inverse(arm, np.eye(3))


@pytest.fixture(scope="module")
def measured(arm):
    return arm.calibrated(load_calibration())


@pytest.mark.requirement(26, 43)
@pytest.mark.parametrize("count", [400, pytest.param(5000, marks=pytest.mark.slow)])
def test_a_calibrated_chain_has_the_joints_that_a_pose_was_made_of_and_none_twice(
    measured, sets, count
):
    q = sets.anywhere(count)
    q = q[np.abs(np.sin(q[:, 4])) > 0.01]
    found = inverse(measured, forward(measured, q))
    away = np.abs(turned(found.joints - q[:, None])).max(axis=2)
    assert np.where(found.valid, away, 9.0).min(axis=1).max() < 1e-6
    assert set(found.valid.sum(axis=1).tolist()) <= {2, 4, 6, 8}  # branches meet in pairs
    for joints, valid in zip(found.joints, found.valid, strict=True):
        own = joints[valid]
        apart = np.abs(turned(own[:, None] - own[None])).max(axis=2)
        assert apart[~np.eye(len(own), dtype=bool)].min(initial=9.0) > 1e-6


@pytest.mark.requirement(26, 43)
def test_a_calibrated_chain_has_all_branches_that_random_starts_find(measured, sets):
    """Joints found from 40 random starts each by scipy, on the measured frames."""
    frames = load_calibration()

    mounts = [
        (np.array(joint.xyz), Rotation.from_euler("xyz", joint.rpy).as_matrix()) for joint in frames
    ]
    tip = Rotation.from_euler("xyz", [0.0, np.pi / 2, 0.0]).as_matrix()

    def prop(q):
        turn, place = np.diag([-1.0, -1.0, 1.0]), np.array([0.0, 0.0, 0.511])
        for (xyz, rpy), cos, sin in zip(mounts, np.cos(q), np.sin(q), strict=True):
            place = place + turn @ xyz
            turn = turn @ rpy @ np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        return place + turn[:, 2] * 0.15, turn @ tip

    rng = np.random.default_rng(12)
    for made in sets.anywhere(3):
        point, orientation = prop(made)
        target = np.eye(4)
        target[:3, :3], target[:3, 3] = orientation, point

        def miss(q, point=point, orientation=orientation):
            place, turn = prop(q)
            turned_by = Rotation.from_matrix(orientation.T @ turn)
            return np.concatenate([place - point, turned_by.as_rotvec()])

        ends = [least_squares(miss, rng.uniform(-np.pi, np.pi, 6)) for _ in range(40)]
        exact = [turned(end.x) for end in ends if np.abs(end.fun).max() < 1e-8]
        own = inverse(measured, target).branches()
        assert len(exact) > 5
        for q in exact:
            assert np.abs(turned(own - q)).max(axis=1).min() < 1e-5


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (np.diag([1.05, 1.0, 1.0, 1.0]), r"targets\[1\].*is 0\.103"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "mirror"),
        (np.full((4, 4), np.nan), "is nan"),
        (np.array([[1, 0, 0, np.inf], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]), "infinite"),
    ],
)
@pytest.mark.parametrize("solve", [inverse, inverse_near])
def test_what_is_no_rigid_pose_is_refused(arm, measured, solve, wrong, message):
    for each in (arm, measured):
        with pytest.raises(ValueError, match=message):
            solve(each, np.stack([np.eye(4), wrong]))
        solve(each, np.eye(4, dtype=np.float32))
