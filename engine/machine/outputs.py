"""Checks of the outputs that states and operators give: declared type, immutable (rule 9)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from engine.types import Type, freeze

_PLAIN = (bool, float, str, type(None))
_LONG_BITS = 64  # integers longer than this are not written out in messages
Freezers = Mapping[type, Callable[[Any], Any]]


def checked(
    given: Mapping[str, Any], types: Mapping[str, Type], freezers: Freezers
) -> dict[str, Any]:
    """The outputs, made immutable.

    Raises:
        TypeError: a value is not of its declared type, or is mutable.
    """
    found = {}
    for name, value in given.items():
        found[name] = frozen = freeze(value, freezers)
        if not admits(types[name])(frozen):
            raise TypeError(f"output {name!r} is {shown(value)}; declared: {types[name]}")
    return found


@cache
def admits(kind: Type) -> Callable[[Any], bool]:
    """A function that tells whether a value is of type `kind`."""
    if kind.name == "any":
        return lambda _: True
    test = _test_of(kind)
    return (lambda value: value is None or test(value)) if kind.optional else test


def _test_of(kind: Type) -> Callable[[Any], bool]:
    if kind.choices:
        return lambda value: any(_is_choice(value, choice) for choice in kind.choices)
    if kind.item is not None:
        of_item = admits(kind.item)
        return lambda value: isinstance(value, tuple) and all(map(of_item, value))
    if kind.python is not None:
        return _instance_of(kind.python)
    if kind.name == "integer":
        return lambda value: isinstance(value, int) and not isinstance(value, bool)
    if kind.is_number:
        return lambda value: isinstance(value, int | float) and not isinstance(value, bool)
    return _instance_of(bool if kind.name == "boolean" else str)


def _is_choice(value: Any, choice: Any) -> bool:
    plain = str.__str__(value) if isinstance(value, str) else value
    return type(plain) is type(choice) and plain == choice


def _instance_of(cls: type) -> Callable[[Any], bool]:
    try:
        isinstance(None, cls)
    except TypeError:  # a protocol or the like, which only type checkers understand
        return lambda _: True
    return lambda value: isinstance(value, cls)


def shown(value: Any) -> str:
    """A value of whatever class as messages show it; runs none of its methods."""
    kind = type(value)
    if kind in _PLAIN or (kind is int and value.bit_length() <= _LONG_BITS):
        return repr(value)
    return f"a {kind.__name__}"
