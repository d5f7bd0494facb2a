"""A project begun with `new` passes `validate` and `pytest` at once, in processes of their own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.console import FAILED, OK

ROOT = Path(__file__).resolve().parents[2]


def python(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("projects") / "my-greeter"
    assert main(["new", str(folder)]) == OK
    return folder


def test_it_is_valid_even_strictly(project: Path) -> None:
    result = python(project, "-m", "cobodeck", "validate", "--strict")

    assert result.returncode == OK, result.stdout + result.stderr
    said, explored = result.stdout.splitlines()
    assert said == "no errors in 1 file"
    assert explored.startswith("greet: ")
    assert explored.endswith(", complete")


def test_its_tests_pass(project: Path) -> None:
    result = python(project, "-m", "pytest", "-q", "-p", "cobodeck.pytest_plugin")

    assert result.returncode == 0, result.stdout + result.stderr
    assert "2 passed" in result.stdout


def test_its_chart_runs_by_name(project: Path) -> None:
    result = python(project, "-m", "cobodeck", "simulate", "greet", "--duration", "100")

    assert result.returncode == OK, result.stdout + result.stderr
    assert "outcome            met" in result.stdout


def test_its_schema_knows_its_state(project: Path) -> None:
    assert '"PersonNear"' in (project / "my_greeter" / "chart.schema.json").read_text()


def test_a_folder_in_use_is_left_alone(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(path for path in project.rglob("*") if path.is_file())

    assert main(["new", str(project)]) == FAILED

    assert "is there already" in capsys.readouterr().err
    assert sorted(path for path in project.rglob("*") if path.is_file()) == before


def test_its_state_is_ten_lines(project: Path) -> None:
    text = (project / "my_greeter" / "states.py").read_text()
    body = text[text.index("class PersonNear") :]

    assert sum(bool(line.strip()) for line in body.splitlines()) == 10
