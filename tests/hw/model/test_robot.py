import math
from pathlib import Path

import pytest

from engine.files.finding import FileError
from hw.geometry import Pose2
from hw.model.robot import FOLDER, MotionLimits, load_robot

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
        ("model: ur10", "model: ur11", "arm.model: ur11: no such arm; did you mean 'ur10'"),
        ("prop: prop", "prop: ./far.yaml", "prop: prop, parked: arm: joint 0 at -7"),
        ("prop: prop", "prop: ./none.yaml", "does not say how an arm ur10 is folded with it"),
        ("calibration: null", "calibration: none", "arm.calibration: "),
        ("arm:\n", "arm:\n  mount_height: 0.5\n", "arm.mount_height: unknown key"),
        ("payload: 10.0", "", "the key 'payload' is missing"),
    ],
)
def test_a_wrong_robot_file_is_named_with_line_and_key(tmp_path, old, new, message):
    text = (FOLDER / "rbkairos_ur10.yaml").read_text()
    assert old in text
    prop = (FOLDER.parent / "props" / "prop.yaml").read_text()
    (tmp_path / "far.yaml").write_text(prop.replace("ur10: [-2.95", "ur10: [-7"))
    (tmp_path / "none.yaml").write_text(prop.replace("ur10: [-2.95", "ur11: [-2.95"))
    path: Path = tmp_path / "robot.yaml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FileError) as caught:
        load_robot(path)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "place", "message"),
    [
        ("brake_deceleration: 3.0", "brake_deceleration: 3000", "14:23", "0.5 to 10 m/s2"),
        ("brake_deceleration: 3.0", "brake_deceleration: 0.4", "14:23", "0.5 to 10 m/s2"),
        ("reaction_time: 0.1", "reaction_time: 0.01", "15:18", "0.02 to 1 s"),
        ("length: 1.13", "length: 11.3 cm", "6:11", "0.113 is out of range, 0.3 to 3 m"),
        ("width: 0.91", "width: 9.1", "7:10", "0.3 to 3 m"),
        ("command_timeout: 0.5", "command_timeout: 50", "16:20", "0.02 to 2 s"),
        ("z: 0.511", "z: 51.1", "24:26", "-10 to 10 m"),
        ("payload: 10.0", "payload: 10 t", "4:10", "'10 t' is not a mass"),
        ("rolling_resistance: 0.05", "rolling_resistance: 5", "21:23", "0.0001 to 0.5"),
        ("max_wheel_rate: 23.622", "max_wheel_rate: 20", "12:14", "turn to 2.54 m/s at most"),
        ("max_speed: 3.0", "max_speed: 3.1", "12:14", "3.1 m/s; the wheels turn to 3 m/s at"),
        ("max_yaw_rate: 3.0", "max_yaw_rate: 8", "13:17", "turn it by 7.026 rad/s at most"),
        ("stop_deceleration: 16.0", "stop_deceleration: 0", "26:22", "0.1 to 1000 rad/s2"),
        ("yaw: 180 deg}   #", "yaw: 180}   #", "24:38", "180 is out of range, -12.57 to"),
    ],
)
def test_what_no_such_robot_can_be_is_refused_at_its_place(tmp_path, old, new, place, message):
    text = (FOLDER / "rbkairos_ur10.yaml").read_text()
    assert old in text
    path: Path = tmp_path / "robot.yaml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FileError) as caught:
        load_robot(path)
    assert f"robot.yaml:{place}: " in str(caught.value)
    assert message in str(caught.value)


def test_sizes_and_speeds_of_a_robot_may_carry_units(tmp_path):
    text = (FOLDER / "rbkairos_ur10.yaml").read_text()
    for old, new in (
        ("length: 1.13", "length: 113 cm"), ("max_speed: 3.0", "max_speed: 10.8 km/h"),
        ("rolling_resistance: 0.05", "rolling_resistance: 5 %"), ("mass: 130.0", "mass: 130 kg"),
        ("reaction_time: 0.1", "reaction_time: 100 ms"), ("z: 0.511", "z: 51.1 cm"),
    ):  # fmt: skip
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "robot.yaml").write_text(text)
    found = load_robot(tmp_path / "robot.yaml")
    assert (found.footprint, found.base) == (ROBOT.footprint, ROBOT.base)
    assert found.arm == ROBOT.arm


def test_mistakes_of_a_robot_and_of_its_prop_are_told_in_both_files(tmp_path):
    text = (FOLDER / "rbkairos_ur10.yaml").read_text()
    path = tmp_path / "robot.yaml"
    path.write_text(
        text.replace("mass: 130.0", "mass: 0.13").replace("prop: prop", "prop: ./p.yaml")
    )
    held = (FOLDER.parent / "props" / "gripped.yaml").read_text()
    (tmp_path / "p.yaml").write_text(held.replace("mass: 1.7", "mass: -5 kg"))
    with pytest.raises(FileError) as caught:
        load_robot(path)
    prop, own = caught.value.findings
    assert (Path(own.place.file).name, own.place.line) == ("robot.yaml", 3)
    assert (Path(prop.place.file).name, prop.place.line) == ("p.yaml", 3)
    assert [place.line for place, _ in prop.related] == [27]


def without(text: str, key: str) -> str:
    """The text of a robot without one of its last sections."""
    return text[: text.index(f"{key}:")] + ("" if key == "prop" else text[text.index("prop:") :])


def test_a_robot_may_be_without_an_arm(tmp_path):
    text = (FOLDER / "rbkairos_ur10.yaml").read_text()
    (tmp_path / "robot.yaml").write_text(text[: text.index("arm:")])
    found = load_robot(tmp_path / "robot.yaml")
    assert (found.arm, found.prop, found.parked) == (None, None, None)
    assert (found.base, found.footprint) == (ROBOT.base, ROBOT.footprint)
    assert ROBOT.parked == ROBOT.prop.parked


@pytest.mark.parametrize(
    ("key", "message"),
    [("arm", "22:7: prop: there is no arm to hold it"), ("prop", "22:1: arm: needs a prop")],
)
def test_an_arm_and_what_it_holds_go_together(tmp_path, key, message):
    text = (FOLDER / "rbkairos_ur10.yaml").read_text()
    (tmp_path / "robot.yaml").write_text(without(text, key))
    with pytest.raises(FileError) as caught:
        load_robot(tmp_path / "robot.yaml")
    assert message in str(caught.value)


def test_an_unknown_robot_is_answered_with_a_suggestion():
    with pytest.raises(FileError, match="did you mean 'rbkairos_ur"):
        load_robot("rbkairos_ur5")


def test_limits_must_be_positive_numbers():
    assert MotionLimits().base_acceleration == 0.5
    for bad in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="base_acceleration"):
            MotionLimits(base_acceleration=bad)


@pytest.mark.parametrize("sense", [-1.0, 1.0])
def test_no_joint_is_asked_to_turn_faster_than_it_can_either_way(sense):
    arm = load_robot("rbkairos_ur10").arm
    for joint, fastest in enumerate(arm.max_speed):
        for share in (0.99, 1.02):
            end = [0.1] * 6
            end[joint] += sense * share * 0.1 * fastest
            course = [(0.0, (0.1,) * 6), (0.1, tuple(end))]
            if share < 1.0:
                arm.check_course(course)
            else:
                with pytest.raises(ValueError, match=f"joint {joint} at"):
                    arm.check_course(course)


@pytest.mark.parametrize(
    ("point", "message"),
    [
        ((0.2, (0.0,) * 5), "5 joint angles; it has 6"),
        ((0.2, (0.0, 0.0, 3.2, 0.0, 0.0, 0.0)), "joint 2 at 3.2"),
        ((9.0, (0.0, 0.0, -3.2, 0.0, 0.0, 0.0)), "joint 2 at -3.2"),
        ((0.2, (0.0, math.nan, 0.0, 0.0, 0.0, 0.0)), "joint 1 at nan"),
        ((0.1, (0.0,) * 6), "times rise"),
        ((math.nan, (0.0,) * 6), "times rise"),
    ],
)
def test_a_course_with_a_wrong_point_is_refused(point, message):
    course = [(0.0, (0.0,) * 6), (0.1, (0.0,) * 6), point, (10.0, (0.0,) * 6)]
    with pytest.raises(ValueError, match=message):
        ROBOT.arm.check_course(course)


def test_calibrated_scanners_are_turned_on_from_their_mounts():
    sensing = load_robot("rbkairos_ur10").sensing
    turned = sensing.moved({"front_laser": Pose2(0.0, 0.0, 0.25)})

    assert turned.mount("front_laser").yaw == pytest.approx(sensing.mount("front_laser").yaw + 0.25)
    assert turned.mount("rear_laser") == sensing.mount("rear_laser")
