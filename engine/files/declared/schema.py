"""JSON Schema, for editors, of the files that `record` reads, from the same dataclasses.

Only keywords are used that mean the same in draft-07, which all editors know, and in draft 2020-12.
A schema knows keys, types, units, ranges and choices; what values have to do with each other
(`faults`), and which names exist, only reading tells. `oneOf` and `anyOf` are not used: with them
editors offer keys several times.
"""

from __future__ import annotations

import ast
import inspect
import json
import math
import re
import textwrap
import typing
from collections.abc import Iterable, Mapping
from functools import cache
from types import UnionType
from typing import Any, Literal, Union

from engine.files.declared.item import Item
from engine.files.declared.records import FileKey, Written, fields_of, split
from engine.files.declared.values import ANY, Count, Range, example
from engine.files.units import NUMBER, UNITS, Dimension, quantity_text, si_unit

Schema = dict[str, Any]
DRAFT = "http://json-schema.org/draft-07/schema#"


def document(kind: type, layered: bool = False) -> Schema:
    """The schema of files that hold a `kind`.

    `layered`: what a file leaves out is that of another one; no key is required but the first.
    """
    found = schema_of(kind)
    if layered:
        found = {**_without_required(found), "required": [next(iter(found["properties"]))]}
    return {"$schema": DRAFT, **said(inspect.getdoc(kind) or ""), **found}


def either_of(one: Schema, other: Schema) -> Schema:
    """The schema of files of two kinds: the keys of both, of which common ones are required."""
    required = [key for key in one["required"] if key in other["required"]]
    return {**one, "properties": {**other["properties"], **one["properties"]}, "required": required}


def text_of(schema: Schema) -> str:
    """A schema as the text of its file."""
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


def said(text: str) -> Schema:
    """`text` as a hover text; most editors show `markdownDescription`."""
    return {"description": text, "markdownDescription": text}


def schema_of(annotation: Any) -> Schema:
    """The schema of the values that are read for an annotation, see `record.reader_of`."""
    kind, marks = split(annotation)
    form = next((mark for mark in marks if isinstance(mark, Written)), None)
    if form is not None:
        return _written(form)
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if kind in (float, int):
        return _number(kind, marks)
    if origin is tuple:
        return _list(inner, marks)
    if origin is Literal:
        return {"enum": list(inner)}
    if origin in (Union, UnionType):
        return _either(map(schema_of, inner))
    if origin is Mapping:
        return {"type": "object", "additionalProperties": schema_of(inner[1])}
    return dict(_PLAIN[kind]) if kind in _PLAIN else _object(kind)


def _written(form: Written) -> Schema:
    if isinstance(form.written, Mapping):
        return dict(form.written)
    found = schema_of(form.written)
    if form.old is not None:
        found["properties"] |= _old(form)
    if form.keys == "one":
        del found["required"]
        found |= {"minProperties": 1, "maxProperties": 1}
    return {**found, "additionalProperties": True} if form.keys == "more" else found


def _old(form: Written) -> dict[str, Schema]:
    """Keys that editors mark as old and do not offer."""
    message = f"Now written with {', '.join(fields_of(form.written))}."
    before = schema_of(form.old)["properties"]
    mark = {"deprecationMessage": message, "doNotSuggest": True}
    return {key: {**schema, **mark} for key, schema in before.items()}


_PLAIN: Mapping[Any, Schema] = {
    Item: {},
    str: {"type": "string"},
    bool: {"type": "boolean"},
    type(None): {"type": "null"},
}


def _object(kind: Any) -> Schema:
    fields, meanings = fields_of(kind), meanings_of(kind)
    found: Schema = {
        "type": "object",
        "properties": {
            key: _property(field, meanings.get(field.name, "")) for key, field in fields.items()
        },
        "additionalProperties": False,
    }
    required = [key for key, field in fields.items() if field.required]
    return {**found, "required": required} if required else found


def _property(field: FileKey, meaning: str) -> Schema:
    value = schema_of(field.annotation)
    written = value.pop("description", "")
    shown = said(" ".join(filter(None, (meaning, written)))) if meaning or written else {}
    default = written_default(field)
    return {**shown, **value, **({} if default is None or default == "" else {"default": default})}


def dimension_of(marks: Iterable[Any]) -> str:
    """The dimension that the marks of an annotation give a number; empty if none does."""
    return next((mark.name for mark in marks if isinstance(mark, Dimension)), "")


def written_default(field: FileKey) -> bool | int | float | str | None:
    """The default of a key as a file would have it, `30 deg`; None if there is no plain value."""
    default = field.default
    if not isinstance(default, bool | int | float | str):
        return None
    dimension = dimension_of(split(field.annotation)[1])
    return quantity_text(float(default), dimension) if dimension else default


def _number(kind: type, marks: Iterable[Any]) -> Schema:
    if kind is int:
        return {"type": "integer", **_bounds(marks)}
    dimension = dimension_of(marks)
    found = {"type": "number", **_bounds(marks)}
    if not dimension:
        return found
    wanted = f"{example(dimension)}; a bare number is in {si_unit(dimension) or 'SI units'}."
    return {
        **found,
        "type": ["number", "string"],
        "pattern": f"^{quantity_pattern(dimension)}$",
        "patternErrorMessage": f"Wanted: {wanted}",
        "description": f"{wanted[0].upper()}{wanted[1:]}",
    }


def _bounds(marks: Iterable[Any]) -> Schema:
    ranges = [mark for mark in marks if isinstance(mark, Range)]
    if not ranges:
        return {}
    (only,) = ranges
    return bounds(only)


def bounds(allowed: Range) -> Schema:
    """What a schema says of the numbers of a range."""
    low = "exclusiveMinimum" if allowed.above else "minimum"
    return {low: allowed.low} | ({"maximum": allowed.high} if allowed.high < math.inf else {})


def quantity_pattern(*dimensions: str) -> str:
    """A pattern of numbers with a unit of one of these dimensions; `ANY`: of any."""
    units = [u for u, (of, _, _) in UNITS.items() if of in dimensions or ANY in dimensions]
    return rf"\s*{NUMBER}\s*(?:{'|'.join(map(re.escape, units))})\s*"


def _list(inner: tuple[Any, ...], marks: Iterable[Any]) -> Schema:
    count = next((mark for mark in marks if isinstance(mark, Count)), Count(0))
    if inner[-1] is not Ellipsis:
        count = Count(len(inner), len(inner))
    items = schema_of(inner[0])  # lists of several types there are none
    items.pop("description", "")
    least = {"minItems": count.least} if count.least else {}
    return {"type": "array", "items": items, **least, "maxItems": count.most}


def _either(schemas: Iterable[Schema]) -> Schema:
    """One of several types of values: what is said of one type does not concern the others."""
    found: Schema = {}
    types: list[str] = []
    for schema in schemas:
        given = schema.get("type", [])
        types += [given] if isinstance(given, str) else given
        found |= schema
    if "enum" in found:
        return {"enum": [*found["enum"], *([None] if "null" in types else [])]}
    return {**found, "type": types} if types else found


def _without_required(schema: Schema) -> Schema:
    found = {key: value for key, value in schema.items() if key != "required"}
    if "properties" in found:
        inner = found["properties"]
        found["properties"] = {key: _without_required(value) for key, value in inner.items()}
    return found


@cache
def meanings_of(kind: type) -> Mapping[str, str]:
    """The text after each field of a dataclass, by the field's name."""
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    assert isinstance(tree, ast.ClassDef)
    found = {}
    for field, after in zip(tree.body, tree.body[1:], strict=False):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
            text = after.value if isinstance(after, ast.Expr) else None
            if isinstance(text, ast.Constant) and isinstance(text.value, str):
                found[field.target.id] = " ".join(inspect.cleandoc(text.value).split())
    return found
