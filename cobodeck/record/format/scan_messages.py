"""Laser scans as foxglove.LaserScan in protobuf, without loss by three additional fields.

Foxglove's fields are 1 timestamp, 2 frame_id, 4 start_angle, 5 end_angle, 6 ranges; angles in rad,
ranges in m. Ours are the step between beams, rad, which does not follow from the two angles to the
last bit, the time from beam to beam, and the repeat flag.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Iterator
from itertools import islice
from typing import Any

from hw import Scan

LASER = "foxglove.LaserScan"
_STEP, _REPEAT, _BEAM_TIME = 1000, 1001, 1002
_VARINT, _DOUBLE, _SIZED = range(3)


def write_scan(stamp_ns: int, scan: Scan, again: bool) -> bytes:
    """A scan as a message; `again`: it is the same object as in the sample before."""
    seconds, rest = divmod(stamp_ns, 10**9)
    time = (_varint(8) + _varint(seconds) if seconds else b"") + (
        _varint(16) + _varint(rest) if rest else b""
    )
    end = scan.start + scan.step * (len(scan.ranges) - 1)
    fields = [
        _sized(1, time),
        _sized(2, scan.sensor.encode("utf-8", "surrogatepass")),
        _double(4, scan.start) + _double(5, end),
        _sized(6, array("d", scan.ranges).tobytes()),
        _double(_STEP, scan.step),
        _double(_BEAM_TIME, scan.beam_time) if scan.beam_time else b"",
    ]
    return b"".join(fields) + (_varint(_REPEAT << 3) + b"\1" if again else b"")


def read_scan(data: bytes) -> tuple[int, Scan, bool]:
    """Stamp in ns, the scan, and whether it repeats the one before."""
    found = dict(_read_fields(data))
    time = dict(_read_fields(found[1]))
    stamp = _signed(time.get(1, 0)) * 10**9 + time.get(2, 0)
    [start], [step] = struct.unpack("<d", found[4]), struct.unpack("<d", found[_STEP])
    [beam_time] = struct.unpack("<d", found.get(_BEAM_TIME, bytes(8)))
    ranges = array("d", found[6])
    name = found[2].decode("utf-8", "surrogatepass")
    return stamp, Scan(name, start, step, tuple(ranges), beam_time), bool(found.get(_REPEAT, 0))


def scanner_of(data: bytes) -> str:
    """The scanner of a message, without reading the rest of it."""
    found = dict(islice(_read_fields(data), 2))
    return str(found[2], "utf-8", "surrogatepass")


def _varint(number: int) -> bytes:
    number &= (1 << 64) - 1
    found = bytearray()
    while number > 0x7F:
        found.append(number & 0x7F | 0x80)
        number >>= 7
    found.append(number)
    return bytes(found)


def _signed(number: int) -> int:
    return number - (1 << 64) if number >> 63 else number


def _sized(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | _SIZED) + _varint(len(content)) + content


def _double(field: int, number: float) -> bytes:
    return _varint(field << 3 | _DOUBLE) + struct.pack("<d", number)


def _read_fields(data: bytes) -> Iterator[tuple[int, Any]]:
    at = 0

    def varint() -> int:
        nonlocal at
        number = shift = 0
        while True:
            byte = data[at]
            at += 1
            number |= (byte & 0x7F) << shift
            if byte < 0x80:
                return number
            shift += 7

    while at < len(data):
        key = varint()
        if key & 7 == _VARINT:
            yield key >> 3, varint()
            continue
        length = 8 if key & 7 == _DOUBLE else varint()
        yield key >> 3, data[at : at + length]
        at += length
