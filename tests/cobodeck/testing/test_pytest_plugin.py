"""What somebody sees who runs `pytest` in a project of their own."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from tests.program import python

GREETER = Path(__file__).resolve().parents[1] / "project" / "kept" / "greeter"
PLUGIN = """
import pytest
from hw.geometry import Twist2

def test_leaves_the_base_moving(parts):
    parts["base"].drive(Twist2(1.0))

def test_stops_it(parts):
    parts["base"].drive(Twist2(1.0))
    parts["base"].stop()

@pytest.mark.requirement(3, 4, 5, 9)
def test_golden(golden):
    golden("text.txt", "some text")
"""
FAILING = """
def test_it_meets_somebody(sim):
    sim.start("greet", script={"park": "parked"}, real=["PersonNear"])
    sim.signal("user.distance", 3.0)
    sim.until("met", timeout=2)

def test_a_wrong_type(sim):
    sim.start("greet", real=["PersonNear"])
    sim.signal("user.distance", True, hold=True)

def test_a_chart_that_is_not_there(sim):
    sim.start("great")
"""
PASSING = """
def test_it_meets_somebody_who_comes_nearer(sim):
    sim.start("greet", script={"park": "parked"}, real=["PersonNear"])
    sim.series("user.distance", {0: 3.0, 2: 1.0})
    sim.until("met", timeout=3)
    assert sim.now == 2.0

def test_an_arm_that_cannot_be_parked_is_a_failure(sim):
    sim.start("greet", script={"park": "failed"})
    sim.until("failed", timeout=1)
"""


def run_pytest(folder: Path, *arguments: str) -> tuple[str, int]:
    """What it prints, and its exit code."""
    result = python(folder, "-m", "pytest", "-p", "cobodeck.pytest_plugin", *arguments)
    return result.stdout + result.stderr, result.returncode


@pytest.fixture
def project(tmp_path: Path) -> Path:
    shutil.copytree(GREETER, tmp_path / "greeter")
    shutil.rmtree(tmp_path / "greeter" / "tests")
    (tmp_path / "greeter" / "tests").mkdir()
    return tmp_path / "greeter"


def test_the_plug_in_watches_parts_compares_golden_files_and_lists_requirements(
    tmp_path: Path,
) -> None:
    (tmp_path / "test_own.py").write_text(PLUGIN)

    first, _ = run_pytest(tmp_path, "-q", "--requirements")
    assert "left moving: base" in first
    assert "is missing; write it with --update-golden" in first
    assert "covered 4 of 150" in first
    assert "covered: R3-R5 R9" in first
    assert "open:    R1-R2 R6-R8 R10-R150" in first
    assert "pytest_plugin.py" not in first

    run_pytest(tmp_path, "-q", "--update-golden")
    assert (tmp_path / "golden" / "text.txt").read_text() == "some text"
    assert "2 passed" in run_pytest(tmp_path, "-q", "-k", "golden or stops")[0]

    (tmp_path / "golden" / "text.txt").write_text("another text")
    assert "differs from" in run_pytest(tmp_path, "-q", "-k", "golden")[0]


def test_a_failed_expectation_is_one_message_without_insides(project: Path) -> None:
    (project / "tests" / "test_own.py").write_text(FAILING)

    text, code = run_pytest(project, "-q", "--showlocals", "-p", "no:cacheprovider")

    assert code == 1
    until, wrong, missing = re.split(r"^_{3,} \w+ _{3,}$", text, flags=re.M)[1:]
    stale = "stale since 0.20 s, its last value is of 0.00 s"
    assert [line for line in until.splitlines() if line[:1] in (">", "E")] == [
        '>       sim.until("met", timeout=2)',
        "E       AssertionError: 'met' was not reached within 2 s, from 0.00 s to 1.97 s",
        "E         active:  person (PersonNear) for 1.97 s",
        "E                  rest/stay (HoldProp, scripted) for 1.97 s",
        f"E         stale:   person reads user.distance, at most 0.2 s old: {stale}",
        "E         entered: person -> rest/park -> rest/stay",
    ]
    assert "sim        = <sim of greet at 1.97 s: person, rest/stay>" in until
    assert "signal 'user.distance': its value is True (bool); wanted: float" in wrong
    assert "did you mean 'greet'" in missing
    for inside in ("cobodeck/", "engine/", "Loop(", "assert ", "def until", "ChartTester object"):
        assert inside not in text


@pytest.mark.slow
def test_the_edges_that_no_test_takes_are_told(project: Path) -> None:
    (project / "tests" / "test_own.py").write_text(PASSING)

    text, code = run_pytest(project, "-q", "--chart-coverage-fail-under=90")

    assert code == 1
    told = text.splitlines()
    begin = next(n for n, line in enumerate(told) if "edges of charts taken" in line)
    assert told[begin + 1 : begin + 4] == [
        "greeter/greet.yaml 4/5 edges (80 %)",
        "  greeter/greet.yaml:11  rest: error -> .failed",
        "FAILED: 80.0 % of all edges; wanted: 90 %",
    ]
    assert "2 passed" in told[-1]
    assert run_pytest(project, "-q", "--chart-coverage-fail-under=80")[1] == 0
    assert "--chart-coverage" in run_pytest(project, "--help")[0]


@pytest.mark.slow
def test_nothing_is_told_of_edges_unless_asked_for(project: Path) -> None:
    (project / "tests" / "test_own.py").write_text(PASSING)

    text, code = run_pytest(project, "-q")

    assert code == 0
    assert "edges" not in text


@pytest.mark.slow
def test_the_edges_are_counted_over_several_workers(project: Path) -> None:
    (project / "tests" / "test_own.py").write_text(PASSING)

    text, code = run_pytest(project, "-q", "-n", "2", "--chart-coverage")

    assert code == 0
    assert text.count("greeter/greet.yaml 4/5 edges (80 %)") == 1
