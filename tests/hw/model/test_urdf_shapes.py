"""Collision shapes of a URDF that cannot be kept clear of are refused, with what would be right."""

from __future__ import annotations

import pytest

from hw.model.urdf import parse_urdf, serial_chain

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
