from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from engine.files.finding import FileError
from hw.model.calibration import load_calibration
from hw.model.prop import Placement, load_prop
from hw.model.robot import FOLDER as ROBOTS, load_robot
from hw.model.urdf import parse_urdf, placement, read_urdf
from states.arm.description.robot_arm import manipulator_of
from states.arm.description.urdf_arm import manipulator_from_urdf
from states.arm.kinematics.inverse_kinematics import inverse
from states.arm.kinematics.kinematics import forward
from states.arm.kinematics.model import matrix
from tests.states.arm.urdf_writing import urdf_of

# a lift with a gripper whose second finger follows the first
LIFT = """<?xml version="1.0"?>
<robot name="lift">
  <!-- a comment -->
  <link name="floor"/>
  <link name="mast">
    <inertial><mass value="12.5"/></inertial>
    <visual>
      <origin xyz="0 0 1"/><geometry><mesh filename="package://lift/mast.dae"/></geometry>
    </visual>
    <collision><geometry><mesh filename="m.stl" scale="0.001 0.001 0.001"/></geometry></collision>
    <collision><geometry><box size="1 1 1"/></geometry></collision>
  </link>
  <link name="hand"/><link name="left"/><link name="right"/>
  <joint name="stand" type="fixed">
    <parent link="floor"/><child link="mast"/><origin xyz="1 2 0" rpy="0.1 -0.2 0.3"/>
  </joint>
  <joint name="right_finger" type="prismatic">
    <parent link="hand"/><child link="right"/><axis xyz="0 2 0"/><limit lower="0" upper="0.04"/>
    <mimic joint="left_finger" multiplier="-1" offset="0.01"/>
  </joint>
  <joint name="turn" type="continuous">
    <parent link="mast"/><child link="hand"/><origin xyz="0 0.5 1"/><axis xyz="0 0.6 0.8"/>
  </joint>
  <joint name="left_finger" type="prismatic">
    <parent link="hand"/><child link="left"/><origin rpy="0 0 1.5"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.04" velocity="0.2"/>
  </joint>
</robot>
"""


@pytest.mark.requirement(17)
def test_links_joints_and_named_meshes_are_read():
    lift = parse_urdf(LIFT)
    assert (lift.name, lift.root) == ("lift", "floor")
    mast = lift.links["mast"]
    assert mast.mass == 12.5
    assert mast.visuals[0].file == "package://lift/mast.dae"
    assert mast.visuals[0].origin.xyz == (0, 0, 1)
    assert [mesh.scale for mesh in mast.collisions] == [(0.001, 0.001, 0.001)]
    joints = {joint.name: joint for joint in lift.joints}
    assert joints["left_finger"].speed == 0.2
    assert math.isinf(joints["turn"].upper)
    assert [j.name for j in lift.joints if j.moves] == ["turn", "left_finger"]
    assert [j.name for j in lift.chain("floor", "left")] == ["stand", "turn", "left_finger"]


@pytest.mark.requirement(17, 26)
def test_every_link_is_where_fixed_turning_sliding_and_mimic_joints_put_it():
    poses = parse_urdf(LIFT).poses({"turn": 0.7, "left_finger": 0.03})
    mast = Rotation.from_euler("xyz", [0.1, -0.2, 0.3])
    hand = mast * Rotation.from_rotvec(0.7 * np.array([0, 0.6, 0.8]))
    at_hand = np.array([1, 2, 0]) + mast.apply([0, 0.5, 1])
    left = hand * Rotation.from_euler("z", 1.5)
    assert np.abs(poses["mast"][:3, :3] - mast.as_matrix()).max() <= 1e-12
    assert np.abs(poses["hand"][:3, :3] - hand.as_matrix()).max() <= 1e-12
    assert np.abs(poses["left"][:3, 3] - at_hand - left.apply([0, 0.03, 0])).max() <= 1e-12
    assert np.abs(poses["right"][:3, 3] - at_hand - hand.apply([0, -0.02, 0])).max() <= 1e-12


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            '<parent link="mast"/>',
            '<parent link="mst"/>',
            r":\d+: .*'mst' that is not there; did you",
        ),
        ('type="continuous"', 'type="ball"', r":\d+: .*'ball'; known: fixed"),
        ('name="hand"/>', 'name="mast"/>', "stands twice"),
        ('xyz="0 0.6 0.8"', 'xyz="0 0 0"', "axis of no length"),
        ('xyz="0 0.5 1"', 'xyz="0 0.5"', "needs 3 finite numbers"),
        ('xyz="0 0.5 1"', 'xyz="0 nan 1"', "needs 3 finite numbers"),
        ('mimic joint="left_finger"', 'mimic joint="left"', "'left', which is not there"),
        ('mimic joint="left_finger"', 'mimic joint="right_finger"', "mimics itself"),
        ('<child link="right"/>', '<child link="left"/>', "more than one joint above link 'left'"),
        (
            '<link name="floor"/>',
            '<link name="floor"/><link name="x"/>',
            "above all others, has floor, x",
        ),
        ("</robot>", "", r"urdf:\d+:1: is not XML"),
        ("<robot", "<human", "is not XML"),
        ('<robot name="lift">', '<!DOCTYPE r [<!ENTITY e "x">]><robot name="lift">', "entities"),
        ('<child link="hand"/>', "", "has no <child>"),
    ],
)
def test_a_wrong_description_is_refused_with_its_place(old, new, message):
    assert old in LIFT
    with pytest.raises(FileError, match=message):
        parse_urdf(LIFT.replace(old, new, 1))


def test_links_in_a_ring_are_refused():
    ring = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
    <joint name="j" type="fixed"><parent link="b"/><child link="c"/></joint>
    <joint name="k" type="fixed"><parent link="c"/><child link="b"/></joint></robot>"""
    with pytest.raises(FileError, match="links in a ring"):
        parse_urdf(ring)


def test_what_is_no_robot_is_refused(tmp_path):
    with pytest.raises(FileError, match="a URDF has <robot>"):
        parse_urdf("<house/>")
    with pytest.raises(FileError, match="has no link"):
        parse_urdf("<robot/>")
    with pytest.raises(FileError, match="cannot be read"):
        read_urdf(tmp_path / "none.urdf")


def test_a_chain_needs_links_that_hang_together():
    lift = parse_urdf(LIFT)
    with pytest.raises(ValueError, match="no link 'hnd'; did you mean 'hand'"):
        lift.chain("floor", "hnd")
    with pytest.raises(ValueError, match="'left' does not hang on 'right'"):
        lift.chain("right", "left")


@pytest.mark.requirement(17, 26)
@pytest.mark.parametrize("measured", [None, load_calibration()])
def test_our_arm_written_and_read_again_is_the_same(arm, measured, sets):
    arm = arm.calibrated(measured)
    read = parse_urdf(urdf_of(arm))
    for q in sets.anywhere(50):
        tcp = read.poses(dict(zip(arm.shape.joints, q, strict=True)))["tcp"]
        assert np.abs(tcp - forward(arm, q)).max() <= 1e-12
    again = manipulator_from_urdf(read, "base_footprint", "tcp", arm)
    assert list(again.shape.joints.items()) == list(arm.shape.joints.items())
    q = sets.anywhere(500)
    assert np.abs(forward(again, q) - forward(arm, q)).max() <= 1e-12


def other_ur(a2, a3, d1, d4, d5, d6):
    """A UR arm as older descriptions have it: frames upright, shoulder and elbow about y."""
    half = math.pi / 2
    rows = [
        ("world", "base_link", "fixed", (0.1, 0.2, 0.3), (0, 0, 0.5), "0 0 1"),
        ("base_link", "l1", "revolute", (0, 0, d1), (0, 0, 0), "0 0 1"),
        ("l1", "l2", "revolute", (0, d4 + 0.01, 0), (0, half, 0), "0 1 0"),
        ("l2", "l3", "revolute", (0, -0.01, -a2), (0, 0, 0), "0 1 0"),
        ("l3", "l4", "revolute", (0, 0, -a3), (0, half, 0), "0 1 0"),
        ("l4", "l5", "revolute", (0, 0, 0), (0, 0, 0), "0 0 1"),
        ("l5", "l6", "revolute", (0, 0, d5), (0, 0, 0), "0 1 0"),
        ("l6", "tool", "fixed", (0, d6, 0), (0, 0, half), "0 0 1"),
    ]
    links = "".join(f'<link name="{name}"/>' for name in ("world", *(row[1] for row in rows)))
    joints = "".join(
        f'<joint name="{p}_{c}" type="{kind}"><parent link="{p}"/><child link="{c}"/>'
        f'<origin xyz="{" ".join(map(repr, xyz))}" rpy="{" ".join(map(repr, rpy))}"/>'
        f'<axis xyz="{axis}"/><limit lower="-3" upper="3" velocity="2"/></joint>'
        for p, c, kind, xyz, rpy, axis in rows
    )
    return f'<robot name="other">{links}{joints}</robot>'


@pytest.mark.requirement(17, 26)
@pytest.mark.parametrize(
    "lengths",
    [
        (-0.612, -0.5723, 0.1273, 0.163941, 0.1157, 0.0922),
        (-0.425, -0.39225, 0.089159, 0.10915, 0.09465, 0.0823),
    ],
    ids=["ur10", "ur5"],
)
def test_an_arm_with_other_frames_keeps_its_forward_kinematics_and_gets_inverse_ones(
    arm, lengths, sets
):
    urdf = parse_urdf(other_ur(*lengths))
    arm = manipulator_from_urdf(urdf, "base_link", "tool", arm)
    dh = arm.shape.dh
    assert (dh.a2, dh.a3, dh.d4, dh.d5) == pytest.approx((*lengths[:2], *lengths[3:5]))
    assert arm.shape.lower == (-3.0,) * 6
    assert arm.shape.max_speed == (2.0,) * 6
    q = sets.anywhere(100) * 0.95
    for row in q:
        poses = urdf.poses(dict(zip(arm.shape.joints, row, strict=True)))
        tip = np.linalg.inv(poses["base_link"]) @ poses["tool"]
        assert np.abs(forward(arm, row) - tip).max() <= 1e-12
    assert inverse(arm, forward(arm, q)).valid.any(axis=1).all()


@pytest.mark.requirement(17)
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('type="revolute"', 'type="fixed"', "5 joints from 'base_link' to 'tool'; needs 6"),
        ('type="revolute"', 'type="prismatic"', "'base_link_l1' slides"),
        ('type="revolute"', 'type="floating"', "'base_link_l1' floats"),
        ('type="revolute"', 'type="planar"', "'base_link_l1' slides in a plane"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0.9 0.4"/>', "the axis of 'l2_l3' is"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><mimic joint="l2_l3"/>', "mimics another"),
    ],
)
def test_an_arm_of_another_kind_is_refused(arm, old, new, message):
    text = other_ur(-0.612, -0.5723, 0.1273, 0.163941, 0.1157, 0.0922)
    with pytest.raises(ValueError, match=message):
        manipulator_from_urdf(parse_urdf(text.replace(old, new, 1)), "base_link", "tool", arm)


def test_a_placement_says_the_same_as_its_matrix(sets):
    for rpy in [*sets.rng.uniform(-3, 3, (200, 3)), (0.3, math.pi / 2, 0.2), (1, -math.pi / 2, 2)]:
        pose = matrix(Placement((1.0, 2.0, 3.0), tuple(rpy)))
        assert np.abs(matrix(placement(pose)) - pose).max() < 1e-12


@pytest.mark.requirement(17, 26, 150)
@pytest.mark.parametrize("prop", ["prop", "gripped"])
def test_a_robot_file_may_take_its_arm_from_a_urdf(arm, sets, tmp_path, prop):
    """Another flange frame, half a turn about z and 12 mm ahead: the prop is screwed on there."""
    own = urdf_of(arm.calibrated(load_calibration()))
    plate = '<link name="plate"/><joint name="p" type="fixed"><parent link="tool0"/>'
    plate += '<child link="plate"/><origin xyz="0 0 0.012" rpy="0 0 3.141592653589793"/></joint>'
    (tmp_path / "own.urdf").write_text(own.replace("</robot>", plate + "</robot>"))
    text = (ROBOTS / "rbkairos_ur10.yaml").read_text()
    described = "calibration: null\n  urdf: {file: own.urdf, base: arm_base, flange: plate, "
    described += "mount: {xyz: [0.1, 0, 0.6], rpy: [0, 0, 3.141592653589793]}}"
    file = tmp_path / "own.yaml"
    file.write_text(text.replace("calibration: null", described))
    found = manipulator_of(load_robot(file, prop=prop))
    length = load_prop(prop).length
    for q in sets.anywhere(20):
        turn, place = Rotation.from_euler("z", math.pi), np.array([0.1, 0, 0.6])
        for joint, angle in zip(load_calibration(), q, strict=True):
            place = place + turn.apply(joint.xyz)
            turn = turn * Rotation.from_euler("xyz", joint.rpy) * Rotation.from_euler("z", angle)
        point = place + turn.apply([0, 0, 0.012 + length])
        assert forward(found, q)[:3, 3] == pytest.approx(point, abs=1e-12)
    for ours, theirs in zip(load_prop(prop).capsules, found.tool.capsules, strict=True):
        behind = math.dist(theirs.end, found.tool.tcp.xyz)
        assert behind == pytest.approx(length - ours.end[2])  # moved with the point


@pytest.mark.requirement(17)
@pytest.mark.parametrize(
    ("described", "message"),
    [
        ("{file: none.urdf, base: a, flange: b}", "arm.urdf.file: there is no file"),
        ("{file: own.urdf, base: arm_base}", "the key 'flange' is missing"),
        ("{file: own.urdf, base: arm_base, flange: tol0}", "did you mean 'tool0'"),
        ("{file: own.urdf, base: arm_base, flange: wrist_2}", "5 joints .* needs 6"),
    ],
)
def test_a_wrong_urdf_of_a_robot_file_is_told(arm, tmp_path, described, message):
    (tmp_path / "own.urdf").write_text(urdf_of(arm))
    text = (ROBOTS / "rbkairos_ur10.yaml").read_text()
    file = tmp_path / "own.yaml"
    file.write_text(text.replace("calibration: null", f"urdf: {described}"))
    with pytest.raises(ValueError, match=message):
        manipulator_of(load_robot(file))


CASE = Path(__file__).resolve().parents[5] / "shared/cases/u_floating.urdf"


@pytest.mark.parametrize("kind", ["floating", "planar", "prismatic", "continuous"])
def test_joints_above_and_beside_an_arm_change_nothing_of_it(kind):
    like = manipulator_of(load_robot("rbkairos_ur10"))
    plain = urdf_of(like)
    more = f'''<link name="world"/><link name="tray"/><link name="lid"/>
      <joint name="free" type="{kind}"><parent link="world"/><child link="base_footprint"/></joint>
      <joint name="beside" type="{kind}"><parent link="base_footprint"/><child link="tray"/></joint>
      <joint name="lid" type="prismatic"><parent link="tray"/><child link="lid"/>
      <mimic joint="beside"/></joint></robot>'''
    arms = [
        manipulator_from_urdf(parse_urdf(text), "base_footprint", "tcp", like)
        for text in (plain, plain.replace("</robot>", more))
    ]
    joints = np.random.default_rng(1).uniform(-2.0, 2.0, (20, 6))
    one, other = (forward(arm, joints) for arm in arms)
    np.testing.assert_array_equal(one, other)


@pytest.mark.skipif(not CASE.is_file(), reason=f"no {CASE}")
def test_an_arm_whose_base_floats_is_read():
    urdf = read_urdf(CASE)
    like = manipulator_of(load_robot("rbkairos_ur10"))
    free = manipulator_from_urdf(urdf, "base_link", "tool0", like)
    text = CASE.read_text().replace('type="floating"', 'type="fixed"')
    fixed = manipulator_from_urdf(parse_urdf(text), "base_link", "tool0", like)
    assert free == fixed
    assert not next(joint for joint in urdf.joints if joint.name == "free").moves
    np.testing.assert_array_equal(urdf.poses({"free": 1.0})["base_link"], np.eye(4))


def test_xacro_is_named():
    text = """<robot xmlns:xacro="http://wiki.ros.org/xacro" name="own"><link name="a">
    <inertial><xacro:cylinder h="1"/></inertial></link></robot>"""
    with pytest.raises(FileError, match=r"own.xacro:2:.*run `xacro own.xacro > own.expanded.urdf`"):
        parse_urdf(text, "own.xacro")
    expanded = text.replace('<xacro:cylinder h="1"/>', '<mass value="1"/>')
    assert parse_urdf(expanded, "own.urdf").root == "a"
