"""Rules 9 and 16 where nodes name signals and outcomes: types of values, exploration."""

from __future__ import annotations

import json
from typing import ClassVar, TypeVar

from hypothesis import given, settings, strategies as st

from engine.machine.exploration import explore
from engine.machine.named_values import NamedValues
from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare, types_of
from engine.state import Context, Key, Monitor, On, Run
from tests.engine.conftest import Bench
from tests.engine.machine.test_exploration import run_script
from tests.engine.written_charts import written_of
from tests.engine.written_states import AROUND, SIGNALS, STATES, TYPES, Spot
from tests.repeats import THOROUGH, examples


@given(st.integers(0, 10**6))
@settings(deadline=None, max_examples=examples(120) if THOROUGH else 10, derandomize=True)
def test_rule_16_the_runner_takes_every_edge_that_exploration_finds_by_named_outcomes(seed):
    case = written_of(seed)
    text = "---\n".join(json.dumps(chart) + "\n" for chart in case.charts.values())
    binding = {"types": TYPES, "around": AROUND, "inputs": case.inputs}

    def fresh() -> Bench:
        bench = Bench(text, states=STATES, binding=binding, board=Board(SIGNALS), parts={})
        for vertex in bench.machine.vertices.values():
            vertex.timeout_ns = vertex.timeout_ns and 10**15
            vertex.retry = None
        return bench

    found = explore(fresh().machine, limit=60)
    named = {leaf.path for leaf in fresh().machine.leaves if leaf.interface.name == "Pick"}
    edges = [script for (path, _), script in found.moves.items() if path in named]
    for script in sorted(set(edges))[:8]:
        if all(len(step) == 1 or "timeout" not in dict(step).values() for step in script):
            run_script(fresh(), script)


T = TypeVar("T")


class Equals(Monitor):
    """`there` once a signal has this value."""

    outcomes = ("there",)
    outputs: ClassVar = {"there": {"value": T}}
    reads: ClassVar = {"$signal": None}

    def __init__(self, signal: Key[T], value: T | None = None) -> None:
        self.signal, self.value = signal, value

    def run(self, ctx: Context) -> Run:
        while ctx.value(self.signal) != self.value:
            yield On(self.signal)
        return "there", {"value": self.value}


def test_rule_9_a_value_beside_a_signal_is_of_the_type_of_the_signal():
    signals = declare([Measured("s.spot", Spot)])
    text = """\
chart: c
outcomes: [x]
outputs: {x: {spot: Spot}}
data: {spot: {type: Spot, initial: none}}
any:
  a: {watch: Equals, with: {signal: s.spot, value: {x: 1 m, y: 20 cm}}, out: {value: spot},
      next: {there: .x}}
"""
    around = NamedValues(signals=types_of(signals))
    binding = {"types": TYPES, "around": around}
    bench = Bench(text, (Equals,), scripted=False, binding=binding, board=Board(signals))
    for spot in (Spot(1.0), Spot(1.0, 0.2)):
        assert bench.run.outcome is None
        bench.run.board.put("s.spot", spot, bench.now)
        bench.tick()
    assert bench.run.results == {"spot": Spot(1.0, 0.2)}
    (leaf,) = bench.machine.leaves
    assert leaf.interface.outputs == {"there": {"value": TYPES["Spot"]}}
    assert leaf.interface.reads == {"s.spot": None}
