"""Any value as JSON text, and back without loss.

Beyond the table of `engine.files.codec`, which a number, text, tuple or class is written by:

| value | JSON |
|---|---|
| list, dict | `{"$list": […]}`, `{"$dict": [[key, value], …]}` |
| set, frozenset | `{"$set": […]}`, `{"$frozenset": […]}`, in the order of their texts |
| inf, nan | `{"$float": "inf"}` |
| enum member, all of them | `{"$enum": ["Class", "NAME"]}`, `{"$members": "Class"}` |
| bytes, numpy array | `{"$bytes": base64}`, `{"$array": [dtype, shape, base64]}` |
| anything else | `{"$opaque": ["module.Class", text]}`, which only compares |

Names of classes: `cobodeck.record.format.class_names`.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from dataclasses import is_dataclass
from enum import Enum
from typing import Any

from cobodeck.record.format.class_names import Unknown, class_of, name_of, renamed
from engine.files import Write, Writers, decoded, fields_of, quoted
from engine.run import encode

_ADDRESS = re.compile(r" at 0x[0-9a-f]+")


def text(value: Any) -> str:
    """A value as JSON text; never raises."""
    try:
        return _WRITE[type(value)](value)
    except Exception:  # noqa: BLE001  a foreign class may raise anything, or contain itself
        return _opaque(type(value), "")


def value(found: Any) -> Any:
    """The value that parsed JSON stands for.

    Raises:
        Unknown: there is no such class.
    """
    return decoded(found, _made)


def today(found: Any) -> Any:
    """Parsed JSON with the names that classes have today, as it would be written now."""
    if isinstance(found, list):
        return [today(item) for item in found]
    if not isinstance(found, dict) or len(found) != 1:
        return found
    [(key, content)] = found.items()
    if key == "$members":
        return {key: renamed(content)}
    if key in ("$enum", "$opaque"):
        return {key: [renamed(part) for part in content]}
    return {key if key.startswith("$") else renamed(key): today(content)}


def _writer(kind: type) -> Write:
    if issubclass(kind, Enum):
        key = quoted(name_of(kind))
        return lambda member: f'{{"$enum":[{key},{quoted(member.name)}]}}'
    if issubclass(kind, type):
        return _class
    if (fields := _WRITE.of_fields(kind, name_of(kind))) is not None:
        return fields
    if issubclass(kind, dict):
        return _pairs
    if issubclass(kind, list):
        return _list
    if hasattr(kind, "dtype") and hasattr(kind, "tobytes"):
        return _array
    return lambda other: _opaque(kind, _ADDRESS.sub("", encode(other)))


def _infinite(held: float) -> str:
    return f'{{"$float":"{held!r}"}}'


def _list(items: list[Any]) -> str:
    return f'{{"$list":{_WRITE.items_text(items)}}}'


def _pairs(pairs: dict[Any, Any]) -> str:
    return f'{{"$dict":{_WRITE.items_text(pairs.items())}}}'


def _members(key: str) -> Write:
    return lambda held: f'{{"{key}":[{",".join(sorted(map(_WRITE.text, held)))}]}}'


def _bytes(data: bytes) -> str:
    return f'{{"$bytes":"{base64.b64encode(data).decode()}"}}'


def _array(array: Any) -> str:
    if array.dtype.hasobject:
        return _opaque(type(array), encode(array.tolist()))
    shape, content = _WRITE.items_text(array.shape), base64.b64encode(array.tobytes()).decode()
    return f'{{"$array":["{array.dtype.str}",{shape},"{content}"]}}'


def _class(held: type) -> str:
    if issubclass(held, Enum):
        return f'{{"$members":{quoted(name_of(held))}}}'
    return _opaque(type(held), name_of(held))


def _opaque(kind: type, shown: str) -> str:
    return f'{{"$opaque":[{quoted(name_of(kind))},{quoted(shown)}]}}'


_WRITE = Writers(_writer, infinite=_infinite)
_WRITE |= {
    list: _list,
    dict: _pairs,
    set: _members("$set"),
    frozenset: _members("$frozenset"),
    bytes: _bytes,
}
number = _WRITE[float]
"""A float as JSON text."""


def _made(key: str, content: Any) -> Any:
    make = _MAKE.get(key)
    return _instance(key, content) if make is None else make(content)


def _instance(name: str, content: list[Any]) -> Any:
    kind = class_of(name)
    items = value(content)
    if issubclass(kind, tuple):
        make: Any = kind
        return make._make(items)
    if not is_dataclass(kind):
        raise Unknown(f"{name} is no dataclass")
    names = fields_of(kind) or ()
    if len(names) != len(items):
        raise Unknown(f"{name} has {len(names)} fields now, not {len(items)}")
    made: Any = object.__new__(kind)
    for field, item in zip(names, items, strict=True):
        object.__setattr__(made, field, item)
    return made


def _member(content: list[str]) -> Any:
    members = _enum(content[0]).__members__
    if content[1] not in members:
        raise Unknown(f"{content[0]} has no member {content[1]}")
    return members[content[1]]


def _enum(name: str) -> type[Enum]:
    kind = class_of(name)
    if not issubclass(kind, Enum):
        raise Unknown(f"{name} has no members")
    return kind


def _made_array(content: list[Any]) -> Any:
    import numpy as np

    kind, shape, data = content
    made = np.frombuffer(base64.b64decode(data), dtype=kind).reshape(shape)
    return made[()] if not shape else made


def _lost(content: list[str]) -> Any:
    raise Unknown(f"a {content[0]} cannot be written down; make it a dataclass")


_MAKE: dict[str, Callable[[Any], Any]] = {
    "$list": lambda items: list(value(items)),
    "$dict": lambda pairs: dict(value(pairs)),
    "$set": lambda items: set(value(items)),
    "$frozenset": lambda items: frozenset(value(items)),
    "$float": float,
    "$bytes": base64.b64decode,
    "$array": _made_array,
    "$enum": _member,
    "$members": _enum,
    "$opaque": _lost,
}
