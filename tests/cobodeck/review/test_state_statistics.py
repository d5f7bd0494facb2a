"""Statistics of nodes: what is counted, by the trace alone and with the operator's commands."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.record.format.sink import open_free
from cobodeck.review.node_visits import NodeVisit, visits_of
from cobodeck.review.run_events import ANSWER, FORCE, RunEvents, events_of, names_of
from cobodeck.review.state_statistics import review
from cobodeck.run import trace_file
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from cobodeck.testing.testing import ChartTester
from engine.chart.load import load_text
from engine.operator.commands import Answer, ForceOutcome
from engine.run.trace import TraceRecord
from tests.cobodeck.review.runs import recorded

ASKING = """
chart: asking
outcomes: [over, failed]
states:
  drive:
    do: DriveTo
    in: {goal: {x: 1 m, y: 0 m}}
    autonomy: {arrived: high}
    next: {arrived: park, no_path: .failed, stuck: .failed, lost: .failed}
  park: {do: ParkArm, next: {parked: .over, failed: .failed}}
"""


def events_in(run: object, file: str = "run") -> RunEvents:
    """The events of a run that is at hand, its operator's commands among them."""
    told: list[tuple[int, int, TraceRecord]] = []
    for at, command in run.carried_out.since(0):  # type: ignore[attr-defined]
        if isinstance(command, Answer):
            event = TraceRecord(at, ANSWER, command.path, (command.granted,))
        elif isinstance(command, ForceOutcome):
            event = TraceRecord(at, FORCE, command.path, (command.outcome,))
        else:
            continue
        told.append((at, 0, event))
    told += [(record.time, 1, record) for record in run.trace]  # type: ignore[attr-defined]
    events = tuple(event for *_, event in sorted(told, key=lambda one: one[:2]))
    until = max((event.time for event in events), default=0)
    return RunEvents(Path(file), "asking", {"drive": "DriveTo"}, events, until, operated=True)


NAMING = """
chart: outer
states:
  first: {use: inner, next: {done: second}}
  second: {use: unknown, next: {done: third}}
  third: {any: {go: {do: DriveTo}, see: {watch: UserNear}}}
---
chart: inner
states:
  again: {use: outer, next: {done: .done}}
"""


def test_states_and_charts_are_named_also_in_used_charts_and_a_circle_ends() -> None:
    charts = [load_text(text, "x.yaml") for text in NAMING.split("---")]
    library = {name: chart for found in charts for name, chart in found.items()}

    assert dict(names_of(library["outer"], library)) == {
        "first": "inner", "first/again": "outer", "second": "unknown",
        "third/go": "DriveTo", "third/see": "UserNear",
    }  # fmt: skip


def asking(sim: ChartTester) -> None:
    sim.start(ASKING)
    sim.operator.set_level("high")
    sim.wait(1.0)
    sim.end("drive", "arrived")
    sim.wait(0.5)
    assert sim.operator.waiting() == {"drive": "arrived"}


def drives(sim: ChartTester) -> list[NodeVisit]:
    return [visit for visit in visits_of(events_in(sim.run)) if visit.path == "drive"]


def test_a_consent_agrees_its_wait_is_told_apart_and_figures_are_sums_over_runs(
    sim: ChartTester,
) -> None:
    asking(sim)
    sim.operator.consent("drive")
    sim.wait(0.2)

    (visit,) = drives(sim)

    assert (visit.ended, visit.led, visit.asked, visit.agreed) == (
        "arrived",
        "park",
        "arrived",
        True,
    )
    assert visit.lasted_s == pytest.approx(1.0, abs=0.1)
    assert visit.waited_ns / 1e9 == pytest.approx(0.5, abs=0.1)

    run = events_in(sim.run)
    found = review([run, run])
    drive = next(one for one in found.states if one.path == "drive")

    assert found.runs == 2
    assert (drive.visits, drive.waits, drive.agreed, drive.differed) == (2, 2, 2, 0)
    assert drive.outcomes == {"arrived": 2}
    assert [(t.outcome, t.to, t.count) for t in drive.transitions] == [("arrived", "park", 2)]
    assert [one.named for one in found.classes] == ["DriveTo"]
    assert found.classes[0].total_s == drive.total_s


def test_a_refusal_differs_and_the_further_try_is_a_visit(sim: ChartTester) -> None:
    asking(sim)
    sim.operator.refuse("drive")
    sim.wait(0.2)

    first, second = drives(sim)

    assert (first.agreed, first.led) == (False, "")
    assert (second.agreed, second.ended) == (None, "(running)")


@pytest.mark.few(1)
@pytest.mark.parametrize(("outcome", "agreed"), [("arrived", True), ("stuck", False)])
def test_a_forced_outcome_agrees_if_it_is_the_one_asked_for(
    sim: ChartTester, outcome: str, agreed: bool
) -> None:
    asking(sim)
    assert sim.operator.force("drive", outcome) is None
    sim.wait(0.2)

    (visit,) = drives(sim)

    assert (visit.ended, visit.asked, visit.agreed) == (outcome, "arrived", agreed)
    assert not visit.forced


def test_a_node_forced_while_it_runs_wanted_nothing(sim: ChartTester) -> None:
    sim.start(ASKING)
    sim.wait(0.5)
    sim.operator.force("drive", "arrived")
    sim.wait(0.2)

    (visit,) = drives(sim)

    assert (visit.ended, visit.led) == ("arrived", "park")
    assert visit.forced
    assert visit.agreed is None


def test_a_consent_that_nobody_gave_is_no_answer(sim: ChartTester) -> None:
    asking(sim)
    sim.operator.set_level(None)
    sim.wait(0.2)

    (visit,) = drives(sim)

    assert (visit.led, visit.agreed) == ("park", None)
    assert visit.waited_ns > 0


@pytest.mark.slow
def test_a_record_and_its_trace_file_agree(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = Options(tier=0, seed=4, duration_s=60.0)
    result = recorded(Path("run.mcap"), options)
    sink = open_free(Path("run.trace.jsonl"), trace_file.ENDING)
    trace_file.write(sink, open_setup(), result)

    by_record = visits_of(events_of(Path("run.mcap")))
    by_trace = visits_of(events_of(Path("run.trace.jsonl")))

    def seen(visits: list[NodeVisit]) -> list[tuple[str, int, str, str]]:
        return [(v.path, v.start_ns, v.ended, v.led) for v in visits]

    assert seen(by_record) == seen(by_trace)
    entered = Counter(r.subject for r in result.wired.run.trace if r.kind == "enter")
    assert Counter(visit.path for visit in by_record) == entered

    assert main(["evaluate", "states", "run.mcap", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert {one["path"]: one["visits"] for one in told["states"]} == entered
    named = {one["named"]: one["visits"] for one in told["classes"]}
    assert named["chase"] == sum(n for path, n in entered.items() if path.endswith("chase"))
    whole = Path("run.mcap").read_bytes()
    Path("cut.mcap").write_bytes(whole[: len(whole) * 3 // 4])
    assert main(["evaluate", "states", "run.mcap", "cut.mcap"]) == 0
    assert "cut.mcap: it breaks off at byte" in capsys.readouterr().out
    assert main(["evaluate", "states", "run.trace.jsonl"]) == 0
    assert "trace files tell neither classes" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["states"], "name the records"),
        (["states", "none.mcap"], "cannot be read"),
        (["states", "odd.jsonl"], "neither a record"),
        (["states", "broken.jsonl"], "broken.jsonl:2:1: line 2 is no record of a trace"),
        (["paper", "some.mcap"], "makes its own runs"),
    ],
)
def test_mistakes_are_told_by_file(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    Path("odd.jsonl").write_text("{}\n")
    head = '{"format": "cobodeck trace 1", "chart": {"name": "x"}}'
    Path("broken.jsonl").write_text(f"{head}\n[1]\n")

    assert main(["evaluate", *arguments]) != 0
    assert said in capsys.readouterr().err
