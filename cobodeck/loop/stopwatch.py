"""Where the time of a run goes, by the wall clock: for `--explain`, and in real time."""

from __future__ import annotations

import time

PHASES = ("plant", "samples", "observers", "chart and states")


class Stopwatch:
    """Measures the phases of each tick.

    `spent_ns` is the time spent in each of `PHASES`; `overruns` counts the ticks that took longer
    than a period. `last_ns` is the time that the last tick took.
    """

    def __init__(self) -> None:
        self.spent_ns = [0] * len(PHASES)
        self.overruns = 0
        self.last_ns = 0
        self._begin = self._last = 0

    def begin(self) -> None:
        """A tick begins."""
        self._begin = self._last = time.perf_counter_ns()

    def lap(self, phase: int) -> None:
        """A phase of the tick is over."""
        now = time.perf_counter_ns()
        self.spent_ns[phase] += now - self._last
        self._last = now

    def end(self, period_ns: int) -> None:
        """The tick is over, with its last phase; a period is that of the grid."""
        self.lap(-1)
        self.last_ns = self._last - self._begin
        self.overruns += self.last_ns > period_ns
