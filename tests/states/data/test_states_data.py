"""States that compute with data."""

from __future__ import annotations

import math
from typing import Any

import pytest

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.source import read
from engine.interfaces import interface
from engine.machine.machine import Machine
from engine.run.chart_run import ChartRun
from engine.signals.board import Board
from engine.state import State
from states.data.states import Compare, Format, Index, Log, Sum, Switch

READY: tuple[type[State], ...] = (Compare, Format, Index, Log, Sum, Switch)
INTERFACES = {cls.__name__: interface(cls) for cls in READY}


@pytest.mark.parametrize(
    ("a", "b", "tolerance", "outcome"),
    [
        (1.0, 2.0, 0.0, "less"),
        (2, 2.0, 0.0, "equal"),
        (3, 2, 0, "greater"),
        (1.9, 2.0, 0.2, "equal"),
        (1.7, 2.0, 0.2, "less"),
        (2.3, 2.0, 0.2, "greater"),
        (math.inf, math.inf, 0.0, "equal"),
        (-math.inf, 0.0, 1.0, "less"),
    ],
)
def test_numbers_are_compared(
    context: Any, a: float, b: float, tolerance: float, outcome: str
) -> None:
    assert Compare(tolerance).run(context({}), a, b) == outcome


def test_what_is_no_number_cannot_be_compared(context: Any) -> None:
    with pytest.raises(ValueError, match="nan and 1 cannot be compared"):
        Compare().run(context({}), math.nan, 1)


@pytest.mark.parametrize(
    ("value", "outcome"), [("tea", "tea"), ("milk", "other"), (None, "other"), ("", "other")]
)
def test_a_text_chooses_its_outcome(context: Any, value: str | None, outcome: str) -> None:
    assert Switch(("tea", "coffee")).run(context({}), value) == outcome


@pytest.mark.parametrize(
    ("index", "outcome"),
    [
        (0, ("found", {"item": "a", "next": 1})),
        (1, ("found", {"item": "b", "next": 2})),
        (2, "end"),
        (9, "end"),
    ],
)
def test_an_item_is_taken_from_a_list(context: Any, index: int, outcome: Any) -> None:
    assert Index().run(context({}), ("a", "b"), index) == outcome


def test_no_item_stands_before_the_first(context: Any) -> None:
    with pytest.raises(ValueError, match="no item -1; the first one is 0"):
        Index().run(context({}), ("a",), -1)


def test_numbers_are_added_and_counted(context: Any) -> None:
    assert Sum().run(context({}), 2) == ("summed", {"sum": 3})
    assert Sum().run(context({}), 2, -0.5) == ("summed", {"sum": 1.5})


@pytest.mark.parametrize(
    ("text", "values", "shown"),
    [
        ("at {a:1} m", (2.345,), "at 2.3 m"),
        ("{b} of {c}, {b}", (None, 1, 3), "1 of 3, 1"),
        ("{a:0} {a} {a:3}", (2.0,), "2 2 2.000"),
        ("{a:2}", ("word",), "word"),
        ("{a} {b}", (True, None), "true none"),
        ("{{a}} {a}", (1,), "{a} 1"),
        ("plain", (), "plain"),
    ],
)
def test_values_are_put_into_a_text(
    context: Any, text: str, values: tuple[Any, ...], shown: str
) -> None:
    given = dict(zip("abc", values, strict=False))

    assert Format(text).run(context({}), **given) == ("formatted", {"text": shown})


@pytest.mark.parametrize(
    "text",
    [
        "{}", "{0}", "{d}", "{a.real}", "{a[0]}", "{a!r}", "{a:>9}", "{a:.2f}", "{a:{b}}", "{a:12}",
        "{a", "a}", "{a:²}", "{a!}",
    ],
)  # fmt: skip
@pytest.mark.parametrize("state", [Format, Log])
def test_a_text_has_nothing_else_in_braces(state: Any, text: str) -> None:
    with pytest.raises(ValueError, match=r"write \{a\}, \{b\} or \{c\}"):
        state(text)


TOUR = """
chart: tour
outcomes: [done, x]
data:
  stops: {type: list of length, initial: [1 m, 2 m, 50 cm]}
  turn: {type: integer, initial: 0}
  stop: {type: length, initial: 0 m}
  way: {type: length, initial: 0 m}
  report: {type: text, initial: ""}
states:
  next: {do: Index, in: {items: stops, index: turn}, out: {item: stop, next: turn},
         next: {found: add, end: report}}
  add: {do: Sum, in: {a: way, b: stop}, out: {sum: way}, next: {summed: next}}
  report:
    do: Format
    with: {text: "{a:1} m in {b}"}
    in: {a: way, b: turn}
    out: {text: report}
    next: {formatted: log}
  log: {do: Log, in: {text: report}, next: {logged: far}}
  far: {do: Compare, in: {a: way, b: 340 cm}, next: {less: .x, equal: .x, greater: choose}}
  choose: {do: Switch, with: {cases: [tea]}, in: {value: report}, next: {tea: .done, other: .done}}
"""


def test_they_work_together_and_what_is_logged_is_in_the_trace() -> None:
    library = Library()
    library.add(read(TOUR.encode(), "<text>"))
    found = [f for f in check(library, INTERFACES) if f.severity == "error"]
    assert not found, [f.message for f in found]

    run = ChartRun(Machine(library["tour"], library, INTERFACES), Board({}))
    for n in range(20):
        run.tick(n * 10**8)

    assert run.outcome == "done"
    notes = [(r.subject, r.detail[0]) for r in run.trace if r.kind == "note"]
    assert ("log", "3.5 m in 3") in notes


@pytest.mark.parametrize(
    ("node", "told"),
    [
        (
            "{do: Switch, with: {cases: [tea, milk]}, in: {value: t}, next: {tea: .x, other: .x}}",
            "milk",
        ),
        ("{do: Sum, in: {a: d}, out: {sum: t}, next: {summed: .x}}", "output 'sum' of Sum"),
        (
            "{do: Compare, in: {a: d, b: 2 s}, next: {less: .x, equal: .x, greater: .x}}",
            "b: '2 s' is a duration; wanted: a length",
        ),
        ("{do: Compare, in: {a: d, b: t}, next: {less: .x, equal: .x, greater: .x}}", "'t' holds"),
    ],
)
def test_mistakes_are_found_when_the_chart_is_loaded(node: str, told: str) -> None:
    library = Library()
    data = "data: {d: {type: length, initial: 0 m}, t: {type: text, initial: x}}"
    text = f"chart: c\noutcomes: [x]\n{data}\nstates:\n  a: {node}\n"
    library.add(read(text.encode(), "<text>"))

    found = [f.message for f in check(library, INTERFACES)]

    assert any(told in message for message in found), found
