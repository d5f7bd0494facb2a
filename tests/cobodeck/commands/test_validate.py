"""Charts, scenes, robots and profiles are checked together, without loading what runs them."""

import io
import json
import os
import re
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.project.named_files import EXAMPLES
from cobodeck.terminal.console import FAILED, OK, USAGE

ROOT = Path(__file__).resolve().parents[3]
HEAVY = ("numpy", "numba", "scipy", "networkx", "shapely", "jsonschema", "pygraphviz", "email")
PARK = "  park: {do: ParkArm, next: {parked: .done, failed: .done%s}}\n"
GOOD = "chart: NAME\noutcomes: [done]\nstates:\n" + PARK % ", error: .done"
WARNED = "chart: warned\noutcomes: [done]\nstates:\n" + PARK % ""


@pytest.fixture(scope="module")
def shipped() -> tuple[int, str]:
    """Exit code and report of all that is shipped, which takes some seconds."""
    with redirect_stdout(io.StringIO()) as report:
        code = main(["validate"])
    return code, report.getvalue()


def test_everything_shipped_is_right(shipped: tuple[int, str]) -> None:
    code, report = shipped

    assert code == OK, report


FOLDERS = ("charts", "hw", "cobodeck/campaign")


def test_validating_loads_neither_numbers_nor_schemas() -> None:
    program = (
        "import sys; from cobodeck.__main__ import main; main(['validate', 'charts', 'hw']);"
        f"print([name for name in {HEAVY!r} if name in sys.modules])"
    )

    result = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )

    assert result.stdout.splitlines()[-1] == "[]"


def test_a_folder_gives_every_file_that_is_something(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "deep" / "deeper").mkdir(parents=True)
    (tmp_path / "deep" / "deeper" / "good.yaml").write_text(GOOD.replace("NAME", "good"))
    (tmp_path / "deep" / "bad.yml").write_text(
        GOOD.replace("NAME", "bad").replace("ParkArm", "ParkArms")
    )
    (tmp_path / "compose.yaml").write_text("services: {db: {image: x}}\n")
    (tmp_path / ".hidden").mkdir()
    (tmp_path / ".hidden" / "bad.yaml").write_text("chart: 1\n")
    monkeypatch.chdir(tmp_path)

    assert main(["validate", "."]) == FAILED

    shown = capsys.readouterr().out
    assert "deep/bad.yml:4:14: error" in shown
    assert "did you mean 'ParkArm'?" in shown
    assert shown.endswith("1 error in 2 files\n")


def test_warnings_are_errors_if_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "warned.yaml").write_text(WARNED)

    assert main(["validate", str(tmp_path)]) == OK
    assert "warning[" in capsys.readouterr().out
    assert main(["validate", "--strict", str(tmp_path)]) == FAILED
    assert "error[" in capsys.readouterr().out


def test_charts_are_found_beside_the_one_that_uses_them(tmp_path: Path) -> None:
    (tmp_path / "helper.yaml").write_text(GOOD.replace("NAME", "helper"))
    user = "chart: user\noutcomes: [done]\nstates:\n  a: {use: helper, next: {done: .done}}\n"
    (tmp_path / "user.yaml").write_text(user)

    assert main(["validate", str(tmp_path / "user.yaml")]) == OK


def test_an_error_in_a_used_chart_is_told_where_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "helper.yaml").write_text(GOOD.replace("NAME", "helper").replace("Arm", "Leg"))
    user = "chart: user\noutcomes: [done]\nstates:\n  a: {use: helper, next: {done: .done}}\n"
    (tmp_path / "user.yaml").write_text(user)

    assert main(["validate", str(tmp_path / "user.yaml")]) == FAILED
    assert "helper.yaml:4:14: error" in capsys.readouterr().out


def test_a_slip_in_the_name_of_a_used_chart_is_seen(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "helper.yaml").write_text(GOOD.replace("NAME", "helper"))
    user = "chart: user\noutcomes: [done]\nstates:\n  a: {use: helpr, next: {done: .done}}\n"
    (tmp_path / "user.yaml").write_text(user)

    assert main(["validate", str(tmp_path / "user.yaml")]) == FAILED
    assert "did you mean 'helper'?" in capsys.readouterr().out


def test_a_pipe_beside_a_chart_is_not_waited_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "good.yaml").write_text(GOOD.replace("NAME", "good"))

    assert main(["validate", str(tmp_path)]) == OK
    assert main(["validate", str(tmp_path / "good.yaml")]) == OK
    assert main(["validate", str(tmp_path / "pipe.yaml")]) == FAILED
    assert "is no regular file" in capsys.readouterr().err


def test_a_copy_of_a_shipped_chart_goes_before_the_shipped_one(tmp_path: Path) -> None:
    copy = tmp_path / "escape.yaml"
    copy.write_text((ROOT / "charts" / "escape.yaml").read_text())

    assert main(["validate", str(copy)]) == OK


@pytest.mark.parametrize("form", ["json", "sarif", "github"])
def test_findings_for_programs_have_the_same_places(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], form: str
) -> None:
    (tmp_path / "bad.yaml").write_text("scene: bad\nroom: lab_a\nrobot: {start: {x: 99, y: 0}}\n")

    assert main(["validate", "--format", form, str(tmp_path)]) == FAILED

    shown = capsys.readouterr().out
    if form == "json":
        (finding,) = json.loads(shown)["findings"]
        assert (finding["code"], finding["line"]) == ("D01", 3)
        assert "not on the free floor" in finding["message"]
    elif form == "sarif":
        (result,) = json.loads(shown)["runs"][0]["results"]
        region = result["locations"][0]["physicalLocation"]["region"]
        assert region["startLine"] == 3
    else:
        assert shown.startswith("::error file=")
        assert "line=3" in shown


def told(
    capsys: pytest.CaptureFixture[str], *paths: Path
) -> list[tuple[str, int, str, list[tuple[str, int]]]]:
    """File, line, first word and notes of each finding."""
    assert main(["validate", "--json", *map(str, paths)]) == FAILED
    return [
        (
            Path(found["file"]).name,
            found["line"],
            found["message"].partition(":")[0],
            [(Path(note["file"]).name, note["line"]) for note in found["related"]],
        )
        for found in json.loads(capsys.readouterr().out)["findings"]
    ]


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """A scene with its own robot, prop and user, each with one mistake or two."""
    robot = (ROOT / "hw/robots/rbkairos_ur10.yaml").read_text()
    robot = robot.replace("prop: prop", "prop: ./held.yaml").replace("mass: 130.0", "mass: 0.13")
    (tmp_path / "body.yaml").write_text(robot)
    prop = (ROOT / "hw/props/prop.yaml").read_text()
    (tmp_path / "held.yaml").write_text(prop.replace("mass: 1.0", "mass: -5 kg"))
    steps = "steps:\n  - stand: 3 m\n  - walk: {x: 1}\n"
    (tmp_path / "someone.yaml").write_text(f"user: someone\n{steps}")
    scene = "room: lab_a\nrobot: {file: ./body.yaml, start: {x: 3, y: 5}}\nuser: {source: "
    (tmp_path / "room.yaml").write_text(f"scene: room\n{scene}./someone.yaml}}\n")
    return tmp_path


def test_mistakes_of_named_files_are_shown_in_them_with_notes_of_who_names_them(
    own: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert told(capsys, own / "room.yaml") == [
        ("body.yaml", 3, "mass", [("room.yaml", 3)]),
        ("held.yaml", 3, "mass", [("body.yaml", 27), ("room.yaml", 3)]),
        ("someone.yaml", 3, "steps[0].stand", [("room.yaml", 4)]),
        ("someone.yaml", 4, "steps[1].walk", [("room.yaml", 4)]),
    ]


def test_mistakes_that_several_files_bring_up_are_shown_once(
    own: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert told(capsys, own) == [
        ("body.yaml", 3, "mass", []),
        ("held.yaml", 3, "mass", []),
        ("someone.yaml", 3, "steps[0].stand", []),
        ("someone.yaml", 4, "steps[1].walk", []),
    ]


def test_the_line_of_a_mistake_in_a_named_file_is_shown(
    own: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["validate", str(own / "room.yaml")]) == FAILED

    shown = capsys.readouterr().out
    assert "mass: -5 kg" in shown
    assert "robot: {file: ./body.yaml" in shown


def test_props_calibrations_and_arms_are_checked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for folder, name, old, new in (
        ("hw/props", "prop", "radius: 0.05", "radius: 5"),
        ("hw/calibrations", "robotnik_ur10", "roll", "rol"),
        ("hw/arms", "ur10", "speed: 120 deg/s", "speed: 209"),
    ):
        text = (ROOT / folder / f"{name}.yaml").read_text()
        (tmp_path / f"{name}.yaml").write_text(text.replace(old, new, 1))

    assert [(file, line) for file, line, _, _ in told(capsys, tmp_path)] == [
        ("prop.yaml", 6), ("robotnik_ur10.yaml", 6), ("ur10.yaml", 10)
    ]  # fmt: skip


def test_everything_shipped_is_looked_at(shipped: tuple[int, str]) -> None:
    count = int(re.search(r"in (\d+) files", shipped[1])[1])  # type: ignore[index]
    files = [file for folder in FOLDERS for file in (ROOT / folder).rglob("*.yaml")]
    assert count == sum(EXAMPLES not in file.parents for file in files)  # a project of its own


def test_a_profile_goes_with_a_robot_beside_it_or_with_a_shipped_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line, profile = 3, "profile: mine\nbase: tuned\nnavigation: {escape: {inflation: 50 cm}}\n"
    (tmp_path / "mine.yaml").write_text(profile)
    assert [found[1] for found in told(capsys, tmp_path)] == [line]

    robot = (ROOT / "hw/robots/rbkairos_ur10.yaml").read_text()
    (tmp_path / "small.yaml").write_text(robot)
    assert [found[1] for found in told(capsys, tmp_path)] == [line]
    small = robot.replace("length: 1.13", "length: 0.6").replace("width: 0.91", "width: 0.5")
    (tmp_path / "small.yaml").write_text(small)
    assert main(["validate", str(tmp_path)]) == OK


def test_what_a_chart_can_do_is_counted(shipped: tuple[int, str]) -> None:
    found = r"paper_cobodeck: \d+ configurations, \d+ edges, complete"
    assert re.search(found, shipped[1])


MODELINE = "# yaml-language-server: $schema=s.json\n"


@pytest.mark.parametrize(
    ("content", "note"),
    [
        (None, "s.json, which is not there; `cobodeck schema -o"),
        ("{}", "s.json: is not up to date, editors complete from it; `cobodeck schema -o"),
        ("current", ""),
    ],
)
def test_a_missing_or_stale_schema_of_the_editor_is_a_note(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str | None, note: str
) -> None:
    (tmp_path / "good.yaml").write_text(MODELINE + GOOD.replace("NAME", "good"))
    if content == "current":
        assert main(["schema", "-o", str(tmp_path / "s.json")]) == OK
    elif content is not None:
        (tmp_path / "s.json").write_text(content)
    capsys.readouterr()

    assert main(["validate", "--strict", str(tmp_path)]) == OK

    shown = capsys.readouterr().out
    assert ("note: " in shown) == bool(note)
    assert note in shown


@pytest.mark.parametrize("written", [None, "{}"])
def test_a_missing_or_stale_schema_of_a_scene_is_a_note_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], written: str | None
) -> None:
    scene = (ROOT / "hw/scenes/lab_a.yaml").read_text()
    (tmp_path / "own.yaml").write_text(MODELINE + scene)
    if written is not None:
        (tmp_path / "s.json").write_text(written)
    assert main(["validate", str(tmp_path)]) == OK
    assert f"`cobodeck schema scene -o {tmp_path / 's.json'}`" in capsys.readouterr().out
    assert main(["schema", "scene", "-o", str(tmp_path / "s.json")]) == OK
    assert main(["validate", str(tmp_path)]) == OK
    assert "note: " not in capsys.readouterr().out


@pytest.mark.parametrize("strict", [[], ["--strict"]])
def test_a_pose_in_the_old_way_is_a_note_also_where_another_file_names_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], strict: list[str]
) -> None:
    robot = (ROOT / "hw/robots/rbkairos_ur10.yaml").read_text()
    held = (ROOT / "hw/props/prop.yaml").read_text()
    old = held.replace(
        "{x: 0, y: 0, z: 0.15, pitch: 90 deg}", "{xyz: [0, 0, 0.15], rpy: [0, 1, 0]}"
    )
    assert old != held
    (tmp_path / "own.yaml").write_text(robot.replace("prop: prop", "prop: ./held.yaml"))
    (tmp_path / "held.yaml").write_text(old)

    assert main(["validate", *strict, "--json", str(tmp_path)]) == OK

    (note,) = json.loads(capsys.readouterr().out)["findings"]
    assert (Path(note["file"]).name, note["line"], note["severity"]) == ("held.yaml", 4, "note")
    assert note["hint"] == "write `{x: 0, y: 0, z: 0.15, pitch: 1}`"


@pytest.fixture
def touching(tmp_path):
    """Robots whose folded arm touches the rover, by its mount, and itself, by its prop."""
    robot = (ROOT / "hw/robots/rbkairos_ur10.yaml").read_text()
    held = (ROOT / "hw/props/prop.yaml").read_text()
    bent = re.sub(r"ur10: \[[^]]*\]", "ur10: [0, -1.2, 3.1, -1.5, 1.5, 0]", held)
    (tmp_path / "held.yaml").write_text(bent)
    (tmp_path / "low.yaml").write_text(robot.replace("z: 0.511", "z: 0.4"))
    (tmp_path / "bent.yaml").write_text(robot.replace("prop: prop", "prop: ./held.yaml"))
    return tmp_path


@pytest.mark.requirement(46)
def test_a_folded_arm_in_contact_is_a_finding(touching, capsys):
    for file, where in (
        ("low.yaml:24:3: ", "its upper_arm is 68 mm deep in the rover or the floor"),
        ("bent.yaml:24:3: ", "folded, its upper_"),
    ):
        assert main(["validate", str(touching / file.partition(":")[0])]) == FAILED
        told = capsys.readouterr().out
        assert file in told
        assert where in told


@pytest.mark.slow
@pytest.mark.requirement(46)
def test_no_run_begins_with_a_folded_arm_in_contact(touching, capsys):
    robot = str(touching / "low.yaml")
    run = ["simulate", "--scene", "study", "--requests", "1", "--robot", robot]
    assert main(run) == FAILED
    assert "68 mm deep in the rover or the floor" in capsys.readouterr().err


def test_a_project_in_a_folder_is_left_to_its_own_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for folder in (tmp_path, tmp_path / "inside"):
        folder.mkdir(exist_ok=True)
        (folder / "c.yaml").write_text("chart: c\noutcomes: [x]\nstates: {a: {do: Mine}}\n")
    (tmp_path / "inside" / "pyproject.toml").write_text(
        '[project.entry-points."cobodeck.states"]\nown = "mine.states"\n'
    )

    assert main(["validate", str(tmp_path)]) == FAILED
    assert "in 1 file" in capsys.readouterr().out
    (tmp_path / "c.yaml").unlink()
    assert main(["validate", str(tmp_path)]) == USAGE
    assert "projects in it are validated from their own folders" in capsys.readouterr().err
