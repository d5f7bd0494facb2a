"""Monitors of any signal end in the tick in which looking at every tick would end them."""

from __future__ import annotations

import random

from hypothesis import HealthCheck, given, settings, strategies as st

from cobodeck.loop.loop import Loop
from cobodeck.loop.sample_router import Inlet
from cobodeck.loop.wiring import Wired
from engine.operator.operator import Operator
from engine.run.chart_run import ChartRun
from tests.cobodeck.loop.test_leaps import END_NS, SIGNALS as REPEATED, Tapped, Toy, script_of
from tests.repeats import THOROUGH, examples
from tests.states.watching.against_polling import (
    GRID,
    READY,
    SIGNALS,
    Feed,
    Watch,
    ended,
    polling,
    run_of,
    watches,
)

NAMES = [cls.__name__ for cls in READY]
TICKS = 120
many = settings(
    deadline=None,
    max_examples=examples(600) if THOROUGH else 40,
    suppress_health_check=list(HealthCheck),
    derandomize=True,
)


def feed(
    run: ChartRun, seed: int, lag: int = 0, leave_out: bool = False, pauses: bool = False
) -> int:
    """Give a run samples, and pauses, by chance; how many ticks it took."""
    samples, ticks = Feed(random.Random(seed), lag, every=1 + seed % 4), 0
    outside, operator = random.Random(seed + 1), Operator(run)
    for number in range(TICKS):
        if pauses and outside.random() < 0.08:
            (operator.resume if run.paused else operator.pause)()
        now = GRID.instant(number)
        for name, value, stamp in samples.samples(now):
            run.board.put(name, value, stamp)
        if leave_out and run.schedule.leave_out(now):
            continue
        run.tick(now)
        ticks += 1
    return ticks


def check_one(watch: Watch, seed: int, lag: int) -> None:
    looks, seen = polling(watch, SIGNALS)
    feed(looks, seed, lag)
    every, some = run_of(watch, SIGNALS), run_of(watch, SIGNALS)
    all_ticks, few_ticks = feed(every, seed, lag), feed(some, seed, lag, leave_out=True)

    assert ended(every) == watch.end(seen)
    assert list(some.trace.lines()) == list(every.trace.lines())
    assert few_ticks <= all_ticks


@many
@given(
    watch=watches(("a", "mean"), NAMES[:-1]),
    seed=st.integers(0, 10**6),
    lag=st.sampled_from((0, 0, 120_000_000, 450_000_000)),
)
def test_it_ends_when_looking_at_every_tick_would_end_it(watch: Watch, seed: int, lag: int) -> None:
    check_one(watch, seed, lag)


@many
@given(watch=watches(("a",), ["Silent"]), seed=st.integers(0, 10**6))
def test_silence_is_noticed_when_looking_at_every_tick_would_notice_it(
    watch: Watch, seed: int
) -> None:
    check_one(watch, seed, lag=0)


@many
@given(watch=watches(("a", "mean"), NAMES), seed=st.integers(0, 10**6))
def test_nothing_is_missed_in_a_pause(watch: Watch, seed: int) -> None:
    looks, seen = polling(watch, SIGNALS)
    feed(looks, seed, pauses=True)
    every, some = run_of(watch, SIGNALS), run_of(watch, SIGNALS)
    feed(every, seed, pauses=True)
    feed(some, seed, leave_out=True, pauses=True)

    end, expected = ended(every), watch.end(seen)  # the one in run time, the other in chart time
    assert (end is None) == (expected is None)
    assert end is None or expected is None or end[1] == expected[1]
    assert list(some.trace.lines()) == list(every.trace.lines())


def played(watch: Watch, seed: int, leave_out: bool, leaps: bool) -> tuple[Loop, Toy]:
    toy, run = Toy(script_of(random.Random(seed))), run_of(watch, REPEATED)
    loop = Loop(toy, Wired(run, run.board, Inlet(run.board, {"toy": toy})), GRID)
    loop.leave_out = leave_out
    loop.taps = [] if leaps else [Tapped()]
    loop.go(END_NS)
    return loop, toy


@many
@given(watch=watches(("a", "e", "twice"), NAMES), seed=st.integers(0, 10**6))
def test_neither_skipping_nor_leaping_changes_when_it_ends(watch: Watch, seed: int) -> None:
    looks, seen = polling(watch, REPEATED)
    toy = Toy(script_of(random.Random(seed)))
    Loop(toy, Wired(looks, looks.board, Inlet(looks.board, {"toy": toy})), GRID).go(END_NS)
    (every, _), (some, still), (few, _) = (
        played(watch, seed, *how) for how in ((False, False), (True, False), (True, True))
    )

    assert still.leapt == 0
    assert ended(every.wired.run) == watch.end(seen)
    for loop in (some, few):
        assert list(loop.wired.run.trace.lines()) == list(every.wired.run.trace.lines())
        assert loop.now_ns == every.now_ns
