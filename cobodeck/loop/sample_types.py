"""Whether a value is of the type that its signal declares, into the fields of dataclasses.

A number may be an integer, or of a class derived from float, as numpy's 64-bit ones are. Other
scalars of numpy, lists in place of tuples, and text in place of numbers are not of their type: they
would behave otherwise in a comparison, a hash or a record.
"""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from engine.machine import shown


def misfit(value: object, kind: Any, place: str = "its value") -> str | None:
    """What of a value is not of its type, and what would be right; None if it fits.

    Types that only type checkers understand fit everything.
    """
    origin = get_origin(kind)
    if origin is Annotated:
        return misfit(value, get_args(kind)[0], place)
    if origin in (Union, types.UnionType):
        found = [misfit(value, one, place) for one in get_args(kind)]
        return None if None in found else _misfit_text(value, kind, place)
    if origin is Literal:
        return None if value in get_args(kind) else _misfit_text(value, kind, place)
    if origin is tuple and isinstance(value, tuple):
        return _misfit_item(value, get_args(kind), place)
    if not _is_instance(value, kind if origin is None else origin):
        return _misfit_text(value, kind, place)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        for name, hint in _fields(type(value)).items():
            wrong = misfit(getattr(value, name, None), hint, f"{place}'s {name}")
            if wrong is not None:
                return wrong
    return None


def class_behind(kind: Any) -> type:
    """The class that values of a type have; `object` where there is no single one."""
    origin = get_origin(kind)
    if origin is Annotated:
        return class_behind(get_args(kind)[0])
    found = type(get_args(kind)[0]) if origin is Literal else origin or kind
    return found if isinstance(found, type) else object


def _misfit_item(value: tuple[object, ...], kinds: tuple[Any, ...], place: str) -> str | None:
    if kinds[-1:] == (Ellipsis,):
        kinds = (kinds[0],) * len(value)
    elif len(kinds) != len(value):
        return f"{place} has {len(value)} items; {len(kinds)} are wanted"
    found = (misfit(item, kind, f"{place}'s item") for item, kind in zip(value, kinds, strict=True))
    return next(filter(None, found), None)


def _is_instance(value: object, kind: Any) -> bool:
    if kind is None:
        return value is None
    if kind in (float, int) and isinstance(value, int):
        return not isinstance(value, bool)
    try:
        return isinstance(value, kind) if kind is not Any else True
    except TypeError:  # a protocol, a type variable or text
        return True


@cache
def _fields(kind: type) -> Mapping[str, Any]:
    """The types of a dataclass's fields; none if its annotations cannot be read at run time."""
    try:
        hints = get_type_hints(kind)
    except Exception:  # noqa: BLE001  a name imported for type checkers only, or no type at all
        return {}
    return {field.name: hints[field.name] for field in dataclasses.fields(kind)}


def _misfit_text(value: object, kind: Any, place: str) -> str:
    wanted = getattr(kind, "__name__", None) if get_origin(kind) is None else None
    text, of = shown(value), type(value).__name__
    given = text if text.endswith(f" {of}") or value is None else f"{text} ({of})"
    right = ""
    if hasattr(value, "dtype") and hasattr(value, "item") and kind in (float, int, bool):
        right = f"; write {wanted}(…)"
    elif isinstance(value, list) and get_origin(kind) is tuple:
        right = "; write tuple(…)"
    return f"{place} is {given}; wanted: {wanted or kind}{right}"
