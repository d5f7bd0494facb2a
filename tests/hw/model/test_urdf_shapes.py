"""Collision shapes of a URDF that cannot be kept clear of are refused, with what would be right."""

from __future__ import annotations

import time

import numpy as np
import pytest

from engine.files import FileError
from hw.model.urdf import parse_urdf, serial_chain
from hw.model.urdf.capsules import MANY, around_mesh

AXES = ("0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0", "0 0 1")
BALL = '<sphere radius="0.1"/>'
POINTS = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def arm_with(shape, folder):
    """The arm of six joints, the second link of which has this shape."""
    links = "".join(
        f'<link name="l{n}"><collision><geometry>'
        f"{shape if n == 2 else BALL}</geometry></collision></link>"
        for n in range(7)
    )
    joints = "".join(
        f'<joint name="j{n}" type="revolute"><parent link="l{n - 1}"/><child link="l{n}"/>'
        f'<origin xyz="0 0 0.2"/><axis xyz="{axis}"/>'
        '<limit lower="-2" upper="2" velocity="1" effort="10"/></joint>'
        for n, axis in enumerate(AXES, 1)
    )
    urdf = parse_urdf(f'<robot name="r">{links}{joints}</robot>')
    return serial_chain(urdf, "l0", "l6", folder)


@pytest.mark.parametrize(
    ("shape", "told"),
    [
        ('<capsule radius="0.1" length="1"/>', "link 'l2' has a <capsule> as <collision>; boxes"),
        ("", "link 'l2' has a <geometry> as <collision>"),
        ('<mesh filename="m.obj" scale="1e200 1e200 1"/>', r"reaches out to 1e\+200 m"),
        ('<mesh filename="m.obj" scale="1000 1000 1"/>', 'give it scale="0.001 0.001 0.001"'),
        ('<mesh filename="large.obj"/>', "large.obj, which holds no triangles"),
    ],
)
def test_a_shape_that_is_no_link_is_refused(tmp_path, shape, told):
    (tmp_path / "m.obj").write_text(f"{POINTS}f 1 2 3\n")
    (tmp_path / "large.obj").write_text(f"{POINTS}f {10**30} 2 3\n")
    with pytest.raises(ValueError, match=told):
        arm_with(shape, tmp_path)


def test_a_mesh_in_millimetres_is_taken_with_its_scale(tmp_path):
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n")
    scale = 'scale="0.001 0.001 0.001"'
    found = arm_with(f'<mesh filename="m.obj" {scale}/>', tmp_path)
    assert 0.03 < max(c.radius for c in found.capsules if c.part == "l2") < 0.1


@pytest.mark.parametrize(
    ("shape", "told"),
    [
        ('<sphere radius="1e6"/>', r"<sphere> has 1e\+06 in radius; lengths are in metres, 50 at"),
        ('<box size="1 1 1e300"/>', r"<box> has 1e\+300 in size; lengths are in metres"),
    ],
)
def test_a_shape_larger_than_any_robot_is_refused(tmp_path, shape, told):
    with pytest.raises(FileError, match=told):
        arm_with(shape, tmp_path)


@pytest.mark.parametrize(
    ("origin", "limit", "told"),
    [
        ('xyz="1e300 0 0"', "", r"<origin> has 1e\+300 in xyz; lengths are in metres"),
        ('rpy="0 0 1e9"', "", r"<origin> has 1e\+09 in rpy; angles are in rad"),
        ("", '<limit lower="-1" upper="1e9"/>', "of 'j' has upper=\"1e9\"; it is in rad"),
    ],
)
def test_a_joint_beyond_all_sense_is_refused(origin, limit, told):
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute">'
        f'<parent link="a"/><child link="b"/><origin {origin}/>{limit}</joint></robot>'
    )
    with pytest.raises(FileError, match=told):
        parse_urdf(text)


def held(points, capsules):
    away = []
    for capsule in capsules:
        start, along = capsule.ends[0], capsule.ends[1] - capsule.ends[0]
        share = np.clip((points - start) @ along / max(along @ along, 1e-18), 0.0, 1.0)
        foot = start + share[:, None] * along
        away.append(np.linalg.norm(points - foot, axis=1) - capsule.radius)
    return np.min(away, axis=0) <= 0.0


@pytest.mark.parametrize("count", [MANY // 3 + 1, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_many_triangles_lie_within_few_capsules_and_soon(count):
    rng = np.random.default_rng(4)
    middle = rng.normal(size=(count, 1, 3)) * (0.2, 0.05, 0.03)
    triangles = middle + rng.uniform(-0.005, 0.005, (count, 3, 3))
    before = time.process_time()
    capsules = around_mesh(triangles)
    assert time.process_time() - before < 30.0
    assert held(triangles.reshape(-1, 3), capsules).all()


@pytest.mark.slow
def test_a_flat_mesh_of_many_triangles_is_enclosed():
    triangles = np.random.default_rng(5).uniform(-0.2, 0.2, (MANY // 3 + 1, 3, 3)) * (1.0, 1.0, 0.0)
    assert held(triangles.reshape(-1, 3), around_mesh(triangles)).all()


def test_a_long_row_of_joints_is_read_soon():
    count = 1000
    links = "".join(f'<link name="l{n}"/>' for n in range(count + 1))
    joints = "".join(
        f'<joint name="j{n}" type="revolute"><parent link="l{n}"/><child link="l{n + 1}"/>'
        + (f'<mimic joint="j{n - 1}"/>' if n else "")
        + "</joint>"
        for n in range(count)
    )
    before = time.process_time()
    assert len(parse_urdf(f'<robot name="r">{links}{joints}</robot>').joints) == count
    assert time.process_time() - before < 3.0
