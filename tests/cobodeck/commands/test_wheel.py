"""A built wheel has all it needs: it runs from any folder, without the checkout."""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from hw.connection.connection import connection_names
from tests.repeats import SHORT

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = ("engine", "states", "behaviors", "hw", "cobodeck", "charts")
COMPILING = {"NUMBA_DISABLE_JIT": "1"} if SHORT else {}
"""A simulation is not compiled in CI: two minutes less, and the same bits; `reach` always is."""


def run(command: list[str], folder: Path, **environment: str) -> str:
    result = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.mark.slow
def test_a_wheel_simulates_validates_and_begins_projects_elsewhere(tmp_path: Path) -> None:
    source, wheels, environment = tmp_path / "source", tmp_path / "wheels", tmp_path / "environment"
    left_out = shutil.ignore_patterns("__pycache__", "*.egg-info")
    for package in PACKAGES:
        shutil.copytree(ROOT / package, source / package, ignore=left_out)
    for file in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / file, source)
    pip = [sys.executable, "-m", "pip", "-qq", "--disable-pip-version-check"]
    run([*pip, "wheel", "--no-deps", "-w", str(wheels), str(source)], tmp_path)
    (wheel,) = wheels.glob("*.whl")
    with zipfile.ZipFile(wheel) as content:
        (licence,) = (name for name in content.namelist() if name.endswith("/LICENSE"))
        assert content.read(licence) == (ROOT / "LICENSE").read_bytes()
        assert "cobodeck/docs/first-hour.md" in content.namelist()
        assert "cobodeck/docs/reference/states.md" in content.namelist()
        assert "cobodeck/manual/examples/chart.yaml" in content.namelist()
    run([*pip, "install", "--no-deps", "--target", str(environment), str(wheel)], tmp_path)

    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    cobodeck = [sys.executable, "-m", "cobodeck"]
    where = run(
        [sys.executable, "-c", "import engine; print(engine.__file__)"],
        elsewhere,
        PYTHONPATH=str(environment),
    )
    assert str(environment) in where
    shown = run(
        [*cobodeck, "simulate", "--duration", "20", "--json"],
        elsewhere,
        PYTHONPATH=str(environment),
        **COMPILING,
    )
    assert json.loads(shown)["ticks"] == 601
    run([*cobodeck, "reach"], elsewhere, PYTHONPATH=str(environment))
    assert not list(environment.rglob("*.nb[ic]"))  # `pip uninstall` would leave them
    assert "no errors" in run([*cobodeck, "validate"], elsewhere, PYTHONPATH=str(environment))
    listed = run(
        [*cobodeck, "list", "connections", "--json"], elsewhere, PYTHONPATH=str(environment)
    )
    assert {one["connection"] for one in json.loads(listed)["connections"]} == set(
        connection_names()
    )
    assert list((environment / "hw" / "drivers" / "can").glob("*.dbc"))
    run([*cobodeck, "new", "own"], elsewhere, PYTHONPATH=str(environment))
    for name in (".gitignore", ".vscode/settings.json"):
        assert (elsewhere / "own" / name).is_file()
    assert "no errors" in run(
        [*cobodeck, "validate"], elsewhere / "own", PYTHONPATH=str(environment)
    )
