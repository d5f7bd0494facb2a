"""Whether a finished record is byte for byte what was written.

Two checksums (CRC-32) cover an MCAP file: `DataEnd` holds that of all bytes before it, the footer
that of the summary between the two and of itself. What they leave out is constant.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from os import SEEK_END
from struct import Struct
from typing import BinaryIO

from mcap.opcode import Opcode

MAGIC = b"\x89MCAP0\r\n"
_DATA_END = Struct("<BQI")
"""Opcode, length of the rest, checksum."""
_FOOTER = Struct("<BQQQI8s")
"""Opcode, length, where summary and summary offsets begin, checksum, magic."""
_CHECKSUM = 4 + len(MAGIC)
"""What comes after the bytes that the footer's checksum covers, bytes."""
_BLOCK = 1 << 20
_NO_END = "it has no end"


def has_end(stream: BinaryIO) -> bool:
    """True if a file ends as complete ones do."""
    size = stream.seek(0, SEEK_END)
    stream.seek(max(0, size - len(MAGIC)))
    return stream.read() == MAGIC


def damage(stream: BinaryIO) -> str | None:
    """How a complete file differs from what was written, in words; None: it does not.

    A checksum of 0 means that there is none, as in copies that other programs have made.
    """
    footer = stream.seek(0, SEEK_END) - _FOOTER.size
    if footer < len(MAGIC) + _DATA_END.size:
        return _NO_END
    kind, length, summary, _, checksum, magic = _FOOTER.unpack(_bytes(stream, footer, _FOOTER.size))
    if (kind, length, magic) != (Opcode.FOOTER, _FOOTER.size - 9 - len(MAGIC), MAGIC):
        return _NO_END
    end = (summary or footer) - _DATA_END.size
    if not len(MAGIC) <= end <= footer - _DATA_END.size:
        return "its footer is damaged"
    kind, length, of_data = _DATA_END.unpack(_bytes(stream, end, _DATA_END.size))
    if (kind, length) != (Opcode.DATA_END, _DATA_END.size - 9):
        return f"byte {end} is not the end of its data"
    summary = end + _DATA_END.size
    for first, last, written in (
        (0, end, of_data),
        (summary, footer + _FOOTER.size - _CHECKSUM, checksum),
    ):
        if written and written != _checksum(stream, first, last):
            return f"bytes {first} to {last} are not those that were written"
    return None


def _bytes(stream: BinaryIO, at: int, size: int) -> bytes:
    stream.seek(at)
    return stream.read(size)


def _checksum(stream: BinaryIO, first: int, last: int) -> int:
    found = 0
    for block in _blocks(stream, first, last):
        found = zlib.crc32(block, found)
    return found


def _blocks(stream: BinaryIO, first: int, last: int) -> Iterator[bytes]:
    stream.seek(first)
    for at in range(first, last, _BLOCK):
        yield stream.read(min(_BLOCK, last - at))
