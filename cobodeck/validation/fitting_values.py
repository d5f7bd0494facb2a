"""Values that fit a type, as charts write them, where any value will do."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from enum import Enum
from typing import Any

from engine import Type, convert, fields_of
from engine.files import si_unit
from engine.files.declared import Mismatch

DEPTH = 8
"""Deepest nesting of values; a class can need another one of its own kind."""


def fitting_value(kind: Type, depth: int = DEPTH) -> Any:
    """A value of this type, such as `1 m` or `{x: 1 m, y: 1 m}`; None if none is found, or fits."""
    for value in _guesses(kind, depth):
        with suppress(Mismatch):
            convert(value, kind)
            return value
    return None


def _guesses(kind: Type, depth: int) -> Iterator[Any]:
    cls: Any = kind.python
    if kind.optional or not depth:
        return
    if kind.choices:
        yield kind.choices[0]
    elif kind.is_number:
        unit = si_unit(kind.name)
        yield from (f"{n} {unit}" if unit else n for n in (1, 0))
    elif kind.item is not None and kind.name == "list":
        yield [fitting_value(kind.item, depth - 1)]
    elif kind.name in _PLAIN:
        yield _PLAIN[kind.name]
    elif cls is not None and issubclass(cls, Enum):
        yield from cls.__members__
    elif cls is not None:
        fields = (fields_of(cls) or {}).items()
        yield {name: fitting_value(f.type, depth - 1) for name, f in fields if f.required}


_PLAIN = {"boolean": False, "text": "any text"}
