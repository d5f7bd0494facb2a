"""Ranges in annotations, and what a state class says of its parameters together."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from typing import Annotated, TypeVar

import pytest
from hypothesis import given, strategies as st

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.declared import ABOVE_0, FROM_0, Mismatch, Range
from engine.files.source import read
from engine.files.suggestions import all_near
from engine.files.units import Angle, Duration, Length
from engine.interfaces import interface
from engine.literals import convert
from engine.schema.value_schemas import value_schema
from engine.state import Action, Context, Outcome
from engine.types import Type, fits, from_annotation, substituted

N = TypeVar("N", bound=float)


class Spread(Action):
    """Two numbers that go together."""

    outcomes = ("done",)

    def __init__(
        self, least: Length, most: Length = 1.0, for_: Annotated[Duration, FROM_0] = 0.0
    ) -> None:
        self.least, self.most = least, most

    @classmethod
    def faults(
        cls, inputs: Collection[str], least: float, most: float = 1.0, for_: float = 0.0
    ) -> Iterator[tuple[str, str]]:
        """The least is more than the most."""
        if least > most:
            yield "least", f"more than {most:g}"
        if for_ > 0.0 and "about" not in inputs:
            yield "for", "says nothing"

    def run(self, ctx: Context, about: str = "") -> Outcome:
        return "done"


def told(with_: str, more: str = "") -> list[str]:
    text = (
        "chart: t\noutcomes: [done]\nparameters: {far: {type: length, default: 3 m}}\n"
        f"states:\n  n: {{do: Spread, with: {with_}, {more}next: {{done: .done}}}}\n"
    )
    library = Library()
    library.add(read(text.encode(), "t.yaml"))
    found = check(library, {"Spread": interface(Spread)})
    return [f"{f.code} {f.message}" for f in found if f.code[0] in "NS"]


@pytest.mark.parametrize(
    ("annotation", "written", "allowed"),
    [
        (Annotated[Duration, FROM_0], "-1 s", "-1 is out of range, 0 s or more is allowed"),
        (Annotated[Duration, ABOVE_0], 0, "0 is out of range, more than 0 s is allowed"),
        (Annotated[Length, FROM_0] | None, -2, "-2 is out of range, 0 m or more is allowed"),
        (Annotated[int, Range(1, 9)], 10, "10 is out of range, 1 to 9 is allowed"),
        (
            Annotated[Angle, Range(-4, 4)],
            90,
            "90 is out of range, -4 to 4 rad is allowed; write `90 deg` for degrees",
        ),
        (tuple[Annotated[Length, FROM_0], ...], ["1 m", "-1 m"], "0 m or more"),
    ],
)
def test_a_number_out_of_range_is_refused_with_the_range(
    annotation: object, written: object, allowed: str
) -> None:
    with pytest.raises(Mismatch, match=allowed):
        convert(written, from_annotation(annotation))


def test_a_range_makes_no_other_type() -> None:
    ranged, plain = from_annotation(Annotated[Length, FROM_0]), from_annotation(Length)
    assert ranged == plain
    assert fits(plain, ranged)
    assert fits(ranged, plain)


def test_a_type_variable_keeps_the_range_of_its_parameter() -> None:
    kind = from_annotation(Annotated[N, FROM_0])
    assert substituted(kind, {"N": Type("length")}).within == FROM_0


def test_editors_know_the_range() -> None:
    assert value_schema(from_annotation(Annotated[Duration, FROM_0]))["minimum"] == 0.0
    assert value_schema(from_annotation(Annotated[Duration, ABOVE_0]))["exclusiveMinimum"] == 0.0


numbers = st.floats(-5.0, 5.0)
ranges = st.builds(Range, numbers, st.one_of(numbers, st.just(math.inf)), st.booleans())


@given(one=ranges, other=ranges, value=st.one_of(numbers, st.integers(-5, 5)))
def test_a_narrowed_range_admits_what_both_do(one: Range, other: Range, value: float) -> None:
    assert one.narrowed(other).admits(value) == (one.admits(value) and other.admits(value))


@pytest.mark.parametrize(
    ("with_", "more", "found"),
    [
        ("{least: 50 cm}", "", []),
        ("{least: 2 m}", "", ["N09 least: more than 1"]),
        ("{least: 2 m, most: 3 m}", "", []),
        ("{least: 4 m, most: 3 m}", "", ["N09 least: more than 3"]),
        ("{least: 4 m, most: $far}", "", []),  # known in a run only
        ("{least: 0 m, for: 1 s}", "", ["N09 for: says nothing"]),
        ("{least: 0 m, for: 1 s}", "in: {about: $far}, ", ["N09 about: $far is a length"]),
        ("{least: 2 m, for: 1 m}", "", ["N09 for: '1 m' is a length"]),  # one thing at a time
        ("{most: 2 m}", "", ["N08 Spread needs parameter 'least'"]),
    ],
)
def test_a_class_says_what_is_wrong_with_its_parameters(
    with_: str, more: str, found: list[str]
) -> None:
    for message, wanted in zip(told(with_, more), found, strict=True):
        assert message.startswith(wanted)


@pytest.mark.parametrize(
    ("word", "near"),
    [("Pose", ["Pose2", "Pose3"]), ("pose2", ["Pose2"]), ("zzz", []), ("lenght", ["length"])],
)
def test_all_words_that_are_equally_near(word: str, near: list[str]) -> None:
    assert all_near(word, ["Pose2", "Pose3", "length", "UserPose"]) == near
