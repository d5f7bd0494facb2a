"""Whatever is typed, the program says what is wrong and how it ends; it never shows a traceback."""

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import cobodeck.commands.list
from cobodeck.__main__ import COMMANDS, main
from cobodeck.commands.list import listing
from cobodeck.project.state_catalogue import catalogue
from cobodeck.terminal.console import FAILED, OK, USAGE

ROOT = Path(__file__).resolve().parents[3]
CHART = """
chart: mine
outcomes: [done]
states:
  park: {do: ParkArm, next: {parked: .done, failed: .done, error: .done}}
"""


HALL = "room: {outer: [[0, 0], [9, 0], [9, 9], [0, 9]]}\n"
MAP = "resolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
FILES = {
    "flat.yaml": "scene: x\nroom: {outer: [[0, 0], [9, 0], [5, 0]]}\n"
    "robot: {start: {x: 1, y: 0}}\n",
    "bowtie.yaml": "scene: x\nroom: {outer: [[0, 0], [9, 9], [9, 0], [0, 9]]}\n"
    "robot: {start: {x: 4, y: 4}}\n",
    "in_wall.yaml": f"scene: x\n{HALL}robot: {{start: {{x: 0.1, y: 4}}}}\n",
    "outside.yaml": f"scene: x\n{HALL}robot: {{start: {{x: 20, y: 4}}}}\n",
    "user_out.yaml": f"scene: x\n{HALL}robot: {{start: {{x: 4, y: 4}}}}\n"
    "user: {source: random, start: {x: 50, y: 5}}\n",
    "nobody.yaml": f"scene: x\n{HALL}robot: {{start: {{x: 4, y: 4}}}}\n"
    "user: {source: nobody, start: {x: 5, y: 5}}\n",
    "no_robot.yaml": f"scene: x\n{HALL}robot: {{file: rbkairos_ur1, start: {{x: 4, y: 4}}}}\n",
    "nan_user.yaml": "user: u\nstart: {x: .nan, y: 4}\nsteps: [{stand: 1}]\n",
    "no_steps.yaml": "user: u\nstart: {x: 5, y: 4}\nsteps: []\n",
    "far_walk.yaml": "user: u\nstart: {x: 5, y: 4}\nsteps: [{walk: {x: 300, y: 2, speed: 1}}]\n",
    "header.csv": "id,t,x,y\n",
    "one.csv": "id,t,x,y\n1,0,1,1\n",
    "backwards.csv": "id,t,x,y\n1,0,1,1\n1,1,2,1\n1,0.5,3,1\n",
    "nan.csv": "id,t,x,y\n1,0,1,1\n1,1,nan,1\n",
    "no_image.yaml": f"image: nothing.pgm\n{MAP}",
    "cut_off.yaml": f"image: cut_off.pgm\n{MAP}",
    "cut_off.pgm": "P5\n100 100\n255\nabc",
    "no_size.yaml": f"image: no_size.pgm\n{MAP}",
    "no_size.pgm": "P5\n0 0\n255\n",
    "not_a_map.yaml": f"image: walk.csv\n{MAP}",
    "folder_map.yaml": f"image: folder\n{MAP}",
    "rover.yaml": "connection: rover\nmodel: rbkairos_ur10\n"
    'parts: {base: {driver: "hw.nothing:Base"}}\n',
    "negative.yaml": f"image: cut_off.pgm\n{MAP.replace('0.05', '-0.05')}",
}


@pytest.fixture
def folder(folder: Path) -> Path:
    (folder / "mine.yaml").write_text(CHART)
    (folder / "binary.yaml").write_bytes(bytes(range(256)) * 40)
    (folder / "empty.yaml").write_text("")
    (folder / "list.yaml").write_text("- 1\n- 2\n")
    (folder / "folder").mkdir()
    (folder / "walk.csv").write_text("id,t,x,y\n1,0,a,b\n")
    (folder / "scene.yaml").write_text("scene: x\nroom: nowhere\n")
    (folder / "profile.yaml").write_text("profile: x\nabout: y\nrobot: 5\n")
    near = "profile: near\nbase: tuned\nnavigation: {escape: {inflation: 30 cm}}\n"
    (folder / "near.yaml").write_text(near)
    os.mkfifo(folder / "pipe.yaml")
    os.mkfifo(folder / "pipe.csv")
    for name, text in FILES.items():
        (folder / name).write_text(text)
    return folder


WRONG = [  # arguments, exit code, part of the message
    ("", USAGE, "usage: cobodeck"),
    ("validat", USAGE, "did you mean 'validate'"),
    ("validate nothing.yaml", USAGE, "nothing.yaml: no such file or folder"),
    ("validate folder", USAGE, "folder: no charts, scenes, robots … in this folder"),
    ("validate binary.yaml", FAILED, "binary.yaml:2:118: error"),
    ("validate empty.yaml", FAILED, "empty.yaml:1:1: error"),
    ("validate list.yaml", FAILED, "list.yaml:1:1: error"),
    ("validate scene.yaml", FAILED, "scene.yaml:"),
    ("validate profile.yaml", FAILED, "profile.yaml:"),
    ("validate in_wall.yaml", FAILED, "robot.start: (0.1, 4, 0): the robot would touch a wall"),
    ("validate outside.yaml", FAILED, "outside.yaml:3:9: error[D01] robot.start: (20, 4)"),
    ("validate nobody.yaml", FAILED, "nobody: no such user"),
    ("validate no_robot.yaml", FAILED, "did you mean 'rbkairos_ur10'"),
    ("validate --format xml", USAGE, "invalid choice: 'xml'"),
    ("render", USAGE, "CHART"),
    ("render chasse", USAGE, "did you mean 'chase'"),
    ("render folder", USAGE, "no chart 'folder'"),
    ("render nothing.yaml", USAGE, "nothing.yaml: no such file"),
    ("render list.yaml", FAILED, "list.yaml:1:1: error"),
    ("render mine.yaml -o mine.gif", USAGE, "unknown form; allowed: dot, mmd, pdf, png, svg"),
    ("render mine.yaml -o folder/mine.yaml/x.dot", OK, "x.dot"),
    ("render mine.yaml -o mine.yaml/x.dot", FAILED, "mine.yaml"),
    ("list things", USAGE, "invalid choice: 'things'"),
    ("simulate nothing", USAGE, "no chart 'nothing'"),
    ("simulate list.yaml", FAILED, "list.yaml cannot run"),
    ("simulate mine.yaml --scene nowhere", USAGE, "nowhere: no such scene"),
    ("simulate mine.yaml --scene scene.yaml", FAILED, "scene.yaml:"),
    ("simulate mine.yaml --scene folder/", FAILED, "folder"),
    ("simulate mine.yaml --profile nothing", USAGE, "nothing: no such profile"),
    ("simulate mine.yaml --profile profile.yaml", FAILED, "profile.yaml:"),
    ("simulate mine.yaml --user nobody", USAGE, "nobody: no such user"),
    ("simulate mine.yaml --user randm", USAGE, "randm: no such user; did you mean 'random'?"),
    ("simulate mine.yaml --user walk.csv", FAILED, "walk.csv:2:1: 'a' is not a number"),
    ("simulate mine.yaml --user nothing.csv", USAGE, "nothing.csv: cannot be read"),
    ("simulate mine.yaml --user walk.csv@1,2", FAILED, "needs three numbers"),
    ("simulate mine.yaml --requests 0", USAGE, "0 is not above 0"),
    ("simulate mine.yaml --tier 7", USAGE, "invalid choice: 7"),
    ("simulate mine.yaml --seed x", USAGE, "invalid int value: 'x'"),
    ("run mine.yaml", USAGE, "--robot"),
    ("run mine.yaml --robot rbkairos_ur10", USAGE, "is a body without drivers; connections: "),
    ("simulate --tick-hz 10", USAGE, "stops the base if that is not less than 80 ms"),
    ("run mine.yaml --robot mokc", USAGE, "no such connection; did you mean 'mock'"),
    ("run mine.yaml --robot rover.yaml --fast", USAGE, "rover.yaml runs in real time"),
    ("render x.mcap", USAGE, "x.mcap: cannot be read: No such file"),
    ("compare x.mcap y.mcap", USAGE, "x.mcap: cannot be read: No such file"),
    ("recover x.mcap.part", USAGE, "No such file"),
    ("localize x.log", USAGE, "No such file"),
    ("calibrate x.log", USAGE, "No such file"),
    ("reach --robot nobody", USAGE, "nobody: no such robot"),
    ("space nowhere", USAGE, "nowhere: no such scene"),
    ("space lab_a --inflation 0", USAGE, "above 0"),
    ("space lab_a --inflation nan", USAGE, "above 0"),
    ("space lab_a --set navigation.haptic.inflatio=1", USAGE, "did you mean 'inflation'"),
    ("doctor --scene lab_a --set robot.base_speed=fast", USAGE, "'fast' is not a speed"),
    ("render --scene lab_a --set chase=1", USAGE, "--set chase=1"),
    ("new mine.yaml/x-1", FAILED, "mine.yaml"),
    ("new engine", USAGE, "a module 'engine' is there already"),
    ("new 1", USAGE, "'1' cannot name a package"),
    ("simulate --scene flat.yaml", FAILED, "flat.yaml:2:8: room.outer"),
    ("simulate --scene bowtie.yaml", FAILED, "crosses itself"),
    ("simulate --scene in_wall.yaml --user random", FAILED, "the robot would touch a wall"),
    ("simulate --scene outside.yaml", FAILED, "(20, 4) is not on the free floor"),
    ("simulate --scene user_out.yaml", FAILED, "(50, 5) is not on the free floor"),
    ("simulate --scene lab_c", USAGE, "did you mean 'lab_b'"),
    ("simulate --profile tunde", USAGE, "did you mean 'tuned'"),
    ("simulate --profile near.yaml", FAILED, "0.3 m is too little for rbkairos_ur10"),
    ("validate near.yaml", FAILED, "near.yaml:3:34: error[D01] navigation.escape.inflation"),
    ("simulate --scene pipe.yaml", FAILED, "pipe.yaml: cannot be read: it is no regular file"),
    ("simulate --profile pipe.yaml", FAILED, "it is no regular file"),
    ("simulate --user pipe.yaml", FAILED, "it is no regular file"),
    ("simulate --user pipe.csv", FAILED, "it is no regular file"),
    ("simulate --user dem", USAGE, "did you mean 'demo'"),
    ("simulate --user nan_user.yaml", FAILED, "nan_user.yaml:2:12: start.x: '.nan' is not"),
    ("simulate --user no_steps.yaml", FAILED, "no_steps.yaml:3:1: steps: is an empty list"),
    ("simulate --user far_walk.yaml", FAILED, "leaves the free floor"),
    ("simulate --user header.csv", FAILED, "header.csv: holds no data"),
    ("simulate --user one.csv", FAILED, "one.csv:2:1: is the only row"),
    ("simulate --user backwards.csv", FAILED, "backwards.csv:4:1: time 0.5 is not after 1.0"),
    ("simulate --user nan.csv", FAILED, "nan.csv:3:1: 'nan' is not a finite number"),
    ("simulate --user folder/", FAILED, "Is a directory"),
    ("simulate --user=", USAGE, "--user: is empty"),
    ("simulate --scene=", USAGE, "--scene: is empty"),
    ("simulate --profile=", USAGE, "--profile: is empty"),
    ("simulate --requests -1", USAGE, "-1 is not above 0"),
    ("simulate --requests x", USAGE, "'x' is no whole number"),
    ("simulate --duration nan", USAGE, "nan is not above 0 s"),
    ("simulate --duration inf", USAGE, "inf is not above 0 s"),
    ("simulate --duration -5", USAGE, "-5 is not above 0 s"),
    ("simulate --duration 0", USAGE, "0 is not above 0 s"),
    ("simulate --stretch 0", USAGE, "0 is not above 0 m"),
    ("simulate --tick-hz 0", USAGE, "0 is not above 0"),
    ("simulate --duration 1 --record folder", USAGE, "folder exists; it is not written over"),
    ("simulate --duration 1 --record mine.yaml", USAGE, "mine.yaml exists"),
    ("simulate --duration 1 --record mine.yaml/x", FAILED, "no trace file: mine.yaml: Not a dir"),
    ("run mine.yaml --robot mock --requests 0", USAGE, "0 is not above 0"),
    ("run mine.yaml --robot mock --duration nan", USAGE, "nan is not above 0 s"),
    ("run mine.yaml --robot mock --record x.jsonl", USAGE, "'x.jsonl' does not end in .mcap"),
    ("replay x.mcap --record x.txt", USAGE, "'x.txt' does not end in .mcap"),
    ("recover x.mcap.part -o x.mcap.part", USAGE, "'x.mcap.part' does not end"),
    ("render x.mcap --from 1s", USAGE, "1s is no time, s"),
    ("render x.mcap --scene hall", USAGE, "leave out --scene"),
    ("render chase --to 9", USAGE, "--from and --to are for records of runs"),
    ("replay x.mcap", USAGE, "x.mcap: cannot be read: No such file"),
    ("replay walk.csv", FAILED, "walk.csv: is no record of a run: it is no MCAP file; `run`"),
    ("space no_image.yaml", FAILED, "nothing.pgm: cannot be read"),
    ("space cut_off.yaml", FAILED, "cut_off.pgm: is cut off: 3 of 10000 pixels, for 100 x 100"),
    ("space no_size.yaml", FAILED, "no_size.pgm: has no valid header with a width and height"),
    ("space not_a_map.yaml", FAILED, "walk.csv: is neither PGM"),
    ("space folder_map.yaml", FAILED, "folder: cannot be read: Is a directory"),
    ("space negative.yaml", FAILED, "negative.yaml:2:13: resolution: -0.05"),
    ("space lab_a --inflation -1", USAGE, "-1 is not above 0 m"),
    ("space lab_a --inflation 1e308", USAGE, "up to 1000 m"),
    ("space lab_a -o folder", USAGE, "folder: unknown form"),
    ("space hall -o mine.yaml/x.svg", FAILED, "mine.yaml"),
    ("render --scene lab_a --at nan", USAGE, "nan is no time"),
    ("render --scene lab_x", USAGE, "did you mean 'lab_"),
    ("render --scene hall -o mine.yaml/x.svg", FAILED, "mine.yaml"),
    ("reach --height nan", USAGE, "nan is no length"),
    ("reach --height -1", USAGE, "-1 does not go upwards"),
    ("reach --tolerance -1", USAGE, "-1 is no length"),
    ("reach --tool folder", USAGE, "cobodeck: folder: no such prop"),
    ("schema -o folder", FAILED, "folder: Is a directory"),
    ("doctor --scene lab_x", USAGE, "did you mean 'lab_"),
    ("doctor --scene hall --profile tunde", USAGE, "did you mean 'tuned'"),
    ("doctor --scene=", USAGE, "--scene: is empty"),
    ("doctor all", USAGE, "unrecognized arguments: all"),
    ("bench navigation --rounds 0", USAGE, "0 is not above 0"),
    ("bench --show folder", FAILED, "folder: Is a directory"),
    ("bench engin", USAGE, "did you mean 'engine'"),
    ("bench --show mine.yaml", USAGE, "mine.yaml: not the output of"),
    ("bench --show nothing.json", USAGE, "nothing.json: No such file"),
]


@pytest.mark.parametrize(("arguments", "code", "message"), WRONG)
@pytest.mark.few(20)
def test_wrong_input_is_told_without_a_traceback(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: str,
    code: int,
    message: str,
) -> None:
    assert main(arguments.split()) == code

    shown = "".join(capsys.readouterr())
    assert message in shown
    assert "Traceback" not in shown


@pytest.mark.parametrize(
    "words", [["compare", "a.mcap", "b\0.mcap"], ["simulate", "--record", "\0.mcap"], ["\0"]]
)
def test_no_name_has_a_nul(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == USAGE
    assert "character NUL" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (OSError(errno.ENOSPC, "No space left", "x.svg"), "x.svg: No space left"),
        (OSError(errno.ENOSPC, "No space left"), "file: No space left"),
        (OSError("is gone"), "file: is gone"),
    ],
)
def test_whatever_the_system_refuses_is_told_with_the_file_if_it_is_known(
    error: OSError, told: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refused(_: object) -> int:
        raise error

    monkeypatch.setattr(cobodeck.commands.list, "run", refused)

    assert main(["list", "users"]) == FAILED
    assert capsys.readouterr().err == f"cobodeck: {told}\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--help"]) == OK

    assert f"usage: cobodeck {command}" in capsys.readouterr().out


def test_a_closed_pipe_is_no_error() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "cobodeck", "list", "states"]

    result = subprocess.run(
        command, cwd=ROOT, stdout=writer, stderr=subprocess.PIPE, text=True, check=False
    )

    os.close(writer)
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize(
    "kind", ["states", "signals", "charts", "scenes", "users", "profiles", "robots"]
)
def test_lists_name_everything_and_say_what_it_is(
    kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["list", kind, "--json"]) == OK
    found = json.loads(capsys.readouterr().out)[kind]
    assert main(["list", kind]) == OK
    shown = capsys.readouterr().out

    assert found
    for item in found:
        assert str(next(iter(item.values()))) in shown


def test_a_chart_is_listed_with_the_values_that_a_run_uses_and_where_they_come_from(
    capsys: pytest.CaptureFixture[str],
) -> None:
    by = ["--profile", "paper", "--set", "chase.room=2 m", "--set", "charts.chase.far=6 m"]
    assert main(["list", "charts", "chase", *by, "--json"]) == OK
    (chase,) = json.loads(capsys.readouterr().out)["charts"]
    assert main(["list", "charts", "chase", *by]) == OK
    shown = " ".join(capsys.readouterr().out.split())

    found = {name: (one["value"], one["origin"]) for name, one in chase["parameters"].items()}
    assert found["near"] == ("3 m", "paper: chase.near")
    assert found["room"] == ("2 m", "--set chase.room=2 m")
    assert found["far"] == ("6 m", "--set charts.chase.far=6 m")
    assert found["patience"] == ("20 s", "")
    assert "near length; default 3 m; from paper: chase.near: …" in shown
    assert "patience duration; default 20 s: Give up" in shown


def test_a_name_that_is_not_in_a_list_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "charts", "chse"]) == USAGE
    assert "did you mean 'chase'" in capsys.readouterr().err


def test_scenes_are_listed_with_their_places(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "scenes", "--json"]) == OK
    scenes = json.loads(capsys.readouterr().out)["scenes"]
    places = {scene["scene"]: scene["places"] for scene in scenes}

    assert places["hall"][:2] == ["south_west", "south_east"]
    assert {"corner", "center"} <= set(places["lab_a"])


@pytest.mark.parametrize("width", [60, 80, 120])
@pytest.mark.parametrize("kind", ["states", "signals", "charts", "scenes", "robots", "users"])
def test_lists_fit_the_terminal_and_leave_nothing_out(
    kind: str, width: int, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["list", kind, "--json"]) == OK
    found = json.loads(capsys.readouterr().out)[kind]

    shown = listing(found, width)

    assert max(map(len, shown.splitlines())) <= width
    printed = "".join(shown.split())  # a path longer than a line goes on in the next one
    for item in found:
        for value in item.values():
            told = ", ".join(value) if isinstance(value, list) else value
            if isinstance(value, dict):
                told = " ".join(f"{name}: {one['value']}" for name, one in value.items())
            assert all(word in printed for word in told.split())


def test_a_list_that_is_piped_is_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "states"]) == OK

    header, *rows = capsys.readouterr().out.splitlines()
    assert header.split()[0] == "state"
    assert len(rows) == len(catalogue().classes)


def test_a_chart_is_drawn_where_it_is_wanted(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for form, begin in (("svg", b"<"), ("dot", b"digraph"), ("mmd", b"flowchart")):
        assert main(["render", "mine.yaml", "-o", f"pictures/mine.{form}"]) == OK

        content = (folder / f"pictures/mine.{form}").read_bytes()
        assert begin in content[:60]
        assert b"ParkArm" in content


def test_a_picture_too_large_to_draw_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for level in range(9):
        nodes = "".join(
            f"  a{n}: {{use: level{level - 1}, next: {{done: a{n + 1}}}}}\n" for n in range(10)
        )
        (folder / f"level{level}.yaml").write_text(
            f"chart: level{level}\noutcomes: [done]\nstates:\n{nodes}"
            "  a10: {do: ParkArm, next: {parked: .done, failed: .done}}\n"
        )

    assert main(["render", "level8.yaml", "--depth", "-1", "-o", "level8.dot"]) == USAGE
    assert "choose a smaller --depth" in capsys.readouterr().err
    assert main(["render", "level8.yaml", "--depth", "2", "-o", "level8.dot"]) == OK
