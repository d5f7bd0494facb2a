"""Every key of the chart language: its meaning, its schema, and snippets of nodes."""

from __future__ import annotations

from typing import Any

from engine.chart import AUTONOMY
from engine.files.declared import NAME
from engine.schema.value_schemas import Schema, value_schema
from engine.state_class import RESERVED_OUTCOMES
from engine.types import Type

_NAMES = {"pattern": f"^{NAME}$"}


def said(text: str) -> Schema:
    """`text` as a hover text; most editors show `markdownDescription`."""
    return {"description": text, "markdownDescription": text}


def _key(text: str, **schema: Any) -> Schema:
    return {**said(text), **schema}


def _words(text: str) -> Schema:
    return _key(text, type="object", additionalProperties={"type": "string"})


def _nodes(text: str) -> Schema:
    return _key(text, type="object", minProperties=1, propertyNames=_NAMES)


def _declared(text: str, **more: Schema) -> Schema:
    kind = _key("A type by name.", **{"$ref": "#/definitions/type"})
    about = _key("What it is for.", type=["string", "null"])
    item = {
        "type": ["string", "object"],
        "properties": {"type": kind, "about": about, **more},
        "additionalProperties": False,
    }
    return _key(text, type="object", propertyNames=_NAMES, additionalProperties=item)


_DURATION = value_schema(Type("duration"))
_RULE: Schema = {
    "type": "object",
    "properties": {
        "outcome": _key("The outcome of the container.", type="string", minLength=1),
        "if": {
            **_words("Children and the outcomes they must have ended with."),
            "minProperties": 1,
        },
    },
    "required": ["outcome", "if"],
    "additionalProperties": False,
}
_SHARED: dict[str, Schema] = {
    "about": _key("What this is for.", type=["string", "null"]),
    "states": _nodes("A sequence: one node after another, from the first."),
    "any": _nodes("Nodes side by side; the first to end decides, the others are stopped."),
    "all": _nodes("Nodes side by side; ends once all have ended."),
    "when": _key(
        "Conditions on `any` or `all`: outcomes of children are kept, the first match ends it.",
        type="array",
        items=_RULE,
    ),
}
NODE_SCHEMAS: dict[str, Schema] = {
    **_SHARED,
    "do": _key("An action: a state class that may command the robot."),
    "watch": _key("A monitor: a state class that only watches."),
    "use": _key("Another chart, by name."),
    "with": _key("Values of parameters: `5 s`, `20 cm`, or `$parameter`.", type="object"),
    "in": _words("Inputs and the data keys they are read from."),
    "out": _words("Outputs and the data keys they are written to."),
    "next": _words("The target of each outcome: a sibling, or `.x` to end the container with x."),
    "timeout": _key(
        "Give up after this long; `next` must map `timeout`.",
        **_DURATION,
        exclusiveMinimum=0,
    ),
    "retry": _key(
        "Further tries after some outcomes.",
        type="object",
        properties={
            "times": _key("How many further tries.", type="integer", minimum=1),
            "on": _key("Outcomes after which to try again.", type=["string", "array"], minItems=1),
            "wait": _key("How long to wait before each.", **_DURATION, minimum=0),
        },
        required=["times", "on"],
        additionalProperties=False,
    ),
    "autonomy": _key(
        "Per outcome: above this level of autonomy it is taken without asking the operator.",
        type="object",
        additionalProperties={"enum": list(AUTONOMY)},
    ),
    "priority": _key(
        "Decides between guards that trip in the same tick; the higher one wins.", type="integer"
    ),
}
CHART_SCHEMAS: dict[str, Schema] = {
    **_SHARED,
    "chart": _key("The name of the chart.", type="string", pattern=f"^{NAME}$"),
    "parameters": _declared("Parameters that `use` can set; `$name` inside the chart.", default={}),
    "inputs": _declared("Data keys that the using chart provides."),
    "data": _declared("Data keys of the chart.", initial={}),
    "outcomes": _key(
        "How the chart can end.",
        type="array",
        items={"type": "string", "pattern": f"^(?!(?:{'|'.join(RESERVED_OUTCOMES)})$){NAME}$"},
    ),
    "outputs": _key(
        "Per outcome: the data keys handed on, with their types.",
        type="object",
        additionalProperties={
            "type": "object",
            "propertyNames": _NAMES,
            "additionalProperties": {"type": "string"},
        },
    ),
}


def _snippet(label: str, text: str, body: Schema) -> Schema:
    return {"label": label, "description": text, "body": body}


_STEP = {"do": "$2", "next": {"${3:done}": "${4:.done}"}}
NODE_SNIPPETS = [
    _snippet("action", "Do something", {"do": "$1", "next": {"${2:done}": "$3"}}),
    _snippet("monitor", "Watch for something", {"watch": "$1", "next": {"${2:seen}": "$3"}}),
    _snippet("sequence", "One after another", {"states": {"${1:first}": _STEP}}),
    _snippet(
        "guarded",
        "A sequence under a guard",
        {
            "any": {
                "${5:guard}": {"watch": "$6", "next": {"${7:tripped}": ".${8:stopped_by_guard}"}},
                "${9:work}": {"states": {"${1:first}": _STEP}},
            }
        },
    ),
    _snippet(
        "together", "All of them", {"all": {"${1:one}": {"do": "$2"}, "${3:two}": {"do": "$4"}}}
    ),
    _snippet("chart", "Another chart", {"use": "$1", "next": {"${2:done}": "$3"}}),
]
CHART_SNIPPETS = [
    _snippet(
        "chart",
        "A chart with one step",
        {
            "chart": "${5:name}",
            "about": "$6",
            "outcomes": ["done"],
            "states": {"${1:first}": _STEP},
        },
    )
]
