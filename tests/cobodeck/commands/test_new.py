"""A project begun with `new` passes `validate` and `pytest` at once, in processes of their own."""

import json
import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.terminal.console import FAILED, OK, REFUSED, USAGE
from tests.program import python

ROOT = Path(__file__).resolve().parents[3]


def begun(folder: Path, *options: str) -> Path:
    """A new project; its modules are not left to be found by this process."""
    package = folder.name.replace("-", "_")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", sys.path.copy())
        assert main(["new", str(folder), *options]) == OK
    for name in [name for name in sys.modules if name.split(".")[0] == package]:
        del sys.modules[name]
    assert find_spec(package) is None
    return folder


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return begun(tmp_path_factory.mktemp("projects") / "my-greeter")


def test_it_is_valid_even_strictly(project: Path) -> None:
    result = python(project, "-m", "cobodeck", "validate", "--strict")

    assert result.returncode == OK, result.stdout + result.stderr
    said, explored = result.stdout.splitlines()
    assert said == "no errors in 3 files"
    assert explored.startswith("greet: ")
    assert explored.endswith(", complete")


def test_its_tests_pass(project: Path) -> None:
    result = python(project, "-m", "pytest", "-q", "-p", "cobodeck.pytest_plugin")

    assert result.returncode == 0, result.stdout + result.stderr
    assert "3 passed" in result.stdout


@pytest.mark.slow
def test_its_chart_runs_by_name(project: Path) -> None:
    result = python(project, "-m", "cobodeck", "simulate", "greet", "--duration", "100")

    assert result.returncode == OK, result.stdout + result.stderr
    assert "outcome            met" in result.stdout


@pytest.mark.slow
def test_the_commands_of_its_readme_work_as_they_are_typed(project: Path, tmp_path: Path) -> None:
    for program in ("cobodeck", "pytest"):
        file = tmp_path / program
        file.write_text(f'#!/bin/sh\nexec {sys.executable} -m {program} "$@"\n')
        file.chmod(0o755)
    typed = re.findall(r"^ {4}(\w.*)$", (project / "README.md").read_text(), flags=re.M)
    typed += re.findall(r"`(cobodeck [^`]*)`", (project / "README.md").read_text())
    environment = {
        **os.environ,
        "PATH": f"{tmp_path}:{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "PYTEST_PLUGINS": "cobodeck.pytest_plugin",
    }

    assert len(typed) == 8
    for command in typed:
        result = subprocess.run(
            ["sh", "-c", command],
            cwd=project, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert result.returncode == OK, f"{command}\n{result.stdout}{result.stderr}"


@pytest.mark.parametrize("is_found", [False, True])
def test_how_to_go_on_can_be_typed_in_the_shell_one_is_in(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    is_found: bool,
) -> None:
    programs = tmp_path / "my env" / "bin"
    programs.mkdir(parents=True)
    for name in ("python", "activate", "cobodeck"):
        (programs / name).touch(0o755)
    monkeypatch.setattr(sys, "executable", str(programs / "python"))
    monkeypatch.setenv("PATH", str(programs if is_found else tmp_path))

    monkeypatch.setattr(sys, "path", sys.path.copy())
    folder = tmp_path / f"own {is_found}"

    assert main(["new", str(folder)]) == OK

    activation = f"  . '{programs}/activate'\n"
    assert capsys.readouterr().out == (
        f"{folder}: a chart, a state, a room, a profile and tests. Go on with\n"
        f"{'' if is_found else activation}"
        f"  cd '{folder}' && cobodeck validate && pytest\n"
    )


def test_every_file_names_a_schema_that_is_there(project: Path) -> None:
    named = {
        file.name: re.findall(
            r"^# yaml-language-server: \$schema=(.*)$", file.read_text(), re.MULTILINE
        )
        for file in (project / "my_greeter").glob("*.yaml")
    }
    assert named == {
        "calm.yaml": ["profile.schema.json"],
        "greet.yaml": ["chart.schema.json"],
        "room.yaml": ["scene.schema.json"],
    }
    assert {path.name for path in (project / "my_greeter").glob("*.json")} == {
        *(name for (name,) in named.values())
    }


@pytest.mark.parametrize("begun_one", ["project", "robot"])
def test_an_editor_without_a_first_line_takes_a_yaml_file_as_a_chart(
    begun_one: str, request: pytest.FixtureRequest
) -> None:
    folder: Path = request.getfixturevalue(begun_one)
    (one,) = json.loads((folder / ".vscode" / "settings.json").read_text())["yaml.schemas"].items()
    schema, files = one

    assert json.loads((folder / schema).read_text())["required"] == ["chart"]
    assert {path.name for path in folder.glob(files)} >= {
        path.name for path in folder.rglob("*.yaml")
    }


def test_git_leaves_out_what_runs_and_tools_write(tmp_path: Path) -> None:
    folder = begun(tmp_path / "kept_clean")
    if shutil.which("git") is None:
        pytest.skip("no `git` on the PATH")
    before = git_sees(folder)
    for name in ("out/x.mcap", "y.mcap.part", ".venv/bin/python", "kept_clean/__pycache__/a.pyc"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()

    assert git_sees(folder) == before
    assert {".gitignore", ".vscode/settings.json", "kept_clean/chart.schema.json"} <= before


def git_sees(folder: Path) -> set[str]:
    subprocess.run(["git", "init", "-q"], cwd=folder, check=True)
    seen = ["git", "ls-files", "--others", "--exclude-standard"]
    return set(subprocess.check_output(seen, cwd=folder, text=True).splitlines())


@pytest.mark.slow
def test_its_schema_is_current_wherever_it_was_begun(
    project: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (project / "my_greeter" / "shed.yaml").write_text(SHED, encoding="utf-8")
    monkeypatch.chdir(project)
    try:
        other = begun(tmp_path / "other", "--robot")
    finally:
        (project / "my_greeter" / "shed.yaml").unlink()

    assert "behind_the_shed" not in (other / "other" / "chart.schema.json").read_text("utf-8")


SHED = """\
scene: shed
room: {outer: [[0, 0], [9, 0], [9, 9], [0, 9]]}
robot: {start: {x: 2 m, y: 2 m}}
places: {behind_the_shed: {x: 4 m, y: 4 m}}
"""


def test_its_schema_knows_its_state(project: Path) -> None:
    assert '"PersonNear"' in (project / "my_greeter" / "chart.schema.json").read_text()


def test_a_folder_in_use_is_left_alone(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(path for path in project.rglob("*") if path.is_file())

    assert main(["new", str(project)]) == FAILED

    assert "is there already" in capsys.readouterr().err
    assert sorted(path for path in project.rglob("*") if path.is_file()) == before


NO_NAMES = ["ü", "naïve", "2nd", "class", "a.b", "_own", "名", "-", "é-lab"]


@pytest.mark.parametrize("name", NO_NAMES)
def test_a_name_that_is_none_for_a_package_leaves_nothing_behind(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", str(tmp_path / name)]) == USAGE

    assert f"{name!r} cannot name a package; use the letters a to z" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("was_there", [False, True])
def test_a_project_that_cannot_be_completed_is_not_begun(
    tmp_path: Path, was_there: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_given: object, **_named: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("cobodeck.commands.schema.schema_of", full)
    monkeypatch.setattr(sys, "path", sys.path.copy())
    if was_there:
        (tmp_path / "half_done").mkdir()

    assert main(["new", str(tmp_path / "half_done")]) == FAILED

    assert [path.name for path in tmp_path.rglob("*")] == (["half_done"] if was_there else [])


def test_its_state_is_ten_lines(project: Path) -> None:
    text = (project / "my_greeter" / "states.py").read_text()
    body = text[text.index("class PersonNear") :]

    assert sum(bool(line.strip()) for line in body.splitlines()) == 10


# -- a robot of one's own ------------------------------------------------------------------------


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return begun(tmp_path_factory.mktemp("robots") / "my-rover", "--robot")


def test_a_robot_of_ones_own_is_valid_even_strictly(robot: Path) -> None:
    result = python(robot, "-m", "cobodeck", "validate", "--strict")

    assert result.returncode == OK, result.stdout + result.stderr
    assert "patrol: " in result.stdout


@pytest.mark.slow
def test_the_tests_of_a_robot_of_ones_own_pass(robot: Path) -> None:
    result = python(robot, "-m", "pytest", "-q", "-p", "cobodeck.pytest_plugin")

    assert result.returncode == 0, result.stdout + result.stderr
    assert "7 passed" in result.stdout


def test_it_patrols_in_simulation_without_a_room_or_a_person(robot: Path) -> None:
    call = ("-m", "cobodeck", "simulate", "patrol", "--robot", "my_rover/rover.yaml", "--json")
    result = python(robot, *call)

    assert result.returncode == OK, result.stdout + result.stderr
    figures = json.loads(result.stdout)
    assert (figures["outcome"], figures["scene"], figures["user"]) == ("home", None, None)
    assert figures["person_watched"] is False
    assert figures["distance_m"] > 4.0
    assert "requests" not in figures


def test_it_is_not_run_where_nobody_watches_people_unless_it_is_said(robot: Path) -> None:
    call = ("-m", "cobodeck", "run", "patrol", "--robot", "my_rover/rover_udp.yaml")
    result = python(robot, *call)

    assert result.returncode == REFUSED
    assert "--person-unwatched" in result.stderr


def test_what_a_robot_lacks_is_told_together_before_the_start(robot: Path) -> None:
    (robot / "my_rover" / "poor.yaml").write_text(
        (robot / "my_rover" / "rover_udp.yaml").read_text().replace("  lamp:", "  bell:")
    )
    call = ("run", "patrol", "--robot", "my_rover/poor.yaml", "--person-unwatched")
    result = python(robot, "-m", "cobodeck", *call)
    (robot / "my_rover" / "poor.yaml").unlink()

    assert result.returncode == FAILED
    assert "this robot lacks part 'lamp', commanded by Light" in result.stderr


def test_the_readme_of_a_robot_of_ones_own_names_files_that_exist(robot: Path) -> None:
    text = (robot / "README.md").read_text()

    for name in re.findall(r"`((?:my_rover|tests)/[\w./]+)`", text):
        assert (robot / name).is_file(), name
