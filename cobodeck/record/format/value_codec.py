"""Any value as JSON text, and back without loss.

| value | JSON |
|---|---|
| None, bool, str, int, finite float | itself; `1` and `1.0` stay apart |
| tuple | `[…]` |
| list, dict | `{"$list": […]}`, `{"$dict": [[key, value], …]}` |
| set, frozenset | `{"$set": […]}`, `{"$frozenset": […]}`, in the order of their texts |
| inf, nan | `{"$float": "inf"}` |
| dataclass, named tuple | `{"hw.geometry.Twist2": […]}`, its fields in order |
| enum member, all of them | `{"$enum": ["module.Class", "NAME"]}`, `{"$members": "module.Class"}` |
| bytes, numpy array | `{"$bytes": base64}`, `{"$array": [dtype, shape, base64]}` |
| anything else | `{"$opaque": ["module.Class", text]}`, which only compares |

Classes are looked up among the modules that are loaded already: reading a record imports nothing.
"""

from __future__ import annotations

import base64
import dataclasses
import json
import math
import re
import sys
from collections.abc import Callable
from enum import Enum
from typing import Any

from engine.run import encode

Encode = Callable[[Any], str]
quoted = json.encoder.encode_basestring_ascii
_ADDRESS = re.compile(r" at 0x[0-9a-f]+")


class Unknown(Exception):
    """A value that cannot be restored: its class is missing, or it was written as opaque."""


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
    if isinstance(found, list):
        return tuple([value(item) for item in found])
    if isinstance(found, dict):
        [(key, content)] = found.items()
        read = _READ.get(key)
        return _instance(key, content) if read is None else read(content)
    return found


class _Writers(dict[type, Encode]):
    """Functions that write values, by class; each is made once."""

    def __missing__(self, kind: type) -> Encode:
        write = self[kind] = _writer(kind)
        return write


def _writer(kind: type) -> Encode:
    if issubclass(kind, Enum):
        key = quoted(name_of(kind))
        return lambda member: f'{{"$enum":[{key},{quoted(member.name)}]}}'
    if issubclass(kind, type):
        return _class
    if dataclasses.is_dataclass(kind):
        return _fields(kind, [field.name for field in dataclasses.fields(kind)])
    if issubclass(kind, tuple) and hasattr(kind, "_fields"):
        return _fields(kind, list(kind._fields))
    if issubclass(kind, dict):
        return _pairs
    if issubclass(kind, list):
        return _list
    if hasattr(kind, "dtype") and hasattr(kind, "tobytes"):
        return _array
    return lambda other: _opaque(kind, _ADDRESS.sub("", encode(other)))


def _fields(kind: type, names: list[str]) -> Encode:
    key = quoted(name_of(kind))

    def write(held: Any) -> str:
        items = [_WRITE[type(item)](item) for item in [getattr(held, name) for name in names]]
        return f"{{{key}:[{','.join(items)}]}}"

    return write


def number(held: float) -> str:
    """A float as JSON text."""
    return repr(held) if math.isfinite(held) else f'{{"$float":"{held!r}"}}'


def _items(items: Any) -> str:
    return f"[{','.join([_WRITE[type(item)](item) for item in items])}]"


def _list(items: list[Any]) -> str:
    return f'{{"$list":{_items(items)}}}'


def _pairs(pairs: dict[Any, Any]) -> str:
    return f'{{"$dict":{_items(pairs.items())}}}'


def _members(key: str) -> Callable[[Any], str]:
    return lambda held: f'{{"{key}":[{",".join(sorted(_WRITE[type(m)](m) for m in held))}]}}'


def _array(array: Any) -> str:
    if array.dtype.hasobject:
        return _opaque(type(array), encode(array.tolist()))
    shape, content = _items(array.shape), base64.b64encode(array.tobytes()).decode()
    return f'{{"$array":["{array.dtype.str}",{shape},"{content}"]}}'


def _class(held: type) -> str:
    if issubclass(held, Enum):
        return f'{{"$members":{quoted(name_of(held))}}}'
    return _opaque(type(held), name_of(held))


def _opaque(kind: type, shown: str) -> str:
    return f'{{"$opaque":[{quoted(name_of(kind))},{quoted(shown)}]}}'


_WRITE = _Writers(
    {
        type(None): lambda _: "null",
        bool: lambda flag: "true" if flag else "false",
        int: repr,
        float: number,
        str: quoted,
        tuple: _items,
        list: _list,
        dict: _pairs,
        set: _members("$set"),
        frozenset: _members("$frozenset"),
        bytes: lambda data: f'{{"$bytes":"{base64.b64encode(data).decode()}"}}',
    }
)


def name_of(kind: type) -> str:
    """A class's name with its module."""
    return f"{kind.__module__}.{kind.__qualname__}"


def class_of(name: str) -> type:
    """The class of this name in a loaded module.

    Raises:
        Unknown: there is no such class.
    """
    module = name.rpartition(".")[0]
    while module and module not in sys.modules:  # a nested class
        module = module.rpartition(".")[0]
    found: Any = sys.modules.get(module)
    for part in name[len(module) + 1 :].split(".") if module else ():
        found = getattr(found, part, None)
    if not isinstance(found, type) or name_of(found) != name:
        raise Unknown(f"no class {name}")
    return found


def _instance(name: str, content: list[Any]) -> Any:
    kind = class_of(name)
    items = [value(item) for item in content]
    if issubclass(kind, tuple):
        make: Any = kind
        return make._make(items)
    if not dataclasses.is_dataclass(kind):
        raise Unknown(f"{name} is no dataclass")
    fields = dataclasses.fields(kind)
    if len(fields) != len(items):
        raise Unknown(f"{name} has {len(fields)} fields now, not {len(items)}")
    made: Any = object.__new__(kind)
    for field, item in zip(fields, items, strict=True):
        object.__setattr__(made, field.name, item)
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


_READ: dict[str, Callable[[Any], Any]] = {
    "$list": lambda items: [value(item) for item in items],
    "$dict": lambda pairs: {value(key): value(item) for key, item in pairs},
    "$set": lambda items: {value(item) for item in items},
    "$frozenset": lambda items: frozenset(value(item) for item in items),
    "$float": float,
    "$bytes": base64.b64decode,
    "$array": _made_array,
    "$enum": _member,
    "$members": _enum,
    "$opaque": _lost,
}
