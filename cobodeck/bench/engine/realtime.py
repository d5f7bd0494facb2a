"""Benchmark of latency in real time: from a sample to the step of the state that waits for it.

CoboDeck runs on the mock in real time. Beside it a monitor waits for an extra part, whose thread
gives 120 samples per second. The time from a sample to the monitor's step is measured; waiting for
the next tick of the grid instead would take half a period, 16.7 ms, on average.
"""

from __future__ import annotations

import statistics
import threading
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from cobodeck.bench.engine.bench_states import Delay
from cobodeck.bench.harness import BenchRow
from cobodeck.loop import RealTime
from cobodeck.run import stage
from cobodeck.setup import Options, Setup, open_setup, warm_up
from engine import interface
from engine.chart import load_text
from engine.signals import Measured
from hw import Sample

NAME, RATE_HZ = "realtime", 120
SECONDS = 2.0
"""Duration of a round, s."""
GOAL_MS = 1.0
CHART = """
chart: probed
outcomes: [seen]
any:
  probe: {watch: Delay, next: {seen: .seen}}
  work: {use: cobodeck, next: {error: .seen}}
"""


class Probe:
    """A part whose samples are the clock's readings, ns, at which they were taken."""

    signals: tuple[str, ...] = ("probe",)

    def __init__(self) -> None:
        self.wake = _nobody
        self._arrived: deque[int] = deque()
        self._over = threading.Event()
        threading.Thread(target=self._produce, daemon=True).start()

    def samples(self, now_ns: int) -> list[Sample]:
        """The samples that have arrived since the last call."""
        count = len(self._arrived)
        return [Sample("probe", now_ns, self._arrived.popleft()) for _ in range(count)]

    def close(self) -> None:
        """Stop the thread."""
        self._over.set()

    def _produce(self) -> None:
        while not self._over.wait(1.0 / RATE_HZ):
            self._arrived.append(time.perf_counter_ns())
            self.wake()


def rows(rounds: int = 5) -> Iterator[BenchRow]:
    """Median and 99 % quantile over all rounds, over what the median may be."""
    found = delays(rounds * SECONDS)
    for what, share in (("median", 0.5), ("99% quantile", 0.99)):
        value_us = statistics.quantiles(found, n=1000)[round(1000 * share) - 1] / 1e3
        yield BenchRow(
            NAME, f"sample to step, {what}", "cobodeck", time_us=value_us,
            ratio=1e-3 * value_us / GOAL_MS, ratio_to=f"{GOAL_MS:g} ms",
            goal=1.0 if what == "median" else None, reference="has no error",
        )  # fmt: skip


def delays(seconds: float) -> list[int]:
    """Run for `seconds`; returns the delays that the monitor noted, ns."""
    setup = probed()
    warm_up(setup, setup.machine())
    loop = stage(setup, Options(mock=True), clock=RealTime())
    loop.go(round(seconds * 1e9))
    loop.plant.parts["probe"].close()
    return list(Delay.noted)


def probed() -> Setup:
    """CoboDeck's default setup, with the probe and its monitor added."""
    setup = open_setup()
    known = setup.catalogue
    chart = load_text(CHART)["probed"]
    own: dict[str, Any] = {"probe": Probe}
    return replace(
        setup,
        chart=chart,
        library={**setup.library, chart.name: chart},
        catalogue=replace(
            known,
            interfaces={**known.interfaces, "Delay": interface(Delay)},
            own_signals=(*known.own_signals, Measured("probe", int)),
            own_parts=own,
        ),
    )


def _nobody() -> None:
    """Do nothing; no loop to wake has been started yet."""
