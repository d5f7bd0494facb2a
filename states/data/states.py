"""States that compute with the data of a chart; each ends at once."""

from __future__ import annotations

import string
from collections.abc import Collection, Iterator, Sequence
from typing import Annotated, Any, Generic, TypeVar

from engine import Action, Context, Outcome
from engine.files.declared import FROM_0

T = TypeVar("T")
N = TypeVar("N", bound=float)

EXACT: Any = 0  # of whatever dimension the numbers have
ONE: Any = 1
PLACES = ("a", "b", "c")
"""The inputs that a text can show."""
DIGITS = ("", *"0123456789")
"""How many digits after the point a number can be given; empty: as many as it has."""
RIGHT = "write {a}, {b} or {c}, {a:2} for two digits after the point, {{ and }} for braces"


class Compare(Action, Generic[N]):
    """Compare two numbers: `a` is `less` than `b`, `equal` to it within `tolerance`, or `greater`.

    `{do: Compare, in: {a: tries, b: 3}, next: {less: again, equal: .failed, greater: .failed}}`.
    What is no number cannot be compared: an error.

    Args:
        tolerance: by how much equal numbers may differ, in their unit.
        a: the first number.
        b: the number it is compared with.

    Outcomes:
        less: `a` is less than `b`, by more than `tolerance`.
        equal: they differ by no more than `tolerance`.
        greater: `a` is greater than `b`, by more than `tolerance`.
    """

    outcomes = ("less", "equal", "greater")

    def __init__(self, tolerance: Annotated[N, FROM_0] = EXACT) -> None:
        self.tolerance = tolerance

    def run(self, ctx: Context, a: N, b: N) -> Outcome:
        if a == b or abs(a - b) <= self.tolerance:
            return "equal"
        if a != a or b != b:
            raise ValueError(f"Compare: {a} and {b} cannot be compared; nan is no number")
        return "less" if a < b else "greater"


class Switch(Action):
    """Go on by a text: the outcome of its own name if it is among `cases`, else `other`.

    `{do: Switch, with: {cases: [tea, coffee]}, in: {value: order}, next: {tea: …, coffee: …,
    other: ask}}`. No text is `other`.

    Args:
        cases: the texts that have an outcome of their own.
        value: the text to go on by.

    Outcomes:
        $cases: the text is this one.
        other: the text is another one, or there is none.
    """

    outcomes = ("$cases", "other")

    def __init__(self, cases: tuple[str, ...]) -> None:
        self.cases = cases

    def run(self, ctx: Context, value: str | None) -> Outcome:
        return value if value is not None and value in self.cases else "other"


class Index(Action, Generic[T]):
    """Take the item at `index` from a list, counted from 0; `end` if the list has no such item.

    `{do: Index, in: {items: stops, index: turn}, out: {item: goal, next: turn},
    next: {found: drive, end: .done}}` goes through a list, one item each time it is entered: the
    output `next` is the index after this one. An index below 0 is an error.

    Args:
        items: the list.
        index: which item, counted from 0.

    Outcomes:
        found: the list has such an item.
        end: it has none: `index` is past the last one.

    Outputs:
        item: the item.
        next: the index after this one.
    """

    outcomes = ("found", "end")
    outputs = {"found": {"item": T, "next": int}}  # type: ignore[misc]

    def run(self, ctx: Context, items: tuple[T, ...], index: int) -> Outcome:
        if index < 0:
            raise ValueError(f"Index: there is no item {index}; the first one is 0")
        if index >= len(items):
            return "end"
        return "found", {"item": items[index], "next": index + 1}


class Sum(Action, Generic[N]):
    """Add two numbers; `b` is 1 if it is not given, and may be negative.

    `{do: Sum, in: {a: tries}, out: {sum: tries}, next: {summed: again}}`.

    Args:
        a: a number.
        b: the number to add.

    Outcomes:
        summed: the sum is there.

    Outputs:
        sum: `a` plus `b`.
    """

    outcomes = ("summed",)
    outputs = {"summed": {"sum": N}}  # type: ignore[misc]

    def run(self, ctx: Context, a: N, b: N = ONE) -> Outcome:
        return "summed", {"sum": a + b}


class _Fills(Action):
    """What `Format` and `Log` share.

    Args:
        text: the text, with places for the values.
        a: the value for `{a}`.
        b: the value for `{b}`.
        c: the value for `{c}`.
    """

    def __init__(self, text: str) -> None:
        self._pieces = tuple(_pieces(text))

    @classmethod
    def faults(cls, inputs: Collection[str], text: str) -> Iterator[tuple[str, str]]:
        """Braces that hold something else than a place, and places of inputs that are not given."""
        try:
            places = dict.fromkeys(name for _, name, _ in _pieces(text) if name is not None)
        except ValueError as error:
            yield "text", str(error)
            return
        for name in places:
            if name not in inputs:
                yield "text", f"{{{name}}} stands for an input that is missing: `in: {{{name}: …}}`"


class Format(_Fills):
    """Put up to three values into a text: `{a}`, `{b}` and `{c}` stand for the inputs.

    `{do: Format, with: {text: "stop {a}, {b:2} m away"}, in: {a: turn, b: distance},
    out: {text: report}, next: {formatted: tell}}`. `{b:2}` is a number with two digits after the
    point; `{{` and `}}` are braces.

    Outcomes:
        formatted: the text is there.

    Outputs:
        text: the text with the values in it.
    """

    outcomes = ("formatted",)
    outputs = {"formatted": {"text": str}}

    def run(self, ctx: Context, a: Any = None, b: Any = None, c: Any = None) -> Outcome:
        return "formatted", {"text": _filled(self._pieces, (a, b, c))}


class Log(_Fills):
    """Note a text in the trace and the record of the run, with values as in `Format`.

    `{do: Log, with: {text: "battery at {a:1}"}, in: {a: charge}, next: {logged: drive}}`.

    Outcomes:
        logged: the text has been noted.
    """

    outcomes = ("logged",)

    def run(self, ctx: Context, a: Any = None, b: Any = None, c: Any = None) -> Outcome:
        ctx.note(_filled(self._pieces, (a, b, c)))
        return "logged"


_Piece = tuple[str, str | None, str]
"""Text, the input that follows it, and how many digits that is to have."""


def _pieces(text: str) -> Iterator[_Piece]:
    """The pieces of a text with places.

    Raises:
        ValueError: a brace has no other one, or they hold something else than a place.
    """
    try:
        parsed = list(string.Formatter().parse(text))
    except ValueError:
        raise ValueError(f"a brace stands alone; {RIGHT}") from None
    for before, name, digits, conversion in parsed:
        is_place = name in PLACES and digits in DIGITS and conversion is None
        if name is not None and not is_place:
            raise ValueError(f"{{{name}…}} stands for no value; {RIGHT}")
        yield before, name, digits or ""


def _filled(pieces: Sequence[_Piece], values: Sequence[object]) -> str:
    return "".join(
        before if name is None else before + _written(values[PLACES.index(name)], digits)
        for before, name, digits in pieces
    )


def _written(value: object, digits: str) -> str:
    """A value as charts write it."""
    if value is None or isinstance(value, bool):
        return str(value).lower()
    if digits and isinstance(value, int | float):
        return f"{value:.{digits}f}"
    return f"{value:g}" if isinstance(value, float) else str(value)
