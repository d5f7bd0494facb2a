"""Objects of MRPT's binary archives: rawlogs and simplemaps, as far as planar logs need them.

An object is the length of its class name (one byte with the highest bit set since MRPT 0.5.5, four
bytes before), the name, a version (one byte; four before) and the fields, little-endian; since
0.5.5 a byte 0x88 ends it. The size of an object is not stored, so unknown classes cannot be
skipped: the archive is read as a flat sequence of objects, in which containers only mark their
beginning, and after an unknown object reading continues at the next known class name.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from cobodeck.logs.formats.mrpt_poses import POSES
from cobodeck.logs.formats.mrpt_sensors import SENSORS

_END = 0x88
_NAME = re.compile(rb"(?:mrpt::\w+::)?(C[A-Z]\w{2,60}|C[1-9]\w{2,60})\Z")
_LONGEST = 120


class Found(NamedTuple):
    """An object: class name without namespace, value (None for containers), offset in bytes."""

    kind: str
    value: Any
    at: int


@dataclass(slots=True)
class ArchiveReader:
    """Reads fields from the bytes of an archive, one after another.

    Every method raises `Broken` where the bytes end or are invalid.
    """

    data: bytes
    at: int = 0

    def take(self, count: int) -> bytes:
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
        return struct.unpack(form, self.take(struct.calcsize(form)))

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
        return self.take(self.count(1)).decode("utf-8", "replace")

    def part(self, kinds: Mapping[str, Callable[[Any, int], Any]] | None = None) -> Any:
        """An object of one of these classes that is a field of another object."""
        head = header_at(self.data, self.at)
        if head is None or head.kind not in (kinds or KINDS):
            name = "no object" if head is None else head.kind
            raise Broken(f"there is {name} where another class is expected, at byte {self.at}")
        return self.body(head)

    def body(self, head: Header) -> Any:
        """The value of an object from its fields; checks its end byte."""
        self.at = head.end
        try:
            value = KINDS[head.kind](self, head.version)
        except ValueError as error:
            raise Broken(f"a {head.kind} at byte {head.at} was left out: {error}") from None
        if not head.old and self.take(1)[0] != _END:
            raise Broken(
                f"a {head.kind} of version {head.version} has an unknown layout, at {head.at}"
            )
        return value


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


def objects(data: bytes, tell: Callable[[str], None]) -> Iterator[Found]:
    """All known objects of an archive, in order; `tell` receives a sentence on each left out."""
    reader = ArchiveReader(data)
    while reader.at < len(data):
        head = header_at(data, reader.at)
        if head is None:
            if data[reader.at] == _END:
                reader.at += 1
            elif not _go_on(reader, reader.at + 1):
                tell(f"it is cut off at byte {len(data)}")
                return
        elif head.kind in HOLDERS:
            reader.at = head.end + HOLDERS[head.kind](head.version)
            yield Found(head.kind, None, head.at)
        elif head.kind in KINDS:
            try:
                yield Found(head.kind, reader.body(head), head.at)
            except Broken as broken:
                tell(str(broken))
                if not _go_on(reader, head.end):
                    return
        else:
            tell(f"{head.kind} is not read")
            if not _go_on(reader, head.end):
                return


def _go_on(reader: ArchiveReader, after: int) -> bool:
    """Advance to the next object of a known class; False if there is none."""
    for match in _KNOWN.finditer(reader.data, after):
        name = match.start()
        for begin in (name - 1, name - 4):
            head = header_at(reader.data, begin) if begin >= after else None
            if head is not None and head.end - (4 if head.old else 1) == match.end():
                reader.at = begin
                return True
    reader.at = len(reader.data)
    return False


def _frame_head(version: int) -> int:
    return 4 + (4 if version < 2 else 0) + (8 if version == 0 else 0)


HOLDERS: Mapping[str, Callable[[int], int]] = {
    "CSensoryFrame": _frame_head,
    "CSensorialFrame": _frame_head,
    "CActionCollection": lambda _: 4,
    "CSimpleMap": lambda _: 4,
    "CSensFrameProbSequence": lambda _: 4,
    "CRawlog": lambda _: 4,
}
"""Container classes, and the number of bytes before their first object, by version."""
KINDS: Mapping[str, Callable[[Any, int], Any]] = {**POSES, **SENSORS}
_NAMES = sorted((*HOLDERS, *KINDS), key=len, reverse=True)
_KNOWN = re.compile(rb"(?:mrpt::\w+::)?(?:" + "|".join(_NAMES).encode() + rb")")
