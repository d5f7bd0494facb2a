"""A project's code is imported where it is the user's own, in their repository; else it is not."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from cobodeck.__main__ import COMMANDS, main
from cobodeck.project.project import projects
from cobodeck.project.state_catalogue import catalogue
from cobodeck.record.read.reader import Record
from cobodeck.record.read.record_replay import setup_of
from cobodeck.terminal.console import FAILED

pytestmark = pytest.mark.usefixtures("own_path")

ROOT = Path(__file__).resolve().parents[3]
ENTRY = '[project.entry-points."cobodeck.states"]\nown = "own_code.states"\n'
STRANGER = 4711
as_root = pytest.mark.skipif(
    not hasattr(os, "getuid") or os.getuid() != 0, reason="only root can give files away"
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A project that notes each import of its code in the file `imported`."""
    package = tmp_path / "own" / "own_code"
    (package / "inner").mkdir(parents=True)
    (package.parent / "pyproject.toml").write_text(ENTRY)
    trap = f"open({str(tmp_path / 'imported')!r}, 'a').close()\n"
    (package / "states.py").write_text(trap)
    (package / "inner" / "more.py").write_text("")
    return package.parent


def names(start: Path) -> list[str]:
    return [project.name for project in projects(start)]


def test_the_folder_itself_counts(folder: Path) -> None:
    assert names(folder) == ["own"]


def test_a_folder_above_counts_up_to_the_root_of_the_repository(folder: Path) -> None:
    (folder / ".git").mkdir()

    assert names(folder / "own_code" / "inner") == ["own"]


@pytest.mark.parametrize("repository", ["", "below"])
def test_a_project_above_the_repository_is_told_of_and_left_out(
    folder: Path, repository: str, capsys: pytest.CaptureFixture[str]
) -> None:
    start = folder / "below" / "deep"
    start.mkdir(parents=True)
    if repository:
        (folder / repository / ".git").write_text("gitdir: elsewhere\n")

    assert names(start) == []

    told = capsys.readouterr().err
    assert told.startswith(f"cobodeck: {folder}/pyproject.toml: its states are not imported: ")
    assert told.count("\n") == 1


def test_a_broken_file_above_the_repository_is_nobodys_business(folder: Path) -> None:
    (folder / "pyproject.toml").write_text("[project\n")
    (folder / "below").mkdir()

    assert names(folder / "below") == []


def test_files_of_projects_without_states_are_passed_by(folder: Path) -> None:
    (folder / ".git").mkdir()
    (folder / "own_code" / "pyproject.toml").write_text('[project]\nname = "tool"\n')

    assert names(folder / "own_code") == ["own"]


def linked(folder: Path) -> Path:
    """A package that is a link to elsewhere."""
    (folder / "own_code").rename(folder.parent / "elsewhere")
    (folder / "own_code").symlink_to(folder.parent / "elsewhere", target_is_directory=True)
    return folder.parent / "elsewhere" / "states.py"


def linked_inside(folder: Path) -> Path:
    """A link inside a package to a folder elsewhere."""
    target = folder.parent / "elsewhere"
    target.mkdir()
    (target / "code.py").write_text("")
    (folder / "own_code" / "link").symlink_to(target, target_is_directory=True)
    return target / "code.py"


def single(folder: Path) -> Path:
    """A module that is no package."""
    (folder / "pyproject.toml").write_text(ENTRY.replace("own_code.states", "single"))
    (folder / "single.py").write_text("")
    return folder / "single.py"


STRANGE: dict[str, Callable[[Path], Path]] = {
    "file": lambda folder: folder / "pyproject.toml",
    "folder": lambda folder: folder,
    "package": lambda folder: folder / "own_code",
    "module": lambda folder: folder / "own_code" / "states.py",
    "inside": lambda folder: folder / "own_code" / "inner" / "more.py",
    "single": single,
    "linked": linked,
    "linked inside": linked_inside,
}


@as_root
@pytest.mark.parametrize("what", STRANGE)
def test_what_belongs_to_somebody_else_is_not_imported(
    folder: Path, what: str, capsys: pytest.CaptureFixture[str]
) -> None:
    strange = STRANGE[what](folder)
    assert names(folder) == ["own"]
    os.chown(strange, STRANGER, STRANGER)

    assert names(folder) == []

    told = capsys.readouterr().err
    assert told.startswith(f"cobodeck: {folder}/pyproject.toml: its states are not imported: ")
    assert f"belongs to user {STRANGER}" in told
    assert told.count("\n") == 1


@pytest.mark.parametrize("user", [os.getuid() + 1 if hasattr(os, "getuid") else 1])
def test_to_another_user_this_project_is_a_strangers(
    folder: Path, user: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    is_roots = (folder / "pyproject.toml").stat().st_uid == 0
    monkeypatch.setattr(os, "getuid", lambda: user, raising=False)

    assert names(folder) == (["own"] if is_roots else [])


def test_where_files_have_no_owner_the_project_counts(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "getuid", raising=False)

    assert names(folder) == ["own"]


def test_links_to_nowhere_and_round_in_circles_do_no_harm(folder: Path) -> None:
    (folder / "own_code" / ".#states.py").symlink_to("nobody@nowhere")
    (folder / "own_code" / "self").symlink_to("self")
    (folder / "own_code" / "round").symlink_to(folder / "own_code", target_is_directory=True)

    assert names(folder) == ["own"]


def test_the_present_folder_counts_by_its_project_file_alone(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "pyproject.toml").unlink()
    (folder / "own.egg-info").mkdir()
    (folder / "own.egg-info" / "entry_points.txt").write_text("[cobodeck.states]\nown = own_code\n")
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend("")  # as `python -m` does

    assert names(folder) == []


# -- importing no code at all ----------------------------------------------------------------------

CALLS = {
    "validate": "validate",
    "schema": "schema",
    "list": "list charts",
    "docs": "docs -o pages",
    "render": "render chase -o chase.dot",
    "watch": "watch chase --tty",
    "simulate": "simulate --tier 0 --duration 1",
    "run": "run cobodeck --robot mock --fast --duration 1",
    "observe": "observe nowhere",
    "replay": "replay first.mcap",
    "recover": "recover first.mcap",
    "compare": "compare first.mcap first.mcap",
    "case": "case first.mcap --at 1",
    "space": "space hall",
    "reach": "reach --height 1 --distance 1",
    "localize": "localize drive.log",
    "calibrate": "calibrate drive.log --map hall",
    "new": "new begun",
    "import-flexbe": "import-flexbe nothing_sm.py -o brought",
    "bench": "bench --show results.json",
    "campaign": "campaign nothing --out out",
    "evaluate": "evaluate paper --profile nothing",
    "doctor": "doctor",
    "completion": "completion bash",
}
SHORT = ("--duration", "1")
MORE = (
    "list states",
    "list signals",
    "list connections",
    "doctor --robot mock",
    "render --scene hall --at 1 -o hall.svg",
)


@cache
def first_record() -> bytes:
    """A record that was made in the folder of the first test that asks for it."""
    main(["simulate", "--tier", "0", "--record", "first.mcap", *SHORT, "--no-project"])
    return Path("first.mcap").read_bytes()


def test_every_command_is_tried_without_projects() -> None:
    assert set(CALLS) == set(COMMANDS)


@pytest.mark.parametrize("call", [*CALLS.values(), *MORE])
def test_without_projects_no_code_of_theirs_is_imported(
    folder: Path, call: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    (folder / "results.json").write_bytes(
        (ROOT / "cobodeck/bench/results/engine.json").read_bytes()
    )
    seen = " ".join(["2.5"] * 181)
    drive = [f"FLASER 181 {seen} {n} 0 0 {n} 0 0 {n} host {n}" for n in range(1, 9)]
    (folder / "drive.log").write_text("\n".join(drive))
    sys.modules.pop("own_code.states", None)
    if "first.mcap" in call:
        (folder / "first.mcap").write_bytes(first_record())

    main([*call.split(), "--no-project"])

    assert not (folder.parent / "imported").exists()
    assert "begun.states" not in sys.modules


def test_without_projects_installed_ones_are_left_out_too(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "own.dist-info").mkdir()
    (folder / "own.dist-info" / "entry_points.txt").write_text(
        "[cobodeck.states]\nown = own_code\n"
    )
    monkeypatch.syspath_prepend(str(folder))

    assert names(tmp_path) == ["own"]
    assert catalogue(tmp_path, own=False).projects == ()


def test_a_record_does_not_say_what_code_is_imported(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    (folder / "pyproject.toml").write_text('[project]\nname = "own"\n')
    sys.modules.pop("own_code.states", None)
    main(["simulate", "--tier", "0", "--record", "forged.mcap", *SHORT])
    record = Record(folder / "forged.mcap")
    record.attachments[str(folder / "pyproject.toml")] = ENTRY.encode()

    assert setup_of(record).catalogue.projects == ()
    assert not (folder.parent / "imported").exists()


CONNECTION = """connection: strange
model: rbkairos_ur10
parts: {base: {driver: "DRIVER:Base"}}
"""


@pytest.mark.parametrize("driver", ["own_code.states", "subprocess"])
def test_a_driver_of_no_project_is_refused_before_it_is_imported(
    folder: Path, driver: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(str(folder))
    sys.modules.pop("own_code.states", None)
    (folder / "strange.yaml").write_text(CONNECTION.replace("DRIVER", driver))

    call = ["run", "cobodeck", "--robot", "strange.yaml", "--scene", "hall", "--no-project"]

    assert main(call) == FAILED

    told = capsys.readouterr().err
    package = driver.partition(".")[0]
    assert f"strange.yaml:3:24: part 'base' by {driver}:Base: {package!r} is the package" in told
    assert not list(folder.glob("out/*"))
    assert not (folder.parent / "imported").exists()


@as_root
def test_a_strangers_project_runs_no_code_and_the_program_works(folder: Path) -> None:
    os.chown(folder / "own_code" / "states.py", STRANGER, STRANGER)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}

    result = subprocess.run(
        [sys.executable, "-m", "cobodeck", "list", "states"],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip

    assert result.returncode == 0, result.stderr
    assert result.stderr.count("its states are not imported") == 1
    assert not (folder.parent / "imported").exists()


def test_a_chart_of_a_project_elsewhere_says_where_to_go(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    package = folder / "there" / "elsewhere"
    package.mkdir(parents=True)
    (folder / "there" / "pyproject.toml").write_text(
        '[project.entry-points."cobodeck.states"]\nelsewhere = "elsewhere.states"\n'
    )
    chart = package / "far.yaml"
    chart.write_text("chart: far\nstates: {go: {do: Elsewhere, next: {gone: go}}}\n")

    assert main(["simulate", str(chart)]) == FAILED

    told = capsys.readouterr().err
    assert "no state class 'Elsewhere'" in told
    assert f"it is in the project {folder / 'there'}" in told
    assert told.endswith(f"cd {folder / 'there'}\n")
