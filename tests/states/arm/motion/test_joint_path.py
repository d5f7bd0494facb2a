from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from states.arm.kinematics.collision import CollisionChecker, Surroundings
from states.arm.motion.joint_path import JointPath, first_contact, rounded

seeds = st.integers(0, 10_000)


@pytest.fixture(scope="module")
def alone(arm):
    return CollisionChecker.of(arm, Surroundings.empty())


def corners(seed, n=4):
    return np.random.default_rng(seed).uniform(-2, 2, (n, 6))


@settings(deadline=None, max_examples=100)
@given(seeds, st.lists(st.floats(0.0, 0.4), min_size=2, max_size=2))
def test_a_path_leads_from_the_first_point_to_the_last_at_unit_speed(seed, rounding):
    points = corners(seed)
    path = JointPath.through(points, rounding)
    s = np.linspace(0, path.length, 3001)
    q, slope, _ = path.at(s)
    assert q[0] == pytest.approx(points[0])
    assert path.goal == pytest.approx(points[-1])
    assert (np.linalg.norm(slope, axis=1) <= 1.0 + 1e-9).all()
    ends = np.linalg.norm(slope[[0, -1]], axis=1)
    assert ends == pytest.approx(1.0)


@settings(deadline=None, max_examples=100)
@given(seeds, st.lists(st.floats(0.01, 0.4), min_size=2, max_size=2))
def test_slope_and_bend_are_the_derivatives_and_rounded_corners_have_no_jump(seed, rounding):
    path = JointPath.through(corners(seed), rounding)
    h = 1e-6
    s = np.random.default_rng(seed).uniform(h, path.length - h, 300)
    before, after = path.at(s - h), path.at(s + h)
    slope = (after[0] - before[0]) / (2 * h)
    assert path.at(s)[1] == pytest.approx(slope, abs=1e-4)
    assert np.abs(after[1] - before[1]).max() < 1e-3
    inner = np.abs(path.knots[:, None] - s).min(axis=0) > 1e-5
    bend = (after[1] - before[1]) / (2 * h)
    assert path.at(s)[2][inner] == pytest.approx(bend[inner], abs=1e-6)
    assert not path.sharp().any()


@settings(deadline=None, max_examples=100)
@given(seeds, st.floats(0.01, 0.4))
def test_a_rounded_corner_stays_within_half_its_cut_of_the_corner(seed, cut):
    points = corners(seed, 3)
    path = JointPath.through(points, [cut])
    q, _, _ = path.at(np.linspace(0, path.length, 3001))
    miss = np.linalg.norm(q - points[1], axis=1).min()
    assert miss <= 0.5 * cut + 1e-3


def test_a_corner_without_rounding_is_sharp_and_known_to_be():
    path = JointPath.through(corners(1), [0.0, 0.3])
    assert path.sharp().tolist() == [True, False, False]


def test_points_that_do_not_differ_make_no_piece():
    point = np.arange(6.0)
    still = JointPath.through([point, point])
    assert still.length == 0.0
    assert still.goal.tolist() == point.tolist()
    assert still.at(np.array([0.0, 1.0]))[1].any() == np.False_
    assert len(JointPath.through([point, point, point + 1.0, point + 1.0]).pieces) == 1


@pytest.mark.requirement(43)
def test_the_first_contact_of_a_path_is_found_also_from_the_middle(alone, arm):
    parked = np.array(arm.tool.parked)
    folded_in = parked.copy()
    folded_in[2] = -3.1
    away = parked + np.array([0.5, 0, 0, 0, 0, 0])
    path = JointPath.through([away, parked, folded_in])
    contact = first_contact(alone, path)
    assert contact is not None
    assert contact > 0.5
    assert first_contact(alone, path, since=0.7 * contact) == pytest.approx(contact, abs=0.02)
    q = path.at(np.array([contact]))[0]
    assert alone.clearance(q)[0] < alone.margin
    assert first_contact(alone, JointPath.through([away, parked])) is None
    assert first_contact(alone, path, since=path.length) is None


@pytest.mark.requirement(43, 45)
def test_rounded_corners_are_free_of_contact_or_left_sharp(alone, sets):
    free = sets.anywhere(900)
    free = free[alone.free(free)]
    rounded_some = 0
    for a, b, c in zip(free, free[1:], free[2:], strict=False):
        if not (alone.line_free(a, b) and alone.line_free(b, c)):
            continue
        path, checks = rounded(alone, np.array([a, b, c]))
        assert first_contact(alone, path) is None
        assert checks > 0
        rounded_some += not path.sharp().any()
    assert rounded_some > 20
