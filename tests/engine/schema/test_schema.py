"""The editor schema: its form, what it offers, and that it agrees with loader and checker."""

from __future__ import annotations

import dataclasses
import json
from copy import deepcopy
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings, strategies as st

from engine.chart.chart import Node
from engine.chart.grammar import FORMS, NODE
from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.declared.values import Mismatch
from engine.files.finding import Finding
from engine.literals import convert
from engine.schema.document import chart_schema, schema_text
from engine.schema.value_schemas import value_schema
from engine.types import Type, builtin_types
from tests.engine.random_charts import INTERFACES, Spot, charts, library
from tests.repeats import examples

TYPES = {"Spot": Type("Spot", python=Spot)}
SCHEMA = chart_schema(INTERFACES, library(), TYPES)
VALIDATOR = jsonschema.Draft7Validator(SCHEMA)


def wrong(value: Any) -> list[str]:
    """What the schema says against a chart."""
    return [f"{list(e.absolute_path)}: {e.message}" for e in VALIDATOR.iter_errors(value)]


def node(**keys: Any) -> dict[str, Any]:
    """A chart with one node, `in` and `with` as `in_` and `with_`."""
    named = {key.rstrip("_"): value for key, value in keys.items()}
    return {"chart": "main", "outcomes": ["done"], "states": {"a": named}}


def every(value: Any) -> list[dict[str, Any]]:
    """All mappings inside `value`."""
    found = [value] if isinstance(value, dict) else []
    for inner in value.values() if isinstance(value, dict) else value:
        if isinstance(inner, dict | list):
            found += every(inner)
    return found


def test_it_is_a_draft_07_schema_with_neither_one_of_nor_any_of() -> None:
    jsonschema.Draft7Validator.check_schema(SCHEMA)
    assert SCHEMA["$schema"] == "http://json-schema.org/draft-07/schema#"
    assert not any({"oneOf", "anyOf"} & part.keys() for part in every(SCHEMA))


def test_every_reference_leads_somewhere() -> None:
    references = {part["$ref"] for part in every(SCHEMA) if isinstance(part.get("$ref"), str)}
    assert {r.removeprefix("#/definitions/") for r in references} <= set(SCHEMA["definitions"])


def test_the_text_does_not_depend_on_the_order_of_classes_and_charts() -> None:
    backwards = dict(reversed(INTERFACES.items()))
    helper = library()
    assert schema_text(INTERFACES, helper, TYPES) == schema_text(backwards, helper, TYPES)
    assert json.loads(schema_text(INTERFACES, helper, TYPES)) == SCHEMA


def test_docstrings_are_hovers_at_the_class_and_at_each_of_its_parameters() -> None:
    drive = SCHEMA["definitions"]["do.Drive"]["properties"]
    assert "Drives to `goal`." in drive["do"]["markdownDescription"]
    assert "m/s" in drive["with"]["properties"]["speed"]["markdownDescription"]
    assert SCHEMA["definitions"]["node"]["properties"]["do"]["enum"] == ["Drive", "Say"]


def test_what_does_not_give_a_node_its_form_is_a_field_of_it() -> None:
    fields = {field.name for field in dataclasses.fields(Node)}
    forming = {name for name, key in NODE.items() if key.value in ("target", "nodes")}
    assert forming == set(FORMS)
    read = {key.field or name for name, key in NODE.items() if name not in forming}
    assert read == fields - {"name", "form", "at", "raw", "target", "children"}


def test_a_right_chart_is_right() -> None:
    ways = {"arrived": ".done", "blocked": "a", "timeout": "a", "error": ".done"}
    assert not wrong(
        node(do="Drive", with_={"speed": "1 m/s"}, in_={"goal": "g"}, timeout="5 s", next=ways)
    )


MISTAKES = {
    "a key misspelt": (node(do="Say", with_={"text": "x"}, nxt={}, next={"said": "a"}), "nxt"),
    "no form": (node(next={"said": "a"}), "'do' is a required property"),
    "two forms": (node(do="Say", watch="Near", with_={}, next={}), "does not allow 'Near'"),
    "a class that there is not": (node(do="Dive", next={}), "'Dive' is not one of"),
    "a monitor under do": (node(do="Near", next={}), "'Near' is not one of"),
    "a parameter missing": (node(do="Say", with_={}, next={"said": "a"}), "'text' is a required"),
    "no parameters at all": (node(do="Say", next={"said": "a"}), "'with' is a required"),
    "an input missing": (
        node(do="Drive", with_={"speed": 1}, next={"arrived": "a", "blocked": "a"}),
        "'in' is a required",
    ),
    "an outcome missing": (
        node(do="Drive", with_={"speed": 1}, in_={"goal": "g"}, next={"arrived": "a"}),
        "'blocked' is a required",
    ),
    "an outcome too many": (
        node(do="Say", with_={"text": "x"}, next={"said": "a", "sad": "a"}),
        "'sad' was unexpected",
    ),
    "a timeout that leads nowhere": (
        node(do="Say", with_={"text": "x"}, timeout="5 s", next={"said": "a"}),
        "'timeout' is a required",
    ),
    "another unit": (
        node(watch="Near", with_={"distance": "5 s"}, next={"near": "a", "far": "a"}),
        "'5 s' does not match",
    ),
    "a choice that there is not": (
        node(
            do="Drive",
            with_={"speed": 1, "mode": "slow"},
            in_={"goal": "g"},
            next={"arrived": "a", "blocked": "a"},
        ),
        "'slow' is not one of",
    ),
    "retry on a container": (
        node(states={"b": {"states": {"c": {"states": {}}}}}, retry={"times": 1, "on": "x"}),
        "does not allow {'times'",
    ),
    "an output that the class has not": (
        node(do="Say", with_={"text": "x"}, out={"where": "g"}, next={"said": "a"}),
        "'where' was unexpected",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_the_message_names_the_mistake(mistake: str) -> None:
    value, message = MISTAKES[mistake]
    assert any(message in shown for shown in wrong(value))


def test_one_mistake_is_reported_once() -> None:
    ways = {"arrived": "a", "blocked": "a"}
    drive = node(do="Drive", with_={"speed": 1, "sped": 2}, in_={"goal": "g"}, next=ways)
    assert len(wrong(drive)) == 1
    assert len(wrong(node(do="Drive", with_={"speed": 1}, in_={"goal": "g"}, next={}))) == 2


def within(form: str, when: bool = False, **keys: Any) -> list[str]:
    leaf = {"watch": "Near", "with": {"distance": 1}, **keys}
    rules = {"when": [{"outcome": "done", "if": {"a": "near"}}]} if when else {}
    return wrong({"chart": "main", "outcomes": ["done"], form: {"a": leaf}, **rules})


BOTH = {"near": ".done", "far": ".done"}


def test_who_decides_about_the_end_decides_what_must_be_mapped() -> None:
    assert within("states")
    assert within("any")
    assert not within("any", when=True)
    assert not within("all")
    for form in ("states", "any", "all"):
        assert not within(form, next=BOTH)


def test_side_by_side_nodes_lead_only_out() -> None:
    sideways = {"near": "a", "far": ".done"}
    assert not within("states", next=sideways)
    assert within("any", next=sideways)
    assert within("any", when=True, next=sideways)
    assert within("all", next=sideways)


def test_guards_have_no_autonomy() -> None:
    assert within("any", next=BOTH, autonomy={"near": "low"})
    assert not within("states", next=BOTH, autonomy={"near": "low"})


# Random charts with random mistakes: schema, loader and checker must be of one mind.

VALUES: list[Any] = [
    None, True, 0, 1.5, -1, "", "x", "a b", "$word", "5 s", "20 cm", "done", ".done", "goal",
    [], ["done"], [1], {}, {"done": ".done"}, {"x": 1}, [{}], [{"outcome": "done", "if": {}}],
]  # fmt: skip
KEYS = [
    "do", "watch", "use", "states", "any", "all", "when", "with", "in", "out", "next", "timeout",
    "retry", "autonomy", "priority", "about", "chart", "outcomes", "data", "parameters", "nxt",
    "error", "timeout", "said", "arrived", "near", "where", "goal", "speed", "text", "1a", "on",
]  # fmt: skip


def spots(value: Any) -> list[tuple[Any, Any]]:
    """Every container inside `value` with each of its keys or positions."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value)
    found = []
    for key, inner in list(pairs):
        found.append((value, key))
        if isinstance(inner, dict | list):
            found += spots(inner)
    return found


@st.composite
def flawed_charts(draw: Any) -> dict[str, Any]:
    """A right chart with up to two changes, anywhere or in a node."""
    chart: dict[str, Any] = deepcopy(draw(charts()))
    for _ in range(draw(st.integers(0, 2))):
        value = deepcopy(draw(st.sampled_from(VALUES)))
        change = draw(st.sampled_from(["delete", "replace", "rename", "add", "class"]))
        if change in ("add", "class"):
            nodes = [m for m in every(chart) if m.keys() & {"do", "watch", "use", "states", "any"}]
            if not nodes:
                continue
            inside = draw(st.sampled_from(nodes))
            if change == "add":
                inside[draw(st.sampled_from(KEYS))] = value
            else:
                name = draw(st.sampled_from([*INTERFACES, "helper", "main", "Nobody"]))
                inside[draw(st.sampled_from(["do", "watch", "use"]))] = name
            continue
        inside, key = draw(st.sampled_from(spots(chart)))
        if change == "delete":
            del inside[key]
        elif change == "rename" and isinstance(inside, dict):
            inside[draw(st.sampled_from(KEYS))] = inside.pop(key)
        else:
            inside[key] = value
        if not chart:
            break
    return chart


OF_NAMES = {"N01", "N02", "N04", "N06", "N08", "N10"}


def errors(known: Library) -> list[Finding]:
    """What makes charts refused."""
    return [f for f in check(known, INTERFACES, types=TYPES) if f.severity == "error"]


def shape_errors(value: Any) -> list[Finding]:
    """Those that can be known from the classes, the node alone, and its parent."""

    def seen(finding: Finding) -> bool:
        if finding.code != "N05":
            return finding.code.startswith("C") or finding.code in OF_NAMES
        # conditions and boxes have outcomes that no schema can follow
        of_class = finding.message.startswith(tuple(INTERFACES))
        return "when" not in json.dumps(value) and (of_class or "no timeout" in finding.message)

    return [finding for finding in errors(library(value)) if seen(finding)]


@settings(derandomize=True, deadline=None, max_examples=examples(150))
@given(charts())
def test_charts_of_a_right_shape_are_right(value: Any) -> None:
    assert not shape_errors(value)
    assert not wrong(value)


@settings(derandomize=True, deadline=None, max_examples=examples(1000))
@given(flawed_charts())
def test_schema_and_checker_agree_on_mistakes_of_shape(value: Any) -> None:
    shape, complaints = shape_errors(value), wrong(value)
    if shape:
        assert complaints
    if complaints:
        assert errors(library(value))


KINDS = [
    *builtin_types().values(),
    Type("choice", choices=("fast", "safe")),
    Type("choice", choices=(1, 2)),
    Type("list", item=Type("length")),
    Type("length", optional=True),
    Type("choice", choices=("fast",), optional=True),
    TYPES["Spot"],
]
PLAIN = st.text(max_size=4).filter(lambda text: not text.startswith("$"))
UNITS_AND_RUBBISH = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 3), st.floats(-5, 5), PLAIN,
    st.sampled_from(["fast", "slow", "5", "", " 5 s", "1e3 m", ".5 cm", "5. %", "-1 deg", "5 °",
                     "1 m/s2", "2 m/s²", "3 furlongs", "5 s s", "+1 Hz", "5s", "1 e3 s", "- 5 s"]),
)  # fmt: skip


@settings(derandomize=True, deadline=None, max_examples=examples(1500))
@given(
    st.sampled_from(KINDS), st.one_of(UNITS_AND_RUBBISH, st.lists(UNITS_AND_RUBBISH, max_size=2))
)
def test_schema_and_loader_agree_on_values(kind: Type, value: Any) -> None:
    try:
        convert(value, kind)
    except Mismatch:
        right = False
    else:
        right = True
    schema = {**value_schema(kind), "definitions": SCHEMA["definitions"]}
    assert jsonschema.Draft7Validator(schema).is_valid(value) == right
