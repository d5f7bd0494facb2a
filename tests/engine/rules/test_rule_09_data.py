"""Rule 9 of engine/README.md: data."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from engine.state import Action
from tests.engine.rules.charts import DATA


def test_rule_9_outputs_appear_at_the_transition_and_inputs_are_read_at_entry(bench):
    b = bench(DATA)
    b.tick()
    b.end("give", "done", value=4.0)
    b.tick()
    assert b.script.inputs["use"] == {"value": 4.0}
    b.end("use", "done")
    b.tick()
    assert b.run.results == {"goal": 4.0}


def test_rule_9_outputs_of_losers_timeouts_and_failed_tries_are_dropped(bench):
    text = """
chart: c
outcomes: [x]
data: {goal: {type: number, initial: 0}}
states:
  both:
    any:
      one: {watch: See, next: {seen: .on, lost: .on}}
      two: {watch: Tell, out: {value: goal}, next: {seen: .on, lost: .on}}
    next: {on: use}
  use: {do: Use, in: {value: goal}, next: {done: .x, failed: .x, other: .x}}
"""
    b = bench(text)
    b.tick()
    b.end("both/two", "seen", value=9.0)
    b.end("both/one", "seen")
    b.tick()
    assert b.script.inputs["use"] == {"value": 0}


def test_rule_9_under_all_the_outputs_of_all_children_appear_when_it_ends(bench):
    text = """
chart: c
outcomes: [x]
outputs: {x: {a: number, b: number}}
data: {a: {type: number, initial: 0}, b: {type: number, initial: 0}}
states:
  both:
    all:
      one: {do: Give, out: {value: a}}
      two: {watch: Tell, out: {value: b}}
    next: {done: .x}
"""
    b = bench(text)
    b.tick()
    b.end("both/one", "done", value=1.0)
    b.tick()
    assert not b.records("data")
    b.end("both/two", "seen", value=2.0)
    b.tick()
    assert b.run.results == {"a": 1.0, "b": 2.0}


def test_rule_9_what_others_could_change_is_refused(bench):
    b = bench(DATA)
    b.tick()
    b.end("give", "done", value=[1, 2])
    b.tick()
    assert b.run.outcome == "error"
    assert b.records("error") == [("error", "give", "TypeError")]


class Grid:
    """A field of numbers, as an array is: whoever has it can change it."""

    def __init__(self, *numbers: float) -> None:
        self.numbers = list(numbers)


class FrozenGrid(Grid):
    """The same, which nobody can change."""


class Level(Enum):
    """A value of a fixed set."""

    LOW = 1


class Reading(NamedTuple):
    """A tuple with names."""

    grid: Grid
    level: Level


class Tenth(float):
    """A number of another library."""


class GiveAny(Action):
    """An action with an output of any type."""

    outcomes = ("done", "failed", "other")
    outputs = {"done": {"value": object}}

    def run(self, ctx):
        yield
        return "done", {"value": None}


def test_rule_9_freezers_reach_into_tuples_and_what_cannot_change_passes(bench):
    text = DATA.replace("do: Give", "do: GiveAny")
    freezers = {Grid: lambda grid: FrozenGrid(*grid.numbers)}
    b = bench(text, states=(GiveAny,), freezers=freezers)
    b.tick()
    given = (Grid(1.0), (Tenth(0.1), Level.LOW, True, b"", None), Reading(Grid(), Level.LOW))
    b.end("give", "done", value=given)
    b.tick()
    grid, others, reading = b.script.inputs["use"]["value"]
    assert type(grid) is type(reading.grid) is FrozenGrid
    assert others is given[1]
    assert reading.level is Level.LOW


def test_rule_9_what_can_be_changed_is_refused_inside_a_tuple_too(bench):
    b = bench(DATA)
    b.tick()
    b.end("give", "done", value=(1.0, (2.0, [3.0])))
    b.tick()
    assert b.records("error") == [("error", "give", "TypeError")]


USED = """
chart: outer
outcomes: [x]
outputs: {x: {result: number}}
data: {result: {type: number, initial: 7}}
states:
  sub: {use: inner, in: {start: result}, out: {answer: result}, next: {ok: .x}}
---
chart: inner
inputs: {start: number}
outcomes: [ok]
outputs: {ok: {answer: number}}
data: {answer: {type: number, initial: 0}, result: {type: number, initial: 3}}
states:
  use: {do: Use, in: {value: start}, next: {done: give, failed: give, other: give}}
  give: {do: Give, out: {value: answer}, next: {done: .ok, failed: .ok, other: use}}
"""


def test_rule_9_a_used_chart_has_data_of_its_own(bench):
    b = bench(USED)
    b.tick()
    assert b.script.inputs["sub/use"] == {"value": 7}
    b.end("sub/use", "done")
    b.end("sub/give", "done", value=5.0)
    b.tick()
    assert b.run.results == {"result": 5.0}
    assert b.run.value_of("result", "sub") == 3
