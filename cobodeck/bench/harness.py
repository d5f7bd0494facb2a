"""Measures alternatives side by side: in one process, taking turns, as medians and ratios.

Absolute times differ by up to a factor of two between runs on the same machine; ratios to work that
was timed just before do not. Thread time is measured, so that other programs disturb little.
Garbage collection is off during measurements.

A bench is a function that yields rows. Most rows are points of a curve of run time against error: a
`BenchRow` without times, with the `Work` that is to be timed, goes through `timed`.
"""

from __future__ import annotations

import gc
import json
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import PackageNotFoundError, distribution
from typing import Any

ROUNDS = 5
ROUND_S = 0.03
"""Approximate time for which one alternative runs in one round, s."""


def nothing() -> None:
    """Do nothing; for work that leaves nothing to clear up."""


@dataclass(frozen=True, slots=True)
class Work:
    """Work to be timed: `run(n)` does it n times, `reset` clears up outside the measurement.

    Doing it once handles `items`, such as poses; times are told for one of them. It is done
    `most` times between two resets.
    """

    run: Callable[[int], None]
    reset: Callable[[], None] = nothing
    items: int = 1
    most: int = sys.maxsize


def times(function: Callable[[], Any]) -> Callable[[int], None]:
    """A function that calls `function` n times."""

    def run(count: int) -> None:
        for _ in range(count):
            function()

    return run


def _pass() -> int:
    s = 0
    for i in range(1_000_000):
        s += i & 7
    return s


UNIT, UNIT_NAME = Work(times(_pass)), "unit"
"""What times are divided by where nothing nearer is at hand: a million passes of a plain loop."""


@dataclass(frozen=True, slots=True)
class BenchRow:
    """One row of a result: time in µs, its ratio to `ratio_to`, and the error, if any.

    `knob` and `value` are the varied setting, `default` marks the one that we use; `spread` is the
    interquartile range of the ratios. `error` is measured against `reference`; without an error
    that says why there is none. `peer`: made by others, and never judged by `compare`.
    `more_is_better`: so is a larger error, such as a gap, or a larger ratio, such as a speed.
    `calls_per_tick` are Python and C calls, see `simulation`. `goal` is the most that the error
    may be; of calls, or without any error of the ratio, the most that these may be.
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
    default: bool = False
    peer: bool = False
    more_is_better: bool = False

    def plain(self) -> dict[str, Any]:
        """The row as values for JSON."""
        return asdict(self)


TimedPoint = tuple[BenchRow, Work]


@dataclass(slots=True)
class _Times:
    work: Work
    count: int
    seconds: list[float] = field(default_factory=list)

    def measure(self) -> None:
        self.seconds.append(seconds_of(self.work, self.count) / (self.count * self.work.items))


def timed(
    points: Sequence[TimedPoint],
    rounds: int = ROUNDS,
    round_s: float = ROUND_S,
    limit: Work = UNIT,
    limit_name: str = UNIT_NAME,
) -> list[BenchRow]:
    """The rows with their times: medians of rounds, in which all points take turns.

    `limit`, to whose time the ratios are, is timed anew before each of them.
    """
    bare = _prepare(limit, round_s)
    taken = [_prepare(work, round_s) for _, work in points]
    limits: list[list[float]] = [[] for _ in points]
    for _ in range(rounds):
        for own, before in zip(taken, limits, strict=True):
            bare.measure()
            before.append(bare.seconds[-1])
            own.measure()
    return [
        _row(row, own.seconds, before, limit_name)
        for (row, _), own, before in zip(points, taken, limits, strict=True)
    ]


def timed_each(
    row: BenchRow, works: Sequence[Work], rounds: int = ROUNDS, share: float = 0.95
) -> tuple[BenchRow, BenchRow]:
    """The row with the mean time of several works, and with the quantile `share` of their times."""

    def run(count: int) -> None:
        for work in works:
            work.run(count)

    (mean,) = timed([(row, Work(run, items=len(works)))], rounds)
    single = [min(seconds_of(work, 1) for _ in range(min(rounds, 3))) for work in works]
    longer = statistics.quantiles(single, n=1000)[round(1000 * share) - 1] / statistics.fmean(
        single
    )
    assert mean.time_us is not None
    assert mean.ratio is not None
    late = replace(
        mean, name=f"{row.name}, {share:.0%} quantile", time_us=longer * mean.time_us,
        ratio=longer * mean.ratio, spread=None, error=None, error_unit=None, default=False,
    )  # fmt: skip
    return mean, late


def _row(row: BenchRow, taken: Sequence[float], limits: Sequence[float], name: str) -> BenchRow:
    ratios = [own / bare for own, bare in zip(taken, limits, strict=True)]
    quartiles = statistics.quantiles(ratios, n=4) if len(ratios) > 1 else (0.0, 0.0, 0.0)
    return replace(
        row,
        time_us=statistics.median(taken) * 1e6,
        ratio=statistics.median(ratios),
        ratio_to=name,
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
    spent = 0
    for done in range(0, count, work.most):
        with _no_collector():
            begin = time.thread_time_ns()
            work.run(min(work.most, count - done))
            spent += time.thread_time_ns() - begin
        work.reset()
    return spent / 1e9


@contextmanager
def _no_collector() -> Iterator[None]:
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def own_version() -> str:
    """Our version, with the commit where the package was installed from one."""
    try:
        found = distribution("cobodeck")
    except PackageNotFoundError:
        return "not installed"
    source = json.loads(found.read_text("direct_url.json") or "{}")
    commit = source.get("vcs_info", {}).get("commit_id")
    return found.version if commit is None else f"{found.version} {commit[:10]}"
