"""Values in the editor schema: literals, signals, places, constants, defaults, named outcomes."""

from __future__ import annotations

import json
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings, strategies as st

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.declared.values import Mismatch
from engine.files.finding import Finding
from engine.files.source import read
from engine.literals import Constant, convert
from engine.machine.named_values import NamedValues
from engine.schema.document import chart_schema
from engine.schema.value_schemas import READ, START, value_schema
from engine.signals.signal_kinds import types_of
from engine.types import Type
from tests.engine.schema.naming_states import CONSTANTS, INTERFACES, NAMES, RIGHT, SIGNALS, TYPES
from tests.engine.schema.test_schema import spots
from tests.repeats import THOROUGH, examples

SCHEMA = chart_schema(INTERFACES, {}, TYPES, SIGNALS, CONSTANTS, NAMES)
VALIDATOR = jsonschema.Draft7Validator(SCHEMA)
KNOWN = {name: Constant(value) for name, value in CONSTANTS.items()}
AROUND = NamedValues(KNOWN, types_of(SIGNALS), {"place": dict.fromkeys(NAMES["place"])})
POST = TYPES["Post"]


def value_of(text: str) -> Any:
    """A chart as plain values."""
    return json.loads(json.dumps(read(text.encode(), "main.yaml").value))


def errors_in(text: str) -> list[Finding]:
    """What the checker says makes a chart unfit to run."""
    library = Library()
    library.add(read(text.encode(), "main.yaml"))
    found = check(library, INTERFACES, types=TYPES, signals=SIGNALS, around=AROUND)
    return [finding for finding in found if finding.severity == "error"]


def complaints(text: str) -> list[str]:
    """What the schema says against a chart, with the place."""
    return [f"{e.json_path}: {e.message}" for e in VALIDATOR.iter_errors(value_of(text))]


def test_it_is_a_schema_that_editors_accept() -> None:
    jsonschema.Draft7Validator.check_schema(SCHEMA)
    assert '"enum": []' not in json.dumps(SCHEMA)
    assert not {"oneOf", "anyOf"} & set(json.dumps(SCHEMA).split('"'))
    empty = chart_schema({}, {})
    jsonschema.Draft7Validator.check_schema(empty)
    assert '"enum": []' not in json.dumps(empty)


def test_nothing_is_said_against_a_right_chart() -> None:
    assert not complaints(RIGHT)


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ("tank.level, limit", "tank.lvel, limit", "'tank.lvel' is not one of"),
        ("tank.level, limit", "door.state, limit", "'door.state' is not one of"),
        ("limit: 2}", "limit: 2 q}", "'2 q' does not match"),
        ("for: 3 s", "for: 3 m", "'3 m' does not match"),
        ("for: 3 s", "for_: 3 s", "'for_' was unexpected"),
        (
            "home: {place: dock}}\n        in",
            "home: {plac: dock}}\n        in",
            "'plac' was unexpec",
        ),
        ("home: {place: dock}}\n        in", "home: [1]}\n        in", "is not of type 'object'"),
        ("{x: 1 m, y: 2}, {place: dock}]", "{x: 1 m}, {place: dock}]", "'y' is a required"),
        ("{x: 1 m, y: 2}", "{x: 1 deg, y: 2}", "'1 deg' does not match"),
        ("{x: 1 m, y: 2}, {place: dock}]", "{place: dock, x: 1}]", "False schema does not allow 1"),
        ("[{x: 1 m, y: 2}, {place: dock}]", "{place: dock}", "is not of type 'array'"),
        ("pause: pause", "paus: pause", "'paus' was unexpected"),
        ("pause: pause", "pause: for ever", "'for ever' does not match"),
        (", pause: pause", "", "'pause' is a required"),
        ("with: {pause: 3 s, home", "with: {home", "'pause' is a required"),
        ("index: 3", "indx: 3", "'index' is a required"),
        ("times: $n", "times: 0", "0 is less than the minimum"),
        ("times: $n", "times: two", "'two' does not match"),
        ("other: visit}", "}", "'other' is a required"),
        ("cases: [tea, milk]", "cases: tea", "'tea' does not match"),
        ("initial: 3 s", "initial: 3 m", "'3 m' does not match"),
        ("initial: 3 s", "initial: $n", "'$n' does not match"),
        ("default: tank.level", "default: tank.lvel", "'tank.lvel' is not one of"),
        ("default: {place: dock}", "default: {x: 1}", "'y' is a required"),
        ("yaw: 90 deg}", "yaw: 90 cm}", "'90 cm' does not match"),
        ("in: {items: posts}\n", "in: {items: [{place: dock}]}\n", "is not of type 'string'"),
        ("in: {items: posts}\n", "in: {items: 3}\n", "3 is not of type 'string'"),
    ],
)
def test_the_message_names_the_mistake(right: str, wrong: str, said: str) -> None:
    at = RIGHT.rindex(right)
    told = complaints(RIGHT[:at] + wrong + RIGHT[at + len(right) :])
    assert any(said in message for message in told), told


def test_the_checker_says_nothing_against_it_either() -> None:
    assert errors_in(RIGHT.replace("$turn", "0")) == []


def test_signals_are_offered_with_what_they_are() -> None:
    offered = SCHEMA["definitions"]["signal-of-number"]
    assert offered["else"]["enum"] == ["tank.level", "tank.share"]
    assert offered["else"]["enumDescriptions"][0] == "length, how full the tank is"
    assert offered["defaultSnippets"][0]["description"] == "length, how full the tank is"


def test_constants_are_offered_where_their_dimension_is_wanted() -> None:
    of = {d: SCHEMA["definitions"][f"named-{d}"] for d in ("length", "duration", "angle")}
    shown = {d: s.get("defaultSnippets", []) for d, s in of.items()}
    assert [(s["label"], s["description"]) for s in shown["length"]] == [
        ("$profile.tank.full", "80 cm")
    ]
    assert [s["label"] for s in shown["duration"]] == ["$profile.tank.wait"]
    assert not shown["angle"]


def test_without_signals_any_name_is_one() -> None:
    schema = chart_schema(INTERFACES, {}, TYPES)
    value = value_of(RIGHT.replace("tank.level, limit", "some.thing, limit"))
    assert jsonschema.Draft7Validator(schema).is_valid(value)


VALUES = [
    None, 0, "x", "2 m", "3 s", "$n", "$full", "$profile.tank.wait", "tank.level", "door.state",
    "posts", "none", [], ["tea"], {}, {"x": 1, "y": 2}, {"place": "dock"}, {"x": 1, "y": "$full"},
]  # fmt: skip
KEYS = [
    "signal", "limit", "for", "older", "cases", "word", "posts", "pause", "home", "x", "y", "place",
    "items", "index", "times", "default", "initial", "type", "tea", "other", "item", "with", "in",
    "out", "next", "do", "watch",
]  # fmt: skip


@st.composite
def flawed(draw: Any) -> Any:
    """The right chart with one or two changes, anywhere."""
    chart = value_of(RIGHT.replace("$turn", "0"))
    for _ in range(draw(st.integers(1, 2))):
        inside, key = draw(st.sampled_from(spots(chart)))
        change = draw(st.sampled_from(["delete", "replace", "rename", "add"]))
        value = draw(st.sampled_from(VALUES))
        if change == "delete":
            del inside[key]
        elif change == "replace" or not isinstance(inside, dict):
            inside[key] = value
        else:
            inside[draw(st.sampled_from(KEYS))] = inside.pop(key) if change == "rename" else value
    return chart


@settings(derandomize=True, deadline=None, max_examples=examples(600) if THOROUGH else 40)
@given(flawed())
def test_what_the_schema_refuses_the_checker_refuses(chart: Any) -> None:
    if list(VALIDATOR.iter_errors(chart)):
        assert errors_in(json.dumps(chart))


NUMBERS = st.sampled_from([0, 1.5, "2 m", "2 s", "90 deg", "x", None, [1], {"x": 1}])
POSTS = st.one_of(
    st.dictionaries(st.sampled_from(["x", "y", "yaw", "z", "place"]), NUMBERS),
    st.sampled_from([{"x": 1, "y": "2 m"}, {"place": "dock"}, {"place": 3}, None, "dock", 2, []]),
)


@settings(derandomize=True, deadline=None, max_examples=examples(800) if THOROUGH else 60)
@given(
    st.sampled_from([POST, Type("list", item=POST)]),
    st.one_of(POSTS, st.lists(POSTS, max_size=3)),
)
def test_schema_and_loader_agree_on_literals(kind: Type, value: Any) -> None:
    try:
        convert(value, kind)
    except Mismatch:
        right = False
    else:
        right = True
    schema = {**value_schema(kind), "definitions": SCHEMA["definitions"]}
    assert jsonschema.Draft7Validator(schema).is_valid(value) == right


@pytest.mark.parametrize("kind", [Type("length"), Type("boolean"), POST, Type("integer")])
@pytest.mark.parametrize(
    ("words", "text", "is_right"),
    [
        (READ, "goal", True),
        (READ, "$goal", True),
        (READ, "a b", False),
        (START, "none", True),
        (START, "$profile.tank.full", True),
        (START, "$goal", False),
        (START, "goal", False),
    ],
)
def test_what_text_stands_for_depends_on_where_it_is(
    kind: Type, words: Any, text: str, is_right: bool
) -> None:
    schema = {**value_schema(kind, words), "definitions": SCHEMA["definitions"]}
    assert jsonschema.Draft7Validator(schema).is_valid(text) == is_right
