"""A project's chart that has a shipped chart's name is used in its place, by whoever uses it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.project.library import load_beside
from cobodeck.project.state_catalogue import CHARTS, catalogue, shipped_charts
from cobodeck.record.read.reader import Record
from cobodeck.terminal.console import FAILED, OK
from cobodeck.testing.testing import ChartTester
from engine.files.finding import Finding

pytestmark = pytest.mark.usefixtures("own_path")

CHASE = """\
chart: chase
about: Waits where it stands.
inputs: {refused: integer | none, shown: UserPose | none}
outcomes: [haptic_request, escape_required, cornered, user_lost, fault, failed]
outputs: {haptic_request: {deep: Pose3, since: integer}}
any:
  danger: {watch: EscapeRequired, priority: 1, next: {required: .escape_required}}
  asked:
    watch: HapticRequest
    in: {refused: refused}
    out: {deep: deep, since: since}
    next: {requested: .haptic_request}
"""
FEWER = CHASE.replace("[haptic_request, escape_required, ", "[haptic_request, ").replace(
    "  danger: {watch: EscapeRequired, priority: 1, next: {required: .escape_required}}\n", ""
)
Told = Callable[..., tuple[int, str, str]]


@pytest.fixture
def package(folder: Path) -> Path:
    """The package of a project in the current folder, with a chart `chase` of its own."""
    package = folder / "own_charts"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "waiting.yaml").write_text(CHASE)
    (folder / "pyproject.toml").write_text(
        '[project.entry-points."cobodeck.states"]\nown = "own_charts"\n'
    )
    return package


@pytest.fixture
def told(capsys: pytest.CaptureFixture[str]) -> Told:
    def run(*words: object) -> tuple[int, str, str]:
        code = main([*map(str, words)])
        out, err = capsys.readouterr()
        return code, out, err

    return run


def line_about(file: Path, name: str = "chase") -> str:
    return f"cobodeck: chart {name}: {file} replaces the shipped one\n"


@pytest.mark.parametrize(
    "words",
    [
        ("simulate", "cobodeck", "--duration", 1),
        ("simulate", CHARTS / "cobodeck.yaml", "--duration", 1),
        ("simulate", "chase", "--duration", 1),
        ("run", "cobodeck", "--robot", "mock", "--fast", "--duration", 1),
    ],
)
def test_it_is_run_in_place_of_the_shipped_one_and_that_is_told_once(
    package: Path, told: Told, words: tuple[object, ...]
) -> None:
    code, out, err = told(*words, "--seed", 3, "--record", "run.mcap", "--json")

    assert (code, json.loads(out)["errors"]) == (OK, [])
    assert err == line_about(package / "waiting.yaml")
    header = Record(Path("run.mcap").resolve()).header
    assert header["charts"]["chase"] == str(package / "waiting.yaml")
    assert str(package / "waiting.yaml") in header["files"]


def test_a_run_that_does_not_use_it_says_nothing(package: Path, told: Told) -> None:
    assert told("simulate", "inform", "--duration", 1, "--json")[2] == ""
    assert told("simulate", "cobodeck", "--duration", 1, "--json", "--no-project")[2] == ""


def test_it_is_drawn_listed_and_checked(package: Path, told: Told) -> None:
    file = package / "waiting.yaml"

    told("render", "cobodeck", "--depth", 1, "-o", "drawn.dot")
    charts = json.loads(told("list", "charts", "--json")[1])["charts"]
    code, out, err = told("validate")

    assert "HapticRequest" in Path("drawn.dot").read_text()
    assert "ChooseChasePose" not in Path("drawn.dot").read_text()
    assert [chart["file"] for chart in charts if chart["chart"] == "chase"] == [str(file)]
    assert code == OK
    assert "error" not in out.replace("no errors", "")
    assert err == line_about(file)


def test_tests_of_charts_see_it(package: Path, folder: Path) -> None:
    by_name, in_text = ChartTester(folder, folder), ChartTester(folder, folder)
    by_name.start("cobodeck")
    in_text.start("chart: mine\nstates:\n  follow: {use: cobodeck, next: {error: again}}\n"
                  "  again: {use: cobodeck, next: {error: follow}}\n")  # fmt: skip

    assert "chase/asked" in by_name.run.machine.vertices
    assert "chase/follow" not in by_name.run.machine.vertices
    assert "follow/chase/asked" in in_text.run.machine.vertices


def findings(out: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(out)["findings"]
    return [finding for finding in found if finding["severity"] == "error"]


def test_one_that_does_not_fit_is_one_finding_in_its_file(package: Path, told: Told) -> None:
    file = package / "waiting.yaml"
    file.write_text(FEWER)

    code, out, err = told("validate", "--json")

    (finding,) = findings(out)
    assert (code, err) == (FAILED, line_about(file))
    assert (finding["file"], finding["line"]) == (str(file), 1)
    fault = "chart 'chase' replaces the shipped one and does not fit 'cobodeck'"
    assert finding["message"] == fault
    assert finding["hint"] == (
        "cobodeck uses it with inputs refused, shown; outputs deep, since; outcomes "
        "haptic_request, escape_required, failed, cornered, user_lost, fault"
    )
    (note,) = finding["related"]
    assert note["file"] == str(CHARTS / "cobodeck.yaml")
    assert note["message"] == "chase has no outcome 'escape_required'"

    code, _, err = told("render", "cobodeck", "-o", "drawn.dot")
    assert (code, fault in err) == (OK, True)


def test_all_that_does_not_fit_is_one_finding(package: Path, told: Told) -> None:
    (package / "waiting.yaml").write_text(
        "chart: chase\noutcomes: [done]\nany:\n"
        "  stop: {watch: WaitFor, with: {signal: stop.engaged}, next: {there: .done}}\n"
    )

    (finding,) = findings(told("validate", "--json")[1])

    assert finding["message"].startswith("chart 'chase' replaces the shipped one")
    assert len(finding["related"]) == 3


def test_what_the_shipped_charts_give_and_map_need_not_be_used(package: Path, told: Told) -> None:
    (package / "waiting.yaml").write_text(
        CHASE.replace("    in: {refused: refused}\n", "").replace(
            "about: Waits", "parameters: {idle: {type: length, default: 1 m}}\nabout: Waits"
        )
    )
    (package / "mine.yaml").write_text(
        "chart: mine\noutcomes: [done, never]\nstates:\n"
        "  rest: {watch: Wait, with: {time: 1 s}, next: {over: .done}}\n"
    )

    code, out, _ = told("validate", "--strict", "--json")

    assert code == FAILED
    assert [finding["message"] for finding in findings(out)] == [
        "nothing ends the chart with 'never'", "$idle is never used",
    ]  # fmt: skip


def test_one_that_does_not_fit_keeps_those_from_running_that_use_it_and_no_others(
    package: Path, told: Told
) -> None:
    (package / "waiting.yaml").write_text(FEWER)

    code, _, err = told("simulate", "cobodeck", "--duration", 1)
    assert code == FAILED
    assert "chase has no outcome 'escape_required'" in err
    assert f"{package / 'waiting.yaml'}:1:8: error[N05] chart 'chase' replaces the shipped" in err

    assert told("simulate", "chase", "--duration", 1, "--json")[0] == OK
    assert told("simulate", "inform", "--duration", 1, "--json")[0] == OK


def test_one_that_cannot_be_read_is_reported_in_its_own_file(package: Path, told: Told) -> None:
    (package / "chase.yaml").write_text(CHASE.replace("any:", "ani:"))
    (package / "waiting.yaml").unlink()

    code, _, err = told("simulate", "cobodeck", "--duration", 1)

    assert code == FAILED
    assert f"{package / 'chase.yaml'}:6:1: error[C01] unknown key 'ani' in a chart" in err
    assert "no chart 'chase'" not in err


def test_two_of_one_name_are_reported_in_both_files(package: Path, told: Told) -> None:
    one, other = package / "waiting.yaml", package / "deep" / "also.yaml"
    other.parent.mkdir()
    other.write_text(CHASE)

    code, out, _ = told("validate", "--json")
    assert code == FAILED
    twice = [finding for finding in findings(out) if finding["code"] == "N02"]
    assert {finding["file"]: finding["message"] for finding in twice} == {
        str(one): f"a chart 'chase' is also in {other}",
        str(other): f"a chart 'chase' is also in {one}",
    }

    for file in (one, other):
        code, _, err = told("simulate", file, "--duration", 1)
        assert code == FAILED
        assert f"{file}:1:8: error[N02] a chart 'chase' is also in" in err
    code, _, err = told("simulate", "cobodeck", "--duration", 1)
    assert code == FAILED
    assert "error[N02] a chart 'chase' is also in" in err
    assert told("simulate", "inform", "--duration", 1, "--json")[0] == OK


def test_a_file_beside_the_given_one_goes_before_a_project_s(package: Path, told: Told) -> None:
    there = package.parent / "there"
    there.mkdir()
    (there / "chase.yaml").write_text(CHASE)
    (there / "mine.yaml").write_text(
        "chart: mine\nstates:\n  follow: {use: cobodeck, next: {error: follow}}\n"
    )

    library = load_beside([there / "mine.yaml"], catalogue(package.parent))
    assert library["chase"].file == str(there / "chase.yaml")
    _, _, err = told("simulate", there / "mine.yaml", "--duration", 1, "--json")
    assert err == line_about(there / "chase.yaml")


def test_a_given_file_outside_of_projects_replaces_nothing(folder: Path, told: Told) -> None:
    (folder / "waiting.yaml").write_text(FEWER)

    code, out, err = told("validate", "waiting.yaml", "--json")

    assert (code, err, findings(out)) == (OK, "", [])
    assert told("simulate", "waiting.yaml", "--duration", 1, "--json")[2] == ""


def test_without_projects_the_shipped_charts_are_read_as_they_are() -> None:
    library = load_beside([CHARTS / "cobodeck.yaml"], catalogue(own=False))
    found: list[Finding] = library.findings

    assert found == []
    assert {chart.file for chart in library.values()} == {str(f) for f in shipped_charts()}
