"""Rule 13: ticks in which nothing is due may be left out, and others added."""

from __future__ import annotations

import random
from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from engine.clock import TickGrid
from engine.machine.machine import Machine
from engine.machine.node import Substitute
from engine.machine.vertices import Leaf
from engine.operator.operator import Operator
from engine.run.chart_run import ChartRun
from engine.signals.board import Board
from engine.signals.signal_kinds import Derived, Estimated, Measured, declare
from engine.state import NEVER_NS, Action, Context, On, Run as Steps, Until
from tests.engine.conftest import Bench, Part
from tests.engine.run.test_lifecycle import INTERFACES, bother, decorate
from tests.engine.valid_charts import chart_texts
from tests.repeats import examples

GRID = TickGrid(10)


class Last:
    """The sum of the last samples of each input; the same object while they stay."""

    def __init__(self) -> None:
        self.values: dict[str, float] = {}
        self.sum = 0.0

    def update(self, signal: str, sample: Any) -> None:
        self.values[signal] = sample.value
        found = sum(self.values.values())
        self.sum = self.sum if found == self.sum else found

    def value(self) -> float:
        return self.sum


SIGNALS = declare(
    [
        Measured("a"),
        Measured("e", event=True),
        Derived("twice", ("a",), lambda value: 2 * value),
        Estimated("sum", ("a", "e"), Last),
    ]
)
NAMES = tuple(SIGNALS)


class Sleepy:
    """A leaf that waits by chance, and whose outcome depends on what it sees."""

    def __init__(self, leaf: Leaf, chance: random.Random) -> None:
        self.leaf, self.chance = leaf, chance

    def run(self, ctx: Any, **_inputs: Any) -> Any:
        chance, seen = self.chance, 0
        for _ in range(chance.randrange(5)):
            kind = chance.randrange(4)
            if kind == 0:
                yield None
            elif kind == 1:
                yield Until(ctx.after(chance.random() * 2.0))
            else:
                until = ctx.after(chance.random() * 3.0) if kind == 2 else NEVER_NS
                older = chance.choice((None, 0.1, 0.35))
                yield On(*chance.sample(NAMES, 2), until=until, older=older)
            seen += len(ctx.events("e")) + round(ctx.value("sum") or 0) + (ctx.now > 10**9)
            seen += ctx.value("a") is None
        return self.leaf.interface.outcomes[seen % len(self.leaf.interface.outcomes)]


def play(text: str, seed: int, leave_out: bool) -> tuple[ChartRun, int]:
    """A run of 8 s with samples, repeats and commands by chance; how many ticks it took."""
    chance = random.Random(seed)
    library = decorate(text, chance)
    machine = Machine(library["c"], library, INTERFACES)
    board = Board(SIGNALS)
    stand_ins = {}
    for leaf in machine.leaves:
        leaf.interface = with_reads(leaf)
        make = lambda leaf=leaf, **_: Sleepy(leaf, chance)  # noqa: E731
        stand_ins[leaf.path] = Substitute(make, leaf.interface.outputs)
    outside = random.Random(seed + 1)
    run = ChartRun(
        machine, board, {"base": Part()}, outside.choice((None, None, 2)), stand_ins=stand_ins
    )
    operator = Operator(run)
    ticks, level, heard = 0, 0.5, True
    for number in range(80):
        now = GRID.instant(number)
        if outside.random() < 0.05:
            board.put("e", outside.random(), now - outside.randrange(10**8))
        if outside.random() < 0.05:
            level = outside.random()
        if outside.random() < 0.1:
            heard = not heard
        if heard:
            board.put("a", level, now - outside.randrange(10**8))
        if outside.random() < 0.1:
            bother(operator, machine, outside)
        if leave_out and run.schedule.leave_out(now):
            continue
        run.tick(now)
        ticks += 1
    return run, ticks


def with_reads(leaf: Leaf, names: Iterable[str] = NAMES) -> Any:
    from dataclasses import replace

    return replace(leaf.interface, reads=dict.fromkeys(names) | {"a": 0.3})


@settings(
    deadline=None,
    max_examples=examples(150),
    suppress_health_check=list(HealthCheck),
    derandomize=True,
)
@given(text=chart_texts(timeouts=True), seed=st.integers(0, 10**6))
def test_rule_13_ticks_before_the_next_that_is_due_may_be_left_out(text, seed):
    every, all_ticks = play(text, seed, leave_out=False)
    some, few_ticks = play(text, seed, leave_out=True)
    assert list(some.trace.lines()) == list(every.trace.lines())
    assert some.outcome == every.outcome
    assert some.active == every.active
    assert few_ticks <= all_ticks


class Nap(Action):
    """Sleeps for a while."""

    outcomes = ("done",)

    def run(self, ctx: Context) -> Steps:
        yield Until(ctx.after(5.0))
        return "done"


class Hark(Action):
    """Waits for a voice, for a while."""

    outcomes = ("done",)
    reads = {"voice": None}

    def run(self, ctx: Context) -> Steps:
        yield On("voice", until=ctx.after(7.0))
        return "done"


def one(node: str, **given: Any) -> Bench:
    text = f"chart: c\noutcomes: [x]\nstates:\n  a: {node}\n"
    board = Board(declare([Measured("voice")]))
    scripted = given.pop("scripted", False)
    return Bench(text, states=(Nap, Hark), scripted=scripted, board=board, **given)


DUE = {
    "a busy state": ("{do: Do, next: {done: .x, failed: .x, other: .x}}", 0),
    "a sleeping state": ("{do: Nap, next: {done: .x}}", 5 * 10**9),
    "a waiting state": ("{do: Hark, next: {done: .x}}", 7 * 10**9),
    "a timeout": ("{do: Hark, timeout: 2 s, next: {done: .x, timeout: .x}}", 2 * 10**9),
}


@pytest.mark.parametrize("what", DUE)
def test_rule_13_what_is_due_next_is_known(what):
    node, due = DUE[what]
    bench = one(node)
    bench.tick()
    assert bench.run.schedule.next_due() == due


def test_rule_13_the_first_tick_is_due_and_none_after_the_end():
    bench = one("{do: Nap, next: {done: .x}}")
    assert bench.run.schedule.next_due() == 0
    bench.tick()
    bench.operator.stop()
    assert bench.run.schedule.next_due() <= bench.now
    bench.tick()
    assert bench.run.schedule.next_due() == NEVER_NS


def test_rule_13_samples_and_commands_are_due_at_once_and_a_pause_moves_the_rest():
    bench = one("{do: Hark, next: {done: .x}}")
    bench.tick()
    bench.operator.pause()
    assert bench.run.schedule.next_due() <= bench.now
    bench.tick()
    assert bench.run.schedule.next_due() == NEVER_NS
    bench.tick(9)
    bench.operator.resume()
    bench.tick()
    assert bench.run.schedule.next_due() == 8 * 10**9
    bench.run.board.put("voice", 1, bench.now)
    assert bench.run.schedule.next_due() <= bench.now


def test_rule_13_an_outcome_that_waits_for_consent_is_not_due():
    node = "{do: Do, autonomy: {done: high}, next: {done: .x, failed: .x, other: .x}}"
    bench = one(node, level=2, scripted=True)
    bench.end("a", "done")
    bench.tick()
    assert bench.run.schedule.next_due() == NEVER_NS
    bench.operator.consent("a")
    assert bench.run.schedule.next_due() <= bench.now


def test_rule_13_a_further_try_is_due_when_its_wait_is_over():
    node = (
        "{do: Do, retry: {times: 1, on: done, wait: 3 s}, next: {done: .x, failed: .x, other: .x}}"
    )
    bench = one(node, scripted=True)
    bench.end("a", "done")
    bench.tick()
    assert bench.run.schedule.next_due() == 3 * 10**9


def test_rule_13_ticks_that_are_added_do_not_move_the_grid():
    bench = one("{do: Nap, next: {done: a}}")
    for now in sorted({*map(GRID.instant, range(200)), *range(0, 20 * 10**9, 77_777_777)}):
        bench.run.tick(now)
    entries = [r.time for r in bench.run.trace if r.kind == "enter" and r.subject == "a"]
    assert entries == [0, 5 * 10**9, 10 * 10**9, 15 * 10**9]


@settings(deadline=None, max_examples=examples(200))
@given(hz=st.integers(1, 2000), at=st.integers(0, 10**13))
def test_rule_1_the_first_tick_not_before_an_instant(hz, at):
    grid = TickGrid(hz)
    number = grid.first(at)
    assert grid.instant(number) >= at
    assert number == 0 or grid.instant(number - 1) < at


def test_rule_1_ticks_are_found_from_their_number():
    assert [TickGrid().instant(n) for n in (0, 1, 2, 3, 30 * 86_400)] == [
        0, 33_333_333, 66_666_666, 10**8, 86_400 * 10**9,
    ]  # fmt: skip


class Listen(Action):
    """Waits for another value, or for silence."""

    outcomes = ("done",)
    reads = {"voice": 0.2}

    def run(self, ctx: Context) -> Steps:
        yield On("voice", older=0.2)
        return "done"


@pytest.mark.parametrize("end", ["another value", "silence"])
def test_rule_13_who_waits_while_a_signal_repeats_needs_no_tick(end):
    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Listen, next: {done: .x}}\n"
    board = Board(declare([Measured("voice")]))
    run = Bench(text, states=(Listen,), scripted=False, board=board).run
    ticked = []
    for number in range(60):
        now = GRID.instant(number)
        if number < 50 or end == "another value":
            board.put("voice", 1.5 if number < 50 else number + 0.5, now)
        if not run.schedule.leave_out(now):
            ticked.append(number)
            run.tick(now)
    assert ticked[:2] == [0, 50 if end == "another value" else 52]
    assert next(r.time for r in run.trace if r.kind == "outcome") == GRID.instant(ticked[1])
