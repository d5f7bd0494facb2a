"""What passes the checks can be built, and a run finds a way for every outcome."""

from __future__ import annotations

import random
from collections.abc import Mapping
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from engine.chart.chart import Chart
from engine.chart.load import Library
from engine.check.all_checks import check
from engine.machine.machine import Machine
from engine.machine.scripted_states import LeafScript
from engine.machine.vertices import Box, Leaf, Vertex
from engine.run.chart_run import ChartRun
from tests.engine import written_states as written
from tests.engine.check.some_charts import INTERFACES, Maker, damage, library
from tests.engine.written_charts import written_of
from tests.repeats import examples

TICK_NS = 100_000_000
VALUES: Mapping[str, Any] = {"number": 1.0, "text": "word", "any": 2, "boolean": True}


def passing(found: Library) -> bool:
    return not any(finding.severity == "error" for finding in check(found, INTERFACES))


def given_parameters(chart: Chart) -> dict[str, Any]:
    required = (parameter for parameter in chart.parameters.values() if parameter.required)
    return {parameter.name: VALUES.get(parameter.type, 1) for parameter in required}


def machines(found: Library) -> list[Machine]:
    return [Machine(chart, found, INTERFACES, given_parameters(chart)) for chart in found.values()]


def end_of(vertex: Vertex, outcome: str) -> str | None:
    """The outcome with which the chart ends if `vertex` ends so; `None` if it goes on."""
    while vertex.parent is not None:
        if outcome in vertex.go or (outcome not in vertex.leave and vertex.parent.keeps):
            return None
        outcome = vertex.leave.get(outcome, outcome)
        vertex = vertex.parent
    return outcome


def outcomes_of(vertex: Vertex) -> list[str]:
    own = ["error"] if vertex.timeout_ns is None else ["error", "timeout"]
    if isinstance(vertex, Leaf):
        return [*own, *vertex.interface.outcomes]
    assert isinstance(vertex, Box)
    return own + [outcome for outcome, _ in vertex.rules if vertex.keeps]


def play(machine: Machine, chance: random.Random, ticks: int = 40) -> ChartRun:
    """Run with leaves that end by chance; what they read has been written."""
    script = LeafScript(machine)
    run = ChartRun(machine, stand_ins=script.stand_ins)
    leaves = {leaf.path: leaf for leaf in machine.leaves}
    for tick in range(ticks):
        for path in run.active:
            leaf = leaves.get(path)
            if leaf is not None and chance.random() < 0.5 and leaf.interface.outcomes:
                outcome = chance.choice(leaf.interface.outcomes)
                produced = leaf.interface.outputs.get(outcome, {})
                values = {name: VALUES[kind.name] for name, kind in produced.items()}
                values |= {n: None for n, k in produced.items() if k.optional and tick % 2}
                script.end(path, outcome, **values)
        if run.tick(tick * TICK_NS) is not None:
            break
        for path, inputs in script.inputs.items():
            for name, value in inputs.items():
                kind = leaves[path].interface.inputs[name].type
                assert value is not None or kind.optional, (path, name)
    return run


@given(st.integers(0, 2**32), st.integers(0, 2))
@settings(deadline=None, max_examples=examples(300), derandomize=True)
def test_what_passes_can_be_built_and_every_outcome_leads_somewhere(seed: int, harm: int) -> None:
    chance = random.Random(seed)
    charts = Maker(chance).charts()
    for _ in range(harm):
        damage(chance.choice(charts), chance)
    found = library(charts)
    if not passing(found):
        return
    for machine in machines(found):
        ways = [end_of(v, outcome) for v in machine.vertices.values() for outcome in outcomes_of(v)]
        assert set(ways) <= {None, "error", *machine.chart.outcomes}


@given(st.integers(0, 2**32))
@settings(deadline=None, max_examples=examples(150), derandomize=True)
def test_what_passes_runs_and_reads_only_what_was_written(seed: int) -> None:
    chance = random.Random(seed)
    found = library(Maker(chance).charts())
    if not passing(found):
        return
    for machine in machines(found):
        if not machine.chart.inputs:
            run = play(machine, chance)
            assert "error" not in {record.kind for record in run.trace}
            if run.outcome is not None:
                results = [run.results[n] for n in machine.chart.outputs.get(run.outcome, ())]
                assert None not in results


@pytest.mark.parametrize(("harm", "least"), [(0, 50), (1, 10)])
def test_the_random_charts_are_of_both_kinds(harm: int, least: int) -> None:
    passed = 0
    for seed in range(200):
        chance = random.Random(seed)
        charts = Maker(chance).charts()
        for _ in range(harm):
            damage(chance.choice(charts), chance)
        passed += passing(library(charts))
    assert least < passed < 200 - least


def written_machines(charts: dict[str, Any]) -> list[Machine] | None:
    """The machines of charts with values; None where they are refused, or name unknown places."""
    found = library(list(charts.values()))
    parts = [f"p{number}" for number in range(1000)]
    told = check(
        found, written.INTERFACES, types=written.TYPES, signals=written.SIGNALS, parts=parts,
        around=written.AROUND,
    )  # fmt: skip
    ours = ("S06", "S08", "F03")  # which runs do not need
    wrong = [f for f in told if f.code == "N13" or f.severity == "error"]
    if any(f.code not in ours and "has no outcome" not in f.message for f in wrong):
        return None
    values: dict[str, Any] = {"Spot": {"x": 1}, "signal of length": "s.far", "text": "p1"}
    return [
        Machine(
            chart,
            found,
            written.INTERFACES,
            {p.name: values.get(p.type, 1) for p in chart.parameters.values() if p.required},
            types=written.TYPES,
            around=written.AROUND,
        )
        for chart in found.values()
    ]


@given(st.integers(0, 2**32), st.integers(0, 1))
@settings(deadline=None, max_examples=examples(600), derandomize=True)
def test_what_passes_can_be_built_with_all_that_charts_write(seed: int, harm: int) -> None:
    chance, charts = random.Random(seed), written_of(seed).charts
    for _ in range(harm):
        damage(chance.choice(list(charts.values())), chance)
    built = written_machines(charts)
    assert built or harm


WORDS = st.sampled_from(
    ("do", "watch", "use", "states", "any", "all", "next", "in", "out", "with", "timeout", "retry",
     "autonomy", "priority", "when", "outcome", "if", "times", "on", "wait", "type", "default",
     "initial", "a", "b", "done", "failed", ".done", "main", "Work", "Give", "Take", "Near",
     "value", "number", "$a", "error", ".error", "", "5 s", "low", "none")
)  # fmt: skip
ANYTHING = st.recursive(
    WORDS | st.none() | st.booleans() | st.integers(-2, 9) | st.floats(allow_nan=False),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(WORDS, inner, max_size=5),
    max_leaves=25,
)
TOP = (
    "parameters",
    "inputs",
    "outcomes",
    "outputs",
    "data",
    "when",
    "about",
    "states",
    "any",
    "all",
)


@given(st.fixed_dictionaries({}, optional=dict.fromkeys(TOP, ANYTHING)))
@settings(deadline=None, max_examples=examples(400), suppress_health_check=list(HealthCheck))
def test_any_nonsense_is_refused_without_an_exception(chart: dict[str, Any]) -> None:
    found = library([{"chart": "main"} | chart])
    if passing(found):
        assert machines(found)
