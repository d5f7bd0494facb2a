"""A bounded log that one thread writes and any number of readers follow, each at its own pace.

Nothing blocks: the writer overwrites the oldest entry, and a reader that is too slow learns how
many entries it has missed.
"""

from __future__ import annotations

from typing import Generic, TypeVar

T = TypeVar("T")


class Log(Generic[T]):
    """The newest `size` entries."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.written = 0
        self._ring: list[tuple[int, T] | None] = [None] * size

    def append(self, entry: T) -> None:
        """Add an entry; one thread only."""
        number = self.written
        self._ring[number % self.size] = (number, entry)
        self.written = number + 1

    def reader(self) -> LogReader[T]:
        """A new reader, which starts with the oldest entry still held."""
        return LogReader(self)

    def entry(self, number: int) -> tuple[T] | None:
        """The entry of this number, from 0; None if overwritten or not written yet."""
        # number and entry are one tuple, so that a concurrent overwrite is noticed
        found = self._ring[number % self.size]
        return None if found is None or found[0] != number else found[1:]


class LogReader(Generic[T]):
    """One reader's place in a log; `missed` counts the entries overwritten before they were read.

    It belongs to one thread.
    """

    def __init__(self, log: Log[T]) -> None:
        self.missed = 0
        self._log = log
        self._next = max(0, log.written - log.size)

    def read_new(self) -> list[T]:
        """All entries since the last call, oldest first."""
        log = self._log
        taken: list[T] = []
        end = log.written
        if end == self._next:
            return taken
        start = max(self._next, end - log.size)
        self.missed += start - self._next
        for number in range(start, end):
            found = log.entry(number)
            if found is None:
                self.missed += 1
            else:
                taken.append(found[0])
        self._next = end
        return taken
