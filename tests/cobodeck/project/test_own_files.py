"""Scenes, users, robots, profiles and connections of a project are found by name, values by key."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.record.read.reader import Record
from cobodeck.record.read.record_replay import setup_of
from cobodeck.terminal.console import FAILED, OK, USAGE

ROOT = Path(__file__).resolve().parents[3]
FILES = {
    "rooms/office.yaml": """scene: office
about: a small room
room: {outer: [[0, 0], [9, 0], [9, 8], [0, 8]]}
robot: {file: cart, start: {x: 2, y: 2, yaw: 0}}
user: {source: guest, start: {x: 6, y: 5, yaw: 0}}
""",
    "cart.yaml": (ROOT / "hw/robots/rbkairos_ur10.yaml")
    .read_text()
    .replace("robot: rbkairos_ur10", "robot: cart"),
    "guest.yaml": (ROOT / "hw/users/brief.yaml").read_text().replace("user: brief", "user: guest"),
    "calm.yaml": "profile: calm\nbase: slow\nchase: {inner: 2.7 m}\n",
    "slow.yaml": "profile: slow\nbase: tuned\nrobot: {base_speed: 1 m/s}\n",
    "twin.yaml": (ROOT / "hw/connections/mock.yaml")
    .read_text()
    .replace("connection: mock", "connection: twin"),
}
Told = Callable[..., tuple[int, str, str]]


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "own"
    package = folder / "own_files"
    for name, text in FILES.items():
        file = package / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    (package / "__init__.py").write_text("")
    (folder / "pyproject.toml").write_text(
        '[project]\nname = "own"\n[project.entry-points."cobodeck.states"]\nown = "own_files"\n'
    )
    monkeypatch.setattr(sys, "path", sys.path.copy())
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def told(capsys: pytest.CaptureFixture[str]) -> Told:
    def run(*words: str) -> tuple[int, str, str]:
        code = main([*map(str, words)])
        out, err = capsys.readouterr()
        return code, out, err

    return run


def lines_of(text: str) -> dict[str, dict[str, Any]]:
    (items,) = json.loads(text).values()
    return {next(iter(item.values())): item for item in items}


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("scenes", "office"),
        ("users", "guest"),
        ("robots", "cart"),
        ("profiles", "calm"),
        ("connections", "twin"),
    ],
)
@pytest.mark.usefixtures("project")
def test_they_are_listed_beside_the_shipped_ones(kind: str, name: str, told: Told) -> None:
    code, out, _ = told("list", kind, "--json")
    without = told("list", kind, "--json", "--no-project")[1]

    assert code == OK
    assert lines_of(out).keys() - lines_of(without).keys() >= {name}
    assert lines_of(out).keys() >= lines_of(without).keys()
    assert name not in lines_of(without)


@pytest.mark.usefixtures("project")
def test_all_of_them_are_checked(told: Told) -> None:
    code, out, err = told("validate", "--strict")

    assert (code, err) == (OK, "")
    assert out == f"no errors in {len(FILES)} files\n"


def test_a_mistake_is_told_in_the_file_that_a_name_stands_for(project: Path, told: Told) -> None:
    guest = project / "own_files" / "guest.yaml"
    guest.write_text(guest.read_text().replace("about:", "abuot:"))

    code, out, _ = told("validate")

    assert code == FAILED
    assert "guest.yaml:" in out
    assert "did you mean 'about'?" in out


@pytest.mark.usefixtures("project")
def test_a_run_finds_them_by_name_and_so_do_the_files_themselves(told: Told) -> None:
    call = ("--scene", "office", "--profile", "calm", "--duration", "1", "--json")

    figures = json.loads(told("simulate", "cobodeck", *call)[1])

    assert figures["scene"] == "office"
    assert figures["robot"] == "cart"
    assert figures["user"] == "guest"
    assert figures["profile"] == "calm"


@pytest.mark.usefixtures("project")
def test_a_connection_is_found_by_name(told: Told) -> None:
    code, out, _ = told("run", "cobodeck", "--robot", "twin", "--fast", "--duration", "1", "--json")

    assert (code, json.loads(out)["scene"]) == (OK, "lab_a")


@pytest.mark.usefixtures("project")
def test_without_projects_they_are_not_there(told: Told) -> None:
    code, _, err = told("simulate", "--scene", "office", "--duration", "1", "--no-project")

    assert code != OK
    assert "no such scene" in err


def test_ones_own_hides_a_shipped_one_and_that_is_told(project: Path, told: Told) -> None:
    file = project / "own_files" / "hall.yaml"
    file.write_text(FILES["rooms/office.yaml"].replace("scene: office", "scene: hall"))

    code, out, err = told("list", "scenes", "--json")

    assert code == OK
    assert lines_of(out)["hall"]["about"] == "a small room"
    assert err == f"cobodeck: scene 'hall' is {file}; the shipped one of this name is hidden\n"


def test_of_two_own_ones_the_first_counts_and_that_is_told(project: Path, told: Told) -> None:
    file = project / "own_files" / "rooms" / "other.yaml"
    file.write_text(FILES["rooms/office.yaml"].replace("a small room", "another room"))
    first = project / "own_files" / "rooms" / "office.yaml"

    _, out, err = told("list", "scenes", "--json")

    assert lines_of(out)["office"]["about"] == "a small room"
    assert err == f"cobodeck: scene 'office' is {first}; rename the other one, {file}\n"


@pytest.mark.slow
def test_a_test_of_a_project_finds_them_too(project: Path) -> None:
    (project / "test_own.py").write_text(
        "def test_it(sim):\n"
        "    sim.start('chase', scene='office', profile='calm')\n"
        "    assert sim.run.machine.chart.name == 'chase'\n"
    )
    call = [sys.executable, "-m", "pytest", "-q", "-p", "cobodeck.pytest_plugin", "test_own.py"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}

    result = subprocess.run(call, env=environment, capture_output=True, text=True, check=False)

    assert result.returncode == 0, result.stdout + result.stderr


# -- paths in files --------------------------------------------------------------------------------

BESIDE = {
    "scene": "scene: {}\nroom: there/room.yaml\n"
    "robot: {{file: there/cart.yaml, start: {{x: 2, y: 2, yaw: 0}}}}\n"
    "user: {{source: there/guest.yaml, start: {{x: 6, y: 5, yaw: 0}}}}\n",
    "profile": "profile: {}\nbase: there/slow.yaml\n",
    "connection": "connection: {}\nplant: mock\nscene: there/room.yaml\n",
}


@pytest.mark.parametrize("kind", BESIDE)
def test_paths_in_a_file_start_at_the_file_wherever_one_stands(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: Told
) -> None:
    there = tmp_path / "far" / "there"
    there.mkdir(parents=True)
    for name, held in (("cart", "cart.yaml"), ("guest", "guest.yaml"), ("slow", "slow.yaml")):
        (there / f"{name}.yaml").write_text(FILES[held])
    room = FILES["rooms/office.yaml"].replace("file: cart,", "").replace("source: guest,", "")
    (there / "room.yaml").write_text(room)
    (tmp_path / "far" / "file.yaml").write_text(BESIDE[kind].format("far"))
    monkeypatch.chdir(tmp_path)

    assert told("validate", "far/file.yaml") == (OK, "no errors in 1 file\n", "")

    (there / "slow.yaml").unlink()
    (there / "guest.yaml").unlink()
    (there / "room.yaml").unlink()
    code, out, _ = told("validate", "far/file.yaml")
    assert code == FAILED
    assert "far/there/" in out


# -- single values ---------------------------------------------------------------------------------

SHORT = ("simulate", "--tier", "0", "--duration", "1")


@pytest.mark.usefixtures("project")
def test_a_record_keeps_own_files_and_values_and_is_replayed_elsewhere(
    told: Told, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    call = ("--scene", "office", "--profile", "calm", "--duration", "2")
    sets = ("--set", "chase.outer=3.2 m", "--set", "charts.chase.patience=9 s")
    code, out, _ = told("simulate", *call, *sets, "--record", "run.mcap")
    assert code == OK
    assert "calm, chase.outer=3.2 m, charts.chase.patience=9 s (" in out.splitlines()[0]
    record = Record(Path("run.mcap").resolve())
    header = record.header
    package = Path.cwd() / "own_files"

    assert header["given"]["set"] == list(sets[1::2])
    assert header["profile"]["values"]["chase.inner"] == "2.7 m"
    assert header["profile"]["values"]["chase.outer"] == "3.2 m"
    assert header["named"]["profile"] == {
        name: str(package / f"{name}.yaml") for name in ("calm", "slow")
    }
    assert {str(package / f"{name}.yaml") for name in ("calm", "slow")} <= header["files"].keys()

    for name in FILES:
        (package / name).write_text("")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    profile = setup_of(record).profile
    code, out, _ = told("replay", str(record.path), "--check", "--json")

    assert (code, json.loads(out)["equal"]) == (OK, True)
    assert (profile.name, profile.settings.chase.inner) == ("calm", 2.7)
    assert (profile.settings.chase.outer, profile.robot.base_speed) == (3.2, 1.0)
    assert profile.charts["chase"]["patience"] == "9 s"


def test_compare_tells_which_value_differs(
    told: Told, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    told(*SHORT, "--record", "a.mcap")
    told(*SHORT, "--set", "chase.inner=2.75 m", "--record", "b.mcap")

    headers = json.loads(told("compare", "a.mcap", "b.mcap", "--json")[1])["headers"]

    assert [found["what"] for found in headers] == ["profile", "chase.inner"]
    assert headers[1]["b"] == "2.75 m"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("chase.iner=2 m", "did you mean 'inner'?"),
        ("charts.chase.patiense=2 s", "no such parameter; did you mean 'patience'?"),
        ("charts.chase.patience=2 m", "'2 m' is a length"),
        ("chase.inner=-2 m", "out of range"),
        ("chase.inner", "is not KEY=VALUE"),
    ],
)
@pytest.mark.parametrize("command", ["simulate", "run"])
def test_a_wrong_value_ends_the_command_before_the_run(
    told: Told,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: str,
    given: str,
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    words = {"simulate": SHORT[1:], "run": ("cobodeck", "--robot", "mock", "--fast")}[command]

    code, out, err = told(command, *words, "--set", given)

    assert (code, out) == (USAGE, "")
    assert f"--set {given}: " in err
    assert message in err
    assert not (tmp_path / "out").exists()
