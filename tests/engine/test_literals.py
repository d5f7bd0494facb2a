"""Values as charts write them, against values made beside them; classes that can be written."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import pytest
from hypothesis import given, settings, strategies as st

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.declared import Mismatch
from engine.files.finding import Finding
from engine.files.source import read
from engine.files.units import Length
from engine.literals import (
    LATER,
    OpenName,
    Reference,
    Resolver,
    convert,
    example_of,
    fields_of,
)
from engine.machine.machine import Machine
from engine.machine.named_values import ParameterValues
from engine.machine.outputs import checked
from engine.types import Type, from_annotation, known_types
from tests.engine.written_states import (
    AROUND,
    INTERFACES,
    PLACES,
    TYPES,
    Heading,
    Leg,
    Level,
    Spot,
)
from tests.repeats import examples

quick = settings(deadline=None, max_examples=examples(400), derandomize=True)
Pair = tuple[Any, Any]
"""A value as it is written, and what it means."""

numbers = st.integers(-999, 999)


def units(*known: tuple[str, float]) -> st.SearchStrategy[Pair]:
    """Numbers alone, or with one of these units; a unit is so many to one of SI."""
    bare = numbers.map(lambda n: (n, float(n)))
    with_unit = [numbers.map(lambda n, u=u, k=k: (f"{n} {u}", n / k)) for u, k in known]
    return st.one_of(bare, *with_unit)


lengths = units(("m", 1.0), ("cm", 100.0), ("mm", 1000.0))
speeds = units(("m/s", 1.0), ("cm/s", 100.0))
angles = units(("deg", 180 / math.pi), ("rad", 1.0))


def record(make: Any, required: dict[str, Any], optional: dict[str, Any]) -> Any:
    """Written records with all required fields and some of the others, in any order."""

    def pair(fields: dict[str, Pair]) -> Pair:
        written = {name: value[0] for name, value in fields.items()}
        return written, make(**{name: value[1] for name, value in fields.items()})

    return st.fixed_dictionaries(required, optional=optional).map(pair)


named = st.sampled_from([({"place": name}, spot) for name, spot in PLACES.items()])
spots = st.one_of(record(Spot, {"x": lengths}, {"y": lengths}), named)
levels = st.sampled_from([(level.name, level) for level in Level])
legs = record(Leg, {"spot": spots}, {"pace": speeds, "level": levels})
headings = record(lambda yaw: Heading(math.cos(yaw), math.sin(yaw)), {"yaw": angles}, {})


def lists(items: Any) -> Any:
    return st.lists(items, max_size=4).map(
        lambda pairs: ([w for w, _ in pairs], tuple(v for _, v in pairs))
    )


KINDS = {"Spot": spots, "Leg": legs, "Heading": headings, "length": lengths, "speed": speeds}
typed = st.one_of(
    *(pairs.map(lambda pair, kind=kind: (kind, *pair)) for kind, pairs in KINDS.items()),
    *(
        lists(pairs).map(lambda pair, kind=kind: (f"list of {kind}", *pair))
        for kind, pairs in KINDS.items()
    ),
)


def alike(found: Any, wanted: Any) -> bool:
    """Equal, with numbers that differ by rounding only."""
    if isinstance(wanted, float):
        return math.isclose(found, wanted, rel_tol=1e-12, abs_tol=1e-12)
    if isinstance(wanted, Spot | Heading):
        names = list(wanted.__dict__)
        return type(found) is type(wanted) and all(
            alike(getattr(found, name), getattr(wanted, name)) for name in names
        )
    if isinstance(wanted, tuple):
        pairs = zip(found, wanted, strict=True)
        return type(found) is type(wanted) and all(alike(f, w) for f, w in pairs)
    return bool(found == wanted)


def library_of(chart: dict[str, Any]) -> Library:
    library = Library()
    library.add(read(json.dumps(chart).encode(), "c.yaml"))
    assert not library.findings, library.findings
    return library


def found_in(chart: dict[str, Any]) -> list[Finding]:
    found = check(library_of(chart), INTERFACES, types=TYPES, around=AROUND)
    return [finding for finding in found if finding.code != "F04"]


WORK = {"do": "Do", "next": {"done": ".x", "failed": ".x", "other": ".x"}}
KEEP = {"do": "Keep", "next": WORK["next"]}


@given(typed)
@quick
def test_rule_9_what_is_written_is_what_is_meant_wherever_it_stands(case: Any) -> None:
    """As the start of data, the default of an input, a parameter's, and for a node."""
    kind, written, meant = case
    chart = {
        "chart": "c",
        "outcomes": ["x"],
        "parameters": {"p": {"type": kind, "default": written}},
        "inputs": {"i": {"type": kind, "default": written}},
        "data": {"k": {"type": kind, "initial": written}},
        "states": {"n": {**KEEP, "in": {"value": "k"}, "with": {"items": ["$p"] * 2}}},
    }
    assert not found_in(chart)
    library = library_of(chart)
    machine = Machine(
        library["c"], library, INTERFACES, types=TYPES, inputs={"i": written}, around=AROUND
    )
    (leaf,) = machine.leaves
    assert alike(machine.root.cells["k"].initial, meant)
    assert alike(machine.root.cells["i"].initial, meant)
    assert alike(leaf.parameters["items"], (meant, meant))


def scalars(written: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The paths to all plain values in a written one."""
    if isinstance(written, dict | list):
        pairs = written.items() if isinstance(written, dict) else enumerate(written)
        return [found for key, value in pairs for found in scalars(value, (*path, key))]
    return [path]


def changed(written: Any, path: tuple[Any, ...], value: Any) -> Any:
    if not path:
        return value
    copy = dict(written) if isinstance(written, dict) else list(written)
    copy[path[0]] = changed(copy[path[0]], path[1:], value)
    return copy


@given(typed, st.data(), st.booleans())
@quick
def test_rule_10_a_wrong_part_of_a_value_is_found_where_it_stands(
    case: Any, data: Any, in_data: bool
) -> None:
    kind, written, _ = case
    inside = scalars(written)
    if not inside:
        return
    path = data.draw(st.sampled_from(inside))
    wrong = changed(written, path, "7 parsec")
    chart: dict[str, Any] = {"chart": "c", "outcomes": ["x"], "states": {"n": WORK}}
    if in_data:
        chart["data"] = {"k": {"type": kind, "initial": wrong}}
    else:
        chart["parameters"] = {"k": {"type": kind, "default": wrong}}
    (finding,) = found_in(chart)
    assert finding.code == ("N13" if path[-1:] == ("place",) else "N09")
    assert finding.place.column == json.dumps(chart).index('"7 parsec"') + 1
    name = "".join(f".{key}" if isinstance(key, str) else f"[{key}]" for key in path)
    assert finding.message.startswith(f"k{name}: ")


@given(typed, st.data(), st.sampled_from(["nothing", "word", "k.none"]))
@quick
def test_rule_10_a_name_that_stands_for_nothing_right_is_found_where_it_stands(
    case: Any, data: Any, name: str
) -> None:
    kind, written, _ = case
    path = data.draw(st.sampled_from([p for p in scalars(written) if p[-1:] != ("place",)] or [()]))
    wrong = changed(written, path, f"${name}")
    chart = {
        "chart": "c",
        "outcomes": ["x"],
        "parameters": {"word": {"type": "text", "default": "a"}},
        "data": {"k": {"type": kind, "initial": written}},
        "states": {"n": {**KEEP, "in": {"value": "k"}, "with": {"items": [wrong]}}},
    }
    (finding,) = found_in(chart)
    assert finding.code == "N09"
    assert finding.place.column == json.dumps(chart).index(f'"${name}"') + 1


# -- classes ---------------------------------------------------------------------------------------


class Pair3(NamedTuple):
    """Named tuples are written by their fields."""

    first: int
    second: tuple[Spot, ...] = ()


@dataclass
class Changing:
    """A class whose values others could change."""

    x: float


@dataclass(frozen=True)
class Strange:
    """A field of it has a type that no chart could name."""

    x: int | str


@dataclass(frozen=True)
class Positive:
    """Refuses some values of its fields."""

    x: Length

    def __post_init__(self) -> None:
        if self.x <= 0:
            raise ValueError(f"{self.x} is not positive")


class Plain:
    """Neither a dataclass nor a named tuple."""


class Made:
    """What `written` makes of its arguments."""

    named_by: ClassVar[str] = "place"

    def __init__(self, value: float) -> None:
        self.value = value

    @classmethod
    def written(cls, half: Length, times: int = 2) -> Made:
        return cls(half * times)


@pytest.mark.parametrize(
    ("cls", "fields"),
    [
        (Spot, {"x": ("length", True), "y": ("length", False)}),
        (Leg, {"spot": ("Spot", True), "pace": ("speed", False), "level": ("Level", False)}),
        (Pair3, {"first": ("integer", True), "second": ("list of Spot", False)}),
        (Heading, {"yaw": ("angle", True)}),
        (Made, {"half": ("length", True), "times": ("integer", False)}),
        (Changing, None),
        (Strange, None),
        (Plain, None),
    ],
)
def test_rule_9_fields_are_those_that_a_chart_can_write(cls: type, fields: Any) -> None:
    found = fields_of(cls)
    shown = found and {name: (str(f.type), f.required) for name, f in found.items()}
    assert shown == fields


def test_rule_9_a_class_method_makes_the_value() -> None:
    assert convert({"half": "50 cm"}, from_annotation(Made)).value == 1.0
    assert convert({"half": "50 cm", "times": 3}, from_annotation(Made)).value == 1.5
    assert convert({"place": "dock"}, from_annotation(Made)) == OpenName("place", "dock")


class Later(Resolver):
    """Knows no value of a parameter before a run."""

    def reference(self, reference: Reference, wanted: Type) -> Any:
        return LATER


@dataclass(frozen=True)
class Total:
    """The sum of its parts."""

    total: float

    @classmethod
    def written(cls, parts: tuple[Length, ...]) -> Total:
        return cls(sum(parts))


X = Reference("x")


@pytest.mark.parametrize("written", [X, {"parts": X}, {"parts": ["1 m", X]}])
def test_rule_10_a_value_is_made_once_all_of_it_is_known(written: Any) -> None:
    assert convert(written, from_annotation(Total), Later()) is LATER
    assert convert({"parts": ["1 m", "20 cm"]}, from_annotation(Total), Later()) == Total(1.2)


@pytest.mark.parametrize(
    ("written", "kind", "told"),
    [
        ({"x": 1, "z": 2}, Spot, "a Spot has no 'z'; allowed: place, x, y"),
        ({"y": 2}, Spot, "'x' missing; wanted: {x: …, y: …} or {place: …}"),
        ({"place": "dock", "x": 1}, Spot, "a place needs nothing beside its name; leave out 'x'"),
        ("dock", Spot, "'dock' is not a Spot; wanted: {x: …, y: …} or {place: …}"),
        ([1, 2], Spot, "a list is not a Spot; wanted: {x: …, y: …} or {place: …}"),
        ({"x": 0}, Positive, "0.0 is not positive"),
        ({"x": 1}, Changing, "a Changing cannot be written in a chart, only passed on by `in:`"),
        ("MIDDLE", Level, "'MIDDLE' is not known; allowed: HIGH, LOW"),
        ({"a": 1}, object, "a mapping is a value only where a type says of what"),
        ({"spot": {"x": 1}, "pace": None}, Leg, "nothing given; wanted: speed"),
    ],
)
def test_rule_10_what_cannot_be_meant_is_told(written: Any, kind: type, told: str) -> None:
    with pytest.raises(Mismatch) as caught:
        convert(written, from_annotation(kind))
    assert str(caught.value) == told


def test_rule_10_examples_show_how_a_value_is_written() -> None:
    assert example_of(Spot) == "{x: …, y: …} or {place: …}"
    assert example_of(Leg) == "{spot: …, pace: …, level: …}"


@given(typed)
@quick
def test_rule_9_what_charts_write_is_immutable_and_of_its_type(case: Any) -> None:
    """So a state may hand out what it was given, and nobody can change what all runs share."""
    kind, written, _ = case
    wanted: Type = known_types(TYPES)[kind]
    value = convert(written, wanted, ParameterValues({}, AROUND))
    assert checked({"value": value}, {"value": wanted}, {})["value"] is value
