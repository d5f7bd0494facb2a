import math
from pathlib import Path

import pytest

from engine.files.finding import FileError
from hw.robot import FOLDER, MotionLimits, load_robot

ROBOT = load_robot("rbkairos_ur10")


@pytest.mark.requirement(1)
def test_mass_payload_and_speed_are_those_of_the_table():
    assert (ROBOT.mass, ROBOT.payload, ROBOT.base.max_speed) == (130.0, 10.0, 3.0)
    reached = ROBOT.base.max_wheel_rate * ROBOT.base.wheel_radius
    assert reached == pytest.approx(ROBOT.base.max_speed, abs=1e-3)


@pytest.mark.requirement(2)
def test_both_ways_of_driving_are_known():
    assert ROBOT.base.modes == ("omni", "differential")


@pytest.mark.requirement(3, 4)
def test_the_outline_with_foam_is_a_box_inside_its_own_enclosing_circle():
    footprint = ROBOT.footprint
    assert (footprint.length, footprint.width, footprint.foam) == (1.13, 0.91, 0.10)
    assert footprint.half_diagonal == pytest.approx(0.7254, abs=1e-4)
    assert footprint.enclosing_radius == 0.77


@pytest.mark.requirement(45)
def test_the_arm_can_brake_from_full_speed_within_a_fifth_of_a_second():
    assert max(ROBOT.arm.max_speed) / ROBOT.arm.stop_deceleration <= 0.2


def test_the_arm_has_the_makers_joint_limits():
    assert ROBOT.arm.max_speed == pytest.approx([math.radians(v) for v in (120,) * 2 + (180,) * 4])
    assert ROBOT.arm.upper == pytest.approx([math.radians(v) for v in (360, 360, 180) + (360,) * 3])
    assert ROBOT.arm.lower == tuple(-v for v in ROBOT.arm.upper)


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        ((0.0,) * 5, "5 joint angles; it has 6"),
        ((0.0, 0.0, 3.2, 0.0, 0.0, 0.0), "joint 2 at 3.2"),
        ((0.0, math.nan, 0.0, 0.0, 0.0, 0.0), "joint 1 at nan"),
    ],
)
def test_joint_angles_out_of_the_limits_are_refused_by_joint(joints, message):
    with pytest.raises(ValueError, match=message):
        ROBOT.arm.check(joints)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass: 130.0", "mass: -1", "3:7: mass: -1 is out of range, 1 to 5000 kg is allowed"),
        ("mass: 130.0", "mass: heavy", "mass: 'heavy' is not a mass; wanted: a mass, in kg, g"),
        ("foam: 0.10", "foam: 0.5", "footprint.foam: no robot is left"),
        ("enclosing_radius: 0.77", "enclosing_radius: 0.7", "half the diagonal"),
        ("modes: [omni, differential]", "modes: [omny]", "did you mean 'omni'"),
        ("modes: [omni, differential]", "modes: []", "base.modes: is an empty list"),
        ("max_speed: 3.0", "max_sped: 3.0", "did you mean 'max_speed'"),
        ("prop: prop", "prop: brop", "prop: brop: no such prop; did you mean 'prop'?"),
        ("payload: 10.0", "payload: 0.5", "prop: prop weighs 1 kg; the payload is 0.5 kg"),
        ("lower: [-6.283185307179586", "lower: [-1.0", "prop: prop, parked: arm: joint 0 at -2.95"),
        ("lower: [-6.283185307179586, ", "lower: [", "arm.lower: needs 6 values, has 5"),
        ("calibration: null", "calibration: none", "arm.calibration: "),
        ("payload: 10.0", "", "the key 'payload' is missing"),
    ],
)
def test_a_wrong_robot_file_is_named_with_line_and_key(tmp_path, old, new, message):
    text = (FOLDER / "rbkairos_ur10.yaml").read_text()
    assert old in text
    path: Path = tmp_path / "robot.yaml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FileError) as caught:
        load_robot(path)
    assert message in str(caught.value)


def test_an_unknown_robot_is_answered_with_a_suggestion():
    with pytest.raises(FileError, match="did you mean 'rbkairos_ur10'"):
        load_robot("rbkairos_ur5")


def test_limits_must_be_positive_numbers():
    assert MotionLimits().base_acceleration == 0.5
    for bad in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="base_acceleration"):
            MotionLimits(base_acceleration=bad)
