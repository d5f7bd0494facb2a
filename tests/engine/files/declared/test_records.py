"""Dataclasses from mappings: units, ranges, choices, and every mistake at once."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import pytest

from engine.files.declared.item import Fault, Item, parse_yaml
from engine.files.declared.records import Name, reader_of, record
from engine.files.declared.values import Count, Range, above_0
from engine.files.finding import FileError
from engine.files.units import UNITS, Angle, Length, Mass, quantity, respelt, si_unit


def upper(item: Item) -> str:
    return str(item.value).upper()


@dataclass(frozen=True, slots=True)
class Wheel:
    radius: Annotated[Length, Range(0.01, 1.0)]
    load: Annotated[Mass, above_0(100.0)] = 10.0

    def faults(self) -> Iterator[Fault]:
        if self.radius > self.load:
            yield "radius", "is more than the load"


@dataclass(frozen=True, slots=True)
class Car:
    name: Name
    wheels: Annotated[tuple[Wheel, ...], Count(1, 4)]
    kind: Literal["fast", "slow"]
    seats: Annotated[int, Range(1, 9)] = 4
    open: bool = False
    turn: Angle | None = None
    middle: tuple[Length, Length] = (0.0, 0.0)
    share: Annotated[float, Range(0.0, 1.0)] = 0.5
    colour: Annotated[str, upper] = ""
    extras: Mapping[str, Length] = field(default_factory=dict)
    from_: str = ""
    raw: Item | None = None


GOOD = """\
name: Emma
wheels:
  - {radius: 25 cm}
  - {radius: 0.25, load: 900 g}
kind: slow
seats: 2
open: true
turn: 90 deg
middle: [1, 20 mm]
share: 0.25
colour: red
extras: {hook: 1.5 m}
from: here
raw: [1]
"""


def read(text: str) -> Car:
    return parse_yaml(text, "car.yaml", lambda item: record(item, Car))


def mistakes(text: str) -> list[tuple[int, int, str]]:
    with pytest.raises(FileError) as caught:
        read(text)
    return [
        (f.place.line, f.place.column, f"{f.message}; {f.hint}" if f.hint else f.message)
        for f in caught.value.findings
    ]


def test_a_mapping_becomes_a_dataclass_in_si_units():
    car = read(GOOD)
    assert car.wheels == (Wheel(0.25), Wheel(0.25, 0.9))
    assert (car.name, car.kind, car.seats, car.open) == ("Emma", "slow", 2, True)
    assert (car.turn, car.middle, car.share) == (math.pi / 2, (1.0, 0.02), 0.25)
    assert (car.colour, car.extras, car.from_) == ("RED", {"hook": 1.5}, "here")
    assert car.raw is not None
    assert car.raw.place.line == 14


def test_what_has_a_default_may_be_left_out():
    car = read("name: Emma\nwheels: [{radius: 0.2}]\nkind: fast\n")
    assert (car.seats, car.turn, car.middle) == (4, None, (0.0, 0.0))


@pytest.mark.parametrize(
    ("right", "wrong", "place", "message"),
    [
        ("25 cm", "25 kg", (3, 14), "'25 kg' is a mass; wanted: a length, in mm, cm, m, km"),
        ("25 cm", "wide", (3, 14), "'wide' is not a length; wanted: a length"),
        ("25 cm", "25", (3, 14), "wheels[0].radius: 25 is out of range, 0.01 to 1 m is allowed"),
        ("25 cm", "true", (3, 14), "True is not a number"),
        ("25 cm", ".nan", (3, 14), "'.nan' is not a length"),
        ("25 cm", "[1]", (3, 6), "a list is not a number"),
        ("900 g", "0", (4, 26), "load: 0 is out of range, above 0 up to 100 kg is allowed"),
        ("kind: slow", "kind: slo", (5, 7), "'slo' is not known; did you mean 'slow'?"),
        ("kind: slow", "kind: 5", (5, 7), "5 is not one of fast, slow"),
        ("kind: slow", "kin: slow", (5, 1), "kin: unknown key; did you mean 'kind'?"),
        ("kind: slow\n", "", (1, 1), "the key 'kind' is missing"),
        ("{radius: 25 cm}", "{}", (3, 5), "wheels[0]: the key 'radius' is missing"),
        ("{radius: 25 cm}", "3", (3, 5), "wheels[0]: needs a mapping (key: value), not 3"),
        ("seats: 2", "seats: 2.5", (6, 8), "2.5 is not a whole number"),
        ("seats: 2", "seats: 2 m", (6, 8), "'2 m' is not a whole number"),
        ("seats: 2", "seats: 20", (6, 8), "seats: 20 is out of range, 1 to 9 is allowed"),
        ("open: true", "open: yes", (7, 7), "'yes' is not true or false"),
        ("90 deg", "90 m", (8, 7), "'90 m' is a length; wanted: an angle, in rad, deg"),
        ("[1, 20 mm]", "[1]", (9, 1), "middle: needs 2 values, has 1"),
        ("[1, 20 mm]", "[1, 2 s]", (9, 13), "middle[1]: '2 s' is a duration"),
        ("[1, 20 mm]", "1", (9, 9), "middle: needs a list, not 1"),
        ("share: 0.25", "share: 25 m", (10, 8), "'25 m' is a length; wanted: a number without a"),
        ("name: Emma", "name: 5", (1, 7), "5 is not text; put it in quotes"),
        ("name: Emma", "name: a/b", (1, 7), "cannot be a name"),
        ("name: Emma", r'name: "a\e[1m"', (1, 7), "cannot be a name"),
        ("hook: 1.5 m", "hook: 1.5 s", (12, 16), "extras.hook: '1.5 s' is a duration"),
        ("radius: 25 cm", "radius: 25 cm, load: 100 g", (3, 14), "is more than the load"),
    ],
)
def test_a_mistake_is_told_with_its_place_and_what_would_be_right(right, wrong, place, message):
    assert right in GOOD
    ((line, column, told),) = mistakes(GOOD.replace(right, wrong, 1))
    assert (line, column) == place
    assert message in told


def test_every_mistake_of_a_file_is_told_at_once():
    text = GOOD.replace("25 cm", "25").replace("slow", "slo").replace("seats", "seat")
    assert [line for line, _, _ in mistakes(text)] == [3, 5, 6]


def test_a_misspelt_key_is_one_mistake_and_another_missing_one_a_second():
    told = mistakes("nam: Emma\nwheels: [{radius: 0.2}]\n")
    assert {message for _, _, message in told} == {
        "nam: unknown key; did you mean 'name'?",
        "the key 'kind' is missing",
    }


def test_lists_are_neither_too_short_nor_too_long():
    ((_, _, empty),) = mistakes("name: Emma\nwheels: []\nkind: fast\n")
    assert empty == "wheels: is an empty list; at least one value is needed"
    ((_, _, full),) = mistakes(f"name: Emma\nwheels: [{'{radius: 1}, ' * 5}]\nkind: fast\n")
    assert full == "wheels: needs 1 to 4 values, has 5"


def test_more_keys_may_be_allowed():
    @dataclass(frozen=True)
    class One:
        a: int

    found = parse_yaml("a: 1\nb: 2\n", "one.yaml", lambda item: record(item, One, more=True))
    assert found == One(1)


@pytest.mark.parametrize("annotation", [object, list[int], Any, Annotated[str, Range(0, 1)]])
def test_an_annotation_that_no_file_can_meet_is_a_bug(annotation):
    with pytest.raises(TypeError):
        reader_of(annotation)


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("36 km/h", 10.0), ("90 deg", math.pi / 2), ("180 deg/s", math.pi), ("250 ms", 0.25),
        ("2 min", 120.0), ("1 h", 3600.0), ("20 cm", 0.2), ("5 mm", 0.005), ("2 km", 2000.0),
        ("50 cm/s", 0.5), ("900 g", 0.9), ("5 %", 0.05), ("3 us", 3e-6), ("7 ns", 7e-9),
        ("30 °", math.pi / 6), ("2 m/s²", 2.0), ("90 deg/s2", math.pi / 2), ("4 Nm", 4.0),
    ],
)  # fmt: skip
def test_units_are_those_of_the_world(written, value):
    assert quantity(written)[0] == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("written", ["٣ m", "1٣ m", "1.٣ m", "1e٣ m", "３ m", "-٣ m", "३ m"])
def test_only_the_digits_0_to_9_make_a_number(written: str):
    assert quantity(written) is None
    meant = respelt(written)
    assert meant
    assert meant.isascii()
    assert quantity(meant) is not None


@pytest.mark.parametrize("unit", sorted(UNITS))
def test_every_unit_is_read_in_its_dimension(unit):
    from engine.files.units import Dimension

    dimension, numerator, denominator = UNITS[unit]
    read_it = reader_of(Annotated[float, Dimension(dimension)])
    item = parse_yaml(f"a: 3 {unit}\n", "file.yaml", lambda found: found.inner("a"))
    assert read_it(item) == 3 * numerator / denominator
    assert UNITS[si_unit(dimension) or unit][0] == dimension
