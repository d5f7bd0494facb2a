"""Rule 11 of engine/README.md: breakpoints, single steps, and who issued a command."""

from __future__ import annotations

import pytest

from engine.chart.breakpoints import text_without_breaks
from engine.chart.load import load_text
from engine.operator.commands import Break
from engine.operator.operator import Operator
from engine.run.chart_run import ChartRun
from tests.engine.conftest import HZ
from tests.engine.rules.charts import DATA, NESTED, SEQUENCE, Listen, listening
from tests.engine.run.test_skipping import one

BROKEN = SEQUENCE.replace("b: {do: Do,", "b: {do: Do, break: true,")
USED = """
chart: c
outcomes: [x]
states:
  sub: {use: helper, break: true, retry: {times: 1, on: bad}, next: {ok: sub, bad: .x}}
---
chart: helper
outcomes: [ok, bad]
states:
  work: {do: Do, break: true, next: {done: .ok, failed: .bad, other: .bad}}
"""
PERIOD = 10**9 // HZ


def broken(run: ChartRun) -> list[tuple[int, str]]:
    """Ticks and paths of the breakpoints that have paused the run."""
    return [(at // PERIOD, c.path) for at, c in run.carried_out if isinstance(c, Break)]


def test_rule_11_a_breakpoint_pauses_with_the_tick_after_the_entry(bench):
    b = bench(BROKEN)
    b.operator.attend()
    b.tick()
    b.end("a", "done")
    assert b.tick() == ["a", "b"]
    assert not b.run.paused
    assert b.tick(3) == []
    assert b.run.paused
    assert b.base.stops >= 1
    assert broken(b.run) == [(2, "b")]
    assert b.records("note") == [("note", "b", "breakpoint")]
    assert b.run.board.chart_now == 2 * PERIOD
    b.operator.resume()
    assert b.tick(2) == ["b"]
    assert broken(b.run) == [(2, "b")]


def test_rule_11_a_breakpoint_does_nothing_without_an_operator(bench):
    runs = []
    for text in (SEQUENCE, BROKEN):
        b = bench(text)
        b.tick()
        b.end("a", "done")
        b.tick(3)
        b.end("b", "other")
        b.tick()
        assert b.run.outcome == "x"
        runs.append(list(b.run.trace))
        assert not b.run.carried_out
    assert runs[0] == runs[1]


def test_rule_15_a_breakpoint_changes_no_hash_even_if_it_pauses(bench):
    hashes, pauses = set(), []
    for text in (SEQUENCE, BROKEN):
        b = bench(text)
        b.operator.attend()
        b.tick()
        b.end("a", "done")
        b.tick(2)
        b.operator.resume()  # in the tick in which the other one has paused
        b.tick()
        b.end("b", "other")
        b.tick()
        hashes.add(b.run.trace.sha256())
        pauses.append(len(broken(b.run)))
    assert len(hashes) == 1
    assert pauses == [0, 1]


@pytest.mark.parametrize("outcome", ["done", "failed"])
def test_rule_11_each_entry_pauses_further_tries_and_used_charts_included(bench, outcome):
    b = bench(USED)
    b.operator.attend()
    b.tick(2)
    assert broken(b.run) == [(1, "sub"), (1, "sub/work")]
    b.operator.resume()
    b.end("sub/work", outcome)
    b.tick(3)
    if not b.run.paused:
        b.tick(2)
    assert [path for _, path in broken(b.run)] == ["sub", "sub/work"] * 2


def test_rule_11_the_operator_sets_and_removes_breakpoints(bench):
    b = bench(BROKEN)
    operator = b.operator
    refused = operator.break_at("a")
    assert refused is not None
    assert "attend" in refused
    operator.attend()
    assert operator.breaks() == ["b"]
    assert "allowed" in operator.break_at("c")
    assert "no breakpoint" in operator.unbreak("a")
    assert operator.break_at("a") is None
    assert operator.unbreak("b") is None
    b.tick()
    assert operator.breaks() == ["a"]
    b.tick()
    assert broken(b.run) == [(1, "a")]
    operator.resume()
    b.end("a", "done")
    b.tick(3)
    assert b.active == ["b"]
    assert not b.run.paused
    operator.attend(False)
    b.end("b", "done")
    b.tick(3)
    assert b.active == ["a"]
    assert not b.run.paused


def test_rule_11_a_replacement_brings_its_breakpoints_and_the_operators_stay(bench):
    b = bench(SEQUENCE.replace("a: {", "a: {break: true, "))
    b.operator.attend()
    b.operator.unbreak("a")
    b.tick()
    assert b.operator.breaks() == []
    changed = load_text(BROKEN.replace("a: {", "a: {break: true, "))["c"]
    assert b.operator.replace(b.machine.changed(changed, {"c": changed})) == []
    b.tick()
    assert b.operator.breaks() == ["b"]
    for path, stand_in in b.script.stand_ins.items():
        b.run.put_in(path, stand_in)
    b.end("a", "done")
    b.tick(2)
    assert broken(b.run)[-1][1] == "b"


def test_rule_11_a_step_runs_one_tick_and_one_period_of_chart_time(bench):
    b = bench(SEQUENCE)
    assert "not paused" in b.operator.step()
    b.tick(2)
    b.operator.pause()
    b.tick(3)
    before, stops = b.run.board.chart_now, b.base.stops
    for number in range(1, 4):
        assert b.operator.step() is None
        assert b.tick() == ["a"]
        assert b.run.paused
        assert b.tick(number) == []
        assert b.run.board.chart_now == before + number * PERIOD
    assert b.base.stops == stops + 3  # held again after each
    b.operator.resume()
    assert b.tick() == ["a"]
    assert b.run.board.chart_now == before + 3 * PERIOD


def test_rule_11_steps_right_after_each_other_are_as_ticks(bench):
    b = bench(SEQUENCE)
    b.tick()
    b.operator.pause()
    b.tick()
    for _ in range(3):
        assert b.operator.step() is None
        assert b.operator.step() is None  # two in a tick are one
        assert b.tick() == ["a"]
    b.operator.step()
    b.operator.resume()
    b.tick()
    assert b.tick() == ["a"]
    assert not b.run.paused


def test_rule_11_a_step_may_end_the_chart(bench):
    b = bench(SEQUENCE)
    b.tick()
    b.operator.pause()
    b.tick()
    b.end("a", "failed")
    b.operator.step()
    b.tick()
    assert b.run.outcome == "x"
    assert "ended" in b.operator.step()


def test_rule_11_a_timeout_in_steps_is_due_by_chart_time(bench):
    text = SEQUENCE.replace("a: {do: Do,", "a: {do: Do, timeout: 300 ms,").replace(
        "other: a}", "other: a, timeout: b}"
    )
    b = bench(text)
    b.tick()
    b.operator.pause()
    b.tick(20)
    for _ in range(2):
        assert b.active == ["a"]
        b.operator.step()
        b.tick()
    assert b.active == ["a"]
    b.tick(5)
    b.operator.step()
    b.tick()
    assert b.active == ["b"]


def test_rule_13_no_tick_is_added_or_left_out_around_a_step(bench):
    b = listening(bench)
    b.operator.pause()
    b.tick()
    assert b.run.schedule.next_due() > 10**18
    b.operator.step()
    assert not b.run.schedule.leave_out(b.now)
    b.tick()
    assert not b.run.schedule.leave_out(b.now)  # the pause goes on with this tick
    assert b.run.schedule.next_due() == b.run.board.now
    b.run.board.put("voice", "hello", b.now - 1)
    assert not b.run.schedule.wants_news()
    heard = len(Listen.heard)
    b.run.tick(b.now - 1, between=True)
    b.tick()
    assert len(Listen.heard) == heard
    b.operator.step()
    b.tick()
    assert Listen.heard[-1][1] == "hello"
    b.tick()
    assert b.run.schedule.next_due() > 10**18


def test_rule_13_the_tick_after_the_entry_is_not_left_out():
    b = one("{do: Nap, break: true, next: {done: .x}}")
    b.operator.attend()
    b.tick()
    assert b.run.schedule.next_due() == b.run.board.now
    assert not b.run.schedule.leave_out(b.now)
    b.tick()
    assert b.run.paused
    assert b.run.schedule.leave_out(b.now)


def test_rule_12_a_consent_in_a_pause_is_acted_on_in_a_step(bench):
    b = bench(SEQUENCE)
    b.tick()
    b.operator.lock("a")
    b.end("a", "done")
    b.tick()
    b.operator.pause()
    b.tick()
    assert b.operator.consent("a") is None
    b.tick()
    assert b.operator.waiting() == {"a": "done"}
    b.operator.step()
    b.tick()
    assert b.active == ["b"]


def test_rule_11_commands_say_who_issued_them(bench):
    b = bench(DATA)
    ada = Operator(b.run, "Ada")
    ada.attend()
    ada.break_at("use")
    b.tick()
    ada.force("give", "done", {"value": 1.0})
    ada.remark("stop")
    b.operator.set_level("low")
    b.tick(2)
    assert [(type(command).__name__, command.by) for _, command in b.run.carried_out] == [
        ("SetBreak", "Ada"),
        ("ForceOutcome", "Ada"),
        ("Remark", "Ada"),
        ("SetLevel", ""),
        ("Break", "breakpoint"),
    ]
    assert ("note", "", "Ada: stop") in b.records("note")


def test_rule_11_after_the_end_remarks_are_on_record_and_nothing_else_is_done(bench):
    b = bench(DATA)
    ada = Operator(b.run, "Ada")
    b.tick()
    ada.stop()
    ada.remark("stop")
    b.tick()
    ada.pause()
    ada.remark("reset")
    b.tick()
    done = [type(command).__name__ for _, command in b.run.carried_out]
    assert done == ["End", "Remark", "Remark"]
    assert [text for *_, text in b.records("note")] == ["Ada: stop", "Ada: reset"]
    assert b.run.outcome == "stopped"
    assert not b.run.paused


def test_rule_11_what_was_paused_and_stepped_is_replayed_without_an_operator(bench):
    def run(commands=None):
        b = bench(NESTED.replace("escape:", "escape:\n    break: true"))
        if commands is None:
            b.operator.attend()
        for number in range(12):
            for at, command in commands or ():
                if at == b.now:
                    b.run.command(command)
            if commands is None:
                {4: b.operator.step, 6: b.operator.step, 8: b.operator.resume}.get(
                    number, lambda: None
                )()
            if number in (1, 9):
                b.end("chase/danger" if number == 1 else "escape/clear", "seen")
            b.tick()
        return b.run

    first = run()
    again = run(list(first.carried_out))
    assert not again.attended
    assert [type(command).__name__ for _, command in first.carried_out] == [
        "Break", "StepOnce", "StepOnce", "Resume"
    ]  # fmt: skip
    assert list(first.carried_out) == list(again.carried_out)
    assert list(first.trace) == list(again.trace)


@pytest.mark.parametrize(
    "written",
    [
        SEQUENCE.replace("a: {", "a: {break: true, "),
        SEQUENCE.replace("other: a}}", "other: a}, break: true}"),
        SEQUENCE.replace("other: .x}}", "other: .x},\n    break: true}"),
        SEQUENCE.replace("b: {do: Do, ", "b: {do: Do, break: false, "),
        BROKEN.replace("a: {", "a: {break: true, "),
    ],
)
def test_rule_15_the_text_of_a_chart_counts_without_breakpoints_in_braces(written):
    library = load_text(written)
    assert not library.findings
    assert text_without_breaks(library["c"]) == SEQUENCE


BLOCK = "chart: c\noutcomes: [x]\nstates:\n  a:\n    do: Do\n    next: {done: .x}\n"


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("line", [4, 5, 6])
@pytest.mark.parametrize("entry", ["    break: true", "    break: false  # here"])
@pytest.mark.parametrize("last", [True, False])
def test_rule_15_the_text_of_a_chart_counts_without_breakpoints_on_lines(line, entry, end, last):
    lines = BLOCK.removesuffix("\n").split("\n")
    written = end.join([*lines[:line], entry, *lines[line:]]) + end * last
    library = load_text(written)
    assert not library.findings
    assert text_without_breaks(library["c"]) == end.join(lines) + end * last


def test_a_breakpoint_is_true_or_false():
    (finding,) = load_text(SEQUENCE.replace("a: {", "a: {break: on, ")).findings
    assert finding.code == "C03"
    assert "true or false" in finding.message
