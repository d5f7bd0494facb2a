from __future__ import annotations

import math

import pytest

from engine.files.declared.item import parse_yaml
from engine.files.finding import FileError
from hw.model.arm import FOLDER, arm_from
from hw.model.calibration import load_calibration
from hw.model.robot import FOLDER as ROBOTS, load_robot
from states.arm.description.robot_arm import manipulator_of

TEXT = (FOLDER / "ur10.yaml").read_text()


def build(text: str):
    return parse_yaml(text, "arm.yaml", arm_from)


def test_the_ur10_has_the_makers_lengths(arm):
    dh = arm.shape.dh
    assert (dh.d1, dh.a2, dh.a3) == (0.1273, -0.612, -0.5723)
    assert (dh.d4, dh.d5, dh.d6) == (0.163941, 0.1157, 0.0922)


@pytest.mark.requirement(17)
def test_the_arm_agrees_with_the_robot_it_stands_on(arm):
    robot = load_robot("rbkairos_ur10")
    assert arm.mount == robot.arm.mount
    assert (arm.shape.lower, arm.shape.upper, arm.shape.max_speed) == (
        robot.arm.lower,
        robot.arm.upper,
        robot.arm.max_speed,
    )
    assert arm.tool == robot.prop
    bumper = next(box for box in arm.body if box.name == "bumper")
    assert bumper.high[:2] == (robot.footprint.half_length, robot.footprint.half_width)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("link: shoulder,", "link: sholder,", "did you mean 'shoulder'"),
        ("radius: 0.081}", "radius: 0}", "radius: 0 is out of range"),
        ("d1: 0.1273, ", "", "'d1' is missing"),
        ("upper: 360 deg, speed: 120", "upper: -400 deg, speed: 120", "not above the lower"),
        ("speed: 120 deg/s", "speed: -1", "speed: -1 is out of range"),
        ("- [wrist_1, wrist_3]", "- [wrist_1]", "needs 2 values, has 1"),
        ("a2: -0.612,", "a2: -0.425,", "not lengths and shape of one arm"),
        ("a3: -0.5723,", "a3: -0.70,", "not lengths and shape of one arm"),
    ],
)
def test_a_wrong_file_is_refused_with_its_place_and_what_would_be_right(old, new, message):
    assert old in TEXT
    with pytest.raises(FileError, match=rf"arm\.yaml:\d+:\d+: .*{message}"):
        build(TEXT.replace(old, new, 1))


def test_an_arm_needs_six_joints():
    text = "\n".join(line for line in TEXT.splitlines() if "elbow_joint" not in line)
    with pytest.raises(FileError, match="needs 6 joints, has 5"):
        build(text)


@pytest.mark.requirement(78, 150)
def test_another_end_effector_brings_its_own_point_capsules_and_parked_pose(arm):
    robot = load_robot("rbkairos_ur10", prop="long")
    held = manipulator_of(robot)
    assert held.tool.tcp.xyz == (0, 0, 0.3)
    assert held.tool.capsules != arm.tool.capsules
    assert robot.parked == held.tool.parked != arm.tool.parked
    assert held.shape.capsules == arm.shape.capsules


@pytest.mark.requirement(17)
def test_the_plus_mount_lifts_the_arm_and_what_it_stands_on(arm):
    plus = manipulator_of(load_robot("rbkairos_plus_ur10"))
    assert plus.mount.xyz == (0, 0, 0.689)
    tops = {box.name: box.high[2] for box in plus.body}
    assert tops == {"bumper": 0.4, "chassis": 0.687}
    assert plus.shape.capsules == arm.shape.capsules
    assert manipulator_of(load_robot("rbkairos_ur10")) == arm


@pytest.mark.requirement(17, 26)
def test_a_robot_with_a_calibration_has_the_measured_chain(tmp_path):
    text = (ROBOTS / "rbkairos_ur10.yaml").read_text()
    file = tmp_path / "measured.yaml"
    file.write_text(text.replace("calibration: null", "calibration: robotnik_ur10"))
    assert manipulator_of(load_robot(file)).placements == load_calibration()
    assert manipulator_of(load_robot("rbkairos_ur10")).placements is None


def test_the_published_calibration_differs_from_the_nominal_chain_by_millimetres(arm):
    measured = load_calibration()
    gaps = [
        math.dist(a.xyz, b.xyz) for a, b in zip(measured, arm.shape.dh.placements(), strict=True)
    ]
    assert 5e-4 < max(gaps) < 2e-3
    assert arm.calibrated(measured).placements == measured
    assert arm.placements is None
