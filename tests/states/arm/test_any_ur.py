"""Eight UR arms by their files, and descriptions that are of none of them."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cobodeck.bench.arm.arm_bench import SETS, joint_sets
from engine.files.finding import FileError
from hw.model.arm import FOLDER as ARMS, LINKS, arm_names, load_arm, nearest_arm
from hw.model.prop import Placement, load_prop
from hw.model.robot import FOLDER as ROBOTS, load_robot
from states.arm.description.robot_arm import folded_contact, manipulator_of
from states.arm.kinematics.inverse_kinematics import inverse
from states.arm.kinematics.kinematics import deviation
from states.arm.kinematics.model import Manipulator
from tests.states.arm.conftest import arm_named
from tests.states.arm.urdf_writing import urdf_of

ROBOT = load_robot("rbkairos_ur10")


def tcps(arm: Manipulator, joints: np.ndarray) -> np.ndarray:
    """rover_from_tcp (n, 4, 4), frame by frame by scipy."""
    frames = [arm.mount, *arm.shape.dh.placements()]
    turn, place = Rotation.identity(len(joints)), np.zeros((len(joints), 3))
    for k, frame in enumerate((*frames, arm.tool.tcp)):
        place = place + turn.apply(frame.xyz)
        turn = turn * Rotation.from_euler("xyz", frame.rpy)
        if 1 <= k <= 6:
            turn = turn * Rotation.from_euler("z", joints[:, k - 1, None])
    found = np.zeros((len(joints), 4, 4))
    found[:, :3, :3], found[:, :3, 3], found[:, 3, 3] = turn.as_matrix(), place, 1.0
    return found


def test_the_eight_arms_are_there() -> None:
    assert set(arm_names()) >= {"ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e", "ur16e", "ur20"}


@pytest.mark.requirement(43)
@pytest.mark.parametrize("name", arm_names())
@pytest.mark.parametrize("kind", SETS)
@pytest.mark.parametrize("count", [250, pytest.param(1000, marks=pytest.mark.slow)])
def test_every_pose_of_every_arm_is_solved_exactly_also_at_singularities(
    name: str, kind: str, count: int
) -> None:
    arm = arm_named(name)
    joints = joint_sets(arm, kind, count)
    targets = tcps(arm, joints)
    solved = inverse(arm, targets)
    assert solved.valid.any(axis=1).all()
    reached = tcps(arm, solved.joints[solved.valid])
    asked = np.broadcast_to(targets[:, None], (*solved.valid.shape, 4, 4))[solved.valid]
    distance, angle = deviation(reached, asked)
    assert distance.max() <= 1e-9
    assert angle.max() <= 1e-9


@pytest.mark.parametrize("name", arm_names())
def test_an_arm_file_is_whole(name: str) -> None:
    arm = load_arm(name)
    assert "2221ec0" in arm.source  # the version of the maker's numbers
    assert {capsule.link for capsule in arm.capsules} == set(range(len(LINKS)))
    assert len(arm.masses) == 6
    for link in arm.masses.values():
        xx, yy, zz, xy, xz, yz = link.inertia
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        low, middle, high = np.linalg.eigvalsh(tensor)
        assert low > 0.0
        assert high <= 1.001 * (low + middle)  # no body has another inertia
    assert nearest_arm(arm.dh).dh.difference(arm.dh) == 0.0


def urdf_robot(tmp_path: Path, text: str, model: str = "ur10") -> Path:
    """A robot file that takes its arm from this URDF."""
    (tmp_path / "own.urdf").write_text(text)
    robot = (ROBOTS / "rbkairos_ur10.yaml").read_text()
    urdf = "urdf: {file: own.urdf, base: arm_base, flange: tool0}"
    robot = robot.replace("calibration: null", urdf).replace("model: ur10 ", f"model: {model} ")
    (tmp_path / "own.yaml").write_text(robot)
    return tmp_path / "own.yaml"


@pytest.mark.requirement(17)
@pytest.mark.parametrize("name", arm_names())
def test_a_description_of_the_arm_that_is_named_is_read(name: str, tmp_path: Path) -> None:
    own = arm_named(name)
    found = manipulator_of(load_robot(urdf_robot(tmp_path, urdf_of(own), name)))
    q = np.random.default_rng(2).uniform(-3.0, 3.0, (20, 6))
    assert inverse(found, tcps(own, q)).valid.any(axis=1).all()
    assert (found.shape.capsules, found.shape.upper) == (own.shape.capsules, own.shape.upper)


@pytest.mark.requirement(17)
@pytest.mark.parametrize(
    ("named", "is_one", "message"),
    [
        ("ur5", "ur10", "those of ur10, not of ur5"),
        ("ur10", "ur5", "those of ur5, not of ur10"),
        ("ur10", "ur10e", "those of ur10e, not of ur10"),
        ("ur5e", "ur5", "those of ur5, not of ur5e"),
    ],
)
def test_a_description_of_another_arm_is_refused_by_both_names(
    named: str, is_one: str, message: str, tmp_path: Path
) -> None:
    file = urdf_robot(tmp_path, urdf_of(arm_named(is_one)), named)
    with pytest.raises(FileError, match=message) as refused:
        manipulator_of(load_robot(file))
    assert "own.urdf" in str(refused.value)


def test_lengths_of_no_known_arm_are_refused_with_the_nearest(tmp_path: Path) -> None:
    own = arm_named("ur5")
    long = replace(own, shape=replace(own.shape, dh=replace(own.shape.dh, a2=-0.44)))
    with pytest.raises(FileError, match=r"no known arm, not of ur5.*nearest is ur5, 15 mm off"):
        manipulator_of(load_robot(urdf_robot(tmp_path, urdf_of(long), "ur5")))


def test_an_arm_file_with_another_arm_s_lengths_is_refused(tmp_path: Path) -> None:
    text = (ARMS / "ur5.yaml").read_text()
    ur10 = load_arm("ur10").dh
    for key, value in (("a2", ur10.a2), ("a3", ur10.a3)):
        text = re.sub(rf"{key}: -[0-9.]+", f"{key}: {value}", text)
    (tmp_path / "ur5.yaml").write_text(text)
    with pytest.raises(FileError, match="not lengths and shape of one arm"):
        load_arm(tmp_path / "ur5.yaml")


PANDA = "".join(
    f'<link name="l{k}"/><joint name="j{k}" type="revolute"><parent link="{p}"/>'
    f'<child link="l{k}"/><origin xyz="0 0 0.2" rpy="{(-1) ** k * 1.5708} 0 0"/>'
    '<axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9" velocity="2" effort="87"/></joint>'
    for k, p in ((k, f"l{k - 1}" if k > 1 else "arm_base") for k in range(1, 8))
)
FIXED = '<joint name="f" type="fixed"><parent link="l7"/><child link="tool0"/></joint>'
MALFORMED = {
    "a panda": lambda t: (
        f'<robot name="panda"><link name="arm_base"/><link name="tool0"/>{PANDA}{FIXED}</robot>'
    ),
    "empty": lambda t: "",
    "no xml": lambda t: "robot: ur10\n",
    "cut off": lambda t: t[: len(t) // 2],
    "another root": lambda t: t.replace("<robot", "<model", 1).replace("</robot>", "</model>"),
    "no links": lambda t: '<robot name="ur10"></robot>',
    "xacro": lambda t: t.replace('xyz="0 0 1"', 'xyz="${x}"', 1),
    "entities": lambda t: '<!DOCTYPE r [<!ENTITY a "aaaa">]>' + t.replace('"ur10"', '"&a;"', 1),
    "a parent that is not there": lambda t: t.replace('parent link="forearm"', 'parent link="x"'),
    "a child that is not there": lambda t: t.replace('child link="wrist_2"', 'child link="x"'),
    "no parent": lambda t: t.replace('<parent link="forearm"/>', "", 1),
    "a loop": lambda t: t.replace('child link="wrist_1"', 'child link="shoulder"'),
    "two roots": lambda t: t.replace("</robot>", '<link name="alone"/></robot>'),
    "a joint twice": lambda t: t.replace('"elbow_joint"', '"wrist_1_joint"'),
    "a link twice": lambda t: t.replace("</robot>", '<link name="forearm"/></robot>'),
    "no name": lambda t: t.replace(' name="elbow_joint"', "", 1),
    "no type": lambda t: t.replace(' type="revolute"', "", 1),
    "an unknown type": lambda t: t.replace('type="revolute"', 'type="floating"', 1),
    "a sliding joint": lambda t: t.replace('type="revolute"', 'type="prismatic"', 1),
    "an axis without length": lambda t: t.replace('axis xyz="0 0 1"', 'axis xyz="0 0 0"', 1),
    "an axis across": lambda t: t.replace('axis xyz="0 0 1"', 'axis xyz="1 0 0"', 1),
    "nan": lambda t: re.sub(r'xyz="[^"]*" rpy', 'xyz="nan 0 0" rpy', t, count=4),
    "two numbers": lambda t: re.sub(r'rpy="[^"]*"', 'rpy="0 0"', t),
    "a length of a kilometre": lambda t: t.replace('xyz="-0.612 ', 'xyz="-1000 '),
    "a short forearm": lambda t: t.replace('xyz="-0.5723 ', 'xyz="-0.3 '),
    "a mimic": lambda t: t.replace('velocity="2', '/><mimic joint="elbow_joint"/><limit x="2', 1),
    "no flange": lambda t: t.replace('"tool0"', '"tool1"'),
}


@pytest.mark.requirement(17)
@pytest.mark.parametrize("what", MALFORMED)
def test_a_malformed_description_is_refused_in_a_sentence(what: str, tmp_path: Path) -> None:
    text = urdf_of(arm_named("ur10"))
    wrong = MALFORMED[what](text)
    assert wrong != text
    file = urdf_robot(tmp_path, wrong)
    with pytest.raises(FileError) as refused:
        manipulator_of(load_robot(file))
    (finding,) = refused.value.findings
    assert "own.urdf" in str(finding.place.file)
    assert 10 < len(finding.message) < 300
    assert "\n" not in finding.message


def test_an_arm_is_added_by_its_file_alone(tmp_path: Path) -> None:
    """A shipped prop does not name it, but its own file says how it is folded with that prop."""
    folded = load_robot("rbkairos_ur10e").parked
    added = (ARMS / "ur10e.yaml").read_text().replace("arm: ur10e", "arm: added")
    robot = (ROBOTS / "rbkairos_ur10e.yaml").read_text()
    (tmp_path / "own.yaml").write_text(re.sub("model: ur10e", "model: ./added.yaml", robot))
    (tmp_path / "added.yaml").write_text(added)
    with pytest.raises(FileError, match="prop does not say how an arm added is folded with it"):
        load_robot(tmp_path / "own.yaml")
    (tmp_path / "added.yaml").write_text(f"{added}parked: {{prop: {list(folded)}}}\n")
    found = load_robot(tmp_path / "own.yaml")
    assert found.parked == folded
    assert folded_contact(found) is None
    assert load_prop().also("ur10", {"prop": (0.0,) * 6}).on("ur10") == load_prop().on("ur10")


def test_a_mount_may_be_any_placement(tmp_path: Path) -> None:
    """An arm that hangs from a gantry reaches what one that stands does, mirrored in height."""
    text = (ROBOTS / "rbkairos_ur10.yaml").read_text()
    hanging = "mount: {x: 0.2, y: 0.1, z: 2.0, roll: 180 deg, yaw: 90 deg}"
    text = re.sub(r"mount: \{x: 0, y: 0, z: 0.511[^}]*\}", hanging, text)
    (tmp_path / "own.yaml").write_text(text)
    arm = manipulator_of(load_robot(tmp_path / "own.yaml"))
    assert arm.mount == Placement((0.2, 0.1, 2.0), (np.pi, 0.0, 0.5 * np.pi))
    q = np.random.default_rng(3).uniform(-3.0, 3.0, (50, 6))
    assert inverse(arm, tcps(arm, q)).valid.any(axis=1).all()
