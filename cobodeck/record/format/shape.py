"""The schema of a record's header, to check records of unknown origin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

TEXT, FLAG, WHOLE, NUMBER = ({"type": t} for t in ("string", "boolean", "integer", "number"))
MAYBE = {"type": ["string", "null"]}
TEXTS = {"type": "object", "additionalProperties": TEXT}
WORDS = {"type": "array", "items": TEXT}


def _object(**entries: Any) -> dict[str, Any]:
    return {"type": "object", "properties": entries, "required": list(entries)}


def _or_none(schema: dict[str, Any]) -> dict[str, Any]:
    return {"anyOf": [schema, {"type": "null"}]}


NAMED = _object(name=TEXT, sha256=TEXT)
OPTIONS = _object(
    user=MAYBE, requests=_or_none(WHOLE), stretch_m=_or_none(NUMBER), tier=WHOLE, seed=WHOLE,
    duration_s=NUMBER, eager=FLAG, frozen_base=FLAG, mock=FLAG, unwatched=FLAG,
) | {"additionalProperties": False}  # fmt: skip
OPTIONS["properties"] |= {
    "heading": {"enum": ["centred", "causal"]},
    "up": _or_none({"enum": ["z", "y", "y-right"]}),
}
GIVEN = _object(scene=MAYBE, profile=MAYBE, robot=MAYBE)
HEADER = _object(
    began=TEXT,
    command=WORDS,
    plant=TEXT,
    real_time=FLAG,
    chart=TEXT,
    charts=TEXTS,
    scene=_or_none(NAMED),
    robot=TEXT,
    profile=NAMED,
    given=GIVEN,
    tick_hz={"type": "integer", "minimum": 1},
    options=OPTIONS,
    user=MAYBE,
    latency_ns=WHOLE,
    parts={"type": "object", "additionalProperties": WORDS},
    signals=WORDS,
    flowing=WORDS,
    guard=_or_none(_object(governor=FLAG, watched=FLAG)),
    versions=TEXTS,
    machine=TEXTS,
    files=TEXTS,
    code=TEXTS,
)
GIVEN["properties"] |= {"connection": MAYBE, "set": WORDS}
CONNECTION = _object(name=TEXT, sha256=TEXT, real=FLAG)
HEADER["properties"] |= {
    "inputs": {"type": "object"},
    "connection": _or_none(CONNECTION),
    "limits": {"type": "object", "additionalProperties": _or_none(NUMBER)},
    "named": {"type": "object", "additionalProperties": TEXTS},
    "profile": {**NAMED, "properties": {**NAMED["properties"], "values": {"type": "object"}}},
}
"""A JSON Schema; older records lack connection, heading, inputs, names, profile values."""


def misfit(header: Mapping[str, Any]) -> str | None:
    """The name of the first entry that is missing or of a wrong type; None if all fit."""
    from jsonschema import Draft202012Validator
    from jsonschema.exceptions import best_match

    error = best_match(Draft202012Validator(HEADER).iter_errors(dict(header)))
    if error is not None:
        return ".".join(map(str, error.absolute_path)) or error.message
    return None if header["chart"] in header["charts"] else "chart"
