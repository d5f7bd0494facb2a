"""`cobodeck space`: the figures of the paper's section 5.1, and what it says of bad input."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cobodeck.__main__ import main
from cobodeck.pictures.space_plot import space_picture
from cobodeck.terminal.console import FAILED, OK, USAGE
from hw.scene.scene import load_scene
from states.floors.floor_plan import RoomFloor
from states.floors.usable_space import Untouchable, measure
from states.maps.cells import room_map
from states.maps.occupancy import save_map

ROOT = Path(__file__).resolve().parents[3]
ROOM = """
scene: {name}
room:
  outer: [[0.0, 0.0], [{side}, 0.0], [{side}, {side}], [0.0, {side}]]
  columns: {columns}
robot: {{start: {{x: {robot}, y: {robot}}}}}
user: {{start: {{x: 1.2, y: 1.2, yaw: 0.785}}}}
"""
USER = """
user: modest
speed: 1.0
repeat: true
steps:
  - stand: 4
  - request: {hold: 12}
  - stand: 2
  - approach: {target: robot, stop_at: 1.4, for: 3, speed: 0.8}
  - stand: 2
  - walk: {x: 1.2, y: 1.2, yaw: 0.785}
"""


def write_room(folder, name, side, columns="[]", robot=None):
    text = ROOM.format(name=name, side=side, columns=columns, robot=robot or 0.7 * side)
    (folder / f"{name}.yaml").write_text(text)


def measured(capsys, *arguments, code=OK):
    assert main(["space", *arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


@pytest.mark.requirement(120, 121)
def test_the_papers_room_has_115_square_metres_and_keeps_62(capsys):
    found = measured(capsys, "lab_a", "--inflation", "1.0")

    assert found["free_m2"] == pytest.approx(115.0, abs=1.0)
    assert found["usable_m2"] == pytest.approx(62.0, abs=1.0)
    assert found["usable_share"] == pytest.approx(0.54, abs=0.005)
    assert found["closed_passages"] == []
    assert found["fits_all_behaviours"] is True


@pytest.mark.requirement(118, 125)
def test_square_corners_and_the_inflation_are_chosen_on_the_command_line(folder, capsys):
    column = "[[[4.85, 4.75], [5.15, 4.75], [5.15, 5.25], [4.85, 5.25]]]"
    write_room(folder, "column", 10.0, column, robot=2.0)
    write_room(folder, "empty", 10.0)
    options = ("--inflation", "0.77", "--corners", "square")

    taken = [measured(capsys, f"{n}.yaml", *options)["usable_m2"] for n in ("empty", "column")]

    assert taken[0] - taken[1] == pytest.approx(3.7536, abs=1e-4)


@pytest.mark.requirement(120)
def test_closed_passages_are_told_with_place_and_width(capsys):
    found = measured(capsys, "lab_b")
    assert main(["space", "lab_b"]) == OK
    shown = capsys.readouterr().out

    (passage,) = found["closed_passages"]
    assert passage["width_m"] == pytest.approx(1.8)
    assert (passage["x"], passage["y"]) == pytest.approx((6.75, 3.12))
    assert "1.80 m at (6.75, 3.12)" in shown
    assert measured(capsys, "lab_b", "--inflation", "0.77")["closed_passages"] == []


@pytest.mark.requirement(124)
def test_a_room_of_five_metres_is_refused_with_a_sentence_and_one_of_six_is_not(folder, capsys):
    write_room(folder, "five", 5.0)
    write_room(folder, "six", 6.0)

    small = measured(capsys, "five.yaml", code=FAILED)
    large = measured(capsys, "six.yaml")

    assert small["shortcoming"] == (
        "the floor of 5 x 5 m is too small for all behaviours: kept 1 m from walls, the robot has "
        "no quarter of a circle of 4 m about the user; the largest is of 3.0 m, at (1.0, 1.0), and "
        "in its way are the outer walls; an empty square room needs 6 x 6 m"
    )
    assert small["fits_all_behaviours"] is False
    assert large["shortcoming"] is None
    assert large["smallest_square_room_m"] == 6.0


@pytest.mark.requirement(124)
@pytest.mark.slow
def test_all_behaviours_run_in_a_room_of_six_metres(folder, capsys):
    write_room(folder, "six", 6.0)
    (folder / "modest.yaml").write_text(USER)
    arguments = "--scene six.yaml --user modest.yaml --duration 60 --record six.jsonl --json"
    arguments += " --profile paper"  # in tuned nobody here is in danger

    assert main(["simulate", *arguments.split()]) == OK
    figures = json.loads(capsys.readouterr().out)

    records = [json.loads(line) for line in Path("six.jsonl").read_text().splitlines()[1:]]
    entered = {record[2] for record in records if record[1] == "enter"}
    assert {"chase", "haptic", "escape", "inform"} <= entered
    assert figures["served"] >= 2
    assert figures["contacts"] == 0


@pytest.mark.requirement(126)
def test_the_nearest_wall_ahead_of_a_user_follows_from_the_profile(capsys):
    paper = measured(capsys, "lab_a", "--profile", "paper")["wall_ahead_m"]

    assert paper["60"] == pytest.approx(2.55)
    assert paper["0"] == pytest.approx(3.05)
    assert paper["90"] == pytest.approx(2.05)


@pytest.mark.requirement(126)
def test_the_share_of_user_poses_without_a_haptic_pose_falls_with_the_inflation(capsys):
    wide, narrow = (
        measured(capsys, "lab_a", "--inflation", inflation)["no_haptic_pose_share"]
        for inflation in ("1.0", "0.77")
    )

    assert 0.0 < narrow < wide < 0.25


@pytest.mark.requirement(121)
def test_a_map_is_measured_by_its_cells(folder, capsys):
    room = load_scene("lab_a").room
    save_map(room_map(room.outer, room.obstacles, 0.05), folder / "lab.yaml")

    found = measured(capsys, "lab.yaml")

    assert found["place"] == "lab"
    assert found["free_m2"] == pytest.approx(115.0, abs=1.0)
    assert found["usable_m2"] == pytest.approx(62.0, abs=1.0)


@pytest.mark.parametrize("place", ["lab_b", "map"])
@pytest.mark.parametrize("form", ["svg", "png"])
@pytest.mark.few(2)
def test_a_picture_is_drawn_and_is_the_same_each_time(folder, capsys, place, form):
    if place == "map":
        room = load_scene("lab_b").room
        save_map(room_map(room.outer, room.obstacles, 0.1), folder / "map.yaml")
        place = "map.yaml"
    for name in ("one", "two"):
        assert main(["space", place, "-o", f"out/{name}.{form}"]) == OK
    shown = capsys.readouterr().out
    one, two = ((folder / f"out/{name}.{form}").read_bytes() for name in ("one", "two"))

    assert f"out/one.{form}" in shown
    assert len(one) > 5000
    assert one == two
    if form == "svg" and place == "lab_b":
        assert b"closed passage" in one


WRONG = [  # arguments, exit code, part of the message
    ("", USAGE, "SCENE|MAP"),
    ("nowhere", USAGE, "nowhere: no such scene"),
    ("lab-a", USAGE, "did you mean 'lab_a'?"),
    ("nothing.yaml", USAGE, "nothing.yaml: cannot be read"),
    ("folder/", FAILED, "folder"),
    ("binary.yaml", FAILED, "binary.yaml"),
    ("flat.yaml", FAILED, "flat.yaml:3:3: room.outer: has no area"),
    ("line.yaml", FAILED, "has the same corner twice"),
    ("lost.yaml", FAILED, "lost.pgm: cannot be read"),
    ("half.yaml", FAILED, "half.yaml:1:1: the key 'resolution' is missing"),
    ("zero.yaml", FAILED, "resolution"),
    ("lab_a --inflation 0", USAGE, "0 is not above 0 m"),
    ("lab_a --inflation nan", USAGE, "nan is not above 0 m"),
    ("lab_a --inflation wide", USAGE, "is no number of m"),
    ("lab_a --corners oval", USAGE, "invalid choice: 'oval'"),
    ("lab_a --profile nothing", USAGE, "nothing: no such profile"),
    ("lab_a -o lab.gif", USAGE, "lab.gif: unknown form; allowed: pdf, png, svg"),
    ("lab_a -o flat.yaml/x.svg", FAILED, "flat.yaml"),
    ("good.yaml --corners square", USAGE, "good.yaml: a map is inflated cell by cell"),
]
MAP = "image: {image}\norigin: [0, 0, 0]\noccupied_thresh: 0.65\nfree_thresh: 0.196\nnegate: 0\n"


@pytest.mark.parametrize(("arguments", "code", "message"), WRONG)
def test_wrong_input_is_told_without_a_traceback(folder, capsys, arguments, code, message):
    (folder / "folder").mkdir()
    (folder / "binary.yaml").write_bytes(bytes(range(256)))
    flat = ROOM.replace("[{side}, {side}]", "[{side}, 0.0]")
    (folder / "flat.yaml").write_text(
        "scene: flat\nroom:\n  outer: [[0.0, 0.0], [5.0, 0.0], [9.0, 0.0]]\n"
        "robot: {start: {x: 1, y: 1}}\n"
    )
    (folder / "line.yaml").write_text(flat.format(name="x", side=4.0, columns="[]", robot=1.0))
    (folder / "lost.yaml").write_text(MAP.format(image="lost.pgm") + "resolution: 0.05\n")
    (folder / "half.yaml").write_text(MAP.format(image="lost.pgm"))
    (folder / "zero.yaml").write_text(MAP.format(image="lost.pgm") + "resolution: 0\n")
    (folder / "good.yaml").write_text(MAP.format(image="good.pgm") + "resolution: 0.1\n")
    (folder / "good.pgm").write_bytes(b"P5\n2 2\n255\n" + bytes((254, 254, 0, 254)))

    assert main(["space", *arguments.split()]) == code

    shown = "".join(capsys.readouterr())
    assert message in shown
    assert "Traceback" not in shown


def test_a_room_without_anything_left_is_reported_and_drawn(folder, capsys):
    (folder / "tiny.yaml").write_text(
        "scene: tiny\nroom: {outer: [[0, 0], [0.5, 0], [0.5, 0.5], [0, 0.5]]}\n"
        "robot: {start: {x: 0.2, y: 0.2}}\n"
    )

    found = measured(capsys, "tiny.yaml", "-o", "tiny.svg", code=FAILED)

    assert (found["usable_m2"], found["pieces_m2"]) == (0.0, [])
    assert found["no_haptic_pose_share"] is None
    assert main(["space", "tiny.yaml"]) == FAILED
    assert "too small for all behaviours" in capsys.readouterr().out
    assert (folder / "tiny.svg").is_file()


def test_drawing_libraries_are_loaded_only_for_drawing():
    program = (
        "import sys\n"
        "from cobodeck.__main__ import main\n"
        "main(['space', 'lab_a'])\n"
        "import cobodeck.commands.render\n"
        "sys.exit('matplotlib' in sys.modules)"
    )

    result = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True)

    assert result.returncode == 0, result.stderr


def test_a_colour_on_the_floor_is_the_one_in_the_legend():
    scene = load_scene("lab_a")
    floor = RoomFloor(scene.room)
    share = np.array([0.0, 0.25, 0.5, 1.0])
    places = Untouchable(np.array([1.0, 1.5, 2.0, 2.5]), np.full(4, 3.0), share, 0.5)
    on = space_picture(floor, measure(floor, 1.0), places, "lab_a", "")
    (image,) = on.axes.images
    shown = image.get_array()[0]

    assert list(shown[:, 3]) == [0.0, 1.0, 1.0, 1.0]
    words = ("… in a quarter", "… in half of the directions", "no Haptic pose in any direction")
    legend = [on.legend[text].get_facecolor() for text in words]
    assert shown[1:].tolist() == pytest.approx(np.array(legend))
    faces = [tuple(patch.get_facecolor()) for patch in on.axes.patches]
    assert tuple(on.legend["1 m from walls"].get_facecolor()) in faces
    assert all(patch.get_alpha() is None for patch in on.axes.patches)
