"""The loop passes over whole seconds that only repeat, and nothing but counts differs for it."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from cobodeck.loop.loop import Loop
from cobodeck.loop.plant import Nothing
from cobodeck.loop.sample_router import Inlet
from cobodeck.loop.wiring import Wired
from engine.clock import TickGrid
from engine.machine.machine import Machine
from engine.machine.node import Substitute
from engine.machine.vertices import Leaf
from engine.operator.operator import Operator
from engine.run.chart_run import ChartRun
from engine.signals.board import Board
from engine.signals.signal_kinds import Derived, Estimated, Measured, declare
from engine.state import NEVER_NS, On, Stamped, Until
from hw.samples import Sample
from tests.engine.conftest import Part
from tests.engine.run.test_lifecycle import INTERFACES, bother, decorate
from tests.engine.run.test_skipping import with_reads
from tests.engine.valid_charts import chart_texts
from tests.repeats import examples

HZ = 10
GRID = TickGrid(HZ)
END_NS = 30 * 10**9
Script = Mapping[int, tuple[float | None, float | None]]
"""By tick: the values of `a` and `b` from then on; None: it gives no sample."""


class Span:
    """The spread in time, the sum and the count of the values of the last 0.4 s."""

    memory_s = 0.4

    def __init__(self) -> None:
        self.seen: deque[tuple[int, float]] = deque()
        self.found = (0, 0.0, 0)

    def update(self, _signal: str, sample: Stamped[float]) -> None:
        self.seen.append((sample.stamp, sample.value))
        while sample.stamp - self.seen[0][0] > 400_000_000:
            self.seen.popleft()
        spread = self.seen[-1][0] - self.seen[0][0]
        found = spread, sum(value for _, value in self.seen), len(self.seen)
        self.found = self.found if self.found == found else found

    def leap(self, span_ns: int) -> None:
        self.seen = deque((stamp + span_ns, value) for stamp, value in self.seen)

    def value(self) -> tuple[int, float, int]:
        return self.found


class Since:
    """Since when its value has been what it is."""

    idempotent = True
    memory_s = 0.0

    def __init__(self) -> None:
        self.last: object = None
        self.since = 0

    def update(self, _signal: str, sample: Stamped[object]) -> None:
        if sample.value != self.last:
            self.last, self.since = sample.value, sample.stamp

    def leap(self, span_ns: int) -> None:
        pass

    def value(self) -> int:
        return self.since


SIGNALS = declare([
    Measured("a"),
    Measured("e"),
    Derived("twice", ("a",), lambda value: 2.0 * value),
    Estimated("sum", ("a", "e"), Span, needs=("a",)),
    Estimated("since", ("sum",), Since),
])  # fmt: skip


class Toy(Nothing):
    """A plant whose parts repeat what a script says; `leapt` has the seconds passed over."""

    def __init__(self, script: Script) -> None:
        super().__init__({"toy": self})
        self.signals = ("a", "e")
        self.script, self.leapt = script, 0
        self.leap = self._leap
        self.now = 0
        self._values: tuple[float | None, float | None] = (None, None)
        self._tick = 0
        self.orders: Mapping[int, Callable[[], object]] = {}

    def advance(self, to_ns: int) -> None:
        self.now = max(to_ns, 0)
        while self._tick <= GRID.last(self.now):
            self._values = self.script.get(self._tick, self._values)
            self.orders.get(self._tick, lambda: None)()
            self._tick += 1

    def samples(self, now_ns: int) -> list[Sample]:
        pairs = zip(self.signals, self._values, strict=True)
        return [Sample(name, now_ns, value) for name, value in pairs if value is not None]

    def quiet_until(self) -> int:
        ahead = (GRID.instant(n) for n in (*self.script, *self.orders) if n >= self._tick)
        return min(ahead, default=NEVER_NS)

    def _leap(self, span_ns: int) -> None:
        self.leapt += span_ns // 10**9
        self._tick += span_ns * HZ // 10**9


class Sleepy:
    """A leaf that waits by chance, and whose outcome depends on all that it sees."""

    def __init__(self, leaf: Leaf, chance: random.Random) -> None:
        self.leaf, self.chance = leaf, chance

    def run(self, ctx: Any, **_inputs: Any) -> Any:
        chance, seen = self.chance, 0
        for _ in range(1 + chance.randrange(3)):
            kind = chance.randrange(9)
            if kind == 0:
                yield None
            elif kind < 3:
                yield Until(ctx.after(chance.random() * 9.0))
            else:
                until = ctx.after(chance.random() * 9.0) if kind == 3 else NEVER_NS
                older = chance.choice((None, 0.1, 0.35, 2.5))
                yield On(*chance.sample(tuple(SIGNALS), 2), until=until, older=older)
            spread = ctx.value("sum") or (0, 0.0, 0)
            seen += hash((spread, ctx.value("since"), ctx.sample("a"), ctx.sample("e"), ctx.now))
            seen += hash((ctx.age("sum"), ctx.value("twice")))
        return self.leaf.interface.outcomes[seen % len(self.leaf.interface.outcomes)]


@dataclass
class Watched:
    """Notes when the sample of `a` has changed."""

    board: Board
    leaps: bool = True
    found: list[tuple[int, object]] = field(default_factory=list)

    def watch(self, now_ns: int) -> None:
        newest = self.board.slots["a"].newest
        value = None if newest is None else newest.value
        if not self.found or self.found[-1][1] is not value:
            self.found.append((now_ns, value))


def script_of(chance: random.Random) -> Script:
    """Stretches of 0 to 9 s in which values are repeated or nothing comes."""
    found, tick = {}, 0
    while tick < END_NS * HZ // 10**9:
        values = [chance.choice((None, 0.5, 1.0, 2.0)) for _ in range(2)]
        found[tick] = values[0], values[1]
        tick += chance.choice((1, 2, 5, 30, 60, 90))
    return found


def stage(text: str, seed: int, commands: int = 0) -> tuple[Loop, Toy]:
    chance = random.Random(seed)
    library = decorate(text, chance)
    machine = Machine(library["c"], library, INTERFACES)
    stand_ins = {}
    for leaf in machine.leaves:
        leaf.interface = with_reads(leaf, SIGNALS)
        make = lambda leaf=leaf, **_: Sleepy(leaf, chance)  # noqa: E731
        stand_ins[leaf.path] = Substitute(make, leaf.interface.outputs)
    board, toy = Board(SIGNALS), Toy(script_of(random.Random(seed + 1)))
    run = ChartRun(machine, board, {"base": Part()}, stand_ins=stand_ins)
    outside = random.Random(seed + 2)
    order = partial(bother, Operator(run), machine, outside)
    toy.orders = {outside.randrange(1, END_NS * HZ // 10**9): order for _ in range(commands)}
    wired = Wired(run, board, Inlet(board, {"toy": toy}))
    return Loop(toy, wired, GRID, [Watched(board)]), toy


def played(text: str, seed: int, leave_out: bool, leaps: bool) -> tuple[Loop, Toy]:
    loop, toy = stage(text, seed, commands=seed % 6)
    loop.leave_out, loop.observers[0].leaps = leave_out, leaps  # type: ignore[attr-defined]
    loop.go(END_NS)
    return loop, toy


@settings(
    deadline=None,
    max_examples=examples(200),
    suppress_health_check=list(HealthCheck),
    derandomize=True,
)
@given(text=chart_texts(timeouts=True), seed=st.integers(0, 10**6))
def test_leaping_changes_nothing(text: str, seed: int) -> None:
    (every, _), (some, still), (few, _) = (
        played(text, seed, leave_out, leaps)
        for leave_out, leaps in ((False, False), (True, False), (True, True))
    )

    assert still.leapt == 0
    for loop in (some, few):
        assert list(loop.wired.run.trace.lines()) == list(every.wired.run.trace.lines())
        assert loop.wired.run.outcome == every.wired.run.outcome
        assert (loop.now_ns, loop.ticks) == (every.now_ns, every.ticks)
        assert loop.observers[0].found == every.observers[0].found  # type: ignore[attr-defined]
    assert few.left_out == some.left_out
    for name, slot in few.wired.board.slots.items():
        assert slot.read() == some.wired.board.slots[name].read(), name
    assert few.wired.board.interval == some.wired.board.interval


SLEEPS = """
chart: c
outcomes: [x]
any:
  a: {do: Do, next: {done: .x, failed: .x, other: .x}}
"""


def sleeping(waits: Any) -> tuple[Loop, Toy]:
    """A chart that waits as told, while `a` is repeated."""

    class Sleeps:
        def run(self, ctx: Any, **_inputs: Any) -> Any:
            while True:
                yield waits(ctx)

    loop, toy = stage(SLEEPS, 0)
    toy.script = {0: (1.0, None)}
    run = loop.wired.run
    run.put_in("a", Substitute(lambda **_: Sleeps(), {}))
    return loop, toy


def forever(_ctx: Any) -> Until:
    return Until(NEVER_NS)


def test_what_only_repeats_is_passed_over() -> None:
    loop, toy = sleeping(forever)
    loop.go(END_NS)

    assert toy.leapt >= 27
    assert loop.left_out >= loop.ticks - 5  # while the window of `sum` fills, repeats are news


@pytest.mark.parametrize("who", ["observer", "tap", "inlet tap", "estimator", "latency", "eager"])
def test_whoever_does_not_say_that_it_needs_no_repeats_gets_them(who: str) -> None:
    loop, toy = sleeping(forever)
    board = loop.wired.board
    if who == "observer":
        loop.observers[0].leaps = False  # type: ignore[attr-defined]
    elif who == "tap":
        loop.taps = [Tapped()]
    elif who == "inlet tap":
        loop.wired.inlet.taps.append(lambda *_: None)
    elif who == "estimator":
        board.slots["sum"].estimator.memory_s = 0.6  # type: ignore[attr-defined]
    elif who == "latency":
        toy.latency_ns = 1
    else:
        loop.leave_out = False
    loop.go(END_NS)

    assert toy.leapt == 0


class Tapped:
    """A tap that does nothing."""

    def failed(self, part: str, error: BaseException) -> None:
        pass

    def tick(self, ticked: Any) -> None:
        pass


def test_the_end_of_a_silence_ends_a_leap_unless_the_signal_is_repeated() -> None:
    visited, passed = [], []
    for name in ("a", "e"):
        loop, toy = sleeping(lambda _, name=name: On(name, older=20.0))
        toy.script = {0: (1.0, 1.0), 1: (1.0, None)}
        loop.go(END_NS)
        visited.append(loop.ticks - loop.left_out)
        passed.append(toy.leapt)

    assert visited[1] == visited[0] + 1
    assert passed[0] > passed[1] > 0


def test_a_leap_ends_before_the_end_of_the_run() -> None:
    loop, toy = sleeping(forever)
    loop.go(2_950_000_000)

    assert (loop.now_ns, loop.ticks, toy.leapt) == (3_000_000_000, 31, 1)
