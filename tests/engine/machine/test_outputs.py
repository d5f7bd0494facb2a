"""Rule 9: what a state or an operator hands out is of the declared type, or it is a mistake."""

from __future__ import annotations

from enum import Enum, StrEnum
from typing import Any, Literal, Protocol

import pytest

from engine.machine.outputs import admits, checked
from engine.state import Action, Context, Run
from engine.types import from_annotation
from tests.engine.conftest import Bench


class Place:
    """Some class."""


class Nearby(Place):
    """One of its kind."""


class Side(StrEnum):
    """Members that are text."""

    LEFT = "left"


class Old(str, Enum):  # noqa: UP042  as it was written before StrEnum
    """Members that are text, too."""

    LEFT = "left"


class Shaped(Protocol):
    """What only a type checker understands."""


@pytest.mark.parametrize(
    ("kind", "right", "wrong"),
    [
        (float, (1, 1.5, -0.0), (None, "1", True, (1.0,))),
        (int, (1, 0), (None, 1.0, True, "1")),
        (bool, (True, False), (None, 1, "yes")),
        (str, ("", "a", Side.LEFT), (None, 1, b"a")),
        (Place, (Place(), Nearby()), (None, 1, Place)),
        (Nearby, (Nearby(),), (Place(),)),
        (Place | None, (None, Place()), (1, "none")),
        (Literal["left", "right"], ("left", Side.LEFT, Old.LEFT), ("up", None, 1)),
        (Literal[1, 2], (1, 2), (True, 1.0, "1", 3)),
        (tuple[float, ...], ((), (1.0, 2)), (1.0, (1.0, "a"), None)),
        (tuple[tuple[int, ...], ...], (((1,), ()),), ((1,), ((1.5,),))),
        (object, (None, 1, Place()), ()),
        (Shaped, (1, None), ()),
    ],
)
def test_rule_9_a_value_belongs_to_its_type_or_not(kind: Any, right: Any, wrong: Any):
    admitted = admits(from_annotation(kind))
    assert [value for value in right if not admitted(value)] == []
    assert [value for value in wrong if admitted(value)] == []


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("here", "output 'goal' is 'here'; declared: Place | none"),
        (2.5, "output 'goal' is 2.5; declared: Place | none"),
        ((1, 2), "output 'goal' is a tuple; declared: Place | none"),
        ([1], "a list can be changed by others; use tuples or frozen dataclasses"),
    ],
)
def test_rule_9_the_mistake_is_said_with_what_would_be_right(value: Any, text: str):
    with pytest.raises(TypeError) as found:
        checked({"goal": value}, {"goal": from_annotation(Place | None)}, {})
    assert str(found.value) == text


def test_rule_9_a_value_that_a_freezer_replaces_is_looked_at_afterwards():
    types = {"goal": from_annotation(tuple[float, ...])}
    assert checked({"goal": [1.0]}, types, {list: tuple}) == {"goal": (1.0,)}


class Measure(Action):
    """Says how far it is, as it was told to."""

    outcomes = ("near", "far")
    outputs = {"near": {"distance": float}}
    given: Any = 1.0

    def run(self, ctx: Context) -> Run:
        yield
        return "near", {"distance": self.given}


class Choose(Action):
    """Ends with a member of an enumeration."""

    outcomes = (Side.LEFT, "right")
    given: Any = Side.LEFT

    def run(self, ctx: Context) -> Run:
        yield
        return self.given


MEASURED = """
chart: c
outcomes: [x, wrong]
outputs: {x: {d: number}}
data: {d: {type: number, initial: 0}}
states:
  a: {do: Measure, out: {distance: d}, next: {near: .x, far: .x, error: .wrong}}
"""
CHOSEN = "chart: c\noutcomes: [x, y]\nstates:\n  a: {do: Choose, next: {left: .x, right: .y}}\n"


@pytest.mark.parametrize(("given", "outcome"), [(2.5, "x"), ("2.5", "wrong"), (None, "wrong")])
def test_rule_9_an_output_of_another_type_is_an_error_at_the_transition(
    given: Any, outcome: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(Measure, "given", given)
    bench = Bench(MEASURED, states=(Measure,), scripted=False)
    bench.tick(2)
    assert bench.run.outcome == outcome
    told = [f"{error.kind}: {error.text}" for error in bench.run.errors]
    shown = f"TypeError: output 'distance' is {given!r}; declared: number"
    assert told == ([] if outcome == "x" else [shown])


def test_rule_9_an_operator_cannot_force_an_output_of_another_type():
    bench = Bench(MEASURED, states=(Measure,), scripted=False)
    bench.tick()
    refused = bench.operator.force("a", "near", {"distance": "text"})
    assert refused == "output 'distance' is 'text'; declared: number"
    assert bench.operator.force("a", "near", {"distance": 3}) is None
    bench.tick()
    assert bench.run.results == {"d": 3}


def test_rule_9_nor_one_of_a_used_chart():
    text = MEASURED.replace("chart: c", "chart: inner")
    outer = """
chart: outer
outcomes: [x, wrong]
outputs: {x: {far: number}}
data: {far: {type: number, initial: 0}}
states:
  sub: {use: inner, out: {d: far}, next: {x: .x, wrong: .wrong}}
---
"""
    bench = Bench(outer + text.lstrip(), states=(Measure,), scripted=False)
    bench.tick()
    refused = bench.operator.force("sub", "x", {"d": (1.0,)})
    assert refused == "output 'd' is a tuple; declared: number"
    assert bench.operator.force("sub", "x", {"d": 4.5}) is None
    bench.tick()
    assert bench.run.results == {"far": 4.5}


def test_rule_9_a_stand_in_may_leave_outputs_out_but_gives_none_of_another_type():
    bench = Bench(MEASURED, states=(Measure,))
    bench.tick()
    bench.end("a", "near")
    bench.tick()
    assert bench.run.outcome == "x"
    bench = Bench(MEASURED, states=(Measure,))
    bench.tick()
    bench.end("a", "near", distance="far")
    bench.tick()
    assert bench.run.outcome == "wrong"


@pytest.mark.parametrize("given", [Side.LEFT, Old.LEFT, "left"])
def test_rule_8_a_member_of_an_enumeration_of_texts_is_an_outcome(
    given: Any, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(Choose, "given", given)
    bench = Bench(CHOSEN, states=(Choose,), scripted=False)
    bench.tick(2)
    assert bench.run.outcome == "x"
    assert {type(r.detail[0]) for r in bench.run.trace if r.kind == "outcome"} == {str}


@pytest.mark.parametrize("given", ["up", 1, None, (), ["left"]])
def test_rule_8_anything_else_is_none(given: Any, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(Choose, "given", given)
    bench = Bench(CHOSEN, states=(Choose,), scripted=False)
    bench.tick(2)
    assert bench.run.outcome == "error"
    assert bench.records("error") == [("error", "a", "UndeclaredOutcome")]


def test_rule_9_outputs_kept_by_a_box_that_ends_with_an_error_are_not_written():
    text = """
chart: c
outcomes: [x, y]
outputs: {x: {a: number}, y: {a: number}}
data: {a: {type: number, initial: 0}}
states:
  both:
    all:
      one: {do: Give, out: {value: a}}
      two: {do: Do}
    next: {done: .x, error: .y}
"""
    for end, found in (("done", ("x", 1.5)), (RuntimeError("two"), ("y", 0))):
        bench = Bench(text)
        bench.tick()
        bench.end("both/one", "done", value=1.5)
        bench.tick()
        bench.end("both/two", end)
        bench.tick()
        assert (bench.run.outcome, bench.run.results["a"]) == found


def test_rule_9_the_data_of_a_used_chart_are_new_at_each_entry():
    text = """
chart: outer
outcomes: [x]
states:
  sub: {use: inner, next: {again: sub, out: .x}}
---
chart: inner
outcomes: [again, out]
data: {v: {type: number, initial: 0}}
states:
  read: {do: Use, in: {value: v}, next: {done: write, failed: .out, other: .out}}
  write: {do: Give, out: {value: v}, next: {done: reread, failed: .out, other: .out}}
  reread: {do: Use, in: {value: v}, next: {done: .again, failed: .out, other: .out}}
"""
    bench = Bench(text)
    assert bench.script is not None
    for number in range(3):
        bench.tick()
        assert bench.script.inputs["sub/read"] == {"value": 0}
        bench.end("sub/read", "done")
        bench.end("sub/write", "done", value=float(number + 1))
        bench.tick()
        assert bench.script.inputs["sub/reread"] == {"value": number + 1.0}
        bench.end("sub/reread", "done")
