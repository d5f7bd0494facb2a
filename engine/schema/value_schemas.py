"""JSON Schema of the values that a type allows in charts."""

from __future__ import annotations

from engine.files import UNITS
from engine.files.declared import NAME, Schema, quantity_pattern
from engine.types import Type

REFERENCE = rf"\${NAME}"
_WRITTEN = {"text": ["string"], "boolean": ["boolean", "string"], "list": ["array", "string"]}


def value_schema(kind: Type) -> Schema:
    """The schema of values of type `kind`, or of a `$parameter` instead of one."""
    schema = _plain(kind)
    if kind.optional and "type" in schema:
        schema["type"] = [*schema["type"], "null"]
    return schema


def _plain(kind: Type) -> Schema:
    if kind.name == "any":
        return {"$ref": "#/definitions/value"}
    if kind.choices:
        return _choice(kind)
    if kind.name == "text":
        return {"type": ["string"]}
    if kind.is_number:
        first = "integer" if kind.name == "integer" else "number"
        return _matching([first, "string"], _number_pattern(kind), kind)
    schema = _matching(_WRITTEN.get(kind.name, ["string"]), f"^{REFERENCE}$", kind)
    if kind.item is not None:
        schema["items"] = value_schema(kind.item)
    return schema


def _matching(types: list[str], pattern: str, kind: Type) -> Schema:
    wanted = f"Wanted: {written(kind)}; or $parameter."
    return {"type": types, "pattern": pattern, "patternErrorMessage": wanted}


def _choice(kind: Type) -> Schema:
    """One of the choices; `if` exempts `$parameter`, so that editors still offer the choices."""
    choices = [*kind.choices, None] if kind.optional else [*kind.choices]
    reference = {"type": "string", "pattern": f"^{REFERENCE}$"}
    offered = [{"label": str(choice), "body": choice} for choice in kind.choices]
    return {"if": reference, "else": {"enum": choices}, "defaultSnippets": offered}


def _number_pattern(kind: Type) -> str:
    if kind.name == "integer":
        return f"^{REFERENCE}$"
    return rf"^(?:{REFERENCE}|{quantity_pattern(kind.name)})$"


def written(kind: Type) -> str:
    """How values of type `kind` are written, for hover texts."""
    units = [unit for unit, (dimension, _, _) in UNITS.items() if dimension == kind.name]
    if units:
        return f"{kind}, in {', '.join(units)}; a bare number is SI"
    return f"{kind}, which is only passed on" if kind.python else str(kind)


ANY_VALUE: Schema = {
    "type": ["array", "boolean", "null", "number", "string"],
    "items": {"$ref": "#/definitions/value"},
}
