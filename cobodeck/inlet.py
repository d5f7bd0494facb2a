"""The one way in for samples: from the parts to the board of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from engine.board import Board
from hw.interfaces import Part
from hw.samples import Sample, is_finite

Hears = tuple[str, Callable[[Sample, int], None]]
"""A signal, and who is given its samples with the instant of their arrival, ns."""


class Inlet:
    """Asks the parts for what has arrived, and hands it on.

    A sample in which a number is NaN or infinite has not arrived; `refused` counts them by name.
    `hears` has the listeners of parts that go by samples themselves, by the names of these.
    """

    def __init__(
        self,
        board: Board,
        sources: Iterable[Part] = (),
        hears: Iterable[Hears] = (),
    ) -> None:
        self.board = board
        self.sources = tuple(sources)
        self.refused: dict[str, int] = {}
        self._hears: dict[str, list[Callable[[Sample, int], None]]] = {}
        self._finite: dict[str, object] = {}  # the newest values that were looked at
        for name, listener in hears:
            self._hears.setdefault(name, []).append(listener)

    def take(self, now_ns: int) -> None:
        """Take what has arrived up to now."""
        for part in self.sources:
            for sample in part.samples(now_ns):
                self.give(sample, now_ns)

    def give(self, sample: Sample, now_ns: int) -> None:
        """Hand on one sample that has arrived now."""
        name, stamp, value = sample
        if value is not self._finite.get(name):
            if not is_finite(value):
                self.refused[name] = self.refused.get(name, 0) + 1
                return
            self._finite[name] = value
        if name in self.board.slots:
            self.board.put(name, value, stamp)
        for listener in self._hears.get(name, ()):
            listener(sample, now_ns)

    def put(self, name: str, value: Any, stamp_ns: int) -> None:
        """Give the board a value that no part measures: a constant, or a test's."""
        self.board.put(name, value, stamp_ns)
