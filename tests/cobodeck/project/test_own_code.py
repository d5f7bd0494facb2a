"""Mistakes in code of one's own are told with their place, and never by a traceback."""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import cobodeck
from cobodeck.__main__ import main
from cobodeck.real.open_connection import open_all
from cobodeck.terminal.console import FAILED, OK, USAGE, Problem
from hw.connection.connection import ServedPart
from tests.cobodeck.own_mistakes import (
    CHART,
    LIT,
    MISTAKES,
    NEVER_RETURNS,
    STATES,
    OwnMistake,
)

ENTRY = '[project.entry-points."cobodeck.states"]\nown = "{package}.states"\n'
ROVER = Path(cobodeck.__file__).parent / "template" / "robot" / "PROJECT" / "rover.yaml"
SIMULATE = ["simulate", "go", "--robot", "rover", "--duration", "0.5"]


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of a package of its own name, in the project that is stood in."""
    folder = tmp_path / f"own_{abs(hash(tmp_path)):x}"
    folder.mkdir()
    (tmp_path / "pyproject.toml").write_text(ENTRY.format(package=folder.name))
    (folder / "__init__.py").write_text("")
    shutil.copy(ROVER, folder / "rover.yaml")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path.copy())
    yield folder
    for name in [name for name in sys.modules if name.partition(".")[0] == folder.name]:
        del sys.modules[name]


def write(package: Path, states: str = STATES, chart: str = CHART) -> None:
    (package / "states.py").write_text(states)
    (package / "go.yaml").write_text(chart)


def test_the_project_without_a_mistake_is_right(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(package)

    assert main(["validate"]) == OK
    assert main(SIMULATE) == OK
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("mistake", [pytest.param(m, id=m.id) for m in MISTAKES])
@pytest.mark.few(6)
def test_a_mistake_is_told_with_its_place_and_what_would_be_right(
    package: Path, mistake: OwnMistake, capsys: pytest.CaptureFixture[str]
) -> None:
    states, chart, place = mistake.project()
    write(package, states, chart)

    codes = {}
    told = {}
    for argv in (["validate"], SIMULATE):
        codes[argv[0]] = main(argv)
        shown = capsys.readouterr()
        told[argv[0]] = shown.out + shown.err

    assert codes["simulate"] != OK
    assert mistake.told in told["simulate"]
    assert place in told["simulate"]
    assert "Traceback" not in told["simulate"]
    assert (codes["validate"] == OK) == mistake.in_run  # no run, nothing to be seen
    if not mistake.in_run:
        assert mistake.told in told["validate"]
        assert place in told["validate"]


RAISES = """
    def run(self, ctx):
        yield
        raise RuntimeError("the lamp is gone")
"""


def test_an_error_of_a_run_is_told_once_however_often_it_comes(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    always(package)

    assert main(SIMULATE) == FAILED

    out, err = capsys.readouterr()
    assert (out + err).count("the lamp is gone") == 1
    assert len(err.splitlines()) == 1
    assert f"{package.name}/states.py:" in err
    assert re.search(r"^errors +[0-9]+, the first in again at 0\.\d\d s$", out, re.MULTILINE)
    assert "Traceback" not in out + err


def test_the_calls_that_led_to_it_are_told_when_asked_for(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    always(package)

    assert main([*SIMULATE, "--traceback"]) == FAILED

    err = capsys.readouterr().err
    assert "Traceback (most recent call last)" in err
    assert 'raise RuntimeError("the lamp is gone")' in err


def always(package: Path) -> None:
    """A chart whose state raises again and again."""
    states = (
        "from engine.state import Action\n\n\nclass Breaks(Action):\n"
        '    """Breaks."""\n\n    outcomes = ("done",)\n'
    )
    chart = "chart: go\noutcomes: [done]\nstates:\n"
    chart += "  again: {do: Breaks, next: {done: .done, error: rest}}\n"
    chart += "  rest: {watch: Wait, with: {time: 0.05 s}, next: {over: again}}\n"
    write(package, states + RAISES, chart)


def test_an_expected_failure_is_a_line_and_with_traceback_all_calls(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (package / "states.py").write_text("import json\nint('x')\n")

    assert main(["list", "states"]) == USAGE
    short = capsys.readouterr().err
    assert main(["list", "states", "--traceback"]) == USAGE
    long = capsys.readouterr().err

    assert "states.py:2" in short
    assert "Traceback" not in short
    assert "ValueError" in long
    assert "Traceback" in long
    assert long.endswith(short)


def test_a_state_that_never_returns_can_run_and_is_a_finding(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    states, chart, place = NEVER_RETURNS.project()
    write(package, states, chart)

    assert main(["validate"]) == FAILED
    told = capsys.readouterr().err
    assert NEVER_RETURNS.told in told
    assert place in told
    assert main(SIMULATE) == OK


@pytest.mark.parametrize("value", ["None", "float('nan')", "float('inf')"])
@pytest.mark.few(1)
def test_what_a_device_may_measure_ends_no_run(
    package: Path, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """None is "nothing"; what is not finite counts as not arrived, and is counted."""
    states = STATES.replace('"lamp.lit", bool', '"lamp.lit", float')
    write(package, states.replace(LIT, f'Sample("lamp.lit", now_ns, {value})'))

    assert main(SIMULATE) == OK
    told = capsys.readouterr().out
    assert ("refused samples" in told) == (value != "None")


def test_files_that_end_in_yml_are_files_of_a_project(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(package)
    for file in package.glob("*.yaml"):
        file.rename(file.with_suffix(".yml"))

    assert main(["validate"]) == OK
    assert "no errors in 2 files" in capsys.readouterr().out
    assert main(SIMULATE) == OK


@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        ("lamp", '    signals = ("lamp.lit",)\n', "", "Lamp has no signals; give the class"),
        ("lamp", "def samples(", "def sample(", "Lamp has no method samples; write"),
        ("lamp", "lit = False\n", "lit = {}[1]\n", r"states.py:\d+: KeyError: 1"),
        (
            "arm",
            "lit = False",
            "dark = True",
            "Lamp has no method follow",
        ),
    ],
)
def test_a_driver_that_is_no_part_is_refused_at_its_opening(
    package: Path, name: str, old: str, new: str, told: str
) -> None:
    write(package, STATES.replace(old, new))
    sys.path.insert(0, str(package.parent))
    opening: Any = SimpleNamespace(now=lambda: 0)
    served = {name: ServedPart(f"{package.name}.states", "Lamp", {}, "rover.yaml:4:3")}

    with pytest.raises(Problem, match=rf"^rover\.yaml:4:3: part '{name}' by .*:Lamp: .*{told}"):
        open_all("part", served, served, opening, {}, {})
