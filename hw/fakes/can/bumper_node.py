"""The board of the foam bumper: pressed zones, a line to the relay, frames on the bus.

Frame 0x110, 8 bytes, every 20 ms and on each change: counter (4 bits), line open, touch latched,
self-test passed; zones; force in 0.1 N; uptime in 10 ms (3 bytes); check sum. Frame 0x111, 2 bytes:
counter, check sum; clears the latched touch once the line is closed. A touch opens the line; it is
closed by hand at the relay.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass

STATUS, RESET = 0x110, 0x111
PERIOD_NS = 20_000_000
SECTOR = math.pi / 4.0


@dataclass
class Errors:
    """Injected defects: of the check sum, the counter, all frames, the self-test, the line."""

    check: bool = False
    stalled: bool = False
    jump: int = 0
    mute: bool = False
    untested: bool = False
    welded: bool = False


class FakeBumper:
    """The board; `relay` is called whenever the line opens or closes."""

    def __init__(
        self,
        send: Callable[[int, bytes], None],
        relay: Callable[[bool], None],
        by_hand_ns: int | None = None,
    ) -> None:
        """The line is closed by hand `by_hand_ns` after a touch; None: only by `unlatch`."""
        self.errors = Errors()
        self.opened = self.latched = False
        self._send, self._relay, self._by_hand_ns = send, relay, by_hand_ns
        self._zones = self._counter = 0
        self._begun_ns: int | None = None
        self._sent_ns: int | None = None
        self._free_ns: int | None = None
        self._changed = False
        self._last_reset: int | None = None

    def touch(self, bearing: float) -> None:
        """Press the foam at a bearing, rad."""
        self._zones |= 1 << round(bearing / SECTOR) % 8
        self.latched = self._changed = True
        if not self.errors.welded:
            self._switch(True)

    def release(self) -> None:
        """Release the foam."""
        self._changed = self._changed or self._zones != 0
        self._zones = 0

    def unlatch(self) -> None:
        """Close the line by hand at the relay."""
        if self._zones == 0:
            self._switch(False)

    def cut(self) -> None:
        """Break the line's wire: it opens without a touch."""
        self._switch(True)

    def on_frame(self, identifier: int, data: bytes) -> None:
        """Take a frame of the bus."""
        if identifier != RESET or len(data) != 2 or data[1] != check_sum(data[:1]):
            return
        if data[0] & 0x0F != self._last_reset and not self.opened and self._zones == 0:
            self.latched = False
            self._changed = True
        self._last_reset = data[0] & 0x0F

    def step(self, now_ns: int) -> None:
        """Send what is due."""
        if self._begun_ns is None:
            self._begun_ns = now_ns
        self._close_by_hand(now_ns)
        due = self._sent_ns is None or now_ns - self._sent_ns >= PERIOD_NS
        if (due or self._changed) and not self.errors.mute:
            self._changed, self._sent_ns = False, now_ns
            self._send(STATUS, self.frame(now_ns - self._begun_ns))

    def frame(self, up_ns: int) -> bytes:
        """The next status."""
        errors = self.errors
        if not errors.stalled:
            self._counter = (self._counter + 1 + errors.jump) % 16
            errors.jump = 0
        flags = self._counter | self.opened << 4 | self.latched << 5 | (not errors.untested) << 6
        force = 250 if self._zones else 0
        head = struct.pack("<BBH", flags, self._zones, force)
        head += struct.pack("<I", up_ns // 10_000_000)[:3]
        return head + bytes((check_sum(head) ^ (0xFF if errors.check else 0),))

    def _close_by_hand(self, now_ns: int) -> None:
        if self._by_hand_ns is None or self._zones or not self.opened:
            self._free_ns = None
        elif self._free_ns is None:
            self._free_ns = now_ns
        elif now_ns - self._free_ns >= self._by_hand_ns:
            self.unlatch()

    def _switch(self, opened: bool) -> None:
        self._changed = self._changed or opened != self.opened
        self.opened = opened
        self._relay(opened)


def check_sum(data: bytes) -> int:
    """CRC-8 SAE J1850, bit by bit: the remainder of x8 + x4 + x3 + x2 + 1."""
    register = int.from_bytes(data, "big") << 8 ^ 0xFF << 8 * len(data)
    for bit in range(8 * len(data) + 7, 7, -1):
        if register >> bit & 1:
            register ^= 0x11D << bit - 8
    return register ^ 0xFF
