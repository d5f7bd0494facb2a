"""Values as charts write them: `5 s`, `[1 m, 2 m]`, `{x: 2 m, y: 1 m, yaw: 90 deg}`, `$name`.

Numbers are SI and radians; text with a unit (`5 s`, `30 deg`, `20 cm`) is converted once, at load.
A mapping is a value of a class: a frozen dataclass or a named tuple by its fields, or what the
class method `written` of the class makes of its arguments. Where a class has an attribute
`named_by`, such as `place`, `{place: kitchen}` is the value of that name in the run's surroundings.
"""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import is_dataclass
from enum import Enum
from functools import cache
from typing import Any, NamedTuple

from engine.files import did_you_mean, quantity
from engine.files.declared import (
    Mismatch,
    boolean,
    choice,
    example,
    number,
    shown,
    text,
    whole,
    with_article,
)
from engine.types import Type, from_annotation


class Reference(NamedTuple):
    """`$name`: a parameter of the chart; with dots, as `$profile.escape.ahead`, a named value."""

    name: str

    @property
    def is_constant(self) -> bool:
        """Whether it names a value from outside of all charts."""
        return "." in self.name

    def __str__(self) -> str:
        return f"${self.name}"


class Constant(NamedTuple):
    """A value from outside of all charts, as written there, and where it comes from."""

    value: Any
    origin: str = ""


class OpenName(NamedTuple):
    """Stands for a value whose name the run's surroundings know: `{kind: name}`."""

    kind: str
    name: str


LATER: Any = object()
"""Stands for a value that only a run has."""


class Resolver:
    """Says what names in values stand for; this one leaves open what it can."""

    def named(self, kind: str, name: str) -> Any:
        """The value of a name that the surroundings know, such as that of a place."""
        return OpenName(kind, name)

    def signal(self, name: str, wanted: Type) -> str:  # noqa: ARG002
        """The name of a signal whose values are to be of the item type of `wanted`."""
        return name

    def reference(self, reference: Reference, wanted: Type) -> Any:
        """The value of `$name`, of the type `wanted`; `LATER` if it is not known yet.

        Raises:
            Mismatch: there is no such name, or it is of another type.
        """
        raise Mismatch(f"${reference.name} stands for nothing here; write a value of type {wanted}")


OPEN = Resolver()


def path_text(keys: Iterable[str | int]) -> str:
    """Keys that lead to a part of a value, to follow its name: `.x`, `[2].yaw`."""
    return "".join(f".{key}" if isinstance(key, str) else f"[{key}]" for key in keys)


class WithinLiteral(Mismatch):
    """A mismatch in a part of a value; `keys` lead to it."""

    def __init__(self, message: str, *keys: str | int) -> None:
        super().__init__(message)
        self.keys = keys

    @property
    def path(self) -> str:
        """The keys as text, to follow the name of the value."""
        return path_text(self.keys)


class WrongKey(WithinLiteral):
    """A key of a value that should not be there; the last of `keys`."""


class Untyped(WithinLiteral):
    """A mapping where no type says what it is a value of."""


class ConstantMismatch(Mismatch):
    """A mismatch of the constant `name`."""

    def __init__(self, message: str, name: str) -> None:
        super().__init__(message)
        self.name = name


class WrittenField(NamedTuple):
    """A field of a class whose values charts can write."""

    type: Type
    required: bool


def convert(value: Any, wanted: Type, by: Resolver = OPEN) -> Any:
    """Convert a value, as written in a chart, to the type `wanted`.

    Raises:
        Mismatch: when it is not of that type.
    """
    if type(value) is Reference:
        return by.reference(value, wanted)
    if value is None or _says_none(value, wanted):
        if wanted.optional:
            return None
        raise Mismatch(f"nothing given; wanted: {wanted}")
    if wanted.choices:
        return choice(value, wanted.choices)
    if wanted.name == "list":
        return _list(value, wanted, by)
    if wanted.python is not None:
        return _instance(value, wanted.python, by)
    if wanted.name == "any":
        return _any(value, by)
    if wanted.name == "signal":
        return by.signal(_signal(value), wanted)
    reader = _READERS.get(wanted.name)
    return _number(value, wanted) if reader is None else reader(value)


def _number(value: Any, wanted: Type) -> float:
    found = whole(value) if wanted.name == "integer" else number(value, wanted.name)
    if wanted.within is not None:
        wanted.within.require(found, wanted.name)
    return found


def constant_of(
    name: str, constants: Mapping[str, Constant], wanted: Type, by: Resolver = OPEN
) -> Any:
    """The value of a constant, which has to be there, of the type `wanted`.

    Raises:
        ConstantMismatch: it is of another type.
    """
    value, origin = constants[name]
    try:
        if wanted.name == "text" and isinstance(value, str) and (measured := quantity(value)):
            raise Mismatch(f"{value!r} is {with_article(measured[1])}; wanted: text")
        return convert(value, wanted, by)
    except Mismatch as mismatch:
        shown_origin = f" ({origin})" if origin else ""
        raise ConstantMismatch(f"${name}{shown_origin}: {mismatch}", name) from None


def constants_in(value: Any) -> Iterator[str]:
    """The names of the constants in a value as written in a chart."""
    if isinstance(value, Reference):
        if value.is_constant:
            yield value.name
    elif isinstance(value, Mapping | list | tuple):
        for item in value.values() if isinstance(value, Mapping) else value:
            yield from constants_in(item)


def can_be_written(kind: Type) -> bool:
    """Whether charts can write values of this type."""
    if kind.item is not None and kind.name == "list":
        return can_be_written(kind.item)
    return kind.python is None or _is_enum(kind.python) or fields_of(kind.python) is not None


def kind_of_names(kind: Type) -> str:
    """The key under which the surroundings name values of this type, such as `place`; or empty."""
    return str(getattr(kind.python, "named_by", ""))


@cache
def fields_of(cls: type) -> Mapping[str, WrittenField] | None:
    """The fields of a class as charts write them; `None` if they cannot write its values."""
    maker = getattr(cls, "written", None)
    if maker is None and not hasattr(cls, "_fields") and not _is_frozen(cls):
        return None
    arguments = inspect.signature(maker or cls).parameters
    try:
        hints = typing.get_type_hints(maker or cls, include_extras=True)
        return {
            name: WrittenField(from_annotation(hints[name]), argument.default is argument.empty)
            for name, argument in arguments.items()
        }
    except (KeyError, NameError, TypeError):  # a field that no chart could write
        return None


def example_of(cls: type) -> str:
    """How values of a class are written: `{x: …, y: …, yaw: …} or {place: …}`."""
    fields = fields_of(cls) or {}
    shape = ", ".join(f"{name}: …" for name in fields)
    kind = getattr(cls, "named_by", "")
    return f"{{{shape}}}" + (f" or {{{kind}: …}}" if kind else "")


def description_of(kind: Type) -> str:
    """A type in words, and how its values are written: `a length, in mm, cm, m, km`."""
    members = vars(kind.python)["_member_map_"] if _is_enum(kind.python) else ()
    if choices := kind.choices or members:
        return f"one of {', '.join(map(str, choices))}"
    if kind.name == "list" and kind.item is not None:
        return f"a list, each item {description_of(kind.item)}"
    if kind.name in _DESCRIPTIONS:
        return _DESCRIPTIONS[kind.name]
    if kind.python is None:
        return example(kind.name)
    article = "an" if kind.name[0] in "AEIOU" else "a"
    how = example_of(kind.python) if can_be_written(kind) else "only another chart can give it"
    return f"{article} {kind.name}, {how}"


_DESCRIPTIONS = {
    "any": "any value",
    "text": "text",
    "boolean": "true or false",
    "signal": "the name of a signal",
}


def _instance(value: Any, cls: type, by: Resolver) -> Any:
    if isinstance(value, cls):
        return value
    if _is_enum(cls):
        members: Mapping[str, Any] = vars(cls)["_member_map_"]
        return members[choice(value, members)]
    fields = fields_of(cls)
    if fields is None:
        what = f"a {cls.__name__} cannot be written in a chart, only passed on by `in:`"
        raise Mismatch(what)
    if not isinstance(value, Mapping):
        raise Mismatch(f"{shown(value)} is not a {cls.__name__}; wanted: {example_of(cls)}")
    kind = getattr(cls, "named_by", "")
    if kind and kind in value and kind not in fields:
        if len(value) > 1:
            other = next(key for key in value if key != kind)
            raise WrongKey(f"a {kind} needs nothing beside its name; leave out {other!r}", other)
        name = _inside(value[kind], Type("text"), by, kind)
        return LATER if name is LATER else by.named(kind, name)
    given = {name: _field(name, item, cls, fields, by) for name, item in value.items()}
    missing = [name for name, field in fields.items() if field.required and name not in given]
    if missing:
        raise Mismatch(f"{', '.join(map(repr, missing))} missing; wanted: {example_of(cls)}")
    return LATER if any(map(_is_open, given.values())) else _made(cls, given)


def _made(cls: type, given: Mapping[str, Any]) -> Any:
    try:
        return getattr(cls, "written", cls)(**given)
    except ValueError as error:
        raise Mismatch(str(error)) from None
    except Exception as error:  # noqa: BLE001  a class of a project may raise anything
        raise Mismatch(f"{cls.__name__}: {type(error).__name__}: {error}") from None


def _field(
    name: str, value: Any, cls: type, fields: Mapping[str, WrittenField], by: Resolver
) -> Any:
    if name not in fields:
        kind = getattr(cls, "named_by", "")
        near = did_you_mean(name, [*fields, *([kind] if kind else [])])
        raise WrongKey(f"a {cls.__name__} has no {name!r}; {near}", name)
    return _inside(value, fields[name].type, by, name)


def _inside(value: Any, wanted: Type, by: Resolver, key: str | int) -> Any:
    try:
        return convert(value, wanted, by)
    except ConstantMismatch:
        raise
    except WithinLiteral as mismatch:
        raise type(mismatch)(str(mismatch), key, *mismatch.keys) from None
    except Mismatch as mismatch:
        raise WithinLiteral(str(mismatch), key) from None


def _list(value: Any, wanted: Type, by: Resolver) -> Any:
    assert wanted.item is not None
    if not isinstance(value, list | tuple):
        raise Mismatch(f"{shown(value)} is not a list; write `[{_item(value, wanted.item)}]`")
    items = tuple(_inside(item, wanted.item, by, n) for n, item in enumerate(value))
    return LATER if any(item is LATER for item in items) else items


def _is_open(item: Any) -> bool:
    """Whether a value, or an item of a list, is known only in a run."""
    if type(item) is tuple:
        return any(map(_is_open, item))
    return item is LATER or type(item) is OpenName


def _item(value: Any, wanted: Type) -> str:
    """How a value stands as an item of a list."""
    if isinstance(value, Mapping):
        return "{…}"
    if kind := kind_of_names(wanted):
        return f"{{{kind}: {value if isinstance(value, str) else '…'}}}"
    is_class = wanted.python is not None and can_be_written(wanted) and not _is_enum(wanted.python)
    return example_of(wanted.python) if wanted.python and is_class else str(value)


def _any(value: Any, by: Resolver) -> Any:
    if isinstance(value, list | tuple):
        return _list(value, Type("list", item=Type("any", optional=True)), by)
    if isinstance(value, Mapping):
        raise Untyped("a mapping is a value only where a type says of what")
    return value


def _signal(value: Any) -> str:
    if isinstance(value, str) and value:
        return value
    raise Mismatch(f"{shown(value)} is not the name of a signal")


def _says_none(value: Any, wanted: Type) -> bool:
    """Whether it is the word `none`, where that is no text of its own."""
    own = wanted.name in ("text", "any", "signal") or "none" in wanted.choices
    return value == "none" and wanted.optional and not own


def _is_frozen(cls: Any) -> bool:
    return is_dataclass(cls) and vars(cls)["__dataclass_params__"].frozen


def _is_enum(cls: type | None) -> bool:
    return isinstance(cls, type) and issubclass(cls, Enum)


_READERS: dict[str, Callable[[Any], Any]] = {"text": text, "boolean": boolean}
