"""A record at any instant: the run as it was then, and what a page shows of all of it.

It is read once. Its ticks are kept compressed, in blocks, with what the run looked like before
each, so that any instant is near.
"""

from __future__ import annotations

import pickle
import zlib
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from cobodeck.live.clients import Message
from cobodeck.live.model import RunModel
from cobodeck.live.sources.plots import plot_of
from cobodeck.live.sources.seen_run import SeenRun
from cobodeck.pictures.run import Course, course_of
from cobodeck.project import catalogue
from cobodeck.record.format import TOPIC
from cobodeck.record.read import Group, Record

BLOCK = 300
"""Ticks in a block: 10 s at 30 Hz."""
SCANNED_NS = 10_000_000_000
"""Before an instant, ns: scans from then on show what obstacles there are."""


@dataclass(frozen=True, slots=True)
class _Block:
    """Ticks from `from_ns` on, and the run before them."""

    from_ns: int
    packed: bytes
    before: RunModel

    def groups(self) -> list[Group]:
        found: list[Group] = pickle.loads(zlib.decompress(self.packed))  # packed by ourselves
        return found


class SeenRecord:
    """A record, read; `seen` is what a page shows of all of it, `model` the run at an instant.

    `moves_s` are the ticks that took transitions, s in the run.

    Raises:
        FileError, Problem: the record does not hold what was run.
    """

    def __init__(self, path: Path, slot: int = 0) -> None:
        self.record = Record(path)
        self.record.require_ticks()
        self.seen = SeenRun(self.record, catalogue(own=False), slot)
        self.moves_s: list[float] = []
        self._blocks: list[_Block] = []
        self._read()
        self.model = self._blocks[0].before.copied()
        self._rest: Iterator[Group] = iter(())
        self._next: Group | None = None
        self.seek(0)
        self.charts()  # drawn now, while nobody waits

    def _read(self) -> None:
        model, groups = RunModel(), list[Group]()
        before = model.copied()

        def close() -> None:
            packed = zlib.compress(pickle.dumps(groups, pickle.HIGHEST_PROTOCOL), 1)
            self._blocks.append(_Block(groups[0].ticked.at_ns, packed, before))

        for group in self.record.groups():
            moves = model.transitions
            with self.record.understood(group):
                self.seen.add(group)
                model.add(group)
            if model.transitions > moves:
                self.moves_s.append(model.at_ns / 1e9)
            groups.append(group)
            if len(groups) == BLOCK:
                close()
                groups, before = [], model.copied()
        if groups:
            close()
        self.end_ns = model.at_ns

    def groups(self, from_ns: int = 0) -> Iterator[Group]:
        """The ticks, from those of the block that has this instant."""
        for block in self._blocks[self._number(from_ns) :]:
            yield from block.groups()

    def _number(self, at_ns: int) -> int:
        return max(0, bisect_right(self._blocks, at_ns, key=lambda block: block.from_ns) - 1)

    def seek(self, at_ns: int) -> None:
        """Go to an instant: all ticks up to it have been taken."""
        number, place = self._number(at_ns), self.seen.place
        self.model = self._blocks[number].before.copied()
        place.restart()
        for block in self._blocks[self._number(at_ns - SCANNED_NS) : number]:
            for group in block.groups():
                place.obstacles.add(group)
        self._rest = self.groups(at_ns)
        self._next = next(self._rest, None)
        self.go_on(at_ns)

    def go_on(self, at_ns: int) -> None:
        """Go forward to an instant."""
        while self._next is not None and self._next.ticked.at_ns <= at_ns:
            self.model.add(self._next)
            self.seen.place.obstacles.add(self._next)
            self._next = next(self._rest, None)

    @property
    def version(self) -> int:
        """How often the charts were replaced until now."""
        return self.seen.version(self.model.at_ns)

    def charts(self) -> list[Message]:
        """The charts that run now."""
        return self.seen.charts(self.model.at_ns)

    @cached_property
    def course(self) -> Course:
        """The whole run, judged as in its figures."""
        return course_of(self.record)

    def plot(self, signal: str) -> Message | None:
        """All values of a signal, as numbers; None if it has none."""
        topic = TOPIC + signal
        told = (one for group in self.groups() for one in group.told if one.topic == topic)
        found = plot_of(signal, told)
        return None if found is None else {**found, **self.seen.slotted}
