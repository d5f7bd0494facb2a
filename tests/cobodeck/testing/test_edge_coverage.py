"""Which edges there are in a chart, and which of them a run has taken."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random

import pytest

from cobodeck.project import catalogue, open_chart
from cobodeck.testing.edge_coverage import EdgeCoverage, edges_of, taken
from cobodeck.testing.stub_parts import Parts
from cobodeck.testing.testing import ChartTester
from engine.machine import ASK, REOPEN, RETRY, Leaf, Machine, NamedValues, Route, explore
from engine.run import ChartRun
from tests.engine.conftest import Bench
from tests.engine.seeded_charts import made_of

ROOT = Path(__file__).resolve().parents[3]
LOOP = """
chart: loop
about: Parks, with further tries, beside two monitors.
outcomes: [over, failed]
any:
  fault: {watch: FaultRaised, priority: 1, next: {raised: .failed}}
  lost: {watch: UserLost, next: {lost: .over}}
  work:
    states:
      park:
        do: ParkArm
        retry: {times: 1, on: failed, wait: 1 s}
        timeout: 5 s
        next: {parked: again, failed: .failed, timeout: again}
      again: {do: ParkArm, next: {parked: park, failed: .over, error: park}}
    next: {over: .over, failed: .failed}
"""
BOTH = """
chart: both
outcomes: [done, failed]
all:
  arm: {do: ParkArm, retry: {times: 1, on: failed}}
  fault: {watch: FaultRaised}
when:
  - {outcome: failed, if: {arm: failed}}
  - {outcome: done, if: {arm: parked, fault: raised}}
"""
OUTER = """
chart: outer
outcomes: [over, failed]
states:
  first: {use: inner, next: {over: second, failed: .failed}}
  second: {use: inner, next: {over: .over, failed: .failed}}
"""
INNER = """
chart: inner
outcomes: [over, failed]
states:
  park: {do: ParkArm, next: {parked: .over, failed: .failed}}
"""
INPUTS = {"haptic": {"since": 0, "deep": {"x": "1 m", "y": "2 m", "z": "1 m"}}}


def edges_taken(sim: ChartTester) -> set[str]:
    return {f"{path} {outcome}" for path, outcome in taken(sim.run.machine, sim.run.trace)}


def machine_of(name: str) -> Machine:
    known = catalogue(ROOT)
    chart, library = open_chart(name, known)
    around = NamedValues(known.tuned.constants)
    return Machine(chart, library, known.interfaces, None, known.types, around=around)


@pytest.mark.parametrize("name", ["chase", "haptic", "escape", "inform", "cobodeck"])
def test_the_edges_of_a_chart_are_those_that_its_exploration_takes(name: str) -> None:
    machine = machine_of(name)

    found = explore(machine)

    assert found.complete
    assert {event for event, _ in edges_of(machine)} == {
        (path, outcome)
        for path, outcome in found.moves
        if outcome != "error"
        or "error" in {*machine.vertices[path].go, *machine.vertices[path].leave}
    }


@pytest.mark.parametrize("name", ["chase", "haptic", "cobodeck"])
def test_every_edge_is_taken_by_the_script_that_exploration_has_found_for_it(
    sim: ChartTester, name: str
) -> None:
    machine = machine_of(name)
    for event, script in list(explore(machine).moves.items())[::4]:
        if any(outcome in ("timeout", "error") for step in script for _, outcome in step):
            continue
        sim.start(name, inputs=INPUTS.get(name))
        sim.tick(2)
        for step in script:
            for path, outcome in step:
                leaf = sim.run.machine.vertices[path]
                assert isinstance(leaf, Leaf)
                sim.end(path, outcome, **dict.fromkeys(leaf.interface.outputs.get(outcome, {})))
            sim.tick(2)
        if sim.run.machine.vertices[script[0][0][0]].retry is None:
            assert event in taken(sim.run.machine, sim.run.trace), script


def test_a_further_try_takes_no_edge(sim: ChartTester) -> None:
    sim.start(LOOP, script={"park": "failed"})
    sim.wait(3)
    assert sim.path("park") == ["park", "park"]
    assert edges_taken(sim) == set()

    sim.end("park", "failed")
    sim.wait(3)

    assert edges_taken(sim) == {"work/park failed", "work failed"}


def test_an_outcome_that_loses_takes_no_edge(sim: ChartTester) -> None:
    sim.start(LOOP, script={"park": []})
    sim.tick()

    sim.end("fault", "raised")
    sim.end("lost", "lost")
    sim.tick()

    assert edges_taken(sim) == {"fault raised"}


def test_timeouts_and_mapped_errors_are_edges(sim: ChartTester) -> None:
    sim.start(LOOP, script={"again": [RuntimeError("broken"), "failed"]})

    sim.until("over", timeout=12)

    assert edges_taken(sim) == {
        "work/park timeout",
        "work/again error",
        "work/again failed",
        "work over",
    }


def test_an_outcome_that_is_kept_is_an_edge(sim: ChartTester) -> None:
    sim.start(BOTH, script={"arm": ["failed", "parked"]})
    sim.tick(5)
    assert edges_taken(sim) == {"arm parked"}

    sim.end("fault", "raised")
    sim.until("done", timeout=1)

    assert edges_taken(sim) == {"arm parked", "fault raised"}
    assert {f"{path} {outcome}" for (path, outcome), _ in edges_of(sim.run.machine)} == {
        "arm parked", "arm failed", "fault raised",
    }  # fmt: skip


def test_what_waits_for_consent_has_taken_no_edge_yet(sim: ChartTester) -> None:
    sim.start(LOOP, script={"park": "parked"})
    sim.operator.lock("work/park")
    sim.tick(3)
    assert edges_taken(sim) == set()

    sim.operator.consent("work/park")
    sim.tick(2)

    assert edges_taken(sim) == {"work/park parked"}


@pytest.fixture
def covering(sim: ChartTester, tmp_path: Path) -> ChartTester:
    (tmp_path / "outer.yaml").write_text(OUTER)
    (tmp_path / "inner.yaml").write_text(INNER)
    return ChartTester(tmp_path, ROOT, Parts(), EdgeCoverage())


def test_a_used_chart_counts_for_its_own_file_wherever_it_is_used(
    covering: ChartTester, tmp_path: Path
) -> None:
    covering.start("outer.yaml", script={"first/park": "parked"})
    covering.tick(2)
    covering.start("outer.yaml", script={"first/park": "parked", "second/park": "failed"})
    covering.tick(2)
    covering.finish()

    assert covering.covers is not None
    assert list(covering.covers.report(tmp_path)) == [
        "inner.yaml 2/2 edges (100 %)",
        "outer.yaml 2/4 edges (50 %)",
        "  outer.yaml:5  first: failed -> .failed",
        "  outer.yaml:6  second: over -> .over",
    ]
    assert covering.covers.share(tmp_path) == pytest.approx(4 / 6)
    assert covering.covers.share(tmp_path / "elsewhere") == 1.0


def test_the_counts_of_several_processes_are_added(covering: ChartTester, tmp_path: Path) -> None:
    both = EdgeCoverage()
    for outcome in ("parked", "failed"):
        covering.covers = EdgeCoverage()
        covering.start("inner.yaml", script={"park": outcome})
        covering.tick(2)
        covering.finish()
        both.merge(covering.covers.rows())

    assert list(both.report(tmp_path)) == ["inner.yaml 2/2 edges (100 %)"]


def test_a_chart_that_is_text_in_a_test_is_left_out(covering: ChartTester, tmp_path: Path) -> None:
    covering.start(LOOP)
    covering.finish()

    assert covering.covers is not None
    assert list(covering.covers.report(tmp_path)) == []


def carried_out(run: ChartRun) -> set[tuple[str, str]]:
    """The edges that a run takes from now on, by what the engine carries out."""
    found: set[tuple[str, str]] = set()
    carry_out = run._carry_out

    def watched(route: Route) -> None:
        again = route.kind in (ASK, RETRY, REOPEN)
        ends = [*route.ends, (route.cause, route.came)]
        found.update((node.path, came) for node, came in ends if not (again and node is route.top))
        carry_out(route)

    run._carry_out = watched  # type: ignore[method-assign]
    return found


@pytest.mark.parametrize("first", range(0, 100, 50))
def test_the_trace_tells_which_edges_the_engine_has_carried_out(first: int) -> None:
    taken_at_all = 0
    for seed in range(first, first + 50):
        charts, script = made_of(seed), Random(seed)
        bench = Bench("---\n".join(json.dumps(chart) + "\n" for chart in charts.values()))
        expected = carried_out(bench.run)
        for _ in range(25):
            for path in bench.active:
                if script.random() < 0.3:
                    leaf = bench.machine.vertices[path]
                    assert isinstance(leaf, Leaf)
                    end = script.choice([*leaf.interface.outcomes, RuntimeError("scripted")])
                    bench.end(path, end)
            bench.tick()

        edges = {event for event, _ in edges_of(bench.machine)}
        found = set(taken(bench.machine, bench.run.trace))
        assert found & edges == expected & edges, seed
        taken_at_all += len(expected & edges)
    assert taken_at_all > 100
