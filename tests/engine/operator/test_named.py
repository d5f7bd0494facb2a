"""Rules 11 and 15 where charts write values and nodes name outcomes, signals and parts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from engine.chart.load import load_text
from engine.machine.machine import Machine
from engine.signals.board import Board
from tests.engine.conftest import Bench
from tests.engine.written_states import AROUND, INTERFACES, SIGNALS, STATES, TYPES, Spot

TEXT = """\
chart: c
outcomes: [x, y]
outputs: {x: {name: text}}
parameters: {eye: {type: signal of length, default: s.far}}
data: {word: {type: text, initial: hello}, name: {type: text, initial: none}}
any:
  pick:
    do: Pick
    with: {cases: [red, blue]}
    in: {value: word}
    out: {chosen: name}
    next: {red: .x, blue: .y, other: .y}
  go: {do: Go, in: {goal: {x: 2 m, y: 50 cm}}, next: {done: .y, failed: .y, other: .y}}
  back: {do: Go, in: {goal: {place: dock}}, next: {done: .y, failed: .y, other: .y}}
  push: {do: Push, with: {part: left}, next: {done: .y, failed: .y, other: .y}}
  over: {watch: Over, with: {signal: $eye, limit: 2 m}, next: {seen: .y, lost: .y}}
"""
BINDING = {"types": TYPES, "around": AROUND}


class Part:
    """A part."""

    def stop(self) -> None:
        """Stop."""


def bench_of(text: str = TEXT, **given: Any) -> Bench:
    parts = {"left": Part(), "right": Part()}
    bench = Bench(text, states=STATES, binding=BINDING, board=Board(SIGNALS), parts=parts, **given)
    bench.tick()
    return bench


def machine_of(text: str, **binding: Any) -> Machine:
    library = load_text(text)
    assert not library.findings, library.findings
    return Machine(library["c"], library, INTERFACES, **{**BINDING, **binding})


def test_rule_11_a_named_outcome_is_forced_with_its_outputs():
    b = bench_of()
    assert b.operator.force("pick", "red", {"chosen": "by hand"}) is None
    b.tick()
    assert (b.run.outcome, b.run.results) == ("x", {"name": "by hand"})


@pytest.mark.parametrize(
    ("outcome", "outputs", "told"),
    [
        ("green", {}, "'pick' has no outcome 'green'; allowed: blue, other, red"),
        ("$cases", {}, "'pick' has no outcome '$cases'; allowed: blue, other, red"),
        ("red", {}, "'red' comes with ['chosen'], given: []"),
        ("other", {"chosen": "a"}, "'other' comes with [], given: ['chosen']"),
        ("blue", {"chosen": 5}, "output 'chosen' is 5; declared: text"),
    ],
)
def test_rule_11_what_a_node_does_not_name_is_not_forced(outcome, outputs, told):
    b = bench_of()
    assert b.operator.force("pick", outcome, outputs) == told
    b.tick()
    assert b.run.outcome is None


def test_rule_8_an_outcome_that_the_node_does_not_name_is_an_error():
    b = bench_of()
    b.end("pick", "green")
    b.tick()
    assert b.run.outcome == "error"
    assert "declared: red, blue, other" in b.run.errors[-1].text


@pytest.mark.parametrize(
    ("old", "new", "path"),
    [
        ("cases: [red, blue]", "cases: [blue, red]", "pick"),
        ("{x: 2 m, y: 50 cm}", "{x: 2 m, y: 51 cm}", "go"),
        ("{x: 2 m, y: 50 cm}", "{place: kitchen}", "go"),
        ("{place: dock}", "{place: kitchen}", "back"),
        ("part: left", "part: right", "push"),
        ("limit: 2 m", "limit: 3 m", "over"),
        ("in: {value: word}", "in: {value: name}", "pick"),
    ],
)
def test_rule_11_what_a_running_node_names_or_is_given_stays_as_it_is(old, new, path):
    b = bench_of()
    (refused,) = b.operator.replace(machine_of(TEXT.replace(old, new)))
    assert refused.startswith(f"{path!r} is active and differs")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("{x: 2 m, y: 50 cm}", "{y: 0.5, x: 200 cm}"),
        ("{place: dock}", "{x: 1 m, y: 2 m}"),
        ("limit: 2 m", "limit: 2000 mm"),
        ("signal: $eye", "signal: s.far"),
    ],
)
def test_rule_11_another_way_to_write_the_same_is_no_change(old, new):
    b = bench_of()
    assert b.operator.replace(machine_of(TEXT.replace(old, new))) == []
    b.end("pick", "blue", chosen="a")
    b.tick()
    assert b.run.outcome == "y"


def test_rule_11_a_place_that_has_moved_is_another_value():
    b = bench_of()
    moved = replace(AROUND, named={"place": {"dock": Spot(9.0), "kitchen": Spot(0.0)}})
    (refused,) = b.operator.replace(machine_of(TEXT, around=moved))
    assert refused.startswith("'back' is active and differs")


def test_rule_11_what_does_not_run_yet_may_name_something_else():
    text = """\
chart: c
outcomes: [x]
data: {word: {type: text, initial: hello}}
states:
  go: {do: Go, in: {goal: {x: 1 m}}, next: {done: pick, failed: .x, other: .x}}
  pick: {do: Pick, with: {cases: [red]}, in: {value: word}, next: {red: .x, other: go}}
"""
    b = bench_of(text)
    other = text.replace("[red]", "[blue]").replace("red:", "blue:")
    assert b.operator.replace(machine_of(other)) == []
    b.end("go", "done", where=Spot(1.0))
    b.tick()
    assert b.operator.force("pick", "red", {"chosen": "a"}) is not None
    assert b.operator.force("pick", "blue", {"chosen": "a"}) is None
    b.tick()
    assert b.run.outcome == "x"


def played(text: str = TEXT, commands: Any = None) -> Bench:
    """Five ticks; `commands` with their instants, or what an operator does."""
    b = Bench(text, states=STATES, binding=BINDING, board=Board(SIGNALS), parts={"left": Part()})
    for number in range(5):
        for at, command in commands or ():
            if at == b.now:
                b.run.command(command)
        if commands is None and number == 3:
            assert b.operator.force("pick", "red", {"chosen": "by hand"}) is None
        b.tick()
    return b


def test_rule_15_what_an_operator_forced_is_replayed_with_the_same_trace():
    first = played()
    again = played(commands=list(first.run.carried_out))
    assert first.run.outcome == again.run.outcome == "x"
    assert first.run.trace.sha256() == again.run.trace.sha256()


def test_rule_15_the_trace_is_that_of_the_values_not_of_how_they_are_written():
    text = """\
chart: c
outcomes: [x]
outputs: {x: {spots: list of Spot, first: Spot}}
data: {spots: list of Spot, first: {type: Spot, initial: {place: dock}}}
states:
  keep:
    do: Keep
    in: {value: first}
    out: {item: first}
    next: {done: .x, failed: .x, other: .x}
"""
    runs = []
    for place in ("{place: dock}", "{x: 100 cm, y: 2}", "{place: kitchen}"):
        b = bench_of(text.replace("{place: dock}", place))
        b.end("keep", "done", item=b.script.inputs["keep"]["value"])
        b.tick()
        runs.append(b.run)
    first, again, other = (run.trace.sha256() for run in runs)
    assert first == again != other
