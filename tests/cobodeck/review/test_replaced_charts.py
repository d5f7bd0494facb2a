"""What is told of runs whose chart was replaced, against an independent count from the record."""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from cobodeck.__main__ import main
from cobodeck.project import catalogue, open_chart
from cobodeck.record.read.reader import Record
from cobodeck.review.chart_coverage import edge_counts
from cobodeck.review.run_events import events_of
from cobodeck.review.state_statistics import review
from cobodeck.setup.options import Options
from cobodeck.testing.chart_only import chart_of_text
from engine.chart import Chart, Library
from engine.operator.operator import Operator
from engine.run.chart_run import ChartRun
from tests.cobodeck.record.read.test_operated_replays import errands, of_one_run  # noqa: F401
from tests.cobodeck.record.read.test_record_replay import Act, recorded

pytestmark = pytest.mark.slow
ROVER = "rbkairos_ur10"
OTHER = """  work:
    do: Carry
    in: {weight: 0.2}
    next: {done: work, failed: work}
"""


def run_of(path: Path, acts: dict[float, Act], seconds: float = 9.0) -> Path:
    recorded(path, Options(duration_s=seconds), acts, chart="errands.yaml", robot=ROVER)
    return path


def other(operator: Operator, run: ChartRun, setup: Any) -> object:
    """Another version of the chart in the place of the one that runs; `work` is a leaf there."""
    return operator.replace(run.machine.changed(*changed()))


def changed() -> tuple[Chart, Library]:
    return chart_of_text(Path("other.txt").read_text(), catalogue())


def lines_of(path: Path) -> list[tuple[int, str, Any]]:
    """Time, topic and content of what counts, by plain mcap."""
    with path.open("rb") as file:
        told = make_reader(file).iter_messages(["trace", "operator", "tick"])
        return [(m.log_time, c.topic, json.loads(m.data)) for _, c, m in told]


def counted(path: Path) -> dict[str, Any]:
    """Visits, seconds, moves, waits and answers by chart and path, counted anew."""
    opened = dict[str, int]()
    found: dict[str, Any] = defaultdict(Counter)
    waiting: dict[str, str] = {}
    end_ns = 0
    for _, topic, told in lines_of(path):
        if topic == "tick":
            end_ns = max(end_ns, told["at_ns"])
        elif topic == "operator":
            given = dict(told["arguments"]["$dict"])
            asked = waiting.get(given.get("path"))
            if asked is not None and told["command"] in ("Answer", "ForceOutcome"):
                wanted = given.get("granted", given.get("outcome") == asked)
                found["agreed" if wanted else "differed"][given["path"]] += 1
                del waiting[given["path"]]
        else:
            at, kind, where, *detail = told["line"]
            if kind == "enter":
                found["visits"][where] += 1
                opened[where] = at
                waiting.pop(where, None)
            elif kind == "exit" and where in opened:
                found["ns"][where] += at - opened.pop(where)
            elif kind == "move":
                child = f"{where}/{detail[0]}".lstrip("/")
                found["moves"][child, detail[1], detail[2]] += 1
                waiting.pop(child, None)
            elif kind == "note" and str(detail[0]).startswith("asks to end with"):
                found["waits"][where] += 1
                waiting[where] = detail[0].rpartition(" ")[2]
    for where, since in opened.items():
        found["ns"][where] += end_ns - since
    return found


@pytest.fixture
def runs(errands: Path) -> list[Path]:  # noqa: F811
    """Runs whose operator did anything, and one whose chart was replaced by another."""
    before = Path("errands.yaml").read_text().partition("  work:\n")[0]
    Path("other.txt").write_text(before + OTHER)  # no chart of the project: it has the same name
    operated = [run_of(Path(f"{seed}.mcap"), of_one_run(seed)) for seed in range(4)]
    return [*operated, run_of(Path("other.mcap"), {0.2: other}, 3.0)]


def test_figures_are_those_of_an_independent_count(runs: list[Path]) -> None:
    expected: dict[str, Any] = defaultdict(Counter)
    for path in runs:
        for name, counts in counted(path).items():
            expected[name].update(counts)

    found = review(map(events_of, runs))

    states = {one.path: one for one in found.states}
    assert {one.chart for one in found.states} == {"errands"}
    assert {path: one.visits for path, one in states.items()} == expected["visits"]
    for name in ("waits", "agreed", "differed"):
        assert expected[name], name
        assert {p: n for p, one in states.items() if (n := getattr(one, name))} == expected[name]
    for path, one in states.items():
        assert one.total_s == pytest.approx(expected["ns"][path] / 1e9), path
        assert sum(one.outcomes.values()) == one.visits
    moved = {
        (p, t.outcome, t.to): t.count for p, one in states.items() for t in one.transitions if t.to
    }
    assert moved == expected["moves"]
    classes = {one.named: one.visits for one in found.classes}
    leaves = counted(Path("other.mcap"))["visits"]["work"]
    assert classes["Carry"] == states["work/both/carry"].visits + leaves
    assert leaves < states["work"].visits


def test_a_record_that_was_cut_off_counts_up_to_there(
    runs: list[Path], capsys: pytest.CaptureFixture[str]
) -> None:
    whole = runs[0].read_bytes()
    cut = Path("cut.mcap.part")
    cut.write_bytes(whole[: len(whole) * 2 // 3])

    some, every = events_of(cut), events_of(runs[0])

    assert 0 < len(some.events) < len(every.events)
    assert some.events == every.events[: len(some.events)]
    assert main(["evaluate", "states", str(cut), "other.mcap"]) == 0
    assert "errands" in capsys.readouterr().out


def test_a_run_in_which_nothing_ended_has_visits_alone(errands: Path) -> None:  # noqa: F811
    found = review([events_of(run_of(Path("short.mcap"), {}, 0.2))])

    fetch = next(one for one in found.states if one.path == "fetch")
    assert (fetch.visits, fetch.median_s, fetch.transitions) == (1, None, ())
    assert fetch.outcomes == {"(running)": 1}


def test_edges_count_for_the_chart_that_ran_then(runs: list[Path]) -> None:
    known, said = catalogue(), list[str]()
    moves = counted(Path("other.mcap"))["moves"]

    records = [Record(Path("other.mcap"))]
    then = edge_counts(*open_chart("errands.yaml", known), records, known, said.append)
    now = edge_counts(*changed(), records, known, said.append)

    assert now["work", "done"] == moves["work", "done", "work"] > 3
    assert "errands was another" in said[0]
    assert "work" not in {path for (path, _), count in then.items() if count}
