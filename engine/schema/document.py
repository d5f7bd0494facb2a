"""JSON Schema (draft-07) of chart files, for editors: completion, hovers, marked mistakes.

A node is the union of all properties, narrowed by `if do is X, then …`. `oneOf` and `anyOf` are not
used: with them editors offer each key several times and report false mistakes.
The schema knows classes and charts; only `engine.check` knows which names exist inside a file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from engine.chart import CHART, CONTAINERS, FORMS, KEYS_OF, NODE, Chart, Keys
from engine.files.declared import DRAFT, NAME, Schema, said, text_of
from engine.interfaces import Interface
from engine.literals import can_be_written
from engine.schema.keys import CHART_SNIPPETS, NODE_SNIPPETS, key_schema
from engine.schema.named_things import shared_definitions
from engine.schema.targets import Target, narrowing, of_chart, of_class
from engine.schema.value_schemas import ANY_VALUE, READ_VALUE, START, value_schema
from engine.signals import Signal
from engine.types import ANY, Type, known_types


def schema_text(
    interfaces: Mapping[str, Interface],
    charts: Mapping[str, Chart],
    types: Mapping[str, Type] | None = None,
    signals: Mapping[str, Signal] | None = None,
    constants: Mapping[str, Any] | None = None,
    names: Mapping[str, Sequence[str]] | None = None,
) -> str:
    """The schema as JSON text; it does not depend on the order of the classes and charts."""
    return text_of(chart_schema(interfaces, charts, types, signals, constants, names))


def chart_schema(
    interfaces: Mapping[str, Interface],
    charts: Mapping[str, Chart],
    types: Mapping[str, Type] | None = None,
    signals: Mapping[str, Signal] | None = None,
    constants: Mapping[str, Any] | None = None,
    names: Mapping[str, Sequence[str]] | None = None,
) -> Schema:
    """The schema of chart files.

    Args:
        interfaces: the state classes, by name.
        charts: the charts that `use` may name.
        types: types beyond the built-in ones, by name.
        signals: the signals that parameters may name; `None`: any name is one.
        constants: values from outside of all charts that editors offer, by their whole names.
        names: the names of values that editors offer, by the key that they stand for, as `place`.
    """
    known = known_types(types or {})
    targets = [of_class(interfaces[name]) for name in sorted(interfaces)]
    targets += [of_chart(charts[name], known) for name in sorted(charts)]
    return {
        "$schema": DRAFT,
        **said("A state chart: what to do and what to watch for."),
        "type": "object",
        "defaultSnippets": CHART_SNIPPETS,
        "properties": _properties(CHART),
        "required": ["chart"],
        "additionalProperties": False,
        "allOf": [*_forms(CONTAINERS, CHART, "states"), _ANY],
        "definitions": {
            **_definitions(targets, known),
            **shared_definitions(_kinds(targets, known), signals, constants or {}, names or {}),
        },
    }


def _kinds(targets: Iterable[Target], types: Mapping[str, Type]) -> Iterator[Type]:
    """All types that values in charts can have."""
    yield from (kind for kind in types.values() if kind.name != "signal")
    yield _SIGNAL
    for target in targets:
        for argument in (*target.parameters.values(), *target.inputs.values()):
            yield argument.type


def _definitions(targets: list[Target], types: Mapping[str, Type]) -> Schema:
    return {
        "value": ANY_VALUE,
        "type": {"type": ["string", "null"], "examples": sorted(types)},
        **_starts(types),
        "read": READ_VALUE,
        "node-in-states": _all("known", "mapped", "child-of-states"),
        "node-in-any": _all("known", "mapped", "child-of-any"),
        "node-in-when": _all("known", "child-of-any"),
        "child-of-states": {"properties": {"next": _TO_SIBLING_OR_OUT}},
        "child-of-any": {"properties": {"next": _TO_OUT}, **_NO_CONSENT},
        "mapped": {"allOf": [*(t.mapped() for t in targets if t.sure), _TIMED_OUT]},
        # classes come first: of several descriptions, an editor shows the first one
        "known": {"allOf": [*(t.when_named(_ref_to(t.key)) for t in targets), _ref_to("node")]},
        "node": _node(targets),
        **{target.key: target.narrowed() for target in targets},
    }


def _starts(types: Mapping[str, Type]) -> dict[str, Schema]:
    """What `default` and `initial` may be, by the type that stands beside them."""
    found: dict[str, Schema] = {}
    choices = []
    for name in sorted(types):
        kind = replace(types[name], optional=True)
        if types[name].optional or kind.name == "signal":
            continue  # told with the type without `| none`; all signals below
        key = f"start-{name.replace(' ', '-')}"
        found[key] = value_schema(kind, START) if can_be_written(kind) else _EMPTY
        start = narrowing({entry: _ref_to(key) for entry in ("default", "initial")})
        choices.append({"if": _typed(rf"^{name}( \| none)?$"), "then": start})
    signal = {"if": _typed("^signal of "), "then": narrowing({"default": value_schema(_SIGNAL)})}
    return {"start": {"allOf": [*choices, signal]}, **found}


def _typed(pattern: str) -> Schema:
    return {"properties": {"type": {"pattern": pattern}}, "required": ["type"]}


def _node(targets: list[Target]) -> Schema:
    """The properties of every node, regardless of what it names."""
    properties = _properties(NODE)
    for form in ("do", "watch", "use"):
        named = [target for target in targets if target.form == form]
        if not named:  # editors refuse an empty `enum`
            properties[form] |= {"type": "string"}
            continue
        properties[form] |= {
            "enum": [target.name for target in named],
            "enumDescriptions": [target.about.split("\n\n")[0] for target in named],
        }
    return {
        "type": "object",
        "defaultSnippets": NODE_SNIPPETS,
        "properties": properties,
        "additionalProperties": False,
        "allOf": [*_forms(FORMS, NODE, "do"), _ANY, _TIMEOUT],
    }


def _properties(keys: Keys) -> dict[str, Schema]:
    found = {name: key_schema(keys[name]) for name in sorted(keys)}
    found["states"] |= _inside("states")
    found["all"] |= _inside("when")
    return found


def _forms(forms: Iterable[str], known: Keys, usual: str) -> Iterable[Schema]:
    """Require exactly one of `forms`, and allow only the keys that belong to it."""
    for form in forms:
        foreign = sorted(known.keys() & NODE.keys() - KEYS_OF[form] - {"about"})
        closed: Schema = {"properties": dict.fromkeys(foreign, False)}
        if form in CONTAINERS and "in" in known:
            closed["properties"]["in"] = {"additionalProperties": {"type": "string"}}
        yield {"if": {"required": [form]}, "then": closed}
    none = {"properties": dict.fromkeys(forms, False)}
    yield {"if": none, "then": {"required": [usual]}}


def _inside(context: str) -> Schema:
    return {"additionalProperties": _ref_to(f"node-in-{context}")}


def _all(*names: str) -> Schema:
    return {"allOf": [_ref_to(name) for name in names]}


def _ref_to(name: str) -> Schema:
    return {"$ref": f"#/definitions/{name}"}


def _targets(pattern: str, wanted: str) -> Schema:
    target = {"type": "string", "pattern": pattern, "patternErrorMessage": f"Wanted: {wanted}."}
    return {"doNotSuggest": True, "additionalProperties": target}


_SIGNAL = Type("signal", item=ANY)
_EMPTY: Schema = {"enum": ["none", None]}
_TO_OUT = _targets(rf"^\.{NAME}$", "`.x`, which ends the container with x")
_TO_SIBLING_OR_OUT = _targets(
    rf"^\.?{NAME}$", "a node beside this one, or `.x`, which ends the container with x"
)
_ANY: Schema = {
    "if": {"required": ["when"], "properties": {"when": {"minItems": 1}}},
    "then": narrowing({"any": _inside("when")}),
    "else": narrowing({"any": _inside("any")}),
}
_NO_CONSENT: Schema = {  # guards never wait for it
    "if": {
        "required": ["watch", "autonomy"],
        "properties": {"autonomy": {"minProperties": 1}},
    },
    "then": {"properties": {"autonomy": False}},
}
_OVER = said("Where to go when the time given by `timeout` is over.")
_TIMEOUT: Schema = {
    "if": {"required": ["timeout"]},
    "then": narrowing({"next": {"properties": {"timeout": _OVER}}}),
    "else": narrowing({"next": {"properties": {"timeout": False}}}),
}
_TIMED_OUT: Schema = {
    "if": {"required": ["timeout"]},
    "then": {"required": ["next"], "properties": {"next": {"required": ["timeout"]}}},
}
