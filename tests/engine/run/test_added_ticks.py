"""Rule 13: a tick between those of the grid steps only who waits for what has come."""

from __future__ import annotations

import random
from typing import Any

import pytest

from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare
from engine.state import NEVER_NS, Action, Context, Monitor, On, Run, Until
from tests.engine.conftest import Bench

LOG: list[tuple[str, int]] = []
MS = 10**6


class Poll(Action):
    """Looks in every tick of the grid."""

    outcomes = ("done",)

    def run(self, ctx: Context) -> Run:
        while True:
            LOG.append(("poll", ctx.now))
            yield


class Watch(Monitor):
    """Looks in every tick of the grid."""

    outcomes = ("seen",)

    def run(self, ctx: Context) -> Run:
        while True:
            LOG.append(("watch", ctx.now))
            yield


class Nap(Action):
    """Sleeps for 10 ms."""

    outcomes = ("done",)

    def run(self, ctx: Context) -> Run:
        yield Until(ctx.after(0.01))
        LOG.append(("nap", ctx.now))
        return "done"


class Hark(Monitor):
    """Ends with the voice, or after half a second."""

    outcomes = ("heard", "silence")
    reads = {"voice": None}

    def run(self, ctx: Context) -> Run:
        yield On("voice", until=ctx.after(0.5))
        LOG.append(("hark", ctx.now))
        return "heard" if ctx.value("voice") else "silence"


class Answer(Action):
    """Ends with the voice."""

    outcomes = ("done",)
    reads = {"voice": None, "other": None}

    def run(self, ctx: Context) -> Run:
        LOG.append(("enter", ctx.now))
        yield On("voice")
        LOG.append(("answer", ctx.now))
        return "done"


class Bell(Monitor):
    """Ends with the second ring."""

    outcomes = ("rung",)
    reads = {"bell": None}

    def run(self, ctx: Context) -> Run:
        yield On("bell")
        yield On("bell")
        return "rung"


class Back(Monitor):
    """Ends when the voice is heard again after 150 ms of silence."""

    outcomes = ("back",)
    reads = {"voice": None}

    def run(self, ctx: Context) -> Run:
        yield On("voice")
        yield On("voice", older=0.15)
        LOG.append(("silent", ctx.now))
        yield On("voice")
        return "back"


STATES = (Poll, Watch, Nap, Hark, Answer, Bell, Back)


@pytest.fixture(autouse=True)
def nothing_logged():
    LOG.clear()


def at(text: str, **given: Any) -> Bench:
    """A chart after its first tick, at 0."""
    board = Board(declare([Measured("voice"), Measured("other"), Measured("bell", event=True)]))
    text = "chart: c\noutcomes: [x]\n" + text
    bench = Bench(text, states=STATES, scripted=False, board=board, **given)
    bench.tick()
    LOG.clear()
    return bench


def between(bench: Bench, now: int, **samples: Any) -> list[tuple[str, int]]:
    """What is stepped in a tick that is added."""
    for name, value in samples.items():
        bench.run.board.put(name, value, now)
    LOG.clear()
    bench.run.tick(now, between=True)
    return list(LOG)


BUSY = """any:
  watch: {watch: Watch, next: {seen: .x}}
  hark: {watch: Hark, next: {heard: .x, silence: .x}}
  poll: {do: Poll, next: {done: .x}}
"""


def test_rule_13_a_plain_yield_and_until_wait_for_the_grid():
    bench = at(BUSY + "  nap: {do: Nap, next: {done: .x}}\n")
    assert between(bench, 50 * MS) == []
    assert bench.run.outcome is None
    bench.tick()
    assert LOG == [("watch", 100 * MS), ("poll", 100 * MS), ("nap", 100 * MS)]


def test_rule_13_who_waits_for_what_has_come_is_stepped_at_once():
    bench = at(BUSY)
    assert between(bench, 50 * MS, other=1) == []
    assert between(bench, 51 * MS, voice=1) == [("hark", 51 * MS)]
    assert bench.run.outcome == "x"


def test_rule_13_the_instant_of_a_wait_comes_with_the_grid():
    bench = at(BUSY)
    assert between(bench, 600 * MS) == []
    bench.ticks = 6
    bench.tick()
    assert ("hark", 600 * MS) in LOG


def test_rule_13_what_an_added_tick_leads_to_is_entered_in_it():
    bench = at("""states:
  first:
    any:
      hark: {watch: Hark, next: {heard: .heard, silence: .x}}
      poll: {do: Poll, next: {done: .x}}
    next: {heard: second, x: .x}
  second:
    any:
      watch: {watch: Watch, next: {seen: .x}}
      answer: {do: Answer, next: {done: .x}}
      poll: {do: Poll, next: {done: .x}}
    next: {x: .x}
""")
    now = 40 * MS
    assert between(bench, now, voice=1) == [
        ("hark", now), ("watch", now), ("enter", now), ("poll", now),
    ]  # fmt: skip


def test_rule_13_an_action_that_ends_in_an_added_tick_is_followed_in_it():
    bench = at("""any:
  work:
    states:
      a: {do: Answer, next: {done: b}}
      b: {do: Answer, next: {done: a}}
  poll: {do: Poll, next: {done: .x}}
""")
    assert between(bench, 40 * MS, voice=1) == [("answer", 40 * MS), ("enter", 40 * MS)]
    assert bench.active == ["work/b", "poll"]
    assert between(bench, 60 * MS, voice=2) == [("answer", 60 * MS), ("enter", 60 * MS)]


def test_rule_13_what_is_put_off_waits_for_the_grid():
    bench = at("states:\n  a: {do: Answer, next: {done: a}}\n")
    assert between(bench, 40 * MS, voice=1) == [("answer", 40 * MS), ("enter", 40 * MS)]
    bench.run.board.put("voice", 2, 100 * MS)
    bench.tick()
    assert bench.active == ["a"]


def test_rule_13_what_was_chosen_before_and_had_to_wait_begins_with_the_grid():
    text = """any:
  work: {do: Do, autonomy: {done: high}, next: {done: .x, failed: .x, other: .x}}
  branch:
    states:
      hark: {watch: Hark, next: {heard: poll, silence: poll}}
      poll: {do: Poll, next: {done: .x}}
"""
    bench = at(text, level=2)
    bench.tick()
    bench.run.board.put("voice", 1, bench.now)
    bench.tick()
    assert bench.operator.refuse("work") is None
    bench.tick()
    assert ("poll", bench.run.board.now) not in LOG
    assert between(bench, bench.run.board.now + MS) == []
    bench.tick()
    assert ("poll", bench.run.board.now) in LOG


def test_rule_13_outcomes_that_are_kept_are_looked_at_in_an_added_tick():
    bench = at("""all:
  one: {do: Answer}
  two: {do: Answer}
when:
  - {outcome: x, if: {one: done, two: done}}
""")
    between(bench, 40 * MS, voice=1)
    assert bench.run.outcome == "x"


def test_rule_13_timeouts_are_due_in_an_added_tick_too():
    bench = at("""states:
  first: {do: Poll, timeout: 130 ms, next: {done: .x, timeout: second}}
  second: {do: Answer, next: {done: .x}}
""")
    assert bench.run.schedule.next_deadline() == 130 * MS
    assert between(bench, 129 * MS) == []
    assert between(bench, 130 * MS) == [("enter", 130 * MS)]
    assert bench.run.schedule.next_deadline() == NEVER_NS


def test_rule_13_commands_wait_for_the_grid_and_in_a_pause_nothing_is_stepped():
    bench = at(BUSY)
    bench.operator.pause()
    assert between(bench, 50 * MS, voice=1) == [("hark", 50 * MS)]
    paused = at(BUSY)
    paused.operator.pause()
    paused.tick()
    assert between(paused, 150 * MS, voice=1) == []
    assert paused.run.schedule.next_deadline() == NEVER_NS
    assert not paused.run.schedule.wants_news()
    paused.operator.resume()
    paused.tick()
    assert ("hark", paused.run.board.chart_now) in LOG


def test_rule_13_a_sample_deserves_a_tick_if_somebody_waits_for_it():
    bench = at(BUSY)
    run = bench.run
    assert not run.schedule.wants_news()
    run.board.put("other", 1, 0)
    assert not run.schedule.wants_news()
    run.board.put("voice", None, 0)
    assert run.schedule.wants_news()
    bench.tick()
    assert not run.schedule.wants_news()


def test_rule_13_a_repeat_deserves_no_tick():
    bench = at("states:\n  a: {do: Answer, next: {done: a}}\n")
    bench.run.board.put("voice", "hello", 0)
    bench.tick()
    bench.run.board.put("voice", "hello", 0)
    assert not bench.run.schedule.wants_news()
    bench.run.board.put("voice", "you", 0)
    assert bench.run.schedule.wants_news()


def test_rule_13_an_event_deserves_a_tick_though_its_value_is_always_the_same():
    bench = at("states:\n  a: {watch: Bell, next: {rung: .x}}\n")
    for now in (50 * MS, 60 * MS):
        bench.run.board.put("bell", True, now)
        assert bench.run.schedule.wants_news()
        bench.run.tick(now, between=True)
    assert bench.run.outcome == "x"


def test_rule_13_a_repeat_that_ends_a_silence_deserves_a_tick():
    bench = at("states:\n  a: {watch: Back, next: {back: .x}}\n")
    for now in (20 * MS, 80 * MS):
        bench.run.board.put("voice", "hello", now)
        bench.run.tick(now, between=True)
    bench.tick(3)
    assert LOG == [("silent", 300 * MS)]
    bench.run.board.put("voice", "hello", 340 * MS)
    assert bench.run.schedule.wants_news()
    bench.run.tick(340 * MS, between=True)
    assert bench.run.outcome == "x"


def test_rule_13_a_deadline_is_later_by_the_pauses_there_were():
    text = "{do: Poll, timeout: 230 ms, next: {done: .x, timeout: .x}}"
    bench = at(f"states:\n  a: {text}\n")
    bench.operator.pause()
    bench.tick(2)
    bench.operator.resume()
    bench.tick()
    pause = bench.run.board.paused_ns
    assert pause == 200 * MS
    assert bench.run.schedule.next_deadline() == 230 * MS + pause
    bench.run.tick(bench.run.schedule.next_deadline() - 1, between=True)
    assert bench.run.outcome is None
    bench.run.tick(bench.run.schedule.next_deadline(), between=True)
    assert bench.run.outcome == "x"


@pytest.mark.parametrize("seed", range(20))
def test_rule_13_added_ticks_without_news_change_nothing(seed):
    chance = random.Random(seed)
    plain, added = at(BUSY), at(BUSY)
    for bench in (plain, added):
        for number in range(1, 12):
            if bench is added:
                for offset in sorted(chance.sample(range(1, 99), 3)):
                    bench.run.tick((number - 1) * 100 * MS + offset * MS, between=True)
            bench.tick()
    assert list(added.run.trace.lines()) == list(plain.run.trace.lines())
