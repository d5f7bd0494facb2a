"""Rule 2: what `On` waits for. A repeat is no news, silence is a wait."""

from __future__ import annotations

import random
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from engine.signals.board import Board
from engine.signals.signal_kinds import Derived, Estimated, Measured, declare
from engine.state import NEVER_NS, Context, Monitor, On, Run
from tests.engine.conftest import Bench
from tests.repeats import examples

SAME, OTHER = (tuple(map(float, (1, 2))) for _ in range(2))  # equal, but two objects


class Average:
    """The mean of the last three values; the same object while it does not change."""

    def __init__(self) -> None:
        self.values: list[float] = []
        self.mean: float | None = None

    def update(self, signal: str, sample: Any) -> None:
        self.values = [*self.values[-2:], sample.value[0]]
        mean = sum(self.values) / len(self.values)
        if mean != self.mean:
            self.mean = mean

    def value(self) -> float | None:
        return self.mean


class Third:
    """True from the third sample on, whatever they are: something that repeats bring about."""

    def __init__(self) -> None:
        self.count = 0

    def update(self, signal: str, sample: Any) -> None:
        self.count += 1

    def value(self) -> bool:
        return self.count >= 3


SIGNALS = (
    Measured("place"),
    Measured("event", event=True),
    Measured("other"),
    Derived("first", ("place",), lambda place: place[0]),
    Estimated("mean", ("place",), Average),
    Estimated("third", ("place",), Third),
)


def board(*wanted: str) -> Board:
    return Board(declare(SIGNALS), wanted or ("place", "first", "event", "other"))


def deliver(on: Board, value: Any, now: int, name: str = "place") -> int:
    on.put(name, value, now)
    on.begin(now)
    return on.fresh


def test_the_same_value_object_is_no_news_and_only_makes_younger():
    b = board()
    assert deliver(b, SAME, 0)
    first = b.slots["first"].read()
    assert deliver(b, SAME, 100) == 0
    assert b.slots["place"].read().stamp == 100
    assert b.slots["first"].read() == (first.value, 100)
    assert b.slots["first"].evaluated == 1


def test_an_equal_value_is_news():
    b = board()
    deliver(b, SAME, 0)
    assert deliver(b, OTHER, 100) == b.slots["place"].roots


def test_an_event_is_never_a_repeat():
    b = board()
    deliver(b, True, 0, "event")
    assert deliver(b, True, 100, "event") == b.slots["event"].roots


def test_a_repeat_is_news_while_an_estimator_over_it_changes_and_no_longer():
    b = board("mean")
    deliver(b, (0.0,), 0)
    fresh = [deliver(b, SAME, now) for now in range(1, 6)]
    assert [bool(bits) for bits in fresh] == [True, True, True, False, False]


def test_a_repeat_is_news_when_it_brings_about_another_estimate():
    b = board("third")
    fresh = [deliver(b, SAME, now) for now in range(6)]
    assert [bool(bits) for bits in fresh] == [True, False, True, False, False, False]


def test_what_is_news_does_not_depend_on_who_has_read():
    lazy, read = board("mean", "other"), board("mean", "other")
    for now, value in enumerate([(0.0,), (3.0,), SAME, SAME, SAME, SAME]):
        found = [deliver(b, value, now) for b in (lazy, read)]
        read.slots["mean"].read()
        assert found[0] == found[1]


def test_what_ends_a_silence_that_a_reader_has_noticed_is_news():
    b = board()
    b.accept("first", 150)
    deliver(b, SAME, 0)
    assert deliver(b, SAME, 150) == 0
    assert deliver(b, SAME, 301) == b.slots["place"].roots


@pytest.mark.parametrize(
    ("ticked", "stamp", "ends_a_silence"), [(0, 150, False), (0, 151, True), (200, 100, True)]
)
def test_what_ends_a_silence_is_known_before_the_tick_that_takes_it(ticked, stamp, ends_a_silence):
    b = board()
    b.accept("first", 150)
    deliver(b, SAME, 0)
    b.begin(ticked)
    b.put("place", SAME, stamp)
    assert b.arrived() == (b.slots["place"].roots if ends_a_silence else 0)


@pytest.mark.parametrize("ages", [(150, 10_000), (10_000, 150)])
def test_a_repeat_is_news_for_the_reader_that_accepts_the_least_age(ages: tuple[int, int]):
    b = board()
    for age in ages:
        b.accept("first", age)
    deliver(b, SAME, 0)
    b.put("place", SAME, 150)
    assert b.arrived() == 0
    b.put("place", SAME, 151)
    assert b.arrived() == b.slots["place"].roots


class Wait(Monitor):
    """Ends when what it waits for has come; counts how often it was woken."""

    outcomes = ("woken",)
    reads = {"place": None, "first": None, "event": None, "other": None}

    def __init__(self, older: float, until: float = 100.0) -> None:
        self.older, self.until = older, until

    def run(self, ctx: Context) -> Run:
        yield On("first", "other", until=ctx.after(self.until), older=self.older or None)
        return "woken"


def waiting(older: float, until: float = 100.0) -> Bench:
    text = (
        "chart: c\noutcomes: [x]\nstates:\n"
        f"  a: {{watch: Wait, with: {{older: {older}, until: {until}}}, next: {{woken: .x}}}}\n"
    )
    bench = Bench(text, states=(Wait,), scripted=False, board=board())
    bench.run.board.put("place", SAME, 0)
    bench.tick()
    return bench


def ended_at(bench: Bench) -> int:
    return next(r.time for r in bench.run.trace if r.kind == "outcome")


def test_rule_2_a_repeat_wakes_nobody_and_a_new_value_does():
    bench = waiting(older=0.0)
    for _ in range(5):
        bench.run.board.put("place", SAME, bench.now)
        bench.tick()
    assert bench.active == ["a"]
    bench.run.board.put("place", OTHER, bench.now)
    bench.tick()
    assert bench.run.outcome == "x"


def test_rule_2_silence_of_a_signal_wakes_who_waits_for_it():
    bench = waiting(older=0.25)
    for _ in range(4):
        bench.run.board.put("place", SAME, bench.now)
        bench.tick()
    bench.tick(10)
    assert ended_at(bench) == 7 * 10**8  # last heard at 0.4 s, and 0.65 s is no tick


def test_rule_2_silence_is_longer_than_was_said():
    bench = waiting(older=0.3)
    bench.tick(10)
    assert ended_at(bench) == 4 * 10**8


def test_rule_2_what_was_silent_before_is_not_waited_for():
    b = board()
    deliver(b, SAME, 0)
    roots = b.slots["first"].roots | b.slots["other"].roots  # the other has never been heard
    assert b.silent_at(roots, 200, since=200) == 201
    assert b.silent_at(roots, 200, since=201) == NEVER_NS


def test_rule_2_the_instant_comes_before_the_silence():
    bench = waiting(older=0.45, until=0.2)
    bench.tick(10)
    assert ended_at(bench) == 2 * 10**8


def test_rule_12_who_tries_again_after_a_silence_does_so_when_its_time_has_come():
    node = "{watch: Wait, with: {older: 0.2}, retry: {times: 1, on: woken, wait: 0.5 s}"
    text = f"chart: c\noutcomes: [x]\nstates:\n  a: {node}, next: {{woken: .x}}}}\n"
    bench = Bench(text, states=(Wait,), scripted=False, board=board())
    bench.run.board.put("place", SAME, 0)
    bench.tick(10)
    entries = [r.time for r in bench.run.trace if r.kind == "enter" and r.subject == "a"]
    assert entries == [0, 8 * 10**8]


@pytest.mark.parametrize("paused", [False, True])
def test_rule_12_news_of_what_the_last_try_waited_for_does_not_shorten_the_wait(paused: bool):
    node = "{watch: Wait, with: {older: 0}, retry: {times: 1, on: woken, wait: 1 s}"
    text = f"chart: c\noutcomes: [x]\nstates:\n  a: {node}, next: {{woken: .x}}}}\n"
    bench = Bench(text, states=(Wait,), scripted=False, board=board())
    bench.tick()
    for number in range(13):
        bench.run.board.put("place", (float(number), 0.0), bench.now)
        if paused and number == 3:
            bench.operator.pause()
            bench.operator.resume()
        bench.tick()
    entries = [r.time for r in bench.run.trace if r.kind == "enter" and r.subject == "a"]
    assert entries == [0, 11 * 10**8]


def test_rule_11_a_pause_does_not_delay_what_falls_silent_in_it():
    bench = waiting(older=0.45)
    bench.operator.pause()
    bench.tick(4)
    bench.operator.resume()
    bench.tick()
    assert ended_at(bench) == 5 * 10**8


def test_rule_13_silence_is_due_when_it_would_be_long_enough():
    bench = waiting(older=0.25)
    assert bench.run.schedule.next_due() == 250_000_001
    for _ in range(3):
        bench.run.board.put("place", SAME, bench.now)
        bench.tick()
    assert bench.run.schedule.next_due() == 550_000_001


class Window:
    """The sum of what came in the last 300 ns, counted from the newest stamp."""

    def __init__(self) -> None:
        self.samples: list[tuple[int, float]] = []
        self.sum = 0.0

    def update(self, signal: str, sample: Any) -> None:
        factor = 10.0 if signal == "b" else 1.0
        self.samples.append((sample.stamp, factor * sample.value[0]))
        newest = max(stamp for stamp, _ in self.samples)
        self.samples = [(s, v) for s, v in self.samples if newest - s <= 300]
        # in the order of arrival, so that another order shows
        total = 0.0
        for index, (_, value) in enumerate(self.samples):
            total += value / (1 + index)
        if total != self.sum:
            self.sum = total

    def value(self) -> float:
        return self.sum


GRAPH = (
    Measured("a"),
    Measured("b"),
    Derived("both", ("a", "b"), lambda a, b: a[0] + b[0]),
    Estimated("window", ("b", "a"), Window),
    Estimated("over", ("a", "window"), lambda: Over()),
    Derived("of over", ("over", "a"), lambda over, a: over + a[0]),
)


class Over:
    """An estimator over an estimator."""

    def __init__(self) -> None:
        self.sum = 0.0

    def update(self, signal: str, sample: Any) -> None:
        value = sample.value[0] if signal == "a" else sample.value
        new = 0.5 * self.sum + value if abs(value - self.sum) > 1.0 else self.sum
        if new != self.sum:
            self.sum = new

    def value(self) -> float:
        return self.sum


def arrivals(chance: random.Random, now: int, values: dict[str, Any]) -> list[tuple[str, Any, int]]:
    """What comes for one tick: changes, repeats, nothing, more than one, late ones."""
    found = []
    for name in ("a", "b"):
        if chance.random() < 0.15:
            values[name] = (chance.choice([0.0, 1.0, 2.5]),)
        if name in values:
            stamps = [
                now - chance.choice([0, 0, 40, 150]) for _ in range(chance.choice([0, 1, 1, 2]))
            ]
            found += [(name, values[name], stamp) for stamp in stamps]
    return found


@settings(deadline=None, max_examples=examples(200), derandomize=True)
@given(seed=st.integers(0, 10**6))
def test_values_and_news_depend_neither_on_who_reads_nor_on_ticks_left_out(seed):
    chance = random.Random(seed)
    lazy, eager, wild, resting = (Board(declare(GRAPH), eager=kind == 1) for kind in range(4))
    values: dict[str, Any] = {}
    for tick in range(60):
        now, between = tick * 100, chance.random() < 0.1
        for sample in arrivals(chance, now, values):
            for board in (lazy, eager, wild, resting):
                board.put(*sample)
        for board in (lazy, eager, wild):
            board.begin(now, between=between)
        left_out = not between and resting.rest(now)
        if not left_out:
            resting.begin(now, between=between)
        assert lazy.fresh == wild.fresh == eager.fresh & 3 == (0 if left_out else resting.fresh)
        assert resting.interval == lazy.interval
        for name in chance.sample(sorted(wild.slots), chance.randrange(6)):
            wild.slots[name].read()
    for name in lazy.slots:
        found = [board.slots[name].read() for board in (lazy, eager, wild, resting)]
        assert found == [found[0]] * 4


@pytest.mark.parametrize("missed", [0, 3])
def test_arrivals_keep_the_number_of_the_interval_in_which_they_came(missed):
    """A sample of a later interval comes after those of an earlier one, whatever its stamp."""
    ticked, late = Board(declare(GRAPH)), Board(declare(GRAPH))
    for number, stamp in enumerate([300, 100, 200, 50]):
        ticked.put("a", (float(number),), stamp)
        ticked.begin(number * 100)
        late.interval = number
        late.put("a", (float(number),), stamp)
        if number > missed:
            late.begin(number * 100)
    late.begin(400)
    assert late.slots["window"].read() == ticked.slots["window"].read()


def test_an_added_tick_does_not_end_the_interval():
    board = Board(declare(GRAPH))
    board.begin(0)
    assert board.interval == 1
    board.begin(50, between=True)
    assert board.interval == 1
    board.begin(100)
    assert board.interval == 2


@pytest.mark.parametrize("told", [True, False])
def test_a_loop_that_misses_ticks_has_to_tell_or_samples_change_places(told):
    """Without it, what came before and after the missed ticks is taken for one interval's."""
    ticked, late = Board(declare(GRAPH)), Board(declare(GRAPH))
    for board in (ticked, late):
        board.put("b", (0.0,), 0)
        board.begin(0)
        board.put("a", (1.0,), 50)
    for now in (100, 200, 300):
        ticked.begin(now)
    if told:
        late.interval = 4
    for board in (ticked, late):
        board.put("a", (2.0,), 40)
        board.begin(400)
    window, usage = late.slots["window"].read(), late.usage()["window"]
    assert (window == ticked.slots["window"].read()) == told
    assert (usage.skipped == ticked.usage()["window"].skipped) == told
