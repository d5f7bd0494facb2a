"""What a running state can access of its run: time, signals, events and parts."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from engine.machine import RUNNING, LeafNode
from engine.run.errors import escaped
from engine.run.trace import RawRecord
from engine.signals import Board, EventReader, MeasuredSlot
from engine.state import ALWAYS_NS, NEVER_NS, RunNews, Stamped

Listeners = list[tuple[LeafNode, Callable[[RunNews], None]]]


class Part(Protocol):
    """The only method that the engine requires of a robot part."""

    def stop(self) -> None:
        """Stop moving. Returns at once."""
        ...


class Ages(dict[str, int]):
    """Maximum ages, ns, of the signals that a leaf `reads`; any other is an error."""

    def __init__(self, node: LeafNode) -> None:
        reads = node.interface.reads.items()
        super().__init__({n: NEVER_NS if age is None else round(age * 1e9) for n, age in reads})
        self._path = node.path

    def __missing__(self, signal: str) -> int:
        known = ", ".join(self) or "none"
        raise LookupError(f"{self._path}: {signal!r} is not among its `reads`: {known}")


class LeafContext:
    """The `Context` of one leaf of a run."""

    __slots__ = (
        "__weakref__",
        "_add",
        "_ages",
        "_bits",
        "_board",
        "_listeners",
        "_parts",
        "_path",
        "_readers",
        "node",
    )

    def __init__(
        self,
        node: LeafNode,
        board: Board,
        parts: Mapping[str, Part],
        add: Callable[[RawRecord], None],
        listeners: Listeners | None = None,
    ) -> None:
        interface = node.interface
        self.node = node
        self._listeners = listeners if listeners is not None else []
        self._add = add
        self._path = node.path
        self._board = board
        self._parts = {name: parts[name] for name in interface.commands if name in parts}
        self._ages = Ages(node)
        self._bits: dict[tuple[str, ...], int] = {}
        self._readers: dict[str, EventReader] = {}
        for name, age in self._ages.items():
            slot = board.slots.get(name)
            if isinstance(slot, MeasuredSlot) and slot.event:
                self._readers[name] = EventReader(slot.log, self._is_running)
            if slot is not None and age < NEVER_NS:
                board.accept(name, age)

    def begin(self) -> None:
        """On entry of the leaf: deliver events from this tick on."""
        for reader in self._readers.values():
            reader.begin(self._board.ticks)

    def _is_running(self) -> bool:
        return self.node.status == RUNNING

    @property
    def now(self) -> int:
        """Chart time in ns."""
        return self._board.now - self._board.paused_ns

    def after(self, seconds: float) -> int:
        """The instant `seconds` from now, in ns of chart time."""
        return self.now + round(seconds * 1e9)

    def value(self, signal: str) -> Any:
        """The newest value; `None` if there is none or it is older than the class accepts."""
        age, board = self._ages[signal], self._board
        slot = board.slots[signal]
        newest = slot.read() if slot.computed else slot.newest
        if newest is None or board.now - newest.stamp > age:
            return None
        return newest.value

    def sample(self, signal: str) -> Stamped | None:
        """The newest value with its stamp, whatever its age."""
        _ = self._ages[signal]
        return self._board.slots[signal].read()

    def age(self, signal: str) -> float:
        """Age of the newest value, s, even if not accepted; infinite without one.

        It is 0 for a value that does not age.
        """
        _ = self._ages[signal]
        newest = self._board.slots[signal].read()
        if newest is None:
            return math.inf
        return 0.0 if newest.stamp == ALWAYS_NS else (self._board.now - newest.stamp) * 1e-9

    def events(self, signal: str) -> tuple[Stamped, ...]:
        """Samples that arrived since this state last asked; at first, since its entry."""
        _ = self._ages[signal]
        reader = self._readers.get(signal)
        assert reader is not None, f"{signal} is no event signal"
        return reader.read(self._board.ticks)

    def is_event(self, signal: str) -> bool:
        """Whether each sample of a signal is an event that is read once."""
        _ = self._ages[signal]
        return signal in self._readers

    def part(self, name: str) -> Any:
        """A part that the class lists in `commands`."""
        if name not in self._parts:
            known = ", ".join(self._parts) or "none"
            raise LookupError(f"{self._path}: no part {name!r} among its `commands`: {known}")
        return self._parts[name]

    def note(self, text: str) -> None:
        """Put a note in the trace."""
        self._add(("note", self._board.now, self.node, escaped(text)))

    def hear_run(self, tell: Callable[[RunNews], None]) -> None:
        """Have `tell` called when the run is paused, resumed or over."""
        self._listeners.append((self.node, tell))

    def bits(self, names: tuple[str, ...]) -> int:
        """Bit mask of the measured signals that these depend on; see `Board.bits`."""
        found = self._bits.get(names)
        if found is None:
            for name in names:
                _ = self._ages[name]
            found = self._bits[names] = self._board.bits(names)
        return found
