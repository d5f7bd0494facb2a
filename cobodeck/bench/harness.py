"""Measures alternatives side by side: in one process, taking turns, as medians and ratios.

Absolute times differ by up to a factor of two between runs on the same machine; ratios to work that
was timed in the same round do not. Thread time is measured, so that other programs disturb little.
Garbage collection is off during measurements.
"""

from __future__ import annotations

import gc
import os
import platform
import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

ROUNDS = 9
ROUND_S = 0.03
"""Approximate time for which one alternative runs in one round, s."""
WORSE = {"ratio": 1.25, "error": 1.25, "calls_per_tick": 1.02}
"""A figure that has grown by more than this factor counts as worse."""


def nothing() -> None:
    """Do nothing; for work that leaves nothing to clear up."""


@dataclass(frozen=True, slots=True)
class Work:
    """Work to be timed: `run(n)` does it n times, `reset` clears up outside the measurement."""

    run: Callable[[int], None]
    reset: Callable[[], None] = nothing


@dataclass(frozen=True, slots=True)
class BenchCase:
    """Alternatives that do the same work; their times are divided by that of `limit`."""

    name: str
    limit: Work
    limit_name: str
    variants: Mapping[str, Work]
    knob: str | None = None
    value: float | None = None
    goal: float | None = None


@dataclass(frozen=True, slots=True)
class BenchRow:
    """One row of a result: time in µs, its ratio to `ratio_to`, and the error, if any.

    `knob` and `value` are the varied setting; `spread` is the interquartile range of the ratios.
    `calls_per_tick` are Python and C calls, see `simulation`; `goal` is then theirs.
    """

    bench: str
    name: str
    variant: str
    knob: str | None = None
    value: float | None = None
    time_us: float | None = None
    ratio: float | None = None
    ratio_to: str | None = None
    error: float | None = None
    error_unit: str | None = None
    reference: str | None = None
    goal: float | None = None
    spread: float | None = None
    calls_per_tick: float | None = None

    def plain(self) -> dict[str, Any]:
        """The row as values for JSON."""
        return asdict(self)


@dataclass(slots=True)
class _Times:
    work: Work
    count: int
    seconds: list[float] = field(default_factory=list)

    def measure(self) -> None:
        self.seconds.append(seconds_of(self.work, self.count) / self.count)


def measure(
    bench: str, case: BenchCase, rounds: int = ROUNDS, round_s: float = ROUND_S
) -> list[BenchRow]:
    """Time all alternatives of a case; returns a row for each."""
    limit = _prepare(case.limit, round_s)
    taken = {name: _prepare(work, round_s) for name, work in case.variants.items()}
    for _ in range(rounds):
        limit.measure()
        for times in taken.values():
            times.measure()
    return [_row(bench, case, variant, times, limit) for variant, times in taken.items()]


def _row(bench: str, case: BenchCase, variant: str, times: _Times, limit: _Times) -> BenchRow:
    ratios = [own / bare for own, bare in zip(times.seconds, limit.seconds, strict=True)]
    quartiles = statistics.quantiles(ratios, n=4) if len(ratios) > 1 else (0.0, 0.0, 0.0)
    return BenchRow(
        bench,
        case.name,
        variant,
        case.knob,
        case.value,
        time_us=statistics.median(times.seconds) * 1e6,
        ratio=statistics.median(ratios),
        ratio_to=case.limit_name,
        goal=case.goal if variant == "cobodeck" else None,
        spread=quartiles[2] - quartiles[0],
    )


def _prepare(work: Work, round_s: float) -> _Times:
    """Find the number of repetitions that fills a round; this also warms caches up."""
    count = 1
    while True:
        seconds = seconds_of(work, count)
        if seconds > 0.1 * round_s:
            return _Times(work, max(1, round(count * round_s / seconds)))
        count *= 4


def seconds_of(work: Work, count: int) -> float:
    """Thread time of doing the work `count` times, s."""
    with _no_collector():
        begin = time.thread_time_ns()
        work.run(count)
        seconds = (time.thread_time_ns() - begin) / 1e9
    work.reset()
    return seconds


@contextmanager
def _no_collector() -> Iterator[None]:
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def machine() -> dict[str, Any]:
    """The machine and Python that the figures were measured on."""
    return {
        "name": _processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": f"{platform.python_implementation()} {platform.python_version()}",
    }


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or platform.machine()
    named = (line.partition(":")[2].strip() for line in text.splitlines() if "model name" in line)
    return next(named, platform.machine())
