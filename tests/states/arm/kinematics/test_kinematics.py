from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from hw.model import inverted
from hw.model.calibration import load_calibration
from hw.model.prop import Placement
from states.arm.kinematics.kinematics import (
    deviation,
    forward,
    jacobian,
    link_frames,
    rotation_vector,
)
from states.arm.kinematics.model import matrix

angle = st.floats(-2 * math.pi, 2 * math.pi)
joints = st.tuples(*[angle] * 6)


@pytest.mark.requirement(26)
def test_forward_kinematics_agrees_with_screw_theory(arm, screws, sets):
    q = sets.anywhere(5000)
    assert np.abs(forward(arm, q) - screws.tcp(q)).max() <= 1e-12


@pytest.mark.requirement(26)
def test_forward_kinematics_of_a_calibrated_arm_agrees_with_a_chain_of_rotations(arm, sets):
    measured = load_calibration()
    arm = arm.calibrated(measured)
    for q in sets.anywhere(50):
        turn, place = Rotation.from_euler("z", math.pi), np.array([0, 0, 0.511])
        for joint, value in zip(measured, q, strict=True):
            place = place + turn.apply(joint.xyz)
            turn = turn * Rotation.from_euler("xyz", joint.rpy) * Rotation.from_euler("z", value)
        place = place + turn.apply([0, 0, 0.15])
        turn = turn * Rotation.from_euler("y", math.pi / 2)
        pose = forward(arm, q)
        assert np.abs(pose[:3, 3] - place).max() <= 1e-12
        assert np.abs(pose[:3, :3] - turn.as_matrix()).max() <= 1e-12


def test_the_zero_pose_is_the_one_the_maker_draws(arm):
    frames = link_frames(arm, np.zeros(6))
    base_from_flange = inverted(frames[0]) @ frames[6]
    assert base_from_flange[:3, 3] == pytest.approx([-1.1843, -0.256141, 0.0116], abs=1e-12)


def test_a_presented_prop_has_its_x_axis_against_the_flange(arm):
    pose, flange = forward(arm, np.zeros(6)), link_frames(arm, np.zeros(6))[6]
    assert pose[:3, 0] == pytest.approx(-flange[:3, 2], abs=1e-12)
    assert pose[:3, 3] == pytest.approx(flange[:3, 3] + 0.15 * flange[:3, 2], abs=1e-12)


def test_one_pose_and_many_give_the_same_bits(arm, sets):
    q = sets.anywhere(20)
    many, slopes = forward(arm, q), jacobian(arm, q)
    for i in range(20):
        assert np.array_equal(forward(arm, q[i]), many[i])
        assert np.array_equal(jacobian(arm, q[i]), slopes[i])


@pytest.mark.requirement(26)
def test_the_jacobian_is_the_derivative_of_the_forward_kinematics(arm, sets):
    arm, h = arm.calibrated(load_calibration()), 1e-6
    for q in sets.anywhere(50):
        found = jacobian(arm, q)
        for k in range(6):
            step = np.zeros(6)
            step[k] = h
            before, after = forward(arm, q - step), forward(arm, q + step)
            slope = (after[:3, 3] - before[:3, 3]) / (2 * h)
            assert found[:3, k] == pytest.approx(slope, abs=1e-8)
            assert found[3:, k] == pytest.approx(rotation_vector(before, after) / (2 * h), abs=1e-8)


@settings(deadline=None, max_examples=200)
@given(q=joints)
def test_every_pose_is_rigid(arm, q):
    pose = forward(arm, np.array(q))
    assert np.abs(pose[:3, :3] @ pose[:3, :3].T - np.eye(3)).max() < 1e-14
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    assert np.abs(inverted(pose) @ pose - np.eye(4)).max() < 1e-14


@settings(deadline=None, max_examples=200)
@given(st.tuples(*[st.floats(-1, 1)] * 3), st.floats(-15, math.log10(math.pi)))
def test_deviation_measures_turns_of_every_size(axis, exponent):
    length = np.linalg.norm(axis)
    if length < 1e-3:
        return
    size = min(10.0**exponent, math.pi)
    turned = np.eye(4)
    turned[:3, :3] = Rotation.from_rotvec(np.array(axis) / length * size).as_matrix()
    _, measured = deviation(np.eye(4), turned)
    assert measured == pytest.approx(size, rel=1e-9, abs=2e-16 if size < 3.1 else 1e-7)


def test_deviation_of_half_a_turn_is_pi():
    half = matrix(Placement((3.0, 0.0, 4.0), (math.pi, 0.0, 0.0)))
    distance, turn = deviation(np.eye(4), half)
    assert (distance, turn) == (5.0, pytest.approx(math.pi))


@pytest.mark.parametrize("shape", [(5,), (2, 7), (1, 2, 6)])
def test_joints_of_another_shape_are_refused(arm, shape):
    with pytest.raises(ValueError, match=r"\(6,\) or \(n, 6\) is needed"):
        forward(arm, np.zeros(shape))


def test_a_chain_cannot_be_changed(arm):
    with pytest.raises(ValueError, match="read-only"):
        arm.origins[0, 0, 0] = 2.0
