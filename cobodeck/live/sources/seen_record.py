"""A record at any instant: the run as it was then, and what a page shows of all of it."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

from cobodeck.live.clients import PageMessage
from cobodeck.live.model import RunModel
from cobodeck.live.sources.past import SeenInstant, SeenTicks
from cobodeck.live.sources.plots import plot_of
from cobodeck.live.sources.seen_run import SeenRun
from cobodeck.pictures.run import Course, course_of
from cobodeck.project import catalogue
from cobodeck.record.read import Record


class SeenRecord(SeenInstant):
    """A record, read once; `seen` is what a page shows of all of it, `model` the run at an instant.

    `moves_s` are the ticks that took transitions, s in the run; `broken` says where the record ends
    before its run, if it does.

    Raises:
        FileError, Problem: the record does not hold what was run.
    """

    def __init__(self, path: Path, slot: int = 0) -> None:
        self.record = Record(path)
        self.record.require_ticks()
        self.seen = SeenRun(self.record, catalogue(own=False), slot)
        self.moves_s: list[float] = []
        self._past, model = SeenTicks(), RunModel()
        for group in self.record.groups():
            moves = model.transitions
            with self.record.understood(group):
                self._past.add(group, model)
                self.seen.add(group)
                model.add(group)
            if model.transitions > moves:
                self.moves_s.append(model.at_ns / 1e9)
        self.end_ns, self.broken = model.at_ns, self.record.broken
        super().__init__(self._past, self.seen.place)
        self.chart()  # drawn now, while nobody waits

    @property
    def version(self) -> int:
        """How often the charts were replaced until now."""
        return self.seen.version(self.model.at_ns)

    def chart(self) -> PageMessage:
        """The chart that runs now."""
        return self.seen.chart(self.model.at_ns)

    @cached_property
    def course(self) -> Course:
        """The whole run, judged as in its figures."""
        return course_of(self.record)

    def plot(self, signal: str) -> PageMessage | None:
        """All values of a signal, as numbers; None if it has none."""
        found = plot_of(signal, self._past.samples(signal))
        return None if found is None else {**found, **self.seen.slotted}
