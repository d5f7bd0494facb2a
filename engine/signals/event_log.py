"""Samples of an event signal, and how far each reader has read them.

A reader gets what arrived since it was entered or last asked, however long it slept or was paused
meanwhile, including what arrived in the tick of its entry.
"""

from __future__ import annotations

from collections.abc import Callable

from engine.state import Stamped

LEAST, MOST = 64, 1 << 16
"""A log of up to LEAST samples is never trimmed; trimming leaves the newest MOST at most."""


class EventLog:
    """The samples of one event signal that a running reader can still ask for.

    A position is the index of a sample among all that ever arrived, from 0.
    """

    __slots__ = ("_before", "_first", "_limit", "_samples", "_tick", "readers")

    def __init__(self) -> None:
        self.readers: list[EventReader] = []
        self._samples: list[Stamped] = []
        self._first = 0  # position of the oldest sample kept
        self._limit = LEAST
        self._tick = -1  # of the last arrival
        self._before = 0  # `end` before that tick

    def __len__(self) -> int:
        return len(self._samples)

    @property
    def end(self) -> int:
        """The position after the newest sample."""
        return self._first + len(self._samples)

    def begin_of(self, tick: int) -> int:
        """The position of the first sample of `tick`, the current one, whether arrived or not."""
        return self._before if self._tick == tick else self.end

    def add(self, sample: Stamped, tick: int) -> None:
        """Append a sample that has arrived for `tick`."""
        if self._tick != tick:
            self._tick, self._before = tick, self.end
        if len(self._samples) >= self._limit:
            self._trim()
        self._samples.append(sample)

    def between(self, start: int, end: int) -> tuple[Stamped, ...]:
        """The samples from position `start` up to, not including, `end`, as far as still kept."""
        first = self._first
        return tuple(self._samples[max(0, start - first) : end - first])

    def _trim(self) -> None:
        self.readers = [reader for reader in self.readers if reader.running()]
        needed = min((reader.start for reader in self.readers), default=self._before)
        needed = max(needed, self.end - MOST)
        del self._samples[: needed - self._first]
        self._first = needed
        self._limit = max(LEAST, 2 * len(self._samples))


class EventReader:
    """How far one state has read a log; `running` tells whether it may still read."""

    __slots__ = ("_asked", "_end", "_log", "running", "start")

    def __init__(self, log: EventLog, running: Callable[[], bool]) -> None:
        self.running = running
        self.start = self._end = 0
        self._log = log
        self._asked = -1  # tick of the last `read`

    def begin(self, tick: int) -> None:
        """Start reading with the samples of `tick`, in which the state is entered."""
        self.start = self._end = self._log.begin_of(tick)
        self._asked = -1
        if self not in self._log.readers:
            self._log.readers.append(self)

    def read(self, tick: int) -> tuple[Stamped, ...]:
        """The new samples; further calls in the same tick return the same ones."""
        if self._asked != tick:
            self._asked, self.start, self._end = tick, self._end, self._log.end
        return self._log.between(self.start, self._end)
