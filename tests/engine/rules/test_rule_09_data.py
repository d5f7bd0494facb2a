"""Rule 9 of engine/README.md: data."""

from __future__ import annotations

import re
from enum import Enum
from typing import NamedTuple

import pytest

from engine.chart.load import load_text
from engine.files.declared.values import Mismatch
from engine.interfaces import interface
from engine.literals import Constant
from engine.machine.machine import Machine
from engine.machine.named_values import NamedValues
from engine.run.chart_run import ChartRun
from engine.state import Action
from tests.engine.conftest import Use
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


BOTH = """
chart: c
outcomes: [x]
outputs: {x: {a: number, b: number}}
data: {a: {type: number, initial: 0}, b: {type: number, initial: 0}}
states:
  both:
    all:
      one: {do: Give, out: {value: a}}
      two: {do: Give, out: {value: b}}
    next: {done: .x, error: .x}
"""


def test_rule_9_under_all_they_are_written_in_document_order_whoever_ends_first(bench):
    b = bench(BOTH)
    b.tick()
    b.end("both/two", "done", value=2.0)
    b.tick()
    b.end("both/one", "done", value=1.0)
    b.tick()
    assert b.records("data") == [("data", "", "a", 1.0), ("data", "", "b", 2.0)]


def test_rule_9_what_was_kept_is_not_written_if_the_container_ends_with_an_error(bench):
    b = bench(BOTH)
    b.tick()
    b.end("both/one", "done", value=1.0)
    b.tick()
    b.end("both/two", RuntimeError("broken"))
    b.tick()
    assert (b.run.outcome, b.run.results) == ("x", {"a": 0, "b": 0})


LISTED = """
chart: c
outcomes: [x]
outputs: {x: {result: number}}
data: {result: {type: number, initial: 0}}
states:
  both:
    any:
      sub: {use: inner, out: {answer: result}}
      other: {do: Do}
    when:
      - {outcome: ended, if: {sub: ok}}
      - {outcome: ended, if: {other: done}}
    next: {ended: .x}
---
chart: inner
outcomes: [ok]
outputs: {ok: {answer: number}}
data: {answer: {type: number, initial: 3}}
any:
  tell: {watch: Tell, out: {value: answer}, next: {seen: .ok, lost: .ok}}
"""


def test_rule_9_a_chart_that_makes_a_list_match_hands_out_what_was_just_written(bench):
    b = bench(LISTED)
    b.tick()
    b.end("both/sub/tell", "seen", value=5.0)
    b.tick()
    assert b.run.results == {"result": 5.0}
    assert b.records("data") == [("data", "both/sub", "answer", 5.0), ("data", "", "result", 5.0)]


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


INPUTS = """
chart: c
inputs:
  start: number
  far: {type: length, default: 2 m}
  near: {type: length | none, default: none}
  name: {type: text, default: none}
outcomes: [x]
states:
  use: {do: Use, in: {value: start}, next: {done: .x, failed: .x, other: .x}}
"""


def given(**inputs):
    library = load_text(INPUTS)
    assert not library.findings
    states = {"Use": interface(Use)}
    around = NamedValues({"profile.ahead": Constant("30 cm")})
    return Machine(library["c"], library, states, inputs=inputs, around=around)


def test_rule_9_inputs_are_given_from_outside_as_in_a_chart():
    run = ChartRun(given(start=4, far="$profile.ahead", near="none", name="door"))
    run.tick(0)

    assert [run.value_of(key) for key in ("start", "far", "near", "name")] == [4, 0.3, None, "door"]


def test_rule_9_an_input_without_a_default_has_to_be_given():
    assert given().missing == ["start"]
    assert given(start=1).missing == []


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"start": "none"}, "start: nothing given; wanted: number"),
        ({"start": 1, "far": "2 s"}, "far: '2 s' is a duration; wanted: a length"),
        ({"start": 1, "far": "$profile.ahed"}, "far: there is no value $profile.ahed; did you"),
        ({"strat": 1}, "it has no input 'strat'; did you mean 'start'?"),
    ],
)
def test_rule_9_inputs_that_are_wrong_are_named(inputs, message):
    with pytest.raises(Mismatch, match=f"^{re.escape(message)}"):
        given(**inputs)


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
