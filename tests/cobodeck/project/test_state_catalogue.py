"""States of one's own are found by the project's file and by entry point; broken ones are named."""

from pathlib import Path

import pytest

from cobodeck.project.state_catalogue import MODULES, catalogue
from cobodeck.terminal.console import Problem
from engine.state import Monitor

pytestmark = pytest.mark.usefixtures("own_path")

STATE = '''from engine.state import Context, Monitor, Run

class {name}(Monitor):
    """Sees nothing."""
    outcomes = ("seen",)
    def run(self, ctx: Context) -> Run:
        yield
        return "seen"
'''
ENTRY = '[project.entry-points."cobodeck.states"]\nown = "{module}.states"\n'


def project(folder: Path, module: str, states: str) -> Path:
    (folder / module).mkdir(parents=True)
    (folder / "pyproject.toml").write_text(ENTRY.format(module=module))
    (folder / module / "__init__.py").write_text("")
    (folder / module / "states.py").write_text(states)
    return folder


def test_every_shipped_class_can_be_named_and_says_what_it_does() -> None:
    known = catalogue()

    assert {known.module_of(name) for name in known.classes} <= set(MODULES)
    for name, found in known.interfaces.items():
        assert found.about.strip().endswith((".", "`")), f"{name}: {found.about!r}"


def test_states_of_the_project_around_a_folder_are_found(tmp_path: Path) -> None:
    folder = project(tmp_path, "found_by_file", STATE.format(name="Own"))
    (folder / ".git").mkdir()
    (folder / "deep" / "down").mkdir(parents=True)

    known = catalogue(folder / "deep" / "down")

    assert issubclass(known.classes["Own"], Monitor)
    assert known.module_of("Own") == "found_by_file.states"


def test_states_of_installed_projects_are_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    environment = project(
        tmp_path / "environment", "found_by_entry", STATE.format(name="Installed")
    )
    (environment / "pyproject.toml").unlink()
    (environment / "found_by_entry-1.0.dist-info").mkdir()
    (environment / "found_by_entry-1.0.dist-info" / "entry_points.txt").write_text(
        "[console_scripts]\nx = y:z\n\n"
        "[cobodeck.states]\nown = found_by_entry.states\n\n[other]\na = b\n"
    )
    monkeypatch.syspath_prepend(str(environment))
    (tmp_path / "elsewhere").mkdir()

    known = catalogue(tmp_path / "elsewhere")

    assert known.module_of("Installed") == "found_by_entry.states"


def test_a_project_that_is_installed_and_stood_in_counts_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = project(tmp_path, "found_twice", STATE.format(name="Once"))
    (folder / "found_twice-1.0.dist-info").mkdir()
    (folder / "found_twice-1.0.dist-info" / "entry_points.txt").write_text(
        "[cobodeck.states]\nown = found_twice.states\n"
    )
    monkeypatch.syspath_prepend(str(folder))

    assert "Once" in catalogue(folder).classes


BROKEN = [
    ("x = (\n", "states.py:1: '(' was never closed (while importing broken_0.states)"),
    ("import no_such_module\n", "states.py:1: ModuleNotFoundError: No module named"),
    ("\n\n1 / 0\n", "states.py:3: ZeroDivisionError: division by zero"),
    ("def f():\n    raise KeyError(5)\n\nf()\n", "states.py:2: KeyError: 5"),
    ("import sys\nsys.exit(3)\n", "states.py:2: SystemExit: 3"),
    (
        STATE.format(name="Own").replace('"""Sees nothing."""', "pass"),
        "states.py:3: Own: give it a",
    ),
    (STATE.format(name="Own").replace("ctx: Context", "ctx: Context, n"), "states.py:3: Own: anno"),
    (STATE.format(name="Own").replace('("seen",)', '("error",)'), "'error' is reserved"),
    (STATE.format(name="UserLost"), "broken_8.states.UserLost: a state of this name is also in"),
]


@pytest.mark.parametrize(("number", "text", "message"), [(n, *b) for n, b in enumerate(BROKEN)])
def test_a_broken_module_is_named_with_its_line(
    tmp_path: Path, number: int, text: str, message: str
) -> None:
    folder = project(tmp_path, f"broken_{number}", text)

    with pytest.raises(Problem) as caught:
        catalogue(folder)

    assert message in str(caught.value)


BROKEN_PROJECTS = [
    "[project\n", "\x00", ENTRY.format(module="not_there"), "project = 3\n",
    "[project]\nentry-points = 3\n", "[project.entry-points.'cobodeck.states']\nmine = 3\n",
]  # fmt: skip


@pytest.mark.parametrize("text", BROKEN_PROJECTS)
def test_a_broken_project_file_is_named(tmp_path: Path, text: str) -> None:
    (tmp_path / "pyproject.toml").write_text(text)

    with pytest.raises(Problem, match=r"pyproject\.toml"):
        catalogue(tmp_path)
