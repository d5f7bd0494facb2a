"""Events: each reader gets what arrived since it was entered or last asked, and nothing twice."""

from __future__ import annotations

import random
from typing import Any

import pytest

from engine.signals.board import Board
from engine.signals.event_log import LEAST, MOST, EventLog, EventReader
from engine.signals.signal_kinds import Measured, declare
from engine.state import Action, Context, On, Run, Stamped, Until
from tests.engine.conftest import Bench

HEARD: list[list[int]] = []


class Hear(Action):
    """Sleeps for a while, then notes what it hears, until it has heard something."""

    outcomes = ("heard",)
    reads = {"bell": None}

    def __init__(self, sleep: float = 0.0) -> None:
        self.sleep = sleep

    def run(self, ctx: Context) -> Run:
        if self.sleep:
            yield Until(ctx.after(self.sleep))
        while not (events := ctx.events("bell")):
            yield On("bell")
        HEARD.append([sample.value for sample in events])
        return "heard"


class Idle(Action):
    """Does not listen."""

    outcomes = ("done",)

    def run(self, ctx: Context) -> Run:
        while True:
            yield


@pytest.fixture(autouse=True)
def nothing_heard():
    HEARD.clear()


def listening(node: str) -> Bench:
    text = f"chart: c\noutcomes: [x]\nstates:\n  a: {node}\n  b: {{do: Idle, next: {{done: .x}}}}\n"
    board = Board(declare([Measured("bell", event=True)]))
    return Bench(text, states=(Hear, Idle), scripted=False, board=board)


def ring(bench: Bench, *numbers: int) -> None:
    for number in numbers:
        bench.run.board.put("bell", number, bench.now)


def test_a_state_that_sleeps_first_gets_what_came_meanwhile():
    bench = listening("{do: Hear, with: {sleep: 1 s}, next: {heard: b}}")
    for number in range(5):
        ring(bench, number)
        bench.tick()
    bench.tick(10)
    assert HEARD == [[0, 1, 2, 3, 4]]


def test_a_state_that_is_paused_before_it_asks_gets_what_came_meanwhile():
    bench = listening("{do: Hear, with: {sleep: 0.2 s}, next: {heard: b}}")
    bench.tick()
    bench.operator.pause()
    bench.tick()
    ring(bench, 1)
    bench.tick(5)
    ring(bench, 2)
    bench.operator.resume()
    bench.tick(5)
    assert HEARD == [[1, 2]]


def test_a_state_that_waits_for_events_is_woken_after_a_pause_in_which_they_came():
    bench = listening("{do: Hear, next: {heard: b}}")
    bench.tick()
    bench.operator.pause()
    bench.tick()
    ring(bench, 1)
    bench.tick(3)
    bench.operator.resume()
    bench.tick()
    assert HEARD == [[1]]


@pytest.mark.parametrize("paused", [False, True])
def test_rule_13_in_a_pause_nobody_wants_news(paused: bool):
    bench = listening("{do: Hear, next: {heard: b}}")
    bench.tick()
    if paused:
        bench.operator.pause()
    bench.tick()
    ring(bench, 1)
    assert bench.run.schedule.wants_news() != paused


def test_a_restarted_state_begins_at_its_entry_with_what_came_in_that_tick():
    bench = listening("{do: Hear, with: {sleep: 0.2 s}, next: {heard: a}}")
    ring(bench, 1)
    bench.tick()
    ring(bench, 2)
    bench.tick(2)  # heard, begins anew
    assert HEARD == [[1, 2]]
    ring(bench, 3)
    bench.tick(2)
    assert HEARD == [[1, 2], [3]]


def test_an_event_of_before_the_entry_is_nobody_s():
    bench = listening("{do: Idle, timeout: 0.5 s, next: {done: .x, timeout: c}}\n"
                      "  c: {do: Hear, next: {heard: b}}")  # fmt: skip
    bench.tick(3)
    ring(bench, 1)
    bench.tick(4)
    assert HEARD == []


def test_a_changed_chart_takes_the_events_of_its_running_states_along():
    bench = listening("{do: Hear, with: {sleep: 0.5 s}, next: {heard: b}}")
    bench.tick()
    ring(bench, 1)
    bench.tick()
    assert bench.operator.replace(bench.bind(bench.chart)) == []
    bench.tick()
    ring(bench, *range(2, 2 * LEAST))  # so many that the log is trimmed
    bench.tick(5)
    assert [list(range(1, 2 * LEAST))] == HEARD
    for number in range(4 * LEAST):  # nobody listens any more
        ring(bench, number)
        bench.tick()
    assert len(bench.run.board.slots["bell"].log) <= LEAST + 1


def test_rule_11_who_waits_for_a_signal_still_does_after_a_change_of_the_chart():
    bench = listening("{do: Hear, next: {heard: b}}")
    bench.tick()
    assert bench.operator.replace(bench.bind(bench.chart)) == []
    bench.tick(2)
    ring(bench, 1)
    bench.tick()
    assert HEARD == [[1]]


# -- the log ---------------------------------------------------------------------------------------


class Listener:
    """A reader that somebody else says is running."""

    def __init__(self, log: EventLog) -> None:
        self.runs = True
        self.reader = EventReader(log, lambda: self.runs)


def fill(log: EventLog, count: int, tick: int = 0) -> None:
    for number in range(count):
        log.add(Stamped(number, tick), tick)
        tick += 1


def test_a_log_that_nobody_reads_stays_short_for_a_day_of_events():
    log = EventLog()
    fill(log, 100_000)
    assert len(log) <= LEAST + 1


def test_a_log_keeps_what_a_running_reader_has_not_had_and_drops_it_when_that_ends():
    log = EventLog()
    slow = Listener(log)
    slow.reader.begin(0)
    fill(log, 5_000)
    assert len(log) == 5_000
    slow.runs = False
    fill(log, 20_000, tick=5_000)
    assert len(log) <= LEAST + 1


def test_a_log_is_trimmed_to_the_slowest_reader_and_nobody_misses_anything():
    log = EventLog()
    readers: list[Any] = [Listener(log), Listener(log)]
    had: list[list[int]] = [[], []]
    for listener in readers:
        listener.reader.begin(0)
    longest = 0
    for tick in range(3_000):
        log.add(Stamped(tick, tick), tick)
        longest = max(longest, len(log))
        for index, every in enumerate((1, 50)):
            if tick % every == 0:
                had[index] += [s.value for s in readers[index].reader.read(tick)]
    assert had == [list(range(3_000)), list(range(2_951))]
    assert longest <= 4 * LEAST


def test_even_a_reader_that_never_asks_does_not_make_the_log_grow_without_end():
    log = EventLog()
    Listener(log).reader.begin(0)
    fill(log, 5 * MOST)
    assert len(log) <= 2 * MOST


def test_who_is_entered_gets_all_of_a_tick_in_which_so_much_came_that_the_log_was_trimmed():
    log = EventLog()
    fill(log, 1_000)
    for number in range(3 * LEAST):
        log.add(Stamped(number, 1_000), 1_000)
    reader = Listener(log).reader
    reader.begin(1_000)
    assert [sample.value for sample in reader.read(1_000)] == list(range(3 * LEAST))


def test_who_asks_twice_in_a_tick_gets_the_same():
    log = EventLog()
    reader = Listener(log).reader
    reader.begin(0)
    fill(log, 2)
    assert reader.read(2) == reader.read(2) == (Stamped(0, 0), Stamped(1, 1))
    assert reader.read(3) == ()


@pytest.mark.parametrize("seed", range(20))
def test_readers_get_what_a_log_that_keeps_everything_has(seed: int):
    chance = random.Random(seed)
    log, everything = EventLog(), []
    listeners = [Listener(log) for _ in range(3)]
    ends = [0, 0, 0]
    for listener in listeners:
        listener.runs = False
    for tick in range(400):
        begun = len(everything)  # before what arrives in this tick
        for _ in range(chance.choice((0, 0, 1, 9))):
            log.add(Stamped(len(everything), tick), tick)
            everything.append(Stamped(len(everything), tick))
        for number, listener in enumerate(listeners):
            if not listener.runs and chance.random() < 0.05:
                listener.runs = True
                listener.reader.begin(tick)
                ends[number] = begun
            elif listener.runs and chance.random() < (0.3, 0.02, 0.9)[number]:
                assert listener.reader.read(tick) == tuple(everything[ends[number] :])
                ends[number] = len(everything)
                listener.runs = chance.random() < 0.9
    assert len(log) < len(everything)
