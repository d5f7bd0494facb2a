"""JSON Schema of the values that a type allows in charts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from enum import Enum
from typing import Any, NamedTuple

from engine.files import UNITS, quantity_text
from engine.files.declared import NAME, Schema, bounds, quantity_pattern, said
from engine.literals import Reference, example_of, fields_of, kind_of_names
from engine.types import Type

CONSTANT = rf"\${NAME}(?:\.{NAME})+"
REFERENCE = rf"\${NAME}(?:\.{NAME})*"


class Words(NamedTuple):
    """What text may stand for where a value is wanted, and how messages say so."""

    pattern: str
    meaning: str


_TEXTS = ("any", "text")
_ANY_TEXT = "|[-+.0-9].*"  # under `in`, text that begins as numbers do is a value
GIVEN = Words(REFERENCE, "$parameter")
START = Words(rf"none|{CONSTANT}", "`none`, or a $name with dots")
READ = Words(rf"{NAME}|{REFERENCE}", "a data key, or $parameter")


def value_schema(kind: Type, words: Words = GIVEN) -> Schema:
    """The schema of values of type `kind`, or of `words` instead of one."""
    schema = _read(kind) if words is READ else _plain(kind, words)
    if kind.optional and "type" in schema:
        schema["type"] = [*schema["type"], "null"]
    return schema


def _plain(kind: Type, words: Words) -> Schema:
    if kind.variable and not kind.is_number:
        return {}
    if kind.name == "any":
        return _ref_to("value")
    if choices := choices_of(kind):
        return _choice(kind, choices, words)
    if kind.name == "text":
        return {"type": ["string"]}
    if kind.name == "signal":
        return {"type": ["string"], "allOf": [_ref_to(key_of(kind))]}
    if kind.is_number:
        pattern = f"^(?:{words.pattern}{_or_quantity(kind)})$"
        return _matching(_numbers(kind), pattern, kind, words) | _known(key_of(kind)) | _range(kind)
    return _matching(_shape(kind), f"^(?:{words.pattern})$", kind, words) | _parts(kind)


def _read(kind: Type) -> Schema:
    """Where text is a data key: of the values only those that are quantities, or no text."""
    if kind.name == "any" or kind.variable:
        types = ["string", "object", "array", "boolean", "number"]
    elif kind.name == "boolean":
        types = ["boolean", "string"]
    else:
        types = _numbers(kind) if kind.is_number else _shape(kind)
    value = _or_quantity(kind) if kind.is_number else _ANY_TEXT if kind.name in _TEXTS else ""
    return (
        _matching(types, f"^(?:{READ.pattern}{value})$", kind, READ) | _parts(kind) | _range(kind)
    )


def _range(kind: Type) -> Schema:
    return bounds(kind.within) if kind.within is not None else {}


def _parts(kind: Type) -> Schema:
    """What is wanted of the fields of a literal, or of the items of a list."""
    if kind.name == "list" and kind.item is not None:
        item = value_schema(kind.item)
        if kind.item.python is not None:
            item.pop("defaultSnippets", None)  # editors offer those of items twice
        return {"items": item}
    if "object" not in _shape(kind):
        return {}
    return {**_known(key_of(kind)), "defaultSnippets": list(_literals(kind))}


def _literals(kind: Type) -> Iterator[Schema]:
    """The ways to write a value of a class, with the fields left to fill in."""
    fields = (kind.python and fields_of(kind.python)) or {}
    key = kind_of_names(kind)
    for names in ([*fields], [key] if key else []):
        if names:
            body = {name: f"${number}" for number, name in enumerate(names, 1)}
            yield {"label": f"{{{', '.join(names)}}}", "body": body}


def _known(key: str) -> Schema:
    return {"allOf": [_ref_to(key)]}


def _ref_to(key: str) -> Schema:
    return {"$ref": f"#/definitions/{key}"}


def _shape(kind: Type) -> list[str]:
    if kind.name == "list":
        return ["array", "string"]
    if kind.name == "boolean":
        return ["boolean", "string"]
    is_literal = kind.python is not None and fields_of(kind.python) is not None
    return ["object", "string"] if is_literal else ["string"]


def _numbers(kind: Type) -> list[str]:
    return ["integer" if kind.name == "integer" else "number", "string"]


def _matching(types: list[str], pattern: str, kind: Type, words: Words) -> Schema:
    value = _written(kind) if words is START else written(kind)  # whose words have `none`
    wanted = f"Wanted: {value}; or {words.meaning}."
    return {"type": types, "pattern": pattern, "patternErrorMessage": wanted}


def choices_of(kind: Type) -> tuple[Any, ...]:
    """The values that a type admits, as charts write them; empty if it does not list them."""
    if kind.python is not None and issubclass(kind.python, Enum):
        return tuple(kind.python.__members__)
    return kind.choices


def _choice(kind: Type, choices: tuple[Any, ...], words: Words) -> Schema:
    """One of the choices; `if` exempts `words`, so that editors still offer the choices."""
    allowed = [*choices, None] if kind.optional else [*choices]
    other = {"type": "string", "pattern": f"^(?:{words.pattern})$"}
    offered = [{"label": str(choice), "body": choice} for choice in choices]
    return {"if": other, "else": {"enum": allowed}, "defaultSnippets": offered}


def _or_quantity(kind: Type) -> str:
    return "" if kind.name == "integer" else f"|{quantity_pattern(kind.name)}"


def key_of(kind: Type) -> str:
    """The name of the definition that types of this kind share; empty if they share none."""
    if kind.name == "signal" and kind.item is not None:
        return f"signal of {kind.item.name}".replace(" ", "-")
    if kind.is_number:
        return f"named-{kind.name}"
    if kind.python is not None and fields_of(kind.python) is not None:
        return f"literal.{kind.name}"
    return ""


def written(kind: Type) -> str:
    """How values of type `kind` are written, for hover texts."""
    return f"{_written(kind)}; or none" if kind.optional else _written(kind)


def _written(kind: Type) -> str:
    units = [unit for unit, (dimension, _, _) in UNITS.items() if dimension == kind.name]
    if units:
        return f"{kind.name}, in {', '.join(units)}; a bare number is SI"
    if kind.variable and kind.is_number:
        return "number, in the unit of what it goes with"
    if kind.name == "any":
        return "value of any type"
    if choices := choices_of(kind):
        return f"choice of {', '.join(map(str, choices))}"
    if kind.python is None:
        return str(replace(kind, optional=False))
    if fields_of(kind.python) is None:
        return f"{kind.name}, which is only passed on"
    return f"{kind.name}, `{example_of(kind.python)}`"


def shown(value: Any, kind: Type | None = None) -> str:
    """A value as a chart would write it, for hover texts; of a `kind`, numbers have its unit."""
    if value is None:
        return "none"
    if kind is not None and isinstance(value, int | float) and not isinstance(value, bool):
        return quantity_text(value, kind.name)
    if isinstance(value, Reference):
        return f"${value.name}"
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{name}: {shown(item)}' for name, item in value.items())}}}"
    if type(value) in (list, tuple) or isinstance(value, list):
        item = kind and kind.item
        return f"[{', '.join(shown(one, item) for one in value)}]"
    return str(value).lower() if isinstance(value, bool) else str(value)


READ_VALUE: Schema = {
    **said("A parameter under `in`: read from a data key when the node is entered."),
    "pattern": f"^(?:{READ.pattern}{_ANY_TEXT})$",
    "patternErrorMessage": f"Wanted: {READ.meaning}; other text stands under `with`.",
    "doNotSuggest": True,
}
ANY_VALUE: Schema = {
    "type": ["array", "boolean", "null", "number", "string"],
    "items": _ref_to("value"),
}
