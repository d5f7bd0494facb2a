"""A module that has the name of one of cobodeck's packages is reported, with what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from cobodeck.project.project import projects
from cobodeck.shadowed import PACKAGES, explained, shadows
from cobodeck.terminal.console import OK, USAGE, Problem
from tests.program import python

ROOT = Path(__file__).resolve().parents[2]
ENTRY = '[project.entry-points."cobodeck.states"]\nown = "{}"\n'


def hide(folder: Path, name: str, *, package: bool) -> Path:
    if not package:
        (folder / f"{name}.py").write_text("")
        return folder / f"{name}.py"
    (folder / name).mkdir()
    (folder / name / "__init__.py").write_text("")
    return folder / name


@pytest.mark.parametrize("package", [False, True])
@pytest.mark.parametrize("name", PACKAGES)
def test_what_python_finds_first_is_told(tmp_path: Path, name: str, package: bool) -> None:
    file = hide(tmp_path, name, package=package)

    found = shadows(path=[str(tmp_path), str(ROOT)])

    assert found == {name: file}
    assert explained(found) == (
        f"{file}: it hides cobodeck's own package {name!r}, {ROOT / name}; rename it"
    )


def test_what_stands_behind_or_is_no_package_hides_nothing(tmp_path: Path) -> None:
    hide(tmp_path, "hw", package=True)
    (tmp_path / "first" / "engine").mkdir(parents=True)

    assert shadows(path=[str(tmp_path / "first"), str(ROOT), str(tmp_path)]) == {}
    assert shadows() == {}


@pytest.mark.parametrize("package", [False, True])
@pytest.mark.parametrize("name", ["engine", "states", "behaviors", "hw"])
def test_the_program_names_it_where_it_cannot_run(tmp_path: Path, name: str, package: bool) -> None:
    file = hide(tmp_path, name, package=package)

    result = python(tmp_path, "-m", "cobodeck", "list", "states")

    assert result.returncode != OK
    assert f"{file}: it hides cobodeck's own package {name!r}" in result.stderr
    if name != "engine":
        assert result.returncode == USAGE
        assert "Traceback" not in result.stderr


def test_a_test_names_it(tmp_path: Path) -> None:
    file = hide(tmp_path, "states", package=False)
    (tmp_path / "pytest.ini").write_text("[pytest]\npythonpath = .\n")
    (tmp_path / "test_own.py").write_text("def test_it(sim):\n    pass\n")

    result = python(tmp_path, "-m", "pytest", "-q", "-p", "cobodeck.pytest_plugin")

    assert result.returncode == 1
    assert f"{file}: it hides cobodeck's own package 'states'" in result.stdout


def test_a_project_cannot_have_its_states_in_a_package_of_cobodeck(tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text(ENTRY.format("states.mine"))

    with pytest.raises(Problem, match=r"pyproject.toml: .*'states.mine', which is in a package of"):
        projects(tmp_path)


@pytest.mark.parametrize("package", [False, True])
def test_what_could_be_taken_for_a_package_of_cobodeck_is_told(
    tmp_path: Path, package: bool
) -> None:
    (tmp_path / "pyproject.toml").write_text(ENTRY.format("own_code.states"))
    (tmp_path / "own_code").mkdir()
    hide(tmp_path, "hw", package=package)
    told: list[str] = []

    found = projects(tmp_path, tell=told.append)

    assert [project.name for project in found] == ["own"]
    file = tmp_path / ("hw/__init__.py" if package else "hw.py")
    assert told == [
        f"{file}: cobodeck has a package 'hw' of its own, and Python may import one for the other; "
        "rename yours"
    ]
