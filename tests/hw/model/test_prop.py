"""End effectors and calibrations from their files."""

import pytest
from hypothesis import given, settings, strategies as st

from engine.files.declared.item import notes, parse_yaml
from engine.files.finding import FileError
from hw.model.calibration import FOLDER as CALIBRATIONS, load_calibration
from hw.model.prop import FOLDER, Placement, load_prop, placement, prop_names
from tests.repeats import examples

TEXT = (FOLDER / "gripped.yaml").read_text()


@pytest.mark.requirement(78, 150)
def test_every_shipped_prop_has_its_own_length_and_is_light_enough_to_be_carried():
    lengths = {name: load_prop(name).length for name in prop_names()}
    assert lengths == {"prop": 0.15, "long": 0.3, "gripped": 0.25, "gripper": 0.2}
    for name in prop_names():
        prop = load_prop(name)
        assert prop.name == name
        assert 0.0 < prop.mass < 10.0
        assert max(c.end[2] + c.radius for c in prop.capsules) == pytest.approx(prop.length)


@pytest.mark.requirement(150)
def test_a_prop_of_ones_own_may_bring_fingers_and_a_sensor(tmp_path):
    file = tmp_path / "own.yaml"
    file.write_text(TEXT.replace("prop: gripped", "prop: own"))
    own = load_prop(file)
    assert own.name == "own"
    assert (own.gripper.opening, own.gripper.speed, own.gripper.held) == (0.085, 0.15, 0.05)
    assert (own.wrench.force, own.wrench.torque) == (300, 30)
    assert load_prop().gripper is None
    assert load_prop().wrench is None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass: 1.7", "mass: -1", "mass: -1 is out of range"),
        ("radius: 0.065", "radius: 0", "radius: 0 is out of range"),
        ("ur10: [-2.7, ", "ur10: [", "parked.ur10: needs 6 to 7 values, has 5"),
        ("held: 0.05", "held: 0.1", "gripper.held: 0.1 is wider than the opening, 0.085"),
        ("speed: 0.15", "sped: 0.15", "did you mean 'speed'"),
        ("force: 300", "force: 0", "wrench.force: 0 is out of range"),
        ("mass: 1.7", "mass: 1.7\ncenter_of_mass: [0, 0, 1.1]", "center_of_mass[2]: 1.1 is out"),
        ("tcp:", "tpc:", "did you mean 'tcp'"),
    ],
)
def test_a_wrong_prop_is_named_with_line_and_key(tmp_path, old, new, message):
    assert old in TEXT
    file = tmp_path / "prop.yaml"
    file.write_text(TEXT.replace(old, new, 1))
    with pytest.raises(FileError, match=r"prop\.yaml:\d+:\d+: ") as caught:
        load_prop(file)
    assert message in str(caught.value)


def test_an_unknown_prop_is_answered_with_a_suggestion():
    with pytest.raises(FileError, match="did you mean 'gripped'"):
        load_prop("griped")


@pytest.mark.requirement(17)
def test_a_calibration_has_a_frame_for_each_of_six_joints(tmp_path):
    text = (CALIBRATIONS / "robotnik_ur10.yaml").read_text()
    assert len(load_calibration()) == 6
    file = tmp_path / "short.yaml"
    file.write_text("\n".join(text.splitlines()[:-1]))
    with pytest.raises(FileError, match="chain: needs 6 values, has 5"):
        load_calibration(file)
    with pytest.raises(FileError, match="no such calibration"):
        load_calibration("nobody")


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("mass: 1.7", "mass: -5 kg", (3, 7)),
        ("mass: 1.7", "mass: 51", (3, 7)),
        ("radius: 0.065", "radius: 6.5", (6, 54)),
        ("z: 0.25", "z: 25", (4, 22)),
        ("pitch: 90 deg", "pitch: 90", (4, 35)),
        ("z: 0.25", "xyz: [0, 0, 0.25]", (4, 19)),
    ],
)
def test_what_no_prop_can_be_is_refused_at_its_place(tmp_path, old, new, place):
    file = tmp_path / "prop.yaml"
    file.write_text(TEXT.replace(old, new, 1))
    with pytest.raises(FileError) as caught:
        load_prop(file)
    assert caught.value.findings[0].place[1:3] == place


def test_the_centre_of_mass_is_half_way_to_the_point_unless_it_is_given(tmp_path):
    assert load_prop("gripped").center_of_mass == (0.0, 0.0, 0.125)
    file = tmp_path / "own.yaml"
    file.write_text(TEXT.replace("mass: 1.7", "mass: 1.7\ncenter_of_mass: [1 cm, 0, 50 mm]"))
    assert load_prop(file).center_of_mass == (0.01, 0.0, 0.05)
    file.write_text(TEXT.replace("mass: 1.7", "mass: 1.7\ncenter_of_mass: [0, 0, 0]"))
    assert load_prop(file).center_of_mass == (0.0, 0.0, 0.0)


def test_props_and_calibrations_may_carry_units(tmp_path):
    file = tmp_path / "own.yaml"
    text = TEXT.replace("mass: 1.7", "mass: 1700 g").replace("z: 0.25", "z: 250 mm")
    file.write_text(
        text.replace("90 deg", "1.5707963267948966").replace("speed: 0.15", "speed: 15 cm/s")
    )
    assert load_prop(file) == load_prop("gripped")
    chain = (CALIBRATIONS / "robotnik_ur10.yaml").read_text()
    file.write_text(chain.replace("z: 0.1279592785000426", "z: 127.9592785000426 mm"))
    assert load_calibration(file) == load_calibration()


def test_all_mistakes_of_a_calibration_are_told_at_once(tmp_path):
    file = tmp_path / "own.yaml"
    text = (CALIBRATIONS / "robotnik_ur10.yaml").read_text()
    file.write_text(text.replace("z: 0.1279592785000426", "z: 0.1 s").replace("yaw", "yam", 2))
    with pytest.raises(FileError) as caught:
        load_calibration(file)
    assert [f.place.line for f in caught.value.findings] == [6, 6, 7]


LENGTHS = st.floats(-10.0, 10.0)
ANGLES = st.floats(-12.0, 12.0)


@settings(max_examples=examples(200), deadline=None)
@given(st.tuples(LENGTHS, LENGTHS, LENGTHS), st.tuples(ANGLES, ANGLES, ANGLES))
def test_a_pose_in_the_old_way_is_the_same_and_noted(xyz, rpy):
    pairs = zip(("x", "y", "z", "roll", "pitch", "yaw"), (*xyz, *rpy), strict=True)
    new = f"at: {{{', '.join(f'{key}: {value!r}' for key, value in pairs)}}}\n"
    old = f"at: {{rpy: {[*rpy]!r}, xyz: {[*xyz]!r}}}\n"
    with notes() as found:
        assert parse_yaml(new, "new.yaml", lambda item: placement(item.inner("at"))) == Placement(
            xyz, rpy
        )
    assert not found
    with notes() as found:
        parsed = parse_yaml(old, "old.yaml", lambda item: placement(item.inner("at")))
    assert parsed == Placement(xyz, rpy)
    (note,) = found
    wanted = f"at: {note.hint.removeprefix('write ').strip('`')}\n"
    assert parse_yaml(wanted, "new.yaml", lambda item: placement(item.inner("at"))) == parsed


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("{xyz: [0, 0, 1], yaw: 1}", "at.xyz: unknown key"),
        ("{xzy: [0, 0, 1]}", "at.xzy: unknown key"),
        ("[0, 0, 1]", "at: needs a mapping"),
        ("{xyz: [0, 0]}", "at.xyz: needs 3 values, has 2"),
    ],
)
def test_what_is_no_pose_is_told(written, message):
    with pytest.raises(FileError) as caught:
        parse_yaml(f"at: {written}\n", "a.yaml", lambda item: placement(item.inner("at")))
    assert message in str(caught.value)
