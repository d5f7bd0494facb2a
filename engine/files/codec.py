"""Values as JSON and back: what records, datagrams and traces have in common.

| value | JSON |
|---|---|
| None, bool, str, int, finite float | itself; `1` and `1.0` stay apart |
| tuple | `[…]` |
| dataclass, named tuple | `{"Twist2": […]}`, its fields in order |

A class has its own name, not its module's, so that it can be moved. All else is up to the format:
`Writers` asks it for one function per class, and `read` gives it the content of each object.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import fields, is_dataclass
from typing import Any

Write = Callable[[Any], str]
quoted = json.encoder.encode_basestring_ascii


class Writers(dict[type, Write]):
    """The functions of one format that write values, by class; each is made once.

    Args:
        other: makes the function for a class that is not in the table above, or raises.
        string: writes a text.
        infinite: writes a float that is infinite or NaN.
    """

    def __init__(
        self,
        other: Callable[[type], Write],
        string: Write = quoted,
        infinite: Write = json.dumps,
    ) -> None:
        def number(held: float) -> str:
            return float.__repr__(held) if math.isfinite(held) else infinite(held)

        self[type(None)] = lambda _: "null"
        self[bool] = lambda flag: "true" if flag else "false"
        self[int], self[float], self[str] = int.__repr__, number, string
        self[tuple] = self.items_text
        self._other = other

    def __missing__(self, kind: type) -> Write:
        write = self[kind] = self._other(kind)
        return write

    def text(self, value: Any) -> str:
        """A value as JSON text."""
        return self[type(value)](value)

    def items_text(self, items: Iterable[Any]) -> str:
        """Values as a JSON array."""
        return f"[{','.join([self[type(item)](item) for item in items])}]"

    def of_base(self, kind: type) -> Write | None:
        """The function of the number or text that a class derives from, if it does."""
        return next((self[base] for base in (float, int, str) if issubclass(kind, base)), None)

    def of_fields(self, kind: type, name: str) -> Write | None:
        """The function of a dataclass or named tuple under a name; None for other classes."""
        names, key = fields_of(kind), quoted(name)
        if names is None:
            return None

        def write(held: Any) -> str:
            return f"{{{key}:{self.items_text([getattr(held, name) for name in names])}}}"

        return write


def fields_of(kind: type) -> tuple[str, ...] | None:
    """The names of the fields of a dataclass or named tuple; None for other classes."""
    if is_dataclass(kind):
        return tuple([field.name for field in fields(kind)])
    return getattr(kind, "_fields", None) if issubclass(kind, tuple) else None


def decoded(found: Any, make: Callable[[str, Any], Any]) -> Any:
    """The value of parsed JSON; `make` is given the key and the content of an object.

    Raises:
        ValueError: an object has not exactly one key.
    """
    if isinstance(found, list):
        return tuple([decoded(item, make) for item in found])
    if isinstance(found, dict):
        [(key, content)] = found.items()
        return make(key, content)
    return found
