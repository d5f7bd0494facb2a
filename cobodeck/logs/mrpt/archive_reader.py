"""Reads objects of MRPT's binary archives, one field after another.

An object is the length of its class name (one byte with the highest bit set since MRPT 0.5.5, four
bytes before), the name, a version (one byte; four before) and the fields, little-endian; since
0.5.5 a byte 0x88 ends it.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

END = 0x88
_NAME = re.compile(rb"(?:mrpt::\w+::)?(C[A-Z]\w{2,60}|C[1-9]\w{2,60})\Z")
_LONGEST = 120
Kinds = Mapping[str, Callable[[Any, int], Any]]
"""By class name: functions that read a value from an object's fields, given its version."""


class Broken(Exception):
    """The bytes of an archive are invalid or end early."""


class Header(NamedTuple):
    """An object's offset, class, version, offset of its fields; `old`: before MRPT 0.5.5."""

    at: int
    kind: str
    version: int
    end: int
    old: bool


def header_at(data: bytes, at: int) -> Header | None:
    """The header of the object that begins at byte `at`; None if none begins there."""
    if at + 4 > len(data):
        return None
    length, old = data[at] & 0x7F, data[at] < 0x80
    if not 3 <= length <= _LONGEST or (old and data[at + 1 : at + 4] != b"\0\0\0"):
        return None
    begin = at + (4 if old else 1)
    name = _NAME.match(data[begin : begin + length])
    end = begin + length + (4 if old else 1)
    if name is None or end > len(data):
        return None
    version = struct.unpack_from("<i" if old else "<B", data, begin + length)[0]
    return Header(at, name[1].decode(), version, end, old)


@dataclass(slots=True)
class ArchiveReader:
    """Reads fields from the bytes of an archive, one after another.

    `kinds` read the fields of a class, by its name, given the version. Every method raises `Broken`
    where the bytes end or are invalid.
    """

    data: bytes
    kinds: Kinds
    at: int = 0

    def read(self, count: int) -> bytes:
        """The next bytes."""
        end = self.at + count
        if count < 0 or end > len(self.data):
            raise Broken(f"it is cut off at byte {len(self.data)}")
        found = self.data[self.at : end]
        self.at = end
        return found

    def numbers(self, form: str) -> tuple[Any, ...]:
        """Numbers by a format of `struct`, little-endian, without padding."""
        form = "<" + form
        return struct.unpack(form, self.read(struct.calcsize(form)))

    def number(self, form: str) -> Any:
        """One number."""
        return self.numbers(form)[0]

    def count(self, size: int) -> int:
        """A count of items of `size` bytes each, checked against the number of bytes left."""
        found: int = self.number("I")
        if found * size > len(self.data) - self.at:
            raise Broken(f"it is cut off at byte {len(self.data)}")
        return found

    def text(self) -> str:
        """A text, preceded by its length."""
        return self.read(self.count(1)).decode("utf-8", "replace")

    def part(self) -> Any:
        """An object that is a field of another object."""
        head = header_at(self.data, self.at)
        if head is None or head.kind not in self.kinds:
            name = "no object" if head is None else head.kind
            raise Broken(f"there is {name} where another class is expected, at byte {self.at}")
        return self.body(head)

    def body(self, head: Header) -> Any:
        """The value of an object from its fields; checks its end byte."""
        self.at = head.end
        try:
            value = self.kinds[head.kind](self, head.version)
        except ValueError as error:
            raise Broken(f"a {head.kind} at byte {head.at} was left out: {error}") from None
        if not head.old and self.read(1)[0] != END:
            raise Broken(
                f"a {head.kind} of version {head.version} has an unknown layout, at {head.at}"
            )
        return value
