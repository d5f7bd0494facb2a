import json
import math
from pathlib import Path

import pytest

from engine.files.finding import FileError
from hw.geometry import Pose2
from hw.scene.room import Room, ring_fault
from hw.scene.scene import load_scene, scene_names

PLANS = (Path(__file__).resolve().parents[3] / "../shared/data/floorplans").resolve()

GOOD = """\
scene: mine
room:
  outer: [[0, 0], [6, 0], [6, 5], [0, 5]]
  columns: [[[2, 2], [3, 2], [3, 3], [2, 3]]]
robot: {start: {x: 1, y: 1}}
user: {start: {x: 4, y: 4, yaw: 7.0}}
parking: {corner: {x: 0.9, y: 0.9, yaw: 0.5}}
"""


def load(tmp_path, text):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    return load_scene(path)


def test_every_shipped_scene_loads():
    shipped = ("cornered", "hall", "lab_a", "lab_b", "study", "tracked_area", "virtual_wall")
    assert scene_names() == shipped
    assert [load_scene(name).name for name in scene_names()] == list(scene_names())


@pytest.mark.requirement(121)
@pytest.mark.parametrize("name", ["lab_a", "lab_b"])
def test_the_free_floor_is_115_square_metres(name):
    assert load_scene(name).room.free_space.area == pytest.approx(115.0, abs=1.0)


@pytest.mark.requirement(121)
@pytest.mark.parametrize("name", ["lab_a", "lab_b"])
def test_one_metre_from_every_wall_leave_62_square_metres(name):
    assert load_scene(name).room.free_space.buffer(-1.0).area == pytest.approx(62.0, abs=1.0)


@pytest.mark.parametrize(("name", "plan"), [("lab_a", "plan_a"), ("lab_b", "plan_b")])
def test_the_scene_is_the_floor_plan(name, plan):
    path = PLANS / f"{plan}.json"
    if not path.is_file():
        pytest.skip(f"no {path}")
    facts, room = json.loads(path.read_text()), load_scene(name).room
    assert set(room.outer) == {tuple(p) for p in facts["outer"]}
    assert [set(r) for r in room.walls] == [{tuple(p) for p in r} for r in facts["walls"]]
    assert [set(r) for r in room.columns] == [{tuple(p) for p in r} for r in facts["columns"]]
    assert set(room.tracked_area) == {tuple(p) for p in facts["tracked_area"]}


@pytest.mark.requirement(6)
def test_the_tracked_area_is_six_by_ten_metres():
    room = load_scene("lab_a").room
    assert room.is_tracked(1.0, 1.0)
    assert not room.is_tracked(7.0, 1.0)


def test_study_takes_the_room_of_lab_a():
    assert load_scene("study").room == load_scene("lab_a").room
    assert load_scene("study").sha256 != load_scene("lab_a").sha256


def test_a_room_given_as_polygons_is_a_scene(tmp_path):
    scene = load(tmp_path, GOOD)
    assert scene.room.free_space.area == pytest.approx(29.0)
    assert scene.user_start.yaw == pytest.approx(7.0 - 2 * math.pi)
    assert scene.place("corner").x == 0.9
    assert scene.robot == "rbkairos_ur10"


def test_a_room_may_be_taken_from_a_scene_file_beside(tmp_path):
    (tmp_path / "other.yaml").write_text(GOOD)
    scene = load(tmp_path, "scene: mine\nroom: other\nrobot: {start: {x: 1, y: 1}}\n")
    assert len(scene.room.columns) == 1


def test_the_hash_follows_the_values_and_not_the_layout(tmp_path):
    one = load(tmp_path, GOOD)
    assert load(tmp_path, "# a remark\n" + GOOD).sha256 == one.sha256
    assert load(tmp_path, GOOD.replace("[6, 5]", "[6, 5.5]")).sha256 != one.sha256


def test_places_and_parking_spots_are_places_by_name(tmp_path):
    scene = load(tmp_path, f"{GOOD}places: {{kitchen: {{x: 500 cm, y: 4, yaw: 90 deg}}}}\n")
    assert list(scene.places) == ["kitchen", "corner"]
    assert scene.place("kitchen") == Pose2(5.0, 4.0, math.pi / 2)
    assert scene.place("corner") == Pose2(0.9, 0.9, 0.5)
    assert scene.sha256 != load(tmp_path, GOOD).sha256


def test_an_unknown_place_is_answered_with_a_suggestion_or_with_those_there_are():
    with pytest.raises(KeyError, match="did you mean 'corner'"):
        load_scene("lab_a").place("corners")
    with pytest.raises(KeyError, match=r"no place 'cellar'; .*center, corner"):
        load_scene("lab_a").place("cellar")


def test_a_scene_without_places_says_so(tmp_path):
    with pytest.raises(KeyError, match="no place 'dock'; it has none"):
        load(tmp_path, GOOD.partition("parking")[0]).place("dock")


def test_a_place_may_be_a_parking_spot_too(tmp_path):
    scene = load(tmp_path, f"{GOOD}places: {{corner: {{x: 0.9, y: 0.9, yaw: 0.5}}}}\n")
    assert list(scene.places) == ["corner"]


def test_the_places_of_a_room_s_own_scene_are_not_taken_with_it(tmp_path):
    (tmp_path / "other.yaml").write_text(GOOD)
    scene = load(tmp_path, "scene: mine\nroom: other\nrobot: {start: {x: 1, y: 1}}\n")
    assert scene.places == {}


@pytest.mark.parametrize(
    ("place", "wrong"),
    [
        ("kitchen: {x: 2.5, y: 2.5}", "places.kitchen: (2.5, 2.5) is not on the free floor"),
        ("kitchen: {x: 2, z: 3}", "places.kitchen: "),
        ("kitchen: {x: 2 kg, y: 3}", "places.kitchen.x: '2 kg' is a mass"),
        ("kitchen: [2, 3]", "places.kitchen: needs a mapping"),
        ("corner: {x: 0.9, y: 0.9}", "places.corner: is a parking spot elsewhere"),
        ("my kitchen: {x: 1, y: 1}", "'my kitchen' cannot be a name"),
    ],
)
def test_a_wrong_place_is_named_with_its_line(tmp_path, place, wrong):
    with pytest.raises(FileError) as caught:
        load(tmp_path, f"{GOOD}places: {{{place}}}\n")
    assert "mine.yaml:8:" in str(caught.value)
    assert wrong in str(caught.value)


def test_a_place_is_in_no_zone_that_the_robot_keeps_out_of(tmp_path):
    zone = "zones: {keepout: [[[4, 4], [5, 4], [5, 5]]]}"
    with pytest.raises(FileError, match=r"places\.desk: \(4\.8, 4\.2\) is in a zone"):
        load(tmp_path, f"{GOOD}places: {{desk: {{x: 4.8, y: 4.2}}}}\n{zone}\n")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "[[0, 0], [6, 0], [6, 5], [0, 5]]",
            "[[0, 0], [6, 0], [6, 0]]",
            "3:3: room.outer: has the s",
        ),
        ("[[0, 0], [6, 0], [6, 5], [0, 5]]", "[[0, 0], [6, 0], [3, 0]]", "has no area"),
        ("[[0, 0], [6, 0], [6, 5], [0, 5]]", "[[0, 0], [6, 0]]", "at least 3"),
        ("[[0, 0], [6, 0], [6, 5], [0, 5]]", "[[0, 0], [6, 5], [6, 0], [0, 5]]", "crosses itself"),
        (
            "[[0, 0], [6, 0], [6, 5], [0, 5]]",
            "[[0, 0, 0], [6, 0], [6, 5]]",
            "needs 2 values",
        ),
        ("[0, 5]", "[0, .nan]", "room.outer[3][1]: '.nan' is not a length"),
        ("outer:", "outter:", "did you mean 'outer'?"),
        ("  outer: [[0, 0], [6, 0], [6, 5], [0, 5]]\n", "", "the key 'outer' is missing"),
        ("scene: mine\n", "", "the key 'scene' is missing"),
        ("robot:", "robots:", "did you mean 'robot'?"),
        (
            "{x: 1, y: 1}",
            "{x: 2.5, y: 2.5}",
            "5:9: robot.start: (2.5, 2.5) is not on",
        ),
        ("{x: 1, y: 1}", "{x: -2, y: 1}", "the room reaches from (0, 0) to (6, 5)"),
        ("[[[2, 2], [3, 2], [3, 3], [2, 3]]]", "[[[20, 2], [30, 2], [30, 3]]]", "lies outside"),
        ("[[[2, 2], [3, 2], [3, 3], [2, 3]]]", "[[2, 2], [3, 2], [3, 3]]", "needs a list"),
    ],
)
def test_a_wrong_scene_is_named_with_file_line_and_key(tmp_path, old, new, message):
    assert old in GOOD
    with pytest.raises(FileError) as caught:
        load(tmp_path, GOOD.replace(old, new))
    assert "mine.yaml:" in str(caught.value)
    assert message in str(caught.value)


def test_an_unknown_scene_name_is_answered_with_a_suggestion():
    with pytest.raises(FileError, match="did you mean 'lab_a'"):
        load_scene("lab_aa")


def test_scenes_that_take_their_rooms_from_each_other_are_refused(tmp_path):
    for name, room in (("one", "two"), ("two", "one")):
        text = f"scene: {name}\nroom: {room}\nrobot: {{start: {{x: 1, y: 1}}}}\n"
        (tmp_path / f"{name}.yaml").write_text(text)
    with pytest.raises(FileError, match="takes its own from another"):
        load_scene(tmp_path / "one.yaml")


@pytest.mark.parametrize(
    ("ring", "fault"),
    [
        (((0, 0), (2, 0), (2, 2), (0, 2)), None),
        (((0, 0), (4, 0), (4, 4), (2, 1), (0, 4)), None),
        (((0, 0), (4, 0), (4, 4), (2, 0), (0, 4)), "crosses"),
        (((0, 0), (4, 0), (2, 0), (2, 3)), "crosses"),
        (((0, 0), (4, 0), (4, 1), (1, 1), (1, -1), (0, -1)), "crosses"),
    ],
)
def test_rings_that_touch_or_cross_themselves_are_found(ring, fault):
    found = ring_fault(ring)
    assert (found is None) if fault is None else (fault in found)


def test_clearance_is_the_distance_to_the_nearest_wall_and_zero_inside_one():
    room = Room(
        outer=((0.0, 0.0), (6.0, 0.0), (6.0, 5.0), (0.0, 5.0)),
        columns=(((2.0, 2.0), (3.0, 2.0), (3.0, 3.0), (2.0, 3.0)),),
    )
    assert room.clearance(5.0, 2.5) == pytest.approx(1.0)
    assert room.clearance(4.0, 4.0) == pytest.approx(1.0)
    assert room.clearance(2.5, 2.5) == 0.0
    assert room.clearance(-1.0, 2.5) == 0.0


def test_the_largest_free_disc_touches_walls_and_holds_none():
    from shapely.geometry import Point

    for name in ("lab_a", "lab_b"):
        room = load_scene(name).room
        disc = room.largest_free_disc
        assert room.free_space.buffer(2e-3).contains(Point(disc.x, disc.y).buffer(disc.radius))
        assert room.clearance(disc.x, disc.y) == pytest.approx(disc.radius, abs=2e-3)
        grid = (room.clearance(0.25 * i, 0.25 * j) for i in range(1, 46) for j in range(1, 41))
        assert max(grid) <= disc.radius + 2e-3


@pytest.mark.requirement(74)
@pytest.mark.parametrize(
    ("surface", "wrong"),
    [
        ("{from: [1, 1], to: [1, 1]}", "no length"),
        ("{from: [1, 1], to: [2, 1], low: 2, high: 1}", "'low' must be below"),
        ("{from: [1, 1]}", "'to' is missing"),
    ],
)
def test_a_wrong_touchable_surface_is_named_with_its_line(tmp_path, surface, wrong):
    with pytest.raises(FileError, match=rf"mine\.yaml:8:\d+: .*{wrong}"):
        load(tmp_path, f"{GOOD}touchable: [{surface}]\n")


def test_lengths_and_angles_may_carry_units(tmp_path):
    text = GOOD.replace("[6, 5]", "[600 cm, 5000 mm]").replace("yaw: 0.5", "yaw: 90 deg")
    scene = load(tmp_path, text)
    assert scene.room == load(tmp_path, GOOD).room
    assert scene.place("corner").yaw == math.pi / 2


def test_all_mistakes_of_a_scene_are_told_at_once(tmp_path):
    wrong = (
        GOOD.replace("[6, 0]", "[6 kg, 0]").replace("x: 4", "z: 4").replace("0.9, yaw", "a, yaw")
    )
    with pytest.raises(FileError) as caught:
        load(tmp_path, wrong)
    assert [f.place.line for f in caught.value.findings] == [3, 6, 6, 7]


def test_every_pose_off_the_floor_is_told_at_once(tmp_path):
    wrong = GOOD.replace("x: 1, y: 1", "x: 2.5, y: 2.5").replace("{x: 0.9", "{x: -1")
    with pytest.raises(FileError) as caught:
        load(tmp_path, wrong)
    assert [f.place.line for f in caught.value.findings] == [5, 7]


def test_a_wrong_room_of_another_scene_is_told_there_with_a_note(tmp_path):
    (tmp_path / "other.yaml").write_text(GOOD.replace("[6, 0]", "[6 s, 0]"))
    with pytest.raises(FileError) as caught:
        load(tmp_path, "scene: mine\nroom: other\nrobot: {start: {x: 1, y: 1}}\n")
    (finding,) = caught.value.findings
    assert (Path(finding.place.file).name, finding.place.line) == ("other.yaml", 3)
    ((place, note),) = finding.related
    assert (Path(place.file).name, place.line, place.column, note) == (
        "mine.yaml", 2, 7, "named here"
    )  # fmt: skip


def test_files_that_a_scene_names_are_looked_for_from_its_own_folder(tmp_path, monkeypatch):
    text = GOOD.replace("robot: {", "robot: {file: ../bodies/mine.yaml, ")
    text = text.replace("user: {", "user: {source: 'walk.csv#3', ")
    (tmp_path / "rooms").mkdir()
    scene = load(tmp_path / "rooms", text)
    assert Path(scene.robot) == tmp_path / "rooms/../bodies/mine.yaml"
    assert scene.user == str(tmp_path / "rooms/walk.csv#3")
    monkeypatch.chdir(tmp_path)
    assert load(Path("rooms"), text).sha256 == scene.sha256


@pytest.mark.parametrize("name", ["../../out", "a\\b", '"a\\e[2Jb"', '""', "a" * 61])
def test_a_scene_is_called_by_what_can_be_the_name_of_a_file(tmp_path, name):
    with pytest.raises(FileError, match="cannot be a name"):
        load(tmp_path, GOOD.replace("scene: mine", f"scene: {name}"))
