"""A CANopen network whose periodic messages are sent by its owner's loop, not by threads."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from typing import Any, Protocol

import can
import canopen


class Wire(Protocol):
    """The interface for sending frames, as of python-can's buses."""

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame."""
        ...


@dataclass
class Periodic:
    """A periodic message."""

    identifier: int
    data: bytes
    period_ns: int
    due_ns: int | None = None
    over: bool = False

    def update(self, data: Any) -> None:
        """Send this from now on."""
        self.data = bytes(data)

    def stop(self) -> None:
        """Stop sending it."""
        self.over = True


@dataclass
class Faults:
    """Injected faults of frames: dead nodes, truncated or lost frames."""

    dead: set[int] = field(default_factory=set)
    cut: int = 0
    drop: float = 0.0
    quiet: bool = False


class FakeNetwork(canopen.Network):
    """Sends to a wire, with faults; `step` sends what is due."""

    def __init__(self, wire: Wire, seed: int = 0) -> None:
        super().__init__()
        self.faults = Faults()
        self._wire = wire
        self._periodic: list[Periodic] = []
        self._chance = random.Random(seed)

    def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
        """Send a frame of a node, known by its identifier."""
        if can_id & 0x7F not in self.faults.dead:
            self.send(can_id, bytes(data), remote)

    def send(self, identifier: int, data: bytes, remote: bool = False) -> None:
        """Send a frame."""
        faults = self.faults
        if faults.quiet or (faults.drop and self._chance.random() < faults.drop):
            return
        if faults.cut and identifier & 0x780 == 0x180:
            faults.cut -= 1
            data = data[:-1]
        message = can.Message(
            arbitration_id=identifier, data=data, is_extended_id=False, is_remote_frame=remote
        )
        self._wire.send(message)

    def send_error(self, kind: int, data: bytes = b"") -> None:
        """Send an error frame of this class."""
        self._wire.send(
            can.Message(arbitration_id=kind, data=data, is_error_frame=True, is_extended_id=False)
        )

    def send_periodic(self, can_id: int, data: Any, period: float, remote: bool = False) -> Any:
        """Send a message every period, s, from the next `step` on."""
        del remote
        made = Periodic(can_id, bytes(data), round(1e9 * period))
        self._periodic.append(made)
        return made

    def step(self, now_ns: int) -> None:
        """Send what is due."""
        self._periodic = [one for one in self._periodic if not one.over]
        for one in self._periodic:
            if one.due_ns is None or now_ns >= one.due_ns:
                one.due_ns = max(now_ns, (one.due_ns or now_ns) + one.period_ns)
                self.send_message(one.identifier, one.data)
