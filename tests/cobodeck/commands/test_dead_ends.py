"""`validate --explain` tells the dead ends of a chart, and writes tests that play them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.terminal.console import FAILED, OK, USAGE
from cobodeck.testing.testing import ChartTester

STATES = '''
from engine.state import Action, Monitor


class Do(Action):
    """Does something."""

    outcomes = ("done", "failed")
    outputs = {"done": {"weight": float}}

    def run(self, ctx):
        yield
        return "failed"


class See(Monitor):
    """Sees something."""

    outcomes = ("seen",)

    def run(self, ctx):
        yield
        return "seen"


class Rest(Action):
    """Never ends."""

    outcomes = ()

    def run(self, ctx):
        while True:
            yield
'''
HALTING = """
chart: halting
outcomes: [over, unused]
states:
  ask: {do: Do, timeout: 1 h, next: {done: both, failed: .over, timeout: try}}
  both:
    any:
      one: {do: Do}
      two: {watch: See}
    when:
      - {outcome: fine, if: {one: failed}}
      - {outcome: fine, if: {one: done, two: seen}}
    next: {fine: rest}
  try: {do: Do, retry: {times: 2, on: failed, wait: 300 ms}, next: {done: .over, failed: twice}}
  twice:
    use: errand
    retry: {times: 1, on: bad}
    next: {good: .over, bad: .unused}
  rest: {do: Rest}
"""
ERRAND = """
chart: errand
outcomes: [good, bad]
states:
  go: {do: Do, retry: {times: 1, on: failed}, next: {done: .good, failed: see}}
  see: {watch: See, next: {seen: .bad}}
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, without_shipped_charts: None) -> Path:
    (tmp_path / "pyproject.toml").write_text(
        '[project.entry-points."cobodeck.states"]\nhalting = "halting_states"\n'
    )
    (tmp_path / "halting_states.py").write_text(STATES)
    (tmp_path / "errand.yaml").write_text(ERRAND)
    (tmp_path / "charts").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "halting_states", raising=False)
    return tmp_path


def written_tests(file: Path) -> dict[str, Callable[[ChartTester], None]]:
    """The tests of a written file, by name."""
    found: dict[str, Any] = {}
    exec(compile(file.read_text(), str(file), "exec"), found)
    return {name: test for name, test in found.items() if name.startswith("test_")}


def play(file: Path, root: Path) -> int:
    """Run the tests of a written file; how many there are."""
    tests = written_tests(file)
    for test in tests.values():
        sim = ChartTester(file.parent, root)
        test(sim)
        sim.finish()
    return len(tests)


def test_a_dead_end_is_told_and_played(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chart = project / "charts" / "halting.yaml"
    chart.write_text(HALTING)
    written = project / "test_halting.py"

    code = main(["validate", "charts", "errand.yaml", "--explain", "-o", str(written)])

    told = capsys.readouterr().out
    assert code == OK, told
    assert "halting: dead end 1: nothing ends any more, except by an error, after" in told
    assert "  1. ask ends with done\n  2. both/one ends with failed\n  then rest (Rest)" in told
    assert "never taken" not in told
    assert play(written, project) == told.count("dead end ") >= 1


@pytest.mark.parametrize(
    ("end", "told"), [("seen: .bad", "bad"), ("seen: stuck", "stuck")], ids=["ends", "stuck"]
)
@pytest.mark.slow
def test_further_tries_are_played_too(
    project: Path, capsys: pytest.CaptureFixture[str], end: str, told: str
) -> None:
    errand = ERRAND.replace("seen: .bad", end)
    if told == "stuck":
        errand += "  stuck: {do: Rest}\n"
    (project / "errand.yaml").write_text(errand)
    chart = project / "charts" / "halting.yaml"
    chart.write_text(
        HALTING.replace("bad: .unused", "bad: rest").replace("done: both", "done: .over")
    )
    written = project / "charts" / "test_halting.py"

    assert main(["validate", "charts", "errand.yaml", "--explain", "-o", str(written)]) == OK

    assert "ask times out" in capsys.readouterr().out
    text = written.read_text()
    assert "sim.start('halting.yaml')" in text
    assert "sim.time_out('ask')" in text
    assert text.count("sim.end('try', 'failed')") == 3
    assert text.count("sim.end('twice/go', 'failed')") == (4 if told == "bad" else 2)
    assert play(written, project) == 1


OPEN = """
chart: open
outcomes: [over]
inputs:
  goal: {type: Pose2}
  near: {type: length}
  often: {type: list of integer}
  named: {type: text, default: none}
states:
  ask: {do: Do, next: {done: rest, failed: .over}}
  rest: {do: Rest}
"""


@pytest.mark.slow
def test_inputs_of_a_test_have_values_of_their_types(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (project / "charts" / "open.yaml").write_text(OPEN)
    written = project / "charts" / "test_open.py"

    assert main(["validate", "charts", "--explain", "-o", str(written)]) == OK

    assert "    'near': '1 m',  # a length, in mm, cm, m, km\n" in written.read_text()
    assert "'named'" not in written.read_text()
    assert play(written, project) == 1
    assert f"{written}: run it with pytest" in capsys.readouterr().out


@pytest.mark.slow
def test_inputs_that_charts_cannot_write_are_left_open_and_told(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (project / "charts" / "open.yaml").write_text(OPEN.replace("Pose2", "signal of number"))
    written = project / "charts" / "test_open.py"

    assert main(["validate", "charts", "--explain", "-o", str(written)]) == OK

    assert "    'goal': ...,  # the name of a signal\n" in written.read_text()
    assert "give each `...` in it a value" in capsys.readouterr().out
    with pytest.raises(AssertionError, match=r"the chart cannot start: .*goal"):
        play(written, project)


def test_what_never_happens_is_told(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (project / "charts" / "plain.yaml").write_text(
        "chart: plain\noutcomes: [x]\nstates:\n"
        "  a: {do: Do, next: {done: .x, failed: .x}}\n  b: {do: Do, next: {done: a, failed: a}}\n"
    )

    (project / "charts" / "given.yaml").write_text(
        ERRAND.replace("errand", "given") + "parameters: {far: {type: length}}\n"
    )

    main(["validate", "charts", "--explain", "-o", "test_plain.py"])

    told = capsys.readouterr().out
    assert "plain: never taken: b: done" in told
    assert "given: not explored, as it is given no far\n" in told
    assert "no dead ends: test_plain.py is not written" in told
    assert not (project / "test_plain.py").exists()


@pytest.mark.parametrize(
    "asked",
    [
        ["-o", "test_x.py"],
        ["--explain", "-o", "x.txt"],
        ["--explain", "-o", "test_kept.py"],
        ["--explain", "--json"],
    ],
)
def test_what_does_not_go_together_is_refused(project: Path, asked: list[str]) -> None:
    (project / "charts" / "errand.yaml").write_text(ERRAND)
    (project / "test_kept.py").touch()
    assert main(["validate", "charts", *asked]) in (FAILED, USAGE)
