"""From YAML values with places to checked values and dataclasses.

A dataclass says what a mapping holds: its fields are the keys, those with a default may be left
out, and annotations give dimension, range, choices and length:

    @dataclass(frozen=True, slots=True)
    class Wheel:
        radius: Annotated[Length, Range(0.01, 1.0)]
        kind: Literal["mecanum", "plain"] = "plain"

        def faults(self) -> Iterator[Fault]: ...  # inconsistent values, by key

`record(item, Wheel)` returns a `Wheel`, or raises a FileError with every mistake in it. A
function among the annotations, `Annotated[Pose2, pose, Written(PoseKeys)]`, reads its value itself,
and `Written` says how such a value is written. A field of type `Item` is passed on unread. A field
`from_` is the key `from`. Text after a field says what the key means; `schema.py` shows it in
editors.
"""

from __future__ import annotations

import dataclasses
import itertools
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from types import FunctionType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union

from engine.files.declared.item import Item, gather, noted
from engine.files.declared.values import (
    LONGEST,
    NAME,
    PLAIN,
    Count,
    Mismatch,
    Range,
    boolean,
    choice,
    name,
    number,
    text,
    whole,
)
from engine.files.finding import CODE, FileError, Finding, did_you_mean
from engine.files.suggestions import nearest
from engine.files.units import Dimension

T = TypeVar("T")
ItemReader = Callable[[Item], Any]
GUESSES = 100
"""At most this many unknown keys of one mapping get a suggestion."""


def record(item: Item, kind: type[T], *, more: bool = False) -> T:
    """A mapping as a dataclass; `more`: unknown keys are ignored.

    Raises:
        FileError: every mistake in it.
    """
    fields = fields_of(kind)  # type: ignore[arg-type]
    content = item.mapping()
    findings = [] if more else _unknown_keys(item, content, fields)
    findings += _missing_keys(item, content, fields, more=more)
    values = {}
    for key, inner in content.items():
        if key in fields:
            with noted(findings):
                values[fields[key].name] = fields[key].read(inner)
    if findings:
        raise FileError(findings)
    made = kind(**values)
    item.require(getattr(made, "faults", tuple)())
    return made


def _unknown_keys(
    item: Item, content: Mapping[str, Item], known: Mapping[str, FileKey]
) -> list[Finding]:
    unknown = [key for key in content if key not in known]
    return [
        Finding(
            CODE,
            f"{content[key].key}: unknown key",
            item.key_place(key),
            did_you_mean(key, known) if n < GUESSES else "",
        )
        for n, key in enumerate(unknown)
    ]


def _missing_keys(
    item: Item, content: Mapping[str, Item], known: Mapping[str, FileKey], *, more: bool
) -> list[Finding]:
    unknown = [key for key in content if key not in known][:GUESSES]
    # a misspelt key is one mistake, not also a missing one
    meant = set() if more else {nearest(key, known) for key in unknown}
    missing = [key for key in known if known[key].required and key not in content]
    errors = [item.error(f"the key '{key}' is missing") for key in missing if key not in meant]
    return [finding for error in errors for finding in error.findings]


@dataclass(frozen=True, slots=True)
class Written:
    """How a value is written that a function reads: the annotation of what it reads, or a schema.

    `keys` of a mapping: those of its dataclass, any others too, or exactly one of them. `old`: a
    dataclass whose keys were used before. Reading ignores all this; `schema.py` does not.
    """

    written: Any
    old: Any = None
    keys: Literal["these", "more", "one"] = "these"


@dataclass(frozen=True, slots=True)
class FileKey:
    """A key of a mapping; `default` is dataclasses.MISSING if it has none, or a factory."""

    name: str
    annotation: Any
    read: ItemReader
    required: bool
    default: Any


@cache
def fields_of(kind: type) -> dict[str, FileKey]:
    """The fields of a dataclass by the keys that files have for them."""
    hints = typing.get_type_hints(kind, include_extras=True)
    missing = dataclasses.MISSING
    return {
        field.name.rstrip("_"): FileKey(
            field.name,
            hints[field.name],
            reader_of(hints[field.name]),
            field.default is missing and field.default_factory is missing,
            field.default,
        )
        for field in dataclasses.fields(kind)
        if field.init
    }


def split(annotation: Any) -> tuple[Any, tuple[Any, ...]]:
    """A type, and what `Annotated` says of it."""
    if typing.get_origin(annotation) is not Annotated:
        return annotation, ()
    kind, *marks = typing.get_args(annotation)
    return kind, tuple(marks)


def reader_of(annotation: Any) -> ItemReader:
    """The function that reads values of an annotated type.

    Raises:
        TypeError: for annotations of values that files cannot hold.
    """
    annotation, marks = split(annotation)
    marks = tuple(mark for mark in marks if not isinstance(mark, Written))
    if marks and isinstance(marks[0], FunctionType):
        return marks[0]
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if annotation in (float, int):
        return _number(annotation, marks)
    if origin is tuple:
        return _tuple(arguments, marks)
    if marks:
        raise TypeError(f"{annotation!r} cannot have {marks}")
    return _unmarked(annotation, origin, arguments)


def _unmarked(annotation: Any, origin: Any, arguments: tuple[Any, ...]) -> ItemReader:
    if annotation in _SCALARS:
        return _SCALARS[annotation]
    if origin is Literal:
        return converted(lambda value: choice(value, arguments))
    if origin in (Union, UnionType) and arguments[1:] == (type(None),):
        inner = reader_of(arguments[0])
        return lambda item: None if item.value is None else inner(item)
    if origin is Mapping:
        return _mapping(reader_of(arguments[1]))
    if dataclasses.is_dataclass(annotation):
        kind: Any = annotation
        return lambda item: record(item, kind)
    raise TypeError(f"{annotation!r} cannot be read from a file")


def converted(convert: Callable[[Any], Any]) -> ItemReader:
    """A reader made from a conversion that raises Mismatch for unsuitable values."""

    def read_value(item: Item) -> Any:
        try:
            return convert(item.value)
        except Mismatch as mismatch:
            raise item.error(str(mismatch)) from None

    return read_value


_SCALARS: dict[Any, ItemReader] = {
    Item: lambda item: item,
    str: converted(text),
    bool: converted(boolean),
}

Name = Annotated[
    str,
    converted(name),
    Written({"type": "string", "pattern": f"^{NAME}$", "maxLength": LONGEST}),
]
"""The name of a scene, a robot, a user …; files may be named after it."""


def _number(kind: type, marks: tuple[Any, ...]) -> ItemReader:
    dimension = next((mark.name for mark in marks if isinstance(mark, Dimension)), PLAIN)
    ranges = [mark for mark in marks if isinstance(mark, Range)]

    def convert(value: Any) -> float:
        found = whole(value) if kind is int else number(value, dimension)
        for allowed in ranges:
            allowed.require(found, dimension)
        return found

    return converted(convert)


def _tuple(arguments: tuple[Any, ...], marks: tuple[Any, ...]) -> ItemReader:
    if arguments[-1] is Ellipsis:
        count = next((mark for mark in marks if isinstance(mark, Count)), Count(0))
        same = reader_of(arguments[0])
        return lambda item: _each(item, count, itertools.repeat(same))
    readers = tuple(map(reader_of, arguments))
    return lambda item: _each(item, Count(len(readers), len(readers)), readers)


def _each(item: Item, count: Count, readers: Iterable[ItemReader]) -> tuple[Any, ...]:
    items = item.items()
    converted(lambda value: count.require(len(value)))(item)
    return tuple(gather(partial(read, each) for read, each in zip(readers, items, strict=False)))


def _mapping(inner: ItemReader) -> ItemReader:
    def read_mapping(item: Item) -> Mapping[str, Any]:
        content = item.mapping()
        values = gather(partial(inner, each) for each in content.values())
        return dict(zip(content, values, strict=True))

    return read_mapping
