"""Definitions that values share: literals of classes, names of signals, places and constants."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from engine.files import quantity
from engine.files.declared import Schema, said, with_article
from engine.literals import WrittenField, fields_of, kind_of_names
from engine.schema.value_schemas import REFERENCE, key_of, shown, value_schema, written
from engine.signals import Signal, types_of
from engine.types import Type, fits


def shared_definitions(
    kinds: Iterable[Type],
    signals: Mapping[str, Signal] | None,
    constants: Mapping[str, Any],
    names: Mapping[str, Sequence[str]],
) -> dict[str, Schema]:
    """The definitions that schemas of values of these types refer to, by their keys.

    The other arguments are those of `document.chart_schema`.
    """

    def definition(kind: Type) -> Schema:
        if kind.name == "signal":
            return {} if signals is None else _signals(kind, signals)
        return _constants(kind, constants) if kind.is_number else _literal(kind, names)

    found = _reachable(kinds)
    return {key: definition(found[key]) for key in sorted(found)}


def _reachable(kinds: Iterable[Type]) -> dict[str, Type]:
    """Types that have a definition, by its key: these, and those of their items and fields."""
    found: dict[str, Type] = {}
    waiting = list(kinds)
    while waiting:
        kind = waiting.pop()
        key = key_of(kind)
        if kind.name == "list" and kind.item is not None:
            waiting.append(kind.item)
        if not key or key in found:
            continue
        found[key] = kind
        if kind.python is not None:
            waiting += [field.type for field in _fields(kind).values()]
    return found


def _fields(kind: Type) -> Mapping[str, WrittenField]:
    return (kind.python and fields_of(kind.python)) or {}


def _literal(kind: Type, names: Mapping[str, Sequence[str]]) -> Schema:
    """A mapping of the fields of a class, or of the one key that names a value of it."""
    fields = _fields(kind)
    properties = {name: _field(field) for name, field in fields.items()}
    needed: Schema = {"required": [name for name, field in fields.items() if field.required]}
    key = kind_of_names(kind)
    if key and key not in fields:
        text = f"A {key} by name, instead of all else."
        properties[key] = {**said(text), "type": "string", "examples": [*names.get(key, ())]}
        alone = {"properties": dict.fromkeys(fields, False)}
        needed = {"if": {"required": [key]}, "then": alone, "else": needed}
    return {"properties": properties, **needed, "additionalProperties": False}


def _field(field: WrittenField) -> Schema:
    text = with_article(written(field.type))
    optional = "" if field.required else " It may be left out."
    return {**said(f"{text[0].upper()}{text[1:]}.{optional}"), **value_schema(field.type)}


def _signals(kind: Type, signals: Mapping[str, Signal]) -> Schema:
    """The names of the signals of a type; `if` exempts `$parameter`."""
    assert kind.item is not None
    wanted = replace(kind.item, optional=True)
    held = {name: of for name, of in types_of(signals).items() if fits(of, wanted)}
    names = sorted(held, key=lambda name: (held[name].name == "any", name))
    if not names:
        return {}  # editors refuse an empty `enum`
    abouts = [", ".join(filter(None, (str(held[name]), signals[name].about))) for name in names]
    offered = [
        {"label": name, "description": about, "body": name}
        for name, about in zip(names, abouts, strict=True)
    ]
    reference = {"type": "string", "pattern": f"^{REFERENCE}$"}
    known = {"enum": names, "enumDescriptions": abouts}
    return {"if": reference, "else": known, "defaultSnippets": offered}


def _constants(kind: Type, constants: Mapping[str, Any]) -> Schema:
    """Named values of this dimension, each offered with its value."""
    offered = [
        {"label": f"${name}", "description": shown(value), "body": f"\\${name}"}
        for name, value in constants.items()
        if _dimension(value) == kind.name
    ]
    return {"defaultSnippets": offered} if offered else {}


def _dimension(value: Any) -> str:
    if isinstance(value, bool):
        return ""
    if isinstance(value, int | float):
        return "integer" if isinstance(value, int) else "number"
    found = quantity(value) if isinstance(value, str) else None
    return found[1] if found is not None else ""
