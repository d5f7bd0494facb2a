"""The only path of samples into a run: from the parts to its board."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from engine.board import Board
from engine.signals import Measured
from hw.finite import is_finite
from hw.interfaces import RobotPart
from hw.samples import Sample

Hears = tuple[str, Callable[[Sample, int], None]]
"""A signal's name, and a function that takes each sample and its instant of arrival, ns."""
SampleTap = Callable[[Sample, int, str | None], None]
"""Takes a sample, its instant of arrival, ns, and why it was refused (None: accepted)."""
AHEAD_NS = 20_000_000
"""Tolerated clock difference, ns; a sample stamped further ahead is refused."""


class Inlet:
    """Polls the parts for samples and passes them on.

    A sample is refused if a number in it is NaN or infinite, if its value is not of its signal's
    type, or if its stamp is not an integer or more than `ahead_ns` ahead; `refused` counts these by
    signal. A part that raises is not polled again; `failures` has the exception. `taps` receive
    every sample, and every estimate that is passed to listeners (`tell`).

    Set `begins` if parts measured before the run began: of those samples only the newest count.
    """

    def __init__(
        self,
        board: Board,
        sources: Mapping[str, RobotPart] | None = None,
        hears: Iterable[Hears] = (),
        ahead_ns: int = AHEAD_NS,
    ) -> None:
        self.board = board
        self.sources = dict(sources or {})
        self.refused: dict[str, int] = {}
        self.failures: list[tuple[str, Exception]] = []
        self.taps: list[SampleTap] = []
        self._ahead_ns = ahead_ns
        self.begins = False
        self._hears: dict[str, list[Callable[[Sample, int], None]]] = {}
        self._fit: dict[str, object] = {}  # the newest values that were checked
        measured = [s for s in board.declared.values() if isinstance(s, Measured)]
        self._kinds = {s.name: s.type for s in measured if isinstance(s.type, type)}
        self._measured = {s.name for s in measured if board.needs(s.name) and not s.constant}
        for name, listener in hears:
            self.listen(name, listener)

    def listen(self, name: str, listener: Callable[[Sample, int], None]) -> None:
        """Call `listener` with the samples of a signal; this causes no part to be polled."""
        self._hears.setdefault(name, []).append(listener)

    @property
    def flowing(self) -> set[str]:
        """The signals of the parts that are polled."""
        return {name for part in self.sources.values() for name in part.signals}

    def take(self, now_ns: int) -> None:
        """Poll the parts and take all samples that have arrived by now."""
        begins, self.begins = self.begins, False
        for name, part in list(self.sources.items()):
            try:
                found = part.samples(now_ns)
                for sample in _newest(found) if begins else found:
                    self.give(sample, now_ns)
            except Exception as error:  # noqa: BLE001  a driver may raise anything
                self.failures.append((name, error))
                del self.sources[name]

    def give(self, sample: Sample, now_ns: int) -> None:
        """Check one sample that has arrived now, and pass it on."""
        name, stamp, value = sample
        problem = None
        if not isinstance(stamp, int):
            problem = "its stamp is not an integer"
        elif stamp > now_ns + self._ahead_ns:
            problem = "its stamp is ahead"
        elif value is not self._fit.get(name):
            if self._fits(name, value):
                self._fit[name] = value
            else:
                problem = "its value is not of its type, or not finite"
        for tap in self.taps:
            tap(sample, now_ns, problem)
        if problem is not None:
            self.refused[name] = self.refused.get(name, 0) + 1
            return
        if name in self._measured:
            board = self.board
            board.inbox.append((board.inlets[name], value, stamp, board.interval))
        for listener in self._hears.get(name, ()):
            listener(sample, now_ns)

    def tell(self, sample: Sample, now_ns: int) -> None:
        """Pass an estimate from the board to listeners; it is not put back on the board.

        The same object is passed on once.
        """
        if self._fit.get(sample.name) is sample.value:
            return
        self._fit[sample.name] = sample.value
        for tap in self.taps:
            tap(sample, now_ns, None)
        for listener in self._hears.get(sample.name, ()):
            listener(sample, now_ns)

    def put(self, name: str, value: Any, stamp_ns: int) -> None:
        """Put a value on the board that no part measures: a constant, or a value from a test."""
        self.board.put(name, value, stamp_ns)

    def _fits(self, name: str, value: object) -> bool:
        kind = self._kinds.get(name, object)
        right = value is None or isinstance(value, kind) or (kind is float and type(value) is int)
        return right and is_finite(value)


def _newest(samples: Iterable[Sample]) -> Iterable[Sample]:
    """The newest sample of each signal and device."""
    found: dict[tuple[str, object], Sample] = {}
    for sample in samples:
        value = sample.value
        device = getattr(value, "tracker", None) or getattr(value, "sensor", None)
        found[sample.name, device] = sample
    return found.values()
