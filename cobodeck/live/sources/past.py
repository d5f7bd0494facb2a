"""What a run has told so far, so that any instant of it is near.

Its ticks are kept compressed, in blocks, with what the run looked like before each.
"""

from __future__ import annotations

import pickle
import zlib
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain
from threading import Lock

from cobodeck.live.model import RunModel
from cobodeck.live.sources.seen_room import SeenRoom
from cobodeck.record.format import TOPIC
from cobodeck.record.read import Group, RecordedMessage

BLOCK = 300
"""Ticks in a block: 10 s at 30 Hz."""
SCANNED_NS = 10_000_000_000
"""Before an instant, ns: scans from then on show what obstacles there are."""


@dataclass(frozen=True, slots=True)
class _Block:
    """Ticks from `from_ns` on, compressed unless they are the newest, and the run before them."""

    from_ns: int
    before: RunModel
    ticks: bytes | tuple[Group, ...]

    def groups(self) -> tuple[Group, ...]:
        if isinstance(self.ticks, tuple):
            return self.ticks
        found: tuple[Group, ...] = pickle.loads(zlib.decompress(self.ticks))  # packed by ourselves
        return found

    def packed(self) -> bytes:
        return zlib.compress(pickle.dumps(self.groups(), pickle.HIGHEST_PROTOCOL), 1)


class SeenTicks:
    """The ticks of a run so far; added by one thread, read by any.

    Args:
        bound: compressed ticks that are kept, bytes; beyond it the oldest go. None: all are kept.
    """

    def __init__(self, bound: int | None = None) -> None:
        self._bound, self._bytes = bound, 0
        self._closed: list[_Block] = []
        self._open: list[Group] = []
        self._before = RunModel()
        self._turn = Lock()

    def add(self, group: Group, before: RunModel) -> None:
        """Take a tick, and what the run looks like before it."""
        with self._turn:
            if not self._open:
                self._before = before.copied()
            self._open.append(group)
        if len(self._open) == BLOCK:
            self.close()

    def close(self) -> None:
        """Close a block: what comes next does not follow from these ticks alone."""
        closed = [replace(block, ticks=block.packed()) for block in self._newest()]
        self._bytes += sum(len(block.ticks) for block in closed)
        with self._turn:
            self._open = []
            self._closed += closed
            while self._bound is not None and self._bytes > self._bound and len(self._closed) > 1:
                self._bytes -= len(self._closed.pop(0).ticks)

    def _newest(self) -> list[_Block]:
        if not self._open:
            return []
        return [_Block(self._open[0].ticked.at_ns, self._before, tuple(self._open))]

    def _from(self, at_ns: int) -> list[_Block]:
        """The block that has an instant, and all after it."""
        with self._turn:
            blocks = [*self._closed, *self._newest()]
        number = bisect_right(blocks, at_ns, key=lambda block: block.from_ns) - 1
        return blocks[max(0, number) :]

    def before(self, at_ns: int) -> tuple[RunModel, int]:
        """The run before the block that has an instant, and when that begins, ns."""
        blocks = self._from(at_ns)
        if not blocks:
            return RunModel(), 0
        return blocks[0].before.copied(), blocks[0].from_ns

    def groups(self, from_ns: int = 0) -> Iterator[Group]:
        """The ticks so far, from those of the block that has this instant."""
        return chain.from_iterable(block.groups() for block in self._from(from_ns))

    def samples(self, signal: str) -> Iterator[RecordedMessage]:
        """The messages of a signal in these."""
        topic = TOPIC + signal
        return (told for group in self.groups() for told in group.told if told.topic == topic)


class SeenInstant:
    """A run at an instant that can be moved; `model` is the run as it was then.

    Args:
        past: its ticks.
        place: its room, which then shows that instant.
    """

    def __init__(self, past: SeenTicks, place: SeenRoom) -> None:
        self._past, self.place = past, place
        self.seek(0)

    def seek(self, at_ns: int) -> None:
        """Go to an instant: all ticks up to it have been taken."""
        self.model, begins_ns = self._past.before(at_ns)
        self.place.restart()
        for group in self._past.groups(at_ns - SCANNED_NS):
            if group.ticked.at_ns >= begins_ns:
                break
            self.place.obstacles.add(group)
        self._rest = self._past.groups(at_ns)
        self._next = next(self._rest, None)
        self.go_on(at_ns)

    def go_on(self, at_ns: int) -> None:
        """Go forward to an instant."""
        while self._next is not None and self._next.ticked.at_ns <= at_ns:
            self.model.add(self._next)
            self.place.obstacles.add(self._next)
            self._next = next(self._rest, None)
