"""Rigid motions as tuples, against scipy's rotations and matrices of numpy."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation, Slerp

from hw.geometry import Pose3
from hw.se3 import IDENTITY, act, between, inverse, product, quaternion_of

LENGTHS = st.floats(-5.0, 5.0)
PARTS = st.tuples(*4 * [st.floats(-1.0, 1.0)]).filter(lambda q: np.linalg.norm(q) > 0.1)


def unit(parts):
    return tuple((np.array(parts) / np.linalg.norm(parts)).tolist())


MOTIONS = st.builds(lambda x, y, z, q: (x, y, z, *unit(q)), LENGTHS, LENGTHS, LENGTHS, PARTS)


def matrix(motion):
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = Rotation.from_quat(motion[3:]).as_matrix(), motion[:3]
    return whole


@given(MOTIONS, MOTIONS)
def test_products_and_inverses_are_those_of_matrices(a, b):
    np.testing.assert_allclose(matrix(product(a, b)), matrix(a) @ matrix(b), atol=1e-12)
    np.testing.assert_allclose(matrix(inverse(a)), np.linalg.inv(matrix(a)), atol=1e-12)
    np.testing.assert_allclose(act(a, *b[:3]), (matrix(a) @ [*b[:3], 1.0])[:3], atol=1e-12)
    assert product(IDENTITY, a) == pytest.approx(a, abs=1e-12)
    assert (Pose3(*a) @ Pose3(*b)).as_motion() == product(a, b)


@given(MOTIONS, MOTIONS, st.floats(0.0, 1.0))
def test_between_two_motions_it_turns_evenly_the_shorter_way(a, b, share):
    found = between(a, b, share)
    slerp = Slerp([0.0, 1.0], Rotation.from_quat([a[3:], b[3:]]))([share])[0]

    assert found[:3] == pytest.approx(
        tuple((1 - share) * np.array(a[:3]) + share * np.array(b[:3]))
    )
    if abs(np.dot(a[3:], b[3:])) > 1e-6:  # of half a turn both ways are as short
        assert (slerp.inv() * Rotation.from_quat(found[3:])).magnitude() < 1e-5


@given(PARTS)
def test_the_quaternion_of_a_matrix_is_exact_for_any_turn(parts):
    turn = Rotation.from_quat(parts)

    found = quaternion_of(turn.as_matrix().tolist())

    assert abs(np.dot(found, unit(parts))) == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)])
def test_half_turns_lose_no_digits(axis):
    rows = np.eye(4)
    rows[:3, :3] = Rotation.from_rotvec(np.pi * np.array(axis)).as_matrix()
    rows[:3, 3] = 1.0, 2.0, 3.0

    pose = Pose3.from_matrix(rows.tolist())

    np.testing.assert_allclose(matrix(pose.as_motion()), rows, atol=1e-15)
