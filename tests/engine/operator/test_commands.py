"""Rule 11: commands that follow each other, or come at an awkward moment."""

from __future__ import annotations

import pytest

from engine.chart.load import load_text
from engine.machine.node import PUT_OFF
from engine.operator.commands import ForceOutcome
from engine.state import Action, Context, Run
from tests.engine.conftest import Bench

WATCHED = """
chart: c
outcomes: [x]
any:
  work: {do: Do, next: {done: .x, failed: .x, other: .x}}
"""
FIRST = WATCHED + "  first: {watch: See, next: {seen: .x, lost: .x}}\n"
BOTH = FIRST + "  second: {watch: See, next: {seen: .x, lost: .x}}\n"
OTHER = WATCHED + "  second: {watch: See, next: {seen: .x, lost: .x}}\n"


def replace(bench: Bench, text: str) -> list[str]:
    return bench.operator.replace(bench.bind(next(iter(load_text(text).values()))))


@pytest.mark.parametrize("paused", [False, True])
@pytest.mark.parametrize(
    ("texts", "active"),
    [
        ((FIRST, FIRST), ["work", "first"]),
        ((FIRST, BOTH), ["work", "first", "second"]),
        ((BOTH, FIRST), ["work", "first"]),
        ((FIRST, OTHER), ["work", "second"]),
        ((FIRST, WATCHED, BOTH), ["work", "first", "second"]),
        ((FIRST, WATCHED), ["work"]),
    ],
)
def test_rule_11_each_of_several_replacements_keeps_the_guards_of_the_last(
    paused: bool, texts: tuple[str, ...], active: list[str]
):
    bench = Bench(WATCHED)
    bench.tick()
    if paused:
        bench.operator.pause()
        bench.tick()
    for text in texts:
        assert replace(bench, text) == []
        if paused:
            bench.tick()
    bench.operator.resume()
    bench.tick()
    assert bench.active == active
    assert bench.records("note") == []
    bench.tick()
    assert [bench.records("enter").count(("enter", path)) for path in active] == [1] * len(active)


def test_rule_11_children_of_a_box_that_was_just_put_in_start_once():
    inner = "  box:\n    any:\n      a: {do: Do}\n      b: {watch: See}\n    next: {done: .x"
    more = ", failed: .x, other: .x, seen: .x, lost: .x}\n"
    bench = Bench(WATCHED)
    bench.tick()
    bench.operator.pause()
    bench.tick()
    for _ in range(3):
        assert replace(bench, WATCHED + inner + more) == []
        bench.tick()
    bench.operator.resume()
    bench.tick()
    assert bench.active == ["work", "box/a", "box/b"]


LOOPING = """
chart: c
outcomes: [x]
any:
  guard: {watch: See, next: {seen: .x, lost: .x}}
  loop:
    states:
      a: {do: Do, next: {done: a, failed: b, other: .y}}
      b: {do: Do, next: {done: a, failed: .y, other: .y}}
    next: {y: .x}
"""


def test_rule_11_a_node_that_was_put_off_is_not_forced():
    bench = Bench(LOOPING)
    bench.end("loop/a", "done")
    bench.tick()  # it leads back to itself in the tick of its entry
    assert bench.active == ["guard"]
    assert bench.operator.force("loop/a", "failed") == "'loop/a' is not active"
    bench.run.command(
        ForceOutcome("loop/a", "failed")
    )  # one that was accepted before, and is not possible now
    bench.tick()
    assert bench.active == ["guard", "loop/a"]
    entered, left = (bench.records(kind) for kind in ("enter", "exit"))
    assert sum(r[1] == "loop/a" for r in entered) == sum(r[1] == "loop/a" for r in left) + 1


BOXED = """
chart: c
outcomes: [x, y]
states:
  box:
    states:
      a: {do: Do, next: {done: .inner, failed: b, other: .y}}
      b: {watch: See, timeout: 5 s, next: {seen: .inner, lost: a, timeout: .y}}
    next: {inner: .x, y: .y}
"""


@pytest.mark.parametrize("outcome", ["done", "failed", "other", "seen", "lost", "timeout", "x"])
def test_rule_11_a_box_is_forced_to_what_it_can_end_with_alone(outcome: str):
    bench = Bench(BOXED)
    bench.tick()
    refused = bench.operator.force("box", outcome)
    assert refused is not None
    assert refused.startswith(f"'box' has no outcome {outcome!r}")
    assert bench.operator.force("box", "inner") is None
    assert bench.operator.force("box", "y") is None


class Untidy(Action):
    """Fails to clean up."""

    outcomes = ("done", "failed")

    def run(self, ctx: Context) -> Run:
        try:
            while True:
                yield
        finally:
            raise OSError("stuck")


UNTIDY = """
chart: c
outcomes: [x, late, wrong]
states:
  box:
    any:
      work: {do: Untidy, next: {done: .on, failed: .off}}
    timeout: 1 s
    next: {on: .x, off: .x, timeout: .late, error: .wrong}
"""


def test_rule_7_a_clean_up_that_raises_inside_does_not_turn_the_outcome_of_a_forced_box():
    bench = Bench(UNTIDY, states=(Untidy,), scripted=False)
    bench.tick()
    assert bench.operator.force("box", "on") is None
    bench.tick()
    assert bench.run.outcome == "x"
    assert [error.kind for error in bench.run.errors] == ["OSError"]


def test_rule_7_nor_that_of_a_box_that_times_out():
    bench = Bench(UNTIDY, states=(Untidy,), scripted=False)
    bench.tick(11)
    assert bench.run.outcome == "late"
    assert bench.records("outcome") == [("outcome", "box", "timeout"), ("outcome", "", "late")]


def test_rule_7_it_turns_that_of_the_leaf_itself():
    bench = Bench(UNTIDY.replace("failed: .off", "failed: .off, error: .off"), (Untidy,), False)
    bench.tick()
    assert bench.operator.force("box/work", "done") is None
    bench.tick()
    assert bench.records("outcome")[:2] == [
        ("outcome", "box/work", "error"),
        ("outcome", "box", "off"),
    ]


def test_a_closed_run_starts_nothing_again():
    bench = Bench(LOOPING)
    bench.tick(2)
    bench.run.close()
    before = bench.run.trace.sha256()
    assert bench.operator.replace(bench.bind(bench.chart)) == ["the run has ended"]
    bench.operator.pause()
    bench.tick(3)
    bench.run.tick(10**9, between=True)
    assert bench.steps == []
    assert bench.run.trace.sha256() == before
    assert bench.run.outcome is None
    assert bench.run.schedule.next_due() == bench.run.schedule.next_deadline() == 1 << 62
    assert not bench.run.schedule.wants_news()


def test_rule_11_what_was_asked_for_after_the_end_of_a_run_is_left_undone():
    bench = Bench(LOOPING)
    bench.tick()
    bench.operator.stop()
    bench.operator.preempt()
    bench.operator.pause()
    bench.tick(2)
    assert bench.run.outcome == "stopped"
    assert bench.run.carried_out.total == 1
    assert bench.base.stops == 1


NESTED = """
chart: c
outcomes: [x, y]
any:
  inner:
    any:
      deep: {do: Do, next: {done: .on, failed: .on, other: .on}}
    next: {on: .x}
  beside: {do: Do, next: {done: .y, failed: .y, other: .y}}
"""


def test_rule_12_who_waits_inside_acts_on_its_consent_though_somebody_outside_waits_too():
    bench = Bench(NESTED)
    bench.operator.lock("inner")
    bench.operator.lock("beside")
    bench.tick()
    bench.end("inner/deep", "done")
    bench.tick()
    bench.end("beside", "done")
    bench.tick()
    assert bench.operator.waiting() == {"inner/deep": "done", "beside": "done"}
    assert bench.operator.consent("inner/deep") is None
    bench.tick()
    assert bench.run.outcome == "x"


def test_rule_6_put_off_in_every_second_tick_is_no_busy_loop():
    bench = Bench(LOOPING)
    for number in range(8):
        for _ in range(2 if number else 1):  # from its last entry, and from that in this tick
            bench.end("loop/a", "done")
        bench.tick()
        assert bench.run.nodes["loop/a"].status == PUT_OFF
        bench.tick()
        assert bench.active == ["guard", "loop/a"]
    assert bench.records("note") == []


ASKING = """
chart: c
outcomes: [x]
states:
  a: {do: Do, autonomy: {done: high}, next: {done: b, failed: .x, other: .x}}
  b: {do: Do, next: {done: a, failed: .x, other: .x}}
"""


def rounds(bench: Bench, count: int = 2) -> None:
    """Let both end again and again, so that what follows is known by heart."""
    for _ in range(count):
        for path in ("a", "b"):
            bench.end(path, "done")
            bench.tick()


def test_rule_12_a_lock_holds_what_was_free_before_and_frees_it_again():
    bench = Bench(ASKING)
    bench.tick()
    rounds(bench)
    assert bench.operator.lock("a") is None
    bench.end("a", "done")
    bench.tick(2)
    assert bench.operator.waiting() == {"a": "done"}
    assert bench.operator.unlock("a") is None
    bench.tick()
    assert bench.active == ["b"]
    bench.end("b", "done")
    bench.tick()
    rounds(bench)
    assert bench.operator.waiting() == {}
    assert bench.active == ["a"]


def test_rule_12_a_level_holds_what_was_free_before_and_frees_what_waits():
    bench = Bench(ASKING)
    bench.tick()
    rounds(bench)
    assert bench.operator.set_level("high") is None
    bench.end("a", "done")
    bench.tick(2)
    assert bench.operator.waiting() == {"a": "done"}
    assert bench.operator.set_level("full") is None
    bench.tick()
    assert bench.active == ["b"]
    bench.end("b", "done")
    bench.tick()
    rounds(bench)
    assert bench.active == ["a"]


class Spilling(Action):
    """Has an output, and fails to clean up."""

    outcomes = ("done",)
    outputs = {"done": {"value": float}}

    def run(self, ctx: Context) -> Run:
        try:
            while True:
                yield
        finally:
            raise OSError("stuck")


def test_rule_11_outputs_of_a_forced_node_that_fails_to_clean_up_are_not_written():
    text = """
chart: c
outcomes: [x, wrong]
outputs: {x: {d: number}, wrong: {d: number}}
data: {d: {type: number, initial: 0}}
states:
  a: {do: Spilling, out: {value: d}, next: {done: .x, error: .wrong}}
"""
    bench = Bench(text, states=(Spilling,), scripted=False)
    bench.tick()
    assert bench.operator.force("a", "done", {"value": 1.5}) is None
    bench.tick()
    assert (bench.run.outcome, bench.run.results) == ("wrong", {"d": 0})
    assert bench.records("data") == []
