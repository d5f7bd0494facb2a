"""Constants, values from outside of all charts: `$profile.chase.inner`."""

from __future__ import annotations

import re

import pytest

from engine.chart.load import load_text
from engine.check.all_checks import check
from engine.files import Duration, Length
from engine.files.declared import Mismatch
from engine.interfaces import interface
from engine.literals import Constant, ConstantMismatch, Reference, constants_in
from engine.machine.machine import Machine
from engine.machine.named_values import NamedValues
from engine.state import Action, Context

CHART = """\
chart: c
parameters: {far: {type: length, default: $robot.far}}
inputs: {shown: {type: length, default: $robot.far}}
outcomes: [over]
data: {kept: {type: length, initial: $robot.near}}
states:
  go:
    do: Go
    with: {to: $robot.near, past: $far, stops: [$robot.near, 3 m]}
    in: {kept: kept, shown: shown, wait: $robot.pause}
    timeout: $robot.patience
    next: {there: .over, timeout: .over}
"""
CONSTANTS = {
    "robot.near": Constant("50 cm", "body: near"),
    "robot.far": Constant(2.0, "body: far"),
    "robot.pause": Constant("200 ms"),
    "robot.patience": Constant("5 s"),
    "robot.nothing": Constant(None, "body: nothing"),
}


class Go(Action):
    """Goes."""

    outcomes = ("there",)

    def __init__(self, to: Length, past: Length, stops: tuple[Length, ...]) -> None:
        self.at = (to, past, stops)

    def run(self, ctx: Context, kept: Length, shown: Length, wait: Duration) -> str:
        return "there"


STATES = {"Go": interface(Go)}


def machine(text: str = CHART) -> Machine:
    library = load_text(text)
    return Machine(library["c"], library, STATES, around=NamedValues(CONSTANTS))


def test_a_constant_stands_wherever_a_value_may() -> None:
    built = machine()
    (leaf,) = built.leaves
    assert leaf.parameters == {"to": 0.5, "past": 2.0, "stops": (0.5, 3.0)}
    assert leaf.given == {"wait": 0.2}
    assert leaf.timeout_ns == 5 * 10**9
    assert {name: cell.initial for name, cell in built.root.cells.items()} == {
        "shown": 2.0,
        "kept": 0.5,
    }


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("with: {to: $robot.near", "with: {to: $robot.nothing"),
        ("default: $robot.far}}\noutcomes", "default: $robot.nothing}}\noutcomes"),
        ("stops: [$robot.near", "stops: [$robot.nothing"),
        ("initial: $robot.near", "initial: $robot.nothing"),
        ("timeout: $robot.patience", "timeout: $robot.nothing"),
    ],
)
def test_a_constant_of_another_type_is_told_with_its_name_and_origin(
    right: str, wrong: str
) -> None:
    assert right in CHART
    with pytest.raises(ConstantMismatch, match=r"\$robot\.nothing \(body: nothing\)") as failure:
        machine(CHART.replace(right, wrong))
    assert failure.value.name == "robot.nothing"


def test_a_constant_that_there_is_not_is_told_with_one_that_is_near() -> None:
    with pytest.raises(Mismatch, match=re.escape("there is no value $robot.nar; did you mean")):
        machine(CHART.replace("to: $robot.near", "to: $robot.nar"))


@pytest.mark.parametrize(
    ("wrong", "message", "hint"),
    [
        ("robot.nar", "to: there is no value $robot.nar", "did you mean 'robot.near'?"),
        ("robot.pause", "to: $robot.pause: '200 ms' is a duration; wanted: a length", ""),
        ("robot.nothing", "to: $robot.nothing (body: nothing): nothing given", ""),
    ],
)
def test_constants_are_checked_before_a_run(wrong: str, message: str, hint: str) -> None:
    library = load_text(CHART.replace("to: $robot.near", f"to: ${wrong}"))
    (finding,) = check(library, STATES, around=NamedValues(CONSTANTS))
    assert (finding.code, finding.place.line) == ("N09", 9)
    assert finding.message.startswith(message)
    assert hint in finding.hint


def test_constants_are_found_inside_values() -> None:
    a, b, parameter = Reference("x.a"), Reference("x.b"), Reference("c")
    assert list(constants_in({"x": a, "y": [b, parameter, 3]})) == ["x.a", "x.b"]
    assert list(constants_in(a)) == ["x.a"]
    assert list(constants_in("x.a")) == []
