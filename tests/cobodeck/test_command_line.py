"""Whatever is typed, the program says what is wrong and how it ends; it never shows a traceback."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from cobodeck.__main__ import COMMANDS, main
from cobodeck.console import FAILED, OK, REFUSED, USAGE

ROOT = Path(__file__).resolve().parents[2]
CHART = """
chart: mine
outcomes: [done]
states:
  park: {do: ParkArm, next: {parked: .done, failed: .done, error: .done}}
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text(CHART)
    (tmp_path / "binary.yaml").write_bytes(bytes(range(256)) * 40)
    (tmp_path / "empty.yaml").write_text("")
    (tmp_path / "list.yaml").write_text("- 1\n- 2\n")
    (tmp_path / "folder").mkdir()
    (tmp_path / "walk.csv").write_text("id,t,x,y\n1,0,a,b\n")
    (tmp_path / "scene.yaml").write_text("scene: x\nroom: nowhere\n")
    (tmp_path / "profile.yaml").write_text("profile: x\nabout: y\nrobot: 5\n")
    return tmp_path


WRONG = [  # arguments, exit code, part of the message
    ("", USAGE, "usage: cobodeck"),
    ("validat", USAGE, "did you mean 'validate'"),
    ("validate nothing.yaml", FAILED, "nothing.yaml: no such file or folder"),
    ("validate binary.yaml", FAILED, "binary.yaml:2:118: error"),
    ("validate empty.yaml", FAILED, "empty.yaml:1:1: error"),
    ("validate list.yaml", FAILED, "list.yaml:1:1: error"),
    ("validate scene.yaml", FAILED, "scene.yaml:"),
    ("validate profile.yaml", FAILED, "profile.yaml:"),
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
    ("simulate mine.yaml --scene nowhere", FAILED, "nowhere: no such scene"),
    ("simulate mine.yaml --scene scene.yaml", FAILED, "scene.yaml:"),
    ("simulate mine.yaml --scene folder/", FAILED, "folder"),
    ("simulate mine.yaml --profile nothing", FAILED, "nothing: no such profile"),
    ("simulate mine.yaml --profile profile.yaml", FAILED, "profile.yaml:"),
    ("simulate mine.yaml --user nobody", FAILED, "nobody: no such user"),
    ("simulate mine.yaml --user walk.csv", FAILED, "walk.csv:2: 'a' is not a number"),
    ("simulate mine.yaml --user nothing.csv", FAILED, "nothing.csv: cannot be read"),
    ("simulate mine.yaml --user walk.csv@1,2", FAILED, "needs three numbers"),
    ("simulate mine.yaml --requests 0", USAGE, "0 is not above 0"),
    ("simulate mine.yaml --tier 7", USAGE, "invalid choice: 7"),
    ("simulate mine.yaml --seed x", USAGE, "invalid int value: 'x'"),
    ("run mine.yaml", USAGE, "--robot"),
    ("run mine.yaml --robot rbkairos_ur10", REFUSED, "nothing drives a real robot yet"),
    ("space nowhere", FAILED, "nowhere: no such scene"),
    ("space lab_a --inflation 0", USAGE, "above 0"),
    ("space lab_a --inflation nan", USAGE, "above 0"),
    ("new mine.yaml/x-1", FAILED, "mine.yaml"),
    ("new engine", USAGE, "a module 'engine' is there already"),
    ("new 1", USAGE, "'1' cannot name a package"),
    ("bench engin", USAGE, "did you mean 'engine'"),
    ("bench --show mine.yaml", USAGE, "mine.yaml: not the output of"),
    ("bench --show nothing.json", FAILED, "nothing.json: No such file"),
]


@pytest.mark.parametrize(("arguments", "code", "message"), WRONG)
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
    found = json.loads(capsys.readouterr().out)
    assert main(["list", kind]) == OK
    shown = capsys.readouterr().out

    assert found
    for item in found:
        assert str(next(iter(item.values()))) in shown


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
