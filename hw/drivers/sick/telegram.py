"""The telegrams that a SICK S300 sends continuously over RS-422, parsed from a byte stream.

| byte | size | content (most significant byte first, unless noted) |
|---|---|---|
| 0 | 4 | 0: the telegram was not requested |
| 4 | 2 | 0 |
| 6 | 2 | size in words of 2 bytes; where it counts from depends on the firmware |
| 8 | 1 | 0xFF |
| 9 | 1 | address of the device: 7, or 8 for the guest of a pair |
| 10 | 2 | version of the protocol |
| 12 | 2 | status; 1: locked out |
| 14 | 4 | number of the scan |
| 18 | 2 | number of the telegram |
| 20 | 2 | what follows: 0xBBBB distances, 0xAAAA inputs and outputs, 0xCCCC reflectors |
| 22 | 2 | 0x1111: first field of measurement |
| 24 | 2 n | distances, least significant byte first |
| end | 2 | CRC-16 (0x1021, starts at 0xFFFF) of all from byte 4 on; least significant byte first |

Bits 0-12 of a distance are cm; 13: a reflector, or dazzled; 14: in the protective field; 15: in the
warning field. A telegram of 541 distances has 1108 bytes. Source: the drivers of Care-O-bot and
Neobotix, and SICK's telegram listing 8015791; never tried on a device.
"""

from __future__ import annotations

import re
import struct
from binascii import crc_hqx
from dataclasses import dataclass

LONGEST = 4096
"""Longest telegram, bytes."""
DISTANCES, FIRST_FIELD = 0xBBBB, 0x1111
LOCKED_OUT = 0x0001
"""Bit of the status of a scanner that refuses to work."""
STANDBY = 0x4004
"""Every distance of a scanner in standby."""
_HEADER = re.compile(rb"\0{6}..\xff", re.DOTALL)
_FIELDS = struct.Struct(">4x2xHxBHHIHHH")
_REPLY = 4
_CRC = 2
_BEYOND = (4, 8, 14)
"""Bytes of a telegram not counted by its size field, by firmware."""
_CENTIMETRES = 0x1FFF


@dataclass(frozen=True, slots=True)
class Telegram:
    """One telegram with a correct CRC; `words` are its distances with flags, if any."""

    address: int
    version: int
    status: int
    scan: int
    number: int
    size: int
    words: tuple[int, ...] = ()

    @property
    def silence(self) -> str | None:
        """Why it has no distances that were measured, and what would be right; None if it has."""
        if any(word != STANDBY for word in self.words):
            return None
        state = f"(status 0x{self.status:04X})"
        if self.status & LOCKED_OUT:
            return (
                f"locked out {state}: it has found a fault of its own, and its display says which"
            )
        if self.words:
            return (
                f"in standby {state}: an input of its own, or its controller, has to let it measure"
            )
        return f"it sends no distances {state}: set its output to measurement data with SICK's CDS"

    def ranges(self, nearest: float, farthest: float) -> tuple[float, ...]:
        """Distances in m; inf outside these limits, as for no return."""
        metres = [0.01 * (word & _CENTIMETRES) for word in self.words]
        return tuple([r if nearest <= r < farthest else float("inf") for r in metres])


class Telegrams:
    """Extracts telegrams from bytes, however they are split and whatever lies between telegrams.

    `refused` counts telegram headers with a wrong CRC, `skipped` bytes outside of telegrams.
    """

    def __init__(self) -> None:
        self.refused = self.skipped = 0
        self._data = bytearray()

    def feed(self, data: bytes) -> list[Telegram]:
        """Take bytes; returns the telegrams completed by them."""
        self._data += data
        found: list[Telegram] = []
        while self._at_header():
            total = self._total()
            if total is None:
                break
            if total:
                found.append(_parsed(bytes(self._data[:total])))
                del self._data[:total]
            else:
                self.refused += 1
                self._skip(1)
        return found

    def _at_header(self) -> bool:
        """Skip to the next telegram header; False if there is none yet."""
        match = _HEADER.search(self._data)
        if match is None:
            self._skip(max(0, len(self._data) - 8))
            return False
        self._skip(match.start())
        return len(self._data) >= _FIELDS.size

    def _total(self) -> int | None:
        """The length with a correct CRC; 0 if there is none, None if incomplete."""
        words = int.from_bytes(self._data[6:8], "big")
        for beyond in _BEYOND:
            total = 2 * words + beyond
            if not _FIELDS.size + _CRC <= total <= LONGEST:
                continue
            if total > len(self._data):
                return None
            crc = int.from_bytes(self._data[total - _CRC : total], "little")
            if crc == crc_hqx(self._data[_REPLY : total - _CRC], 0xFFFF):
                return total
        return 0

    def _skip(self, count: int) -> None:
        self.skipped += count
        del self._data[:count]


def _parsed(data: bytes) -> Telegram:
    _, address, version, status, scan, number, kind, field = _FIELDS.unpack_from(data)
    body = data[_FIELDS.size : -_CRC]
    words: tuple[int, ...] = ()
    if kind == DISTANCES and field == FIRST_FIELD and len(body) % 2 == 0:
        words = struct.unpack(f"<{len(body) // 2}H", body)
    return Telegram(address, version, status, scan, number, len(data), words)
