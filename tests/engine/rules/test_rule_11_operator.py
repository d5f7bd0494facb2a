"""Rule 11 of engine/README.md: the operator."""

from __future__ import annotations

import pytest

from engine.operator.commands import Pause
from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare
from engine.state import Action, Context, Run
from tests.engine.rules.charts import DATA, NESTED, SEQUENCE, Listen, listening


def test_rule_11_stop_and_preempt_end_any_chart_in_one_tick(bench):
    for command, outcome in (("stop", "stopped"), ("preempt", "preempted")):
        b = bench(NESTED)
        b.tick(2)
        getattr(b.operator, command)()
        b.tick()
        assert b.run.outcome == outcome
        assert b.steps == []
        assert {r[2] for r in b.last("exit")} == {outcome}


def test_rule_11_in_a_pause_nothing_is_stepped_and_chart_time_stands_still(bench):
    b = bench(
        SEQUENCE.replace("a: {do: Do,", "a: {do: Do, timeout: 400 ms,").replace(
            "other: a}", "other: a, timeout: b}"
        )
    )
    b.tick(2)
    b.operator.pause()
    assert b.tick(10) == []
    stops = b.base.stops
    assert stops >= 1
    b.operator.resume()
    assert b.tick(2) == ["a"]
    b.tick()
    assert b.active == ["b"] or b.active == ["a"]
    b.tick(2)
    assert b.active == ["b"]


def test_rule_11_forcing_closes_the_node_and_asks_for_its_outputs(bench):
    b = bench(DATA)
    b.tick()
    assert "value" in b.operator.force("give", "done")
    assert b.operator.force("give", "gone") is not None
    assert b.operator.force("use", "done") is not None
    assert b.operator.force("nowhere", "done") is not None
    assert b.operator.force("give", "done", {"value": 3.0}) is None
    b.tick()
    assert b.last("exit")[0] == ("exit", "give", "forced")
    assert b.script.inputs["use"] == {"value": 3.0}


def test_rule_11_chart_time_is_less_by_all_pauses_there_were(bench):
    b = bench(NESTED)
    found = []
    for paused in (2, 3, 0):
        b.tick(5)
        found.append((b.run.board.now, b.run.board.chart_now))
        b.operator.pause()
        b.tick(paused)
        b.operator.resume()
    assert found == [
        (400_000_000, 400_000_000),
        (1_100_000_000, 900_000_000),
        (1_900_000_000, 1_400_000_000),
    ]


def test_rule_11_a_lock_makes_outcomes_wait_but_never_guards(bench):
    b = bench(NESTED)
    b.tick()
    assert b.operator.lock("chase/inner") is None
    b.end("chase/inner/drive", "done")
    b.tick()
    assert b.operator.waiting() == {"chase/inner/drive": "done"}
    assert b.tick() == ["chase/danger", "chase/inner/near"]
    b.end("chase/danger", "seen")
    b.tick()
    assert b.active == ["escape/clear", "escape/flee"]


def test_rule_11_taking_a_lock_away_lets_go_on_what_waited(bench):
    b = bench(SEQUENCE)
    b.tick()
    b.operator.lock("a")
    b.end("a", "done")
    b.tick(2)
    assert b.active == []
    b.operator.unlock("a")
    b.tick()
    assert b.active == ["b"]


def test_rule_11_a_lock_on_a_container_never_holds_a_guard_on_its_way_out(bench):
    b = bench(NESTED)
    b.tick()
    b.operator.lock("chase")
    b.end("chase/danger", "seen")
    b.tick()
    assert b.operator.waiting() == {}
    assert b.active == ["escape/clear", "escape/flee"]


@pytest.mark.parametrize("lock", ["box", "box/work"])
@pytest.mark.parametrize("reason", ["error", "timeout"])
def test_rule_11_a_lock_never_holds_errors_and_timeouts_on_their_way_out(bench, lock, reason):
    text = """
chart: c
outcomes: [x]
states:
  box:
    states:
      work:
        do: Do
        timeout: 1 s
        next: {error: .bad, timeout: .bad, done: .x, failed: .x, other: .x}
    next: {bad: after, x: .x}
  after: {do: Do, next: {done: .x, failed: .x, other: .x}}
"""
    b = bench(text)
    b.tick()
    b.operator.lock(lock)
    if reason == "error":
        b.end("box/work", RuntimeError("broken"))
    b.tick(10)
    assert b.operator.waiting() == {}
    assert b.active == ["after"]


def test_rule_11_a_lock_never_holds_a_guard_whose_outcome_is_kept(bench):
    text = """
chart: c
outcomes: [x]
states:
  box:
    any:
      guard: {watch: See}
      work: {do: Do}
    when:
      - {outcome: gone, if: {guard: seen}}
      - {outcome: gone, if: {guard: lost}}
    next: {gone: after}
  after: {do: Do, next: {done: .x, failed: .x, other: .x}}
"""
    b = bench(text)
    b.tick()
    b.operator.lock("box")
    b.end("box/guard", "seen")
    b.tick()
    assert b.active == ["after"]


def test_rule_11_a_lock_on_the_whole_chart_holds_every_outcome(bench):
    b = bench(NESTED)
    b.tick()
    assert b.operator.lock("") is None
    b.end("chase/inner/drive", "done")
    b.tick()
    assert b.operator.waiting() == {"chase/inner/drive": "done"}
    assert b.operator.consent("chase/inner/drive") is None
    b.tick(2)
    assert b.operator.waiting() == {}
    assert b.active == ["chase/danger", "chase/inner/near", "chase/inner/drive"]


def test_rule_11_in_a_pause_a_wait_that_is_asked_for_does_not_run_down(bench):
    text = """
chart: c
outcomes: [x]
states:
  sub: {use: helper, retry: {times: 1, on: bad, wait: 300 ms}, next: {ok: .x, bad: .x}}
---
chart: helper
outcomes: [ok, bad]
states:
  work: {do: Do, next: {done: .ok, failed: .bad, other: .bad}}
"""
    b = bench(text)
    b.tick()
    b.operator.pause()
    b.tick(10)
    b.operator.force("sub/work", "failed")
    b.tick(10)
    b.operator.resume()
    b.tick(3)
    assert b.active == []
    b.tick()
    assert b.active == ["sub/work"]


def test_rule_11_a_command_may_come_from_another_thread_at_any_time(bench):
    b = bench(SEQUENCE)
    b.tick()

    class Twice(Pause):
        """While it is carried out, another command comes."""

        def carry_out(self, run):
            run.command(Pause())

    b.run.command(Twice())
    b.tick(2)
    assert b.run.carried_out == [(10**8, Twice()), (10**8, Pause())]
    assert b.run.paused


def test_rule_11_a_sample_that_comes_in_a_pause_is_noticed_after_it(bench):
    b = listening(bench)
    b.operator.pause()
    b.tick()
    b.run.board.put("voice", "hello", b.now)
    b.tick(3)
    assert len(Listen.heard) == 1
    b.operator.resume()
    b.tick(3)
    assert Listen.heard == [(0, None), (10**8, "hello")]


def test_rule_11_a_pause_alone_wakes_nobody(bench):
    b = listening(bench)
    b.operator.pause()
    b.run.board.put("other", "hello", b.now)
    b.tick(3)
    b.operator.resume()
    b.tick(3)
    assert Listen.heard == [(0, None)]


@pytest.mark.parametrize("paused", [0, 1, 10])
def test_rule_11_a_timeout_that_begins_after_a_pause_is_as_long_as_any(bench, paused):
    b = bench(SEQUENCE.replace("b: {do: Do,", "b: {do: Do, timeout: 400 ms,").replace(
        "other: .x}", "other: .x, timeout: a}"
    ))  # fmt: skip
    b.tick(2)
    b.operator.pause()
    b.tick(paused)
    b.operator.resume()
    b.end("a", "done")
    b.tick()
    entered = b.run.board.now
    assert b.active == ["b"]
    while b.active == ["b"]:
        b.tick()
    assert 400_000_000 <= b.run.board.now - entered < 400_000_000 + b.run.board.now // (b.ticks - 1)


class Look(Action):
    """Notes what it sees, unless that is too old."""

    outcomes = ("done",)
    reads = {"voice": 0.5}
    seen: list = []

    def run(self, ctx: Context) -> Run:
        while True:
            self.seen.append(ctx.value("voice"))
            yield


@pytest.mark.parametrize("paused", [False, True])
def test_rule_11_values_grow_older_in_a_pause(bench, paused):
    Look.seen.clear()
    board = Board(declare([Measured("voice")]))
    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Look, next: {done: .x}}\n"
    b = bench(text, states=(Look,), scripted=False, board=board)
    board.put("voice", 1, 0)
    b.tick()
    if paused:
        b.operator.pause()
    while board.now < 600_000_000:
        b.tick()
    b.operator.resume()
    b.tick()
    assert (Look.seen[0], Look.seen[-1]) == (1, None)
