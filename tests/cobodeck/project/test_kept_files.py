"""What people have written stays valid, wherever our modules are now.

`kept` has projects made by `cobodeck new`, a connection file and profiles before the modules were
moved (commit 37394ed), and a record of a run of that version.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

from behaviors.profile.profile import load_profile
from cobodeck.__main__ import main
from cobodeck.terminal.console import OK
from engine.files.declared.item import notes
from hw.connection import load_connection
from tests.program import python

KEPT = Path(__file__).parent / "kept"
CONNECTION = KEPT / "fakes_of_37394ed.yaml"


@pytest.fixture
def project(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return Path(shutil.copytree(KEPT / request.param, tmp_path / request.param))


@pytest.mark.parametrize(
    "project",
    ["greeter", pytest.param("rover", marks=pytest.mark.slow)],
    indirect=True,
)
def test_a_project_of_that_version_is_valid_and_passes_its_tests(project: Path) -> None:
    checked = python(project, "-m", "cobodeck", "validate")
    tested = python(project, "-m", "pytest", "-q", "-p", "no:cacheprovider")

    assert checked.returncode == OK, checked.stdout + checked.stderr
    assert tested.returncode == OK, tested.stdout


def test_its_connection_has_the_drivers_of_the_shipped_one() -> None:
    old, new = load_connection(CONNECTION), load_connection("fakes")

    assert "hw.drivers.can.base:CanBase" in CONNECTION.read_text()
    assert list(old.drivers)
    assert [d[2] for d in old.drivers] == [d[2] for d in new.drivers]


@pytest.mark.slow
@pytest.mark.realtime
def test_its_connection_runs(tmp_path: Path) -> None:
    options = ["--robot", str(CONNECTION), "--duration", "8", "--seed", "3", "--json"]
    done = python(tmp_path, "-m", "cobodeck", "run", "cobodeck", *options)

    assert done.returncode == OK, done.stderr
    assert '"errors":[]' in done.stdout


def test_its_record_is_drawn_and_replays_equal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(shutil.copytree(KEPT / "greeter", tmp_path / "greeter"))
    monkeypatch.setattr(sys, "path", [*sys.path])

    assert main(["render", str(KEPT / "greet.mcap"), "-o", "run.svg"]) == OK
    assert main(["replay", str(KEPT / "greet.mcap"), "--check"]) == OK

    assert Path("run.svg").stat().st_size > 1000
    assert "equal" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["paper", "tuned"])
def test_its_profiles_are_read_with_remarks_and_lack_nothing(name: str) -> None:
    with notes() as told:
        found = load_profile(KEPT / f"{name}_of_37394ed.yaml")

    assert found.policy == name
    assert found.values.keys() >= load_profile(name).values.keys()
    assert told
    assert all(note.hint for note in told)
