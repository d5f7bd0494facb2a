"""Reads and writes objects of a CANopen node one by one, without waiting (CiA 301, expedited SDO).

The SDO client of `canopen` waits for each answer, which the chain's cycle must not do. Here one
request is in progress at a time, and the next goes out when its answer has come.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from canopen.sdo.exceptions import SdoAbortedError

ANSWER_NS = 300_000_000
"""Time limit for an answer, ns; the request is then repeated."""
TRIES = 3
MISSING = (0x0602_0000, 0x0609_0011)
"""Abort codes: no such object; no such subindex."""
_FRAME = struct.Struct("<BHB4s")
_COMMANDS = {1: 0x2F, 2: 0x2B, 4: 0x23}
_READ, _IS_READ, _WRITTEN, _ABORTED = 0x40, 0x40, 0x60, 0x80
_KIND = 0xE0
"""The bits of a command that tell what it is."""


@dataclass(frozen=True, slots=True)
class SdoWrite:
    """A value for an object: `size` is 1, 2 or 4 bytes; negative values in two's complement.

    Bits in `keeps` are the node's own: they are read first, and written back. `lack` says what it
    means if the node lacks the object; `optional`: then the write is left out.
    """

    index: int
    subindex: int
    size: int
    value: int
    keeps: int = 0
    lack: str = ""
    optional: bool = False

    @property
    def frame(self) -> bytes:
        """The request, 8 bytes."""
        return self.with_own(0)

    def with_own(self, own: int) -> bytes:
        """The request, 8 bytes; `own` is the node's present value."""
        value = self.value & ~self.keeps | own & self.keeps
        data = value.to_bytes(self.size, "little", signed=value < 0)
        return _FRAME.pack(_COMMANDS[self.size], self.index, self.subindex, data)


@dataclass(frozen=True, slots=True)
class SdoCheck:
    """An object to read, if the node has it: `fault` says what is wrong with a value, or None."""

    index: int
    subindex: int
    fault: Callable[[int], str | None]


class Writer:
    """Requests to one node; `fault` says which has failed and why.

    `lacking` are the writes that were left out, because the node lacks the object.
    """

    def __init__(self, node: int, send: Callable[[int, bytes], None]) -> None:
        self._node, self._send = node, send
        self._left: deque[SdoWrite | SdoCheck] = deque()
        self._own: int | None = None
        self._sent_ns: int | None = None
        self._tries = 0
        self.fault: str | None = None
        self.lacking: list[SdoWrite] = []

    @property
    def done(self) -> bool:
        """True once all is written."""
        return not self._left

    def begin(self, steps: Iterable[SdoWrite | SdoCheck]) -> None:
        """Do these, dropping what is left of others."""
        self._left, self.lacking = deque(steps), []
        self._own, self._sent_ns, self._tries, self.fault = None, None, 0, None

    def poll(self, now_ns: int) -> None:
        """Send the next request, or repeat one without an answer."""
        if not self._left or self.fault is not None:
            return
        if self._sent_ns is not None and now_ns - self._sent_ns < ANSWER_NS:
            return
        if self._tries == TRIES:
            self.fault = f"does not answer (object 0x{self._left[0].index:04X})"
            return
        self._tries += 1
        self._sent_ns = now_ns
        self._send(0x600 + self._node, self._request(self._left[0]))

    def on_answer(self, data: bytes, now_ns: int) -> None:
        """Take an answer: to this request or, from a slow node, to an earlier one."""
        if len(data) != 8 or not self._left or self._sent_ns is None:
            return
        command, index, subindex, rest = _FRAME.unpack(data)
        step = self._left[0]
        if (index, subindex) != (step.index, step.subindex):
            return
        value = int.from_bytes(rest, "little")
        if command == _ABORTED:
            self._refuse(step, value)
        elif command & _KIND == _IS_READ and self._reads(step):
            self._have(step, value)
        elif command == _WRITTEN and not self._reads(step):
            self._left.popleft()
            self._own = None
        else:
            return
        self._sent_ns, self._tries = None, 0
        self.poll(now_ns)

    def _reads(self, step: SdoWrite | SdoCheck) -> bool:
        return isinstance(step, SdoCheck) or bool(step.keeps and self._own is None)

    def _request(self, step: SdoWrite | SdoCheck) -> bytes:
        if isinstance(step, SdoCheck) or self._reads(step):
            return _FRAME.pack(_READ, step.index, step.subindex, bytes(4))
        return step.with_own(self._own or 0)

    def _have(self, step: SdoWrite | SdoCheck, value: int) -> None:
        if isinstance(step, SdoCheck):
            self.fault = step.fault(value)
            self._left.popleft()
        else:
            self._own = value

    def _refuse(self, step: SdoWrite | SdoCheck, code: int) -> None:
        place = f"object 0x{step.index:04X}:{step.subindex}"
        if isinstance(step, SdoCheck):
            self._left.popleft()
        elif code in MISSING and step.optional:
            self.lacking.append(step)
            self._left.popleft()
        elif code in MISSING and step.lack:
            self.fault = f"has no {place}: {step.lack}"
        else:
            self.fault = f"refuses {place}: {SdoAbortedError(code)}"
