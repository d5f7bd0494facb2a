"""The keys of a kind of file, from the dataclass that declares them."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Iterator, Mapping
from types import UnionType
from typing import Any, Literal, NamedTuple, Union

from cobodeck.manual.page import sentence
from cobodeck.manual.wording import REQUIRED, range_text
from engine.files import Dimension, si_unit, written_text
from engine.files.declared import (
    NAME,
    Count,
    FileKey,
    Item,
    Range,
    Written,
    fields_of,
    meanings_of,
    split,
    written_default,
)

Values = Mapping[str, Any]
"""What is used instead of a key that is left out, by its dotted name."""
_DEEPEST = 6


class KeyRow(NamedTuple):
    """A key with its dotted name, as `lidars.NAME.rate`."""

    key: str
    type: str
    default: str
    meaning: str


class _Kind(NamedTuple):
    """A type in words; of a mapping or of items of a list the dataclass, and what leads there."""

    text: str
    inner: type | None = None
    path: str = ""


def key_rows(kind: type, values: Values | None = None, before: str = "") -> Iterator[KeyRow]:
    """A row for each key that files of a kind have.

    Args:
        kind: the dataclass.
        values: instead of defaults, for files that are merged with another one.
        before: the dotted name of the mapping, with a dot.
    """
    meanings = meanings_of(kind)
    for key, field in fields_of(kind).items():
        name = before + key
        held = _kind(field.annotation)
        meaning = sentence(meanings.get(field.name, ""))
        yield KeyRow(name, held.text, _default(name, field, held, values), meaning)
        if held.inner is not None and name.count(".") < _DEEPEST:
            yield from key_rows(held.inner, values, f"{name}{held.path}.")


def _default(name: str, field: FileKey, held: _Kind, values: Values | None) -> str:
    if values is not None and name in values:
        return written_text(values[name])
    if field.required:
        return "" if values is not None and _is_merged(name, held) else REQUIRED
    if field.default is None:
        return "null"
    if isinstance(field.default, tuple):
        return "" if held.inner is not None else written_text(field.default)
    plain = written_default(field)
    return "" if plain in (None, "") else written_text(plain)


def _is_merged(name: str, held: _Kind) -> bool:
    """Whether a file may leave a key out because it is merged with another one."""
    return ("." in name or held.inner is not None) and ".NAME" not in name and "[]" not in name


def _kind(annotation: Any) -> _Kind:
    """What values of an annotation are, in words."""
    kind, marks = split(annotation)
    form = next((mark for mark in marks if isinstance(mark, Written)), None)
    if form is not None:
        return _written(form)
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if kind in (float, int):
        return _Kind(_number(kind, marks))
    if origin is tuple:
        return _list(inner, marks)
    if origin is Literal:
        return _Kind(f"one of {', '.join(map(str, inner))}")
    if origin in (Union, UnionType):
        return _either([_kind(one) for one in inner if one is not type(None)])
    if origin is Mapping:
        return _mapping(_kind(inner[1]))
    if kind is not Item and dataclasses.is_dataclass(kind):
        return _Kind("mapping", typing.cast("type", kind))
    return _Kind(_PLAIN.get(kind, "any value"))


_PLAIN = {str: "text", bool: "true or false", Item: "any value"}


def _written(form: Written) -> _Kind:
    """How a value is written that a function reads."""
    if not isinstance(form.written, Mapping):
        found = _kind(form.written)
        if form.keys == "one" and found.inner is not None:
            return found._replace(text="mapping with one of these keys")
        if form.keys == "more" and found.inner is not None:
            return found._replace(text="mapping with these keys, and others")
        return found
    schema = form.written
    if "enum" in schema:
        return _Kind(f"one of {', '.join(map(str, schema['enum']))}")
    if schema.get("pattern") == f"^{NAME}$":
        return _Kind("name")
    types = schema.get("type", "any value")
    named = [types] if isinstance(types, str) else types
    words = {"string": "text", "boolean": "true or false", "array": "list", "object": "mapping"}
    return _Kind(" or ".join(words.get(one, one) for one in named))


def _number(kind: type, marks: tuple[Any, ...]) -> str:
    dimension = next((mark.name for mark in marks if isinstance(mark, Dimension)), "")
    within = next((mark for mark in marks if isinstance(mark, Range)), None)
    unit = si_unit(dimension)
    what = "integer" if kind is int else dimension.replace("_", " ") or "number"
    told = range_text(within, dimension)
    return ", ".join(filter(None, (what, "" if told.endswith(unit) else unit, told)))


def _list(inner: tuple[Any, ...], marks: tuple[Any, ...]) -> _Kind:
    item = _kind(inner[0])
    count = next((mark for mark in marks if isinstance(mark, Count)), None)
    if inner[-1] is not Ellipsis:
        count = Count(len(inner), len(inner))
    many = "" if count is None else _count(count)
    items = _plural(item.text)
    return _Kind(
        f"list of {many}: {items}" if many else f"list of {items}", item.inner, f"[]{item.path}"
    )


def _plural(text: str) -> str:
    """The text of a type for several of them."""
    word, space, rest = text.partition(" ")
    return f"{word}s{space}{rest}" if word in ("list", "mapping") else text


def _count(count: Count) -> str:
    if count.least == count.most:
        return str(count.least)
    return f"{count.least} or more" if count.least > 1 else ""


def _mapping(item: _Kind) -> _Kind:
    return _Kind(f"mapping of names to {_plural(item.text)}", item.inner, f".NAME{item.path}")


def _either(kinds: list[_Kind]) -> _Kind:
    """One of several; the keys told are those of the first that has some."""
    with_keys = next((kind for kind in kinds if kind.inner is not None), kinds[0])
    text = " or ".join(dict.fromkeys(kind.text for kind in kinds))
    return with_keys._replace(text=text)
