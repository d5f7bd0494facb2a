"""Writes objects of a CANopen node one after another, without waiting (CiA 301, expedited SDO).

The SDO client of `canopen` waits for each answer, which the chain's cycle must not do. Here one
write is in progress at a time, and the next goes out when its answer has come.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from canopen.sdo.exceptions import SdoAbortedError

ANSWER_NS = 300_000_000
"""Time limit for an answer, ns; the write is then repeated."""
TRIES = 3
_FRAME = struct.Struct("<BHB4s")
_COMMANDS = {1: 0x2F, 2: 0x2B, 4: 0x23}
_WRITTEN, _ABORTED = 0x60, 0x80


@dataclass(frozen=True, slots=True)
class SdoWrite:
    """A value for an object: `size` is 1, 2 or 4 bytes; negative values in two's complement."""

    index: int
    subindex: int
    size: int
    value: int

    @property
    def frame(self) -> bytes:
        """The request, 8 bytes."""
        data = self.value.to_bytes(self.size, "little", signed=self.value < 0)
        return _FRAME.pack(_COMMANDS[self.size], self.index, self.subindex, data)


class Writer:
    """Writes to one node; `fault` says which write has failed and why."""

    def __init__(self, node: int, send: Callable[[int, bytes], None]) -> None:
        self._node, self._send = node, send
        self._left: deque[SdoWrite] = deque()
        self._sent_ns: int | None = None
        self._tries = 0
        self.fault: str | None = None

    @property
    def done(self) -> bool:
        """True once all is written."""
        return not self._left

    def begin(self, writes: Iterable[SdoWrite]) -> None:
        """Write these, dropping what is left of others."""
        self._left = deque(writes)
        self._sent_ns, self._tries, self.fault = None, 0, None

    def poll(self, now_ns: int) -> None:
        """Send the next write, or repeat one without an answer."""
        if not self._left or self.fault is not None:
            return
        if self._sent_ns is not None and now_ns - self._sent_ns < ANSWER_NS:
            return
        if self._tries == TRIES:
            self.fault = f"does not answer (object 0x{self._left[0].index:04X})"
            return
        self._tries += 1
        self._sent_ns = now_ns
        self._send(0x600 + self._node, self._left[0].frame)

    def take(self, data: bytes, now_ns: int) -> None:
        """Take an answer: to this write or, from a slow node, to an earlier one."""
        if len(data) != 8 or not self._left or self._sent_ns is None:
            return
        command, index, subindex, rest = _FRAME.unpack(data)
        if (index, subindex) != (self._left[0].index, self._left[0].subindex):
            return
        if command == _ABORTED:
            told = SdoAbortedError(int.from_bytes(rest, "little"))
            self.fault = f"refuses object 0x{index:04X}:{subindex}: {told}"
        elif command == _WRITTEN:
            self._left.popleft()
            self._sent_ns, self._tries = None, 0
            self.poll(now_ns)
