"""The types of parameters and data keys. How charts write their values: `engine.literals`."""

from __future__ import annotations

import inspect
import math
import operator
import types as python_types
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from enum import Enum
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Generic, Literal, cast

from engine.files import DIMENSIONS, Dimension
from engine.files.declared import Range, above_0

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    V = TypeVar("V", default=Any, covariant=True)
else:
    V = typing.TypeVar("V", covariant=True)


class Key(str, Generic[V]):
    """The name of a signal, with the type of its values.

        USER_POSE: Key[UserPose] = Key("user.pose")

    `ctx.value(USER_POSE)` is then a `UserPose | None`; with plain text it is `Any`. At run time a
    key is a plain `str`, so a lookup costs the same as with any text. A parameter annotated
    `Key[float]` names any signal of numbers.
    """

    __slots__ = ()

    def __new__(cls, name: str) -> Key[V]:
        """Return the name itself."""
        return cast("Key[V]", str(name))


@dataclass(frozen=True, slots=True)
class Type:
    """What a parameter or key holds.

    `name` is a dimension, `number`, `integer`, `boolean`, `text`, `choice`, `list`, `signal`, `any`
    or the name of a Python class. `item` is the type of a list's items or of a signal's values.
    `variable`: the name of a type variable, until a node says what it stands for. `within`: the
    numbers that may be written, in SI units and rad; it does not make another type.
    """

    name: str
    choices: tuple[Any, ...] = ()
    item: Type | None = None
    optional: bool = False
    python: type | None = None
    variable: str = ""
    within: Range | None = field(default=None, compare=False)

    def __str__(self) -> str:
        shown = self.name
        if self.choices:
            shown = " | ".join(str(choice) for choice in self.choices)
        if self.item is not None:
            shown = f"{self.name} of {self.item}"
        return f"{shown} | none" if self.optional else shown

    @property
    def is_number(self) -> bool:
        """Whether values are numbers, with or without a dimension."""
        return self.name in _NUMBERS


_NUMBERS = frozenset((*DIMENSIONS, "number", "integer"))
ANY = Type("any", optional=True)
_LONGEST_S = 1e9  # about 30 years
TIMEOUT = Type("duration", within=above_0(_LONGEST_S))
WAIT = Type("duration", within=Range(0.0, _LONGEST_S))
TIMES = Type("integer", within=Range(0, math.inf))
"""How often to try again; a literal 0 is refused when a chart is read, as it says nothing."""
_SCALARS = {bool: Type("boolean"), int: Type("integer"), float: Type("number"), str: Type("text")}


def from_annotation(annotation: Any) -> Type:
    """The type a Python annotation stands for.

    Raises:
        TypeError: for annotations that no chart value could satisfy.
    """
    if annotation in _SCALARS:
        return _SCALARS[annotation]
    if annotation is Any or annotation is object:
        return ANY
    if isinstance(annotation, typing.TypeVar):
        above = ANY if annotation.__bound__ is None else from_annotation(annotation.__bound__)
        return replace(above, optional=False, variable=annotation.__name__)
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is Key:
        return Type("signal", item=from_annotation(arguments[0]))
    if origin is Annotated:
        return _from_marks(arguments[0], arguments[1:])
    if origin is Literal:
        return Type("choice", choices=arguments)
    if origin in (typing.Union, python_types.UnionType):
        return _from_union(arguments)
    if origin is tuple and len(arguments) == 2 and arguments[1] is Ellipsis:
        return Type("list", item=from_annotation(arguments[0]))
    if isinstance(annotation, type) and annotation not in (list, tuple, dict, set, frozenset):
        return Type(annotation.__name__, python=annotation)
    raise TypeError(
        f"{annotation!r} cannot be a chart type; use a class, X | None or tuple[X, ...]"
    )


def _from_marks(annotation: Any, marks: tuple[Any, ...]) -> Type:
    dimension = next((mark for mark in marks if isinstance(mark, Dimension)), None)
    within = next((mark for mark in marks if isinstance(mark, Range)), None)
    found = from_annotation(annotation) if dimension is None else Type(dimension.name)
    return found if within is None else replace(found, within=within)


def _from_union(arguments: tuple[Any, ...]) -> Type:
    others = [a for a in arguments if a is not type(None)]
    if len(others) != 1 or len(others) == len(arguments):
        raise TypeError(f"a union of {arguments!r} cannot be a chart type; only X | None can")
    inner = from_annotation(others[0])
    return replace(inner, optional=True)


def bind(wanted: Type, given: Type, bound: dict[str, Type]) -> None:
    """Note in `bound` what the type variables in `wanted` stand for where `given` is given.

    What a variable cannot stand for is left to the check of the value.
    """
    if wanted.variable and given.name != "any":
        known = bound.get(wanted.variable)
        is_wider = known is None or (fits(known, given) and not fits(given, known))
        if is_wider and fits(given, replace(wanted, optional=True)):
            bound[wanted.variable] = given
    elif wanted.item is not None and given.item is not None:
        bind(wanted.item, given.item, bound)


def substituted(kind: Type, bound: Mapping[str, Type]) -> Type:
    """A type with what its variables stand for; unbound ones stay."""
    if kind.variable in bound:
        found = replace(bound[kind.variable], within=kind.within)
        return replace(found, optional=True) if kind.optional else found
    if kind.item is None:
        return kind
    return replace(kind, item=substituted(kind.item, bound))


def fits(source: Type, target: Type) -> bool:
    """Whether a value of type `source` may be given where `target` is wanted."""
    if "any" in (source.name, target.name):
        return True
    if source.optional and not target.optional:
        return False
    if source.name == target.name:
        if source.item and target.item:
            return fits(source.item, target.item)
        return _kinds(source.choices) <= _kinds(target.choices)
    if source.is_number and target.is_number:
        if target.name in ("number", "integer"):
            return target.name == "number"
        return source.name in ("number", "integer")
    if source.name == "choice" and target.name == "text":
        return all(isinstance(choice, str) for choice in source.choices)
    if source.python and target.python:
        return issubclass(source.python, target.python)
    return False


def _kinds(choices: tuple[Any, ...]) -> set[tuple[type, Any]]:
    return {(type(choice), choice) for choice in choices}


def builtin_types() -> dict[str, Type]:
    """The types that every chart can name."""
    named = {name: Type(name) for name in (*DIMENSIONS, "number", "integer", "boolean", "text")}
    return named | {"any": ANY}


def known_types(more: Mapping[str, Type]) -> dict[str, Type]:
    """The built-in types and `more` by name; `list of` and `signal of` these; all `| none`, too."""
    named = builtin_types() | dict(more)
    single = dict(named)
    for shape in ("list", "signal"):
        named |= {f"{shape} of {name}": Type(shape, item=kind) for name, kind in single.items()}
    return named | {f"{name} | none": replace(kind, optional=True) for name, kind in named.items()}


_IMMUTABLE = (int, float, str, bytes, Enum, type(None))
DEPTH = 64
"""Deepest nesting of tuples and dataclasses in an output."""


def freeze(value: Any, freezers: Mapping[type, Callable[[Any], Any]]) -> Any:
    """`value`, made immutable where a freezer is registered for its class.

    Fields of frozen dataclasses and items of tuples and frozen sets are looked into, but not those
    of dataclasses whose annotations admit nothing mutable.

    Raises:
        TypeError: for mutable values of a class without a freezer, for a dataclass with a field
            that would have to be replaced, and for values nested deeper than `DEPTH`.
    """
    return _frozen(value, freezers, DEPTH, "")


def _frozen(
    value: Any, freezers: Mapping[type, Callable[[Any], Any]], depth: int, place: str
) -> Any:
    """As `freeze`; `depth`: how much deeper it may be nested; `place`: the field it is in."""
    kind: Any = type(value)
    if kind in freezers:
        return freezers[kind](value)
    if isinstance(value, _IMMUTABLE):
        return value
    if isinstance(value, type):
        raise TypeError(f"{place}the class {value.__name__} is no value; make an instance")
    if not depth:
        raise TypeError(f"a {kind.__name__} holds itself, or is nested deeper than {DEPTH} levels")
    if isinstance(value, tuple | frozenset):
        frozen = [_frozen(item, freezers, depth - 1, place) for item in value]
        if all(map(operator.is_, frozen, value)):
            return value
        if hasattr(kind, "_fields"):
            return kind(*frozen)
        return tuple(frozen) if isinstance(value, tuple) else frozenset(frozen)
    if _is_frozen(kind):
        if not _admits_nothing_mutable(kind):
            _require_frozen_fields(value, freezers, depth)
        return value
    raise TypeError(
        f"{place}a {kind.__name__} can be changed by others; use tuples or frozen dataclasses"
    )


def _require_frozen_fields(
    value: Any, freezers: Mapping[type, Callable[[Any], Any]], depth: int
) -> None:
    for inner in fields(value):
        place = f"{type(value).__name__}.{inner.name}"
        if not hasattr(value, inner.name):
            raise TypeError(f"{place} was never set")
        held = getattr(value, inner.name)
        if _frozen(held, freezers, depth - 1, f"{place}: ") is not held:
            raise TypeError(f"{place} can be changed by others; freeze it before it is put there")


def _is_frozen(kind: type) -> bool:
    return is_dataclass(kind) and kind.__dataclass_params__.frozen  # type: ignore[attr-defined]


@cache
def _admits_nothing_mutable(kind: type, seen: tuple[type, ...] = ()) -> bool:
    """Whether the annotations of a frozen dataclass say that all in it is immutable, too."""
    try:
        hints = typing.get_type_hints(kind)
    except Exception:  # noqa: BLE001  names that only type checkers know
        return False
    within = (*seen, kind)
    return all(_is_immutable(hints[field.name], within) for field in fields(kind))


def _is_immutable(hint: Any, seen: tuple[type, ...]) -> bool:
    """Whether values annotated so are immutable; `seen` are the classes that it stands inside."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (tuple, frozenset, typing.Union, python_types.UnionType):
        return all(a is Ellipsis or _is_immutable(a, seen) for a in arguments)
    if origin is Literal:
        return True
    if not inspect.isclass(hint) or hint in seen:  # one that can hold its own kind is looked into
        return False
    kind: Any = hint
    return issubclass(kind, _IMMUTABLE) or (
        _is_frozen(kind) and _admits_nothing_mutable(kind, seen)
    )
