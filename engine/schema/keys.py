"""How editors see the keys of a chart, by the kinds of their values; snippets of nodes."""

from __future__ import annotations

from engine.chart import AUTONOMY, DATA, INPUT, PARAMETER, RETRY, RULE, ChartKey, Keys, Value
from engine.files.declared import NAME, Schema, said
from engine.schema.value_schemas import value_schema
from engine.state_class import RESERVED_OUTCOMES
from engine.types import Type

_NAMES = {"pattern": f"^{NAME}$"}


def key_schema(key: ChartKey) -> Schema:
    """What editors show and check of a key."""
    return {**said(key.about), **_VALUES[key.value]}


def _closed(keys: Keys) -> Schema:
    properties = {name: key_schema(key) for name, key in keys.items()}
    return {"properties": properties, "additionalProperties": False}


def _inside(keys: Keys, *required: str) -> Schema:
    """A mapping with these keys."""
    closed = _closed(keys)
    found = {"type": "object", "properties": closed["properties"], "required": [*required]}
    return {**found, "additionalProperties": False}


def _declared(keys: Keys) -> Schema:
    start = {"allOf": [{"$ref": "#/definitions/start"}]}
    item = {"type": ["string", "object"], **_closed(keys), **start}
    return {"type": "object", "propertyNames": _NAMES, "additionalProperties": item}


_DURATION = value_schema(Type("duration"))
_WORDS: Schema = {"type": "object", "additionalProperties": {"type": "string"}}
_VALUES: dict[Value, Schema] = {
    "any": {},
    "bindings": {"type": "object"},
    "conditions": {**_WORDS, "minProperties": 1},
    "count": {**value_schema(Type("integer")), "minimum": 1},
    "duration": {**_DURATION, "minimum": 0},
    "flag": {"type": "boolean"},
    "integer": {"type": "integer"},
    "levels": {"type": "object", "additionalProperties": {"enum": list(AUTONOMY)}},
    "name": {"type": "string", **_NAMES},
    "names": {"type": ["string", "array"], "items": {"type": "string"}, "minItems": 1},
    "nodes": {"type": "object", "minProperties": 1, "propertyNames": _NAMES},
    "outcomes": {
        "type": "array",
        "items": {"type": "string", "pattern": f"^(?!(?:{'|'.join(RESERVED_OUTCOMES)})$){NAME}$"},
    },
    "outputs": {
        "type": "object",
        "additionalProperties": {
            "type": "object",
            "propertyNames": _NAMES,
            "additionalProperties": {"type": "string"},
        },
    },
    "period": {**_DURATION, "exclusiveMinimum": 0},
    "target": {},
    "text": {"type": ["string", "null"]},
    "type": {"$ref": "#/definitions/type"},
    "values": {"type": "object"},
    "word": {"type": "string", "minLength": 1},
    "words": _WORDS,
}
_VALUES |= {
    "data": _declared(DATA),
    "inputs": _declared(INPUT),
    "parameters": _declared(PARAMETER),
    "retry": _inside(RETRY, "times", "on"),
    "rules": {"type": "array", "items": _inside(RULE, "outcome", "if")},
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
