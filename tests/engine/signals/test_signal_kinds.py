"""Signals: three kinds, closure, ages, and that skipping changes nothing."""

from __future__ import annotations

import random
from traceback import walk_tb

import pytest
from hypothesis import given, settings, strategies as st

from engine.signals.board import CATCH_UP, Board
from engine.signals.signal_kinds import Derived, Estimated, Measured, closure, declare
from engine.state import Context, Monitor, On, Run
from tests.engine.conftest import Bench


class Mean:
    """The mean of all samples so far, and how they came."""

    def __init__(self) -> None:
        self.values: list[float] = []
        self.order: list[tuple[str, int]] = []

    def update(self, signal: str, sample) -> None:
        self.values.append(sample.value)
        self.order.append((signal, sample.stamp))

    def value(self) -> float:
        return sum(self.values) / len(self.values)


def graph():
    calls: list[str] = []

    def double(value: float) -> float:
        calls.append("double")
        return 2 * value

    signals = declare(
        [
            Measured("a"),
            Measured("b"),
            Measured("e", event=True),
            Derived("double", ("a",), double),
            Derived("sum", ("double", "b"), lambda x, y: x + y),
            Estimated("mean", ("a",), Mean),
            Estimated("mean of mean", ("mean", "b"), Mean),
        ]
    )
    return signals, calls


def test_the_closure_holds_the_wanted_and_what_they_rest_on():
    signals, _ = graph()
    assert closure(signals, ["sum"]) == ["a", "double", "b", "sum"]
    board = Board(signals, ["double"])
    assert set(board.slots) == {"a", "double"}
    assert board.needs("a")
    assert not board.needs("b")
    board.put("b", 1.0, 0)  # nobody can ask for it
    assert not board.inbox


def test_a_derived_value_is_computed_when_asked_once_and_only_after_news():
    signals, calls = graph()
    board = Board(signals)
    board.put("a", 1.0, 0)
    board.begin(0)
    assert calls == []
    assert board.slots["double"].read().value == 2.0
    assert board.slots["sum"].read() is None
    assert calls == ["double"]
    board.put("b", 5.0, 1)
    board.begin(1)
    assert board.slots["sum"].read().value == 7.0
    assert calls == ["double"]


def test_a_value_is_as_old_as_its_oldest_input():
    signals, _ = graph()
    board = Board(signals)
    board.put("a", 1.0, 10)
    board.put("b", 1.0, 70)
    board.begin(100)
    assert board.slots["sum"].read().stamp == 10


def test_a_reader_states_the_age_it_accepts():
    class Reader(Monitor):
        """Ends when its signal is fresh."""

        outcomes = ("seen",)
        reads = {"a": 0.15}

        def run(self, ctx: Context) -> Run:
            while ctx.value("a") is None:
                yield
            return "seen"

    signals, _ = graph()
    board = Board(signals)
    text = "chart: c\noutcomes: [x]\nstates:\n  a: {watch: Reader, next: {seen: .x}}\n"
    bench = Bench(text, states=(Reader,), scripted=False, board=board)
    board.put("a", 1.0, -(10**9))
    bench.tick(3)
    assert bench.run.outcome is None
    board.put("a", 1.0, bench.now - 10**8)
    bench.tick()
    assert bench.run.outcome == "x"


def test_a_value_exactly_as_old_as_a_reader_accepts_is_accepted():
    class Reader(Monitor):
        """Ends when its signal is too old."""

        outcomes = ("old",)
        reads = {"a": 0.3}

        def run(self, ctx: Context) -> Run:
            while ctx.value("a") is not None:
                yield
            return "old"

    signals, _ = graph()
    board = Board(signals)
    text = "chart: c\noutcomes: [x]\nstates:\n  a: {watch: Reader, next: {old: .x}}\n"
    bench = Bench(text, states=(Reader,), scripted=False, board=board)
    board.put("a", 1.0, 0)
    bench.tick(4)
    assert (bench.run.board.now, bench.run.outcome) == (3 * 10**8, None)
    bench.tick()
    assert bench.run.outcome == "x"


def test_a_state_may_only_read_what_it_declares():
    class Sneaky(Monitor):
        """Reads what it has not declared."""

        outcomes = ("seen",)
        reads = {"a": None}

        def run(self, ctx: Context) -> Run:
            yield
            ctx.value("b")
            return "seen"

    text = "chart: c\noutcomes: [x]\nstates:\n  a: {watch: Sneaky, next: {seen: .x}}\n"
    signals, _ = graph()
    bench = Bench(text, states=(Sneaky,), scripted=False, board=Board(signals))
    bench.tick(2)
    assert bench.records("error") == [("error", "a", "LookupError")]


def test_events_reach_each_reader_once_and_levels_are_the_newest():
    heard: dict[str, list[list[int]]] = {"quick": [], "slow": []}

    class Hear(Monitor):
        """Notes its events."""

        outcomes = ("seen",)
        reads = {"e": None, "a": None}

        def __init__(self, who: str, every: int) -> None:
            self.who, self.every = who, every

        def run(self, ctx: Context) -> Run:
            while True:
                heard[self.who].append([sample.value for sample in ctx.events("e")])
                for _ in range(self.every):
                    yield
            return "seen"

    text = """
chart: c
outcomes: [x]
any:
  quick: {watch: Hear, with: {who: quick, every: 1}, next: {seen: .x}}
  slow: {watch: Hear, with: {who: slow, every: 3}, next: {seen: .x}}
"""
    signals, _ = graph()
    board = Board(signals)
    bench = Bench(text, states=(Hear,), scripted=False, board=board)
    for tick in range(7):
        for number in range(tick % 3):
            board.put("e", 10 * tick + number, bench.now)
        bench.tick()
    assert heard["quick"] == [[], [10], [20, 21], [], [40], [50, 51], []]
    assert heard["slow"] == [[], [10, 20, 21], [40, 50, 51]]


def test_a_new_reader_gets_the_events_of_its_first_tick_and_none_before():
    got = []

    class Hear(Monitor):
        """Ends at the first event."""

        outcomes = ("seen",)
        reads = {"e": None}

        def run(self, ctx: Context) -> Run:
            while not (events := ctx.events("e")):
                yield On("e")
            got.append([sample.value for sample in events])
            return "seen"

    text = "chart: c\noutcomes: [x]\nstates:\n  a: {watch: Hear, next: {seen: a}}\n"
    signals, _ = graph()
    board = Board(signals)
    bench = Bench(text, states=(Hear,), scripted=False, board=board)
    board.put("e", 1, 0)
    bench.tick()
    bench.tick(2)
    board.put("e", 2, bench.now)
    bench.tick()
    assert [1] in got
    assert [2] in got
    assert all(len(values) == 1 for values in got)


def test_a_late_sample_does_not_replace_a_newer_one_but_reaches_estimators():
    signals, _ = graph()
    board = Board(signals)
    board.put("a", 4.0, 100)
    board.put("a", 2.0, 50)
    board.begin(120)
    assert board.slots["a"].read().value == 4.0
    assert board.slots["mean"].read().value == 3.0


def test_estimators_take_samples_by_tick_of_arrival_then_stamp_then_declaration():
    signals = declare([Measured("a"), Measured("b"), Estimated("both", ("b", "a"), Mean)])
    board = Board(signals)
    board.put("a", 1.0, 30)
    board.put("a", 1.0, 20)
    board.put("b", 1.0, 20)
    board.begin(40)
    board.put("b", 1.0, 10)
    board.begin(80)
    board.slots["both"].read()
    order = board.slots["both"].estimator.order
    assert order == [("b", 20), ("a", 20), ("a", 30), ("b", 10)]


def test_an_estimator_catches_up_when_256_samples_wait():
    signals, _ = graph()
    board = Board(signals)
    for number in range(CATCH_UP - 1):
        board.put("a", float(number), number)
    board.begin(10**6)
    assert len(board.slots["mean"].pending) == CATCH_UP - 1
    board.put("a", 0.0, CATCH_UP)
    board.begin(2 * 10**6)
    assert board.slots["mean"].pending == []
    assert len(board.slots["mean"].estimator.values) == CATCH_UP


@settings(deadline=None, max_examples=100, derandomize=True)
@given(seed=st.integers(0, 10**6))
def test_values_never_depend_on_who_reads_when(seed):
    chance = random.Random(seed)
    signals, _ = graph()
    lazy, eager, wild = Board(signals), Board(signals, eager=True), Board(signals)
    for tick in range(80):
        for _ in range(chance.randrange(8)):
            name, stamp = chance.choice(["a", "b"]), tick * 100 - chance.randrange(250)
            value = chance.random()
            for board in (lazy, eager, wild):
                board.put(name, value, stamp)
        for board in (lazy, eager, wild):
            board.begin(tick * 100)
        for name in chance.sample(sorted(signals), chance.randrange(len(signals))):
            if name != "e":
                wild.slots[name].read()
    for name in signals:
        assert lazy.slots[name].read() == eager.slots[name].read() == wild.slots[name].read()


def test_usage_says_what_was_built_computed_and_skipped():
    signals, _ = graph()
    board = Board(signals, ["double"])
    for tick in range(4):
        if tick < 2:
            board.put("a", 1.0, tick)
        board.begin(tick)
        if tick == 1:
            board.slots["double"].read()
    usage = board.usage()
    assert (usage["a"].built, usage["a"].evaluated) == (True, 2)
    assert (usage["double"].evaluated, usage["double"].skipped) == (1, 3)
    assert (usage["sum"].built, usage["sum"].evaluated, usage["sum"].skipped) == (False, 0, 4)


@pytest.mark.parametrize(
    ("signals", "message"),
    [
        ([Measured("a"), Measured("a")], "twice"),
        ([Derived("d", ("a",), abs)], "unknown 'a'"),
        ([Measured("e", event=True), Derived("d", ("e",), abs)], "event"),
        ([Derived("d", ("f",), abs), Derived("f", ("d",), abs)], "circle"),
        ([Measured("a"), Derived("d", ("a",), abs), Estimated("m", ("d",), Mean)], "derived"),
    ],
)
def test_wrong_declarations_are_refused_with_the_reason(signals, message):
    with pytest.raises(ValueError, match=message):
        declare(signals)


def failing(value: float) -> float:
    if value > 1.0:
        raise ValueError("too large")
    return value


class Picky:
    """Takes everything but 2."""

    def __init__(self) -> None:
        self.values: list[float] = []

    def update(self, signal: str, sample) -> None:
        if sample.value == 2.0:
            raise ValueError("two")
        self.values.append(sample.value)

    def value(self) -> tuple[float, ...]:
        return tuple(self.values)


def read(board: Board, name: str):
    try:
        sample = board.slots[name].read()
    except ValueError as error:
        return str(error)
    return sample and sample.value


def failing_board(eager: bool) -> Board:
    return Board(
        declare(
            [
                Measured("a"),
                Derived("small", ("a",), failing),
                Derived("as small", ("small",), abs),
                Estimated("picky", ("a",), Picky),
                Estimated("on picky", ("picky",), Picky),
                Derived("of picky", ("picky",), len),
            ]
        ),
        eager=eager,
    )


@pytest.mark.parametrize("eager", [True, False])
def test_what_a_pure_function_raises_reaches_every_reader_until_the_input_changes(eager):
    board = failing_board(eager)
    names = ("small", "as small")
    seen = []
    for value in (1.0, 3.0, None, 0.5):
        if value is not None:
            board.put("a", value, 0)
        board.begin(0)
        seen.append([read(board, name) for name in (*names, *names)])
    assert seen == [[1.0] * 4, ["too large"] * 4, ["too large"] * 4, [0.5] * 4]


@pytest.mark.parametrize("eager", [True, False])
@pytest.mark.parametrize("first", ["picky", "on picky", "of picky"])
def test_an_estimator_that_has_raised_raises_for_every_reader_from_then_on(eager, first):
    board = failing_board(eager)
    for number, values in enumerate(((1.0,), (2.0, 3.0), (4.0,))):
        for value in values:
            board.put("a", value, number)
        board.begin(number)
        found = [read(board, name) for name in (first, "picky", "on picky", "of picky")]
        if number:
            assert found == ["two"] * 4
        else:
            assert found[1:] == [(1.0,), ((1.0,),), 1]
    assert len(list(walk_tb(board.slots["picky"].failure.__traceback__))) < 5  # it does not grow


def test_an_estimator_that_nobody_reads_may_fail_unnoticed():
    board = failing_board(eager=False)
    for _ in range(3):
        for number in range(CATCH_UP):
            board.put("a", 2.0, number)
        board.begin(1)
    assert board.slots["picky"].pending == []
    assert read(board, "small") == "too large"


@settings(deadline=None, max_examples=60, derandomize=True)
@given(seed=st.integers(0, 10**6))
def test_failures_never_depend_on_who_reads_when(seed):
    chance = random.Random(seed)
    lazy, eager, wild = failing_board(False), failing_board(True), failing_board(False)
    for tick in range(20):
        for _ in range(chance.randrange(4)):
            value, stamp = chance.choice([0.5, 1.0, 1.5, 2.0]), tick - chance.randrange(3)
            for board in (lazy, eager, wild):
                board.put("a", value, stamp)
        for board in (lazy, eager, wild):
            board.begin(tick)
        for name in chance.sample(sorted(wild.slots), chance.randrange(6)):
            read(wild, name)
    for name in lazy.slots:
        assert read(lazy, name) == read(eager, name) == read(wild, name)


@pytest.mark.parametrize("name", ["small", "picky", "nothing"])
def test_only_measured_signals_are_delivered(name):
    with pytest.raises(LookupError, match="no measured signal"):
        failing_board(False).put(name, 1.0, 0)
