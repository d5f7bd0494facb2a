"""The numbered rules of engine/README.md; each test is named after its rule."""

from __future__ import annotations

import itertools
from enum import Enum
from typing import NamedTuple

import pytest

from engine.chart.load import load_text
from engine.machine.node import Substitute
from engine.operator.commands import Pause
from engine.run.chart_run import ChartRun
from engine.signals.board import Board
from engine.signals.signal_kinds import Derived, Measured, declare
from engine.state import Action, Context, Monitor, On, Run, Until
from tests.engine.conftest import Part

TWO_GUARDS = """
chart: c
outcomes: [x, y]
any:
  first: {watch: See, next: {seen: .x, lost: .y}}
  second: {watch: See, next: {seen: .y, lost: .x}}
  work: {do: Do, next: {done: .x, failed: .y, other: .y}}
"""

SEQUENCE = """
chart: c
outcomes: [x]
states:
  a: {do: Do, next: {done: b, failed: .x, other: a}}
  b: {do: Do, next: {done: a, failed: .x, other: .x}}
"""

NESTED = """
chart: c
outcomes: [x]
states:
  chase:
    any:
      danger: {watch: See, next: {seen: .away, lost: .away}}
      inner:
        any:
          near: {watch: See, next: {seen: .again, lost: .x}}
          drive: {do: Drive, next: {done: .again, failed: .x, other: .x}}
        next: {again: .again, x: .x}
    next: {away: escape, again: chase}
  escape:
    any:
      clear: {watch: See, next: {seen: .safe, lost: .x}}
      flee: {do: Drive, next: {done: .safe, failed: .x, other: .x}}
    next: {safe: chase}
"""


# -- rule 1: ticks and time ------------------------------------------------------------------------


def test_rule_1_durations_are_rounded_to_nanoseconds(bench):
    class Hold(Action):
        """Ends after a tenth of a second."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Run:
            yield Until(ctx.after(0.1))
            return "done"

    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Hold, next: {done: a}}\n"
    b = bench(text, states=(Hold,), scripted=False)
    b.tick(400)
    entries = [r.time for r in b.run.trace if r.kind == "enter" and r.subject == "a"]
    assert len(entries) > 300
    assert {after - before for before, after in itertools.pairwise(entries)} == {10**8}


def test_rule_1_the_same_script_gives_the_same_trace(bench):
    hashes = set()
    for _ in range(2):
        b = bench(NESTED)
        b.tick(2)
        b.end("chase/danger", "seen")
        b.tick(3)
        b.end("escape/flee", "done")
        b.tick(2)
        hashes.add(b.run.trace.sha256())
    assert len(hashes) == 1


# -- rule 2: a state is one generator --------------------------------------------------------------


def test_rule_2_until_and_on_say_when_to_be_stepped_next(bench):
    steps = []

    class Listen(Monitor):
        """Notes when it is stepped."""

        outcomes = ("seen",)
        reads = {"twice": None}

        def run(self, ctx: Context) -> Run:
            while True:
                steps.append((ctx.now, ctx.value("twice")))
                yield On("twice", until=ctx.after(0.5))

    signals = declare([Measured("one"), Derived("twice", ("one",), lambda v: 2 * v)])
    board = Board(signals)
    text = "chart: c\noutcomes: [x]\nstates:\n  a: {watch: Listen, next: {seen: .x}}\n"
    b = bench(text, states=(Listen,), scripted=False, board=board)
    b.tick(3)
    board.put("one", 4, b.now)
    b.tick(8)
    assert steps == [(0, None), (3 * 10**8, 8), (8 * 10**8, 8)]


def test_rule_2_a_run_without_yield_is_an_instant_state(bench):
    class Decide(Action):
        """Decides at once."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Run:
            return "done"

    text = """
chart: c
outcomes: [x]
states:
  a: {do: Decide, next: {done: b}}
  b: {do: Decide, next: {done: .x}}
"""
    b = bench(text, states=(Decide,), scripted=False)
    b.tick()
    assert b.run.outcome == "x"


def test_rule_2_each_entry_has_a_fresh_instance(bench):
    made = []

    class Once(Action):
        """Remembers its instances."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Run:
            made.append(self)
            yield
            return "done"

    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Once, next: {done: a}}\n"
    b = bench(text, states=(Once,), scripted=False)
    b.tick(6)
    assert len(made) == len(set(map(id, made))) == 6


# -- rule 3: phases --------------------------------------------------------------------------------


def test_rule_3_monitors_are_stepped_before_actions_and_outer_ones_first(bench):
    b = bench(NESTED)
    b.tick()
    assert b.tick() == ["chase/danger", "chase/inner/near", "chase/inner/drive"]


def test_rule_3_a_boxs_own_monitors_come_before_those_of_its_boxes(bench):
    text = """
chart: c
outcomes: [x]
any:
  box:
    any:
      inner: {watch: See, next: {seen: .x, lost: .x}}
  own: {watch: See, next: {seen: .x, lost: .x}}
"""
    b = bench(text)
    b.tick()
    assert b.tick() == ["own", "box/inner"]


def test_rule_3_no_command_follows_a_tripped_guard(bench):
    b = bench(TWO_GUARDS)
    b.tick()
    b.end("second", "seen")
    assert b.tick() == ["first", "second"]
    assert b.run.outcome == "y"


# -- rule 4: deciding ------------------------------------------------------------------------------


def test_rule_4_document_order_decides_between_equal_guards(bench):
    b = bench(TWO_GUARDS)
    b.tick()
    b.end("second", "seen")
    b.end("first", "seen")
    b.tick()
    assert b.run.outcome == "x"


def test_rule_4_losers_are_recorded_before_the_winner(bench):
    b = bench(TWO_GUARDS)
    b.tick()
    b.end("second", "seen")
    b.end("first", "seen")
    b.tick()
    assert b.last()[:4] == [
        ("outcome", "second", "seen"),
        ("exit", "second", "lost"),
        ("outcome", "first", "seen"),
        ("exit", "first", "outcome"),
    ]


def test_rule_4_priority_goes_before_document_order(bench):
    text = TWO_GUARDS.replace("second: {watch: See,", "second: {watch: See, priority: 1,")
    b = bench(text)
    b.tick()
    b.end("second", "seen")
    b.end("first", "seen")
    b.tick()
    assert b.run.outcome == "y"


def test_rule_4_the_outer_transition_wins(bench):
    b = bench(NESTED)
    b.tick()
    b.end("chase/inner/near", "lost")  # would end the whole chart, the outermost of all
    b.end("chase/danger", "seen")
    b.tick()
    assert b.run.outcome == "x"
    b = bench(
        NESTED.replace(
            "near: {watch: See, next: {seen: .again", "near: {watch: See, next: {seen: .stay"
        ).replace("next: {again: .again, x: .x}", "next: {again: .again, stay: .again, x: .x}")
    )
    b.tick()
    b.end("chase/inner/near", "seen")
    b.end("chase/danger", "seen")
    b.tick()
    assert b.active == ["escape/clear", "escape/flee"]
    assert ("exit", "chase/inner/near", "lost") in b.last()


def test_rule_4_transitions_in_other_branches_are_all_taken(bench):
    text = """
chart: c
outcomes: [x]
all:
  left:
    states:
      a: {watch: See, next: {seen: b, lost: b}}
      b: {do: Do, next: {done: .x, failed: .x, other: .x}}
  right:
    states:
      a: {watch: See, next: {seen: b, lost: b}}
      b: {do: Do, next: {done: .x, failed: .x, other: .x}}
"""
    b = bench(text)
    b.tick()
    b.end("left/a", "seen")
    b.end("right/a", "seen")
    b.tick()
    assert b.active == ["left/b", "right/b"]


def test_rule_4_monitors_entered_by_a_decision_are_stepped_at_once_and_decided_anew(bench):
    b = bench(NESTED)
    b.tick()
    b.end("chase/danger", "seen")
    b.end("escape/clear", "lost")
    assert b.tick() == ["chase/danger", "chase/inner/near", "escape/clear"]
    assert b.run.outcome == "x"


def test_rule_4_later_actions_of_a_closed_container_are_not_stepped(bench):
    text = """
chart: c
outcomes: [x]
any:
  a: {do: Do, next: {done: .x, failed: .x, other: .x}}
  b: {do: Do, next: {done: .x, failed: .x, other: .x}}
  c: {do: Do, next: {done: .x, failed: .x, other: .x}}
"""
    b = bench(text)
    b.tick()
    b.end("b", "done")
    assert b.tick() == ["a", "b"]


def test_rule_4_under_when_all_children_are_stepped_before_the_list_is_looked_at(bench):
    text = """
chart: c
outcomes: [both, one]
any:
  a: {do: Do}
  b: {do: Do}
when:
  - {outcome: both, if: {a: done, b: done}}
  - {outcome: one, if: {a: done}}
  - {outcome: one, if: {a: failed}}
  - {outcome: one, if: {a: other}}
"""
    b = bench(text)
    b.tick()
    b.end("a", "done")
    b.end("b", "done")
    assert b.tick() == ["a", "b"]
    assert b.run.outcome == "both"


def test_rule_4_monitors_under_when_are_kept_and_the_list_decides(bench):
    text = """
chart: c
outcomes: [both, rest]
any:
  a: {watch: See}
  b: {watch: See}
when:
  - {outcome: both, if: {a: seen, b: seen}}
  - {outcome: rest, if: {a: lost}}
  - {outcome: rest, if: {b: lost}}
"""
    b = bench(text)
    b.tick()
    b.end("a", "seen")
    b.tick()
    assert b.run.outcome is None
    b.end("b", "seen")
    b.tick()
    assert b.run.outcome == "both"


def test_rule_4_all_alone_waits_for_every_child(bench):
    text = """
chart: c
outcomes: [done]
all:
  a: {do: Do}
  b: {watch: See}
"""
    b = bench(text)
    b.tick()
    b.end("a", "failed")
    b.tick()
    assert b.active == ["b"]
    b.end("b", "lost")
    b.tick()
    assert b.run.outcome == "done"


def test_rule_4_an_error_comes_before_the_list(bench):
    text = """
chart: c
outcomes: [x]
any:
  a: {do: Do}
  b: {do: Do}
when: [{outcome: x, if: {b: done}}]
"""
    b = bench(text)
    b.tick()
    b.end("a", RuntimeError("broken"))
    b.end("b", "done")
    b.tick()
    assert b.run.outcome == "error"


# -- rule 5: timeouts ------------------------------------------------------------------------------

TIMED = """
chart: c
outcomes: [x, late, seen]
states:
  box:
    any:
      guard: {watch: See, next: {seen: .seen, lost: .seen}}
      follow:
        any:
          inner: {watch: See, next: {seen: .round, lost: .round}}
          work: {do: Do, next: {done: .round, failed: .round, other: .round}}
        next: {round: .round}
    timeout: 200 ms
    next: {timeout: after, seen: .seen, round: after}
  after: {do: Do, next: {done: .x, failed: .x, other: .x}}
"""


def test_rule_5_in_the_due_tick_monitors_are_stepped_and_actions_are_not(bench):
    b = bench(TIMED)
    b.tick(2)
    assert b.tick() == ["box/guard", "box/follow/inner", "after"]
    assert ("move", "", "box", "timeout", "after") in b.last()


def test_rule_5_a_guard_that_ends_the_due_node_wins(bench):
    b = bench(TIMED)
    b.tick(2)
    b.end("box/guard", "seen")
    b.tick()
    assert b.run.outcome == "seen"


def test_rule_5_a_guard_that_hands_over_inside_the_due_node_loses(bench):
    text = """
chart: c
outcomes: [x]
states:
  box:
    states:
      inner:
        any:
          guard: {watch: See, next: {seen: .on, lost: .on}}
        next: {on: next}
      next: {do: Do, next: {done: .x, failed: .x, other: .x}}
    timeout: 200 ms
    next: {timeout: after}
  after: {do: Do, next: {done: .x, failed: .x, other: .x}}
"""
    b = bench(text)
    b.tick(2)
    b.end("box/inner/guard", "seen")
    b.tick()
    assert b.active == ["after"]
    assert ("exit", "box/inner/guard", "lost") in b.last()
    assert ("exit", "box", "timeout") in b.last()


def test_rule_5_the_outer_timeout_goes_first(bench):
    text = """
chart: c
outcomes: [x]
states:
  outer:
    states:
      inner: {do: Do, timeout: 200 ms, next: {timeout: inner, done: .x, failed: .x, other: .x}}
    timeout: 200 ms
    next: {timeout: .x}
"""
    b = bench(text)
    b.tick(3)
    assert b.run.outcome == "x"
    assert ("outcome", "outer/inner", "timeout") not in b.records()


def test_rule_5_the_timeout_spans_all_tries_and_a_waiting_node_can_be_due(bench):
    text = """
chart: c
outcomes: [x]
states:
  a:
    do: Do
    retry: {times: 9, on: failed, wait: 1 s}
    timeout: 300 ms
    next: {timeout: .x, done: .x, failed: .x, other: .x}
"""
    b = bench(text)
    b.tick()
    b.end("a", "failed")
    b.tick()
    assert b.active == []
    b.tick(2)
    assert b.run.outcome == "x"
    assert ("outcome", "a", "timeout") in b.last()


def test_rule_5_the_outer_of_two_timeouts_in_different_branches_goes_first(bench):
    text = """
chart: c
outcomes: [x, y]
any:
  left:
    states:
      deep: {do: Do, timeout: 200 ms, next: {timeout: .on, done: .on, failed: .on, other: .on}}
    next: {on: .y}
  right: {do: Do, timeout: 200 ms, next: {timeout: .x, done: .x, failed: .x, other: .x}}
"""
    b = bench(text)
    b.tick(3)
    assert b.run.outcome == "x"


# -- rule 6: transitions ---------------------------------------------------------------------------


def test_rule_6_what_the_monitor_phase_chooses_acts_in_the_same_tick(bench):
    b = bench(NESTED)
    b.tick()
    b.end("chase/danger", "seen")
    assert b.tick() == ["chase/danger", "chase/inner/near", "escape/clear", "escape/flee"]


def test_rule_6_what_the_action_pass_chooses_starts_in_place(bench):
    text = """
chart: c
outcomes: [x]
all:
  left:
    states:
      a: {do: Do, next: {done: box, failed: .x, other: .x}}
      box:
        any:
          work: {do: Do, next: {done: .x, failed: .x, other: .x}}
          guard: {watch: See, next: {seen: .x, lost: .x}}
  right: {do: Do, next: {failed: .x}}
"""
    b = bench(text)
    b.tick()
    b.end("left/a", "done")
    assert b.tick() == ["left/a", "left/box/guard", "left/box/work", "right"]


def test_rule_6_a_node_already_entered_in_this_tick_is_put_off(bench):
    b = bench(SEQUENCE)
    b.end("a", "done")
    b.end("b", "done")
    b.tick()
    assert b.active == []
    assert b.tick() == ["a"]
    assert b.active == ["a"]


def test_rule_6_a_chosen_monitor_that_was_put_off_joins_the_next_monitor_phase(bench):
    text = """
chart: c
outcomes: [x]
states:
  a: {watch: See, next: {seen: a, lost: .x}}
"""
    b = bench(text)
    b.end("a", "seen")
    b.end("a", "lost")
    b.tick()
    assert b.run.outcome is None
    b.tick()
    assert b.run.outcome == "x"


def test_rule_6_being_put_off_for_ever_is_called_a_busy_loop(bench):
    b = bench(
        "chart: c\noutcomes: [x]\nstates:\n  a: {do: Do, next: {done: a, failed: .x, other: .x}}\n"
    )
    for _ in range(6):
        b.end("a", "done")
    b.tick(3)
    assert b.records("note") == []
    b.tick(3)
    assert ("note", "a", "busy-loop") in b.records("note")


def test_rule_6_a_leaf_is_stepped_once_in_the_tick_it_is_entered(bench):
    b = bench(SEQUENCE)
    b.tick()
    b.end("a", "done")
    assert b.tick() == ["a", "b"]


# -- rule 7: leaving -------------------------------------------------------------------------------


def test_rule_7_closed_in_reverse_order_of_start_exactly_once(bench):
    b = bench(NESTED)
    b.tick()
    b.end("chase/danger", "seen")
    b.tick()
    assert b.last("exit") == [
        ("exit", "chase/danger", "outcome"),
        ("exit", "chase/inner/drive", "preempted"),
        ("exit", "chase/inner/near", "preempted"),
        ("exit", "chase/inner", "preempted"),
        ("exit", "chase", "outcome"),
    ]


def test_rule_7_a_node_never_stepped_has_neither_enter_nor_exit(bench):
    b = bench(TWO_GUARDS)
    b.end("first", "seen")
    b.tick()
    assert b.run.outcome == "x"
    assert not [r for r in b.records("enter", "exit") if r[1] == "work"]


def test_rule_7_a_container_is_entered_with_the_first_step_of_its_first_leaf(bench):
    b = bench(NESTED)
    b.tick()
    assert [r[1] for r in b.records("enter")] == [
        "", "chase", "chase/danger", "chase/inner", "chase/inner/near", "chase/inner/drive",
    ]  # fmt: skip


class Untidy(Action):
    """Fails when it cleans up."""

    outcomes = ("done", "failed", "other")

    def run(self, ctx: Context) -> Run:
        try:
            while True:
                yield
        finally:
            raise RuntimeError("clean-up")


class Clingy(Action):
    """Yields when it should clean up."""

    outcomes = ("done", "failed", "other")

    def run(self, ctx: Context) -> Run:
        try:
            while True:
                yield
        finally:
            yield


@pytest.mark.parametrize("cls", [Untidy, Clingy])
def test_rule_7_a_clean_up_that_fails_does_not_keep_the_others_from_theirs(bench, cls):
    closed = []

    class Tidy(Action):
        """Notes its clean-up."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Run:
            try:
                while True:
                    yield
            finally:
                closed.append(self)

    class Once(Monitor):
        """Trips in the second tick."""

        outcomes = ("seen",)

        def run(self, ctx: Context) -> Run:
            yield
            return "seen"

    text = f"""
chart: c
outcomes: [x]
any:
  guard: {{watch: Once, next: {{seen: .x}}}}
  tidy: {{do: Tidy, next: {{done: .x}}}}
  bad: {{do: {cls.__name__}, next: {{done: .x, failed: .x, other: .x}}}}
"""
    b = bench(text, states=(Tidy, Once, cls), scripted=False)
    b.tick(2)
    assert b.run.outcome == "x"
    assert len(closed) == 1
    assert ("error", "bad", "RuntimeError") in b.records("error")


def test_rule_7_a_leaf_whose_clean_up_fails_at_its_own_timeout_ends_with_error(bench):
    text = """
chart: c
outcomes: [x, late]
states:
  a:
    do: Untidy
    timeout: 100 ms
    next: {timeout: .late, done: .x, failed: .x, other: .x, error: .x}
"""
    b = bench(text, states=(Untidy,), scripted=False)
    b.tick(2)
    assert b.run.outcome == "x"


def test_rule_7_a_leaf_that_raises_while_returning_ends_with_error(bench):
    class Tail(Action):
        """Returns, and fails on the way out."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Run:
            try:
                yield
                return "done"
            finally:
                raise RuntimeError("late")

    text = "chart: c\noutcomes: [x, y]\nstates:\n  a: {do: Tail, next: {done: .x, error: .y}}\n"
    b = bench(text, states=(Tail,), scripted=False)
    b.tick(2)
    assert b.run.outcome == "y"


def test_rule_7_a_part_stands_still_before_another_state_commands_it(bench):
    b = bench(NESTED)
    b.tick()
    stops = b.base.stops
    b.end("chase/danger", "seen")
    b.tick()
    assert b.base.stops == stops + 1


def test_rule_7_a_part_stands_still_before_the_same_state_starts_anew_on_it(bench):
    b = bench(NESTED)
    b.tick()
    stops = b.base.stops
    b.end("chase/inner/drive", "done")
    b.tick(2)
    assert b.records("enter").count(("enter", "chase/inner/drive")) == 2
    assert b.base.stops == stops + 1


# -- rule 8: errors --------------------------------------------------------------------------------


def test_rule_8_an_unmapped_error_bubbles_up_and_the_robot_is_held(bench):
    b = bench(NESTED)
    b.tick()
    stops = b.base.stops
    b.end("chase/inner/drive", RuntimeError("broken"))
    b.tick()
    assert b.run.outcome == "error"
    assert b.base.stops > stops
    assert list(b.last("error")) == [("error", "chase/inner/drive", "RuntimeError")]


@pytest.mark.parametrize("command", ["stop", "pause"])
def test_rule_8_a_part_that_cannot_stop_does_not_keep_the_others_from_it(bench, command):
    class Broken:
        """Cannot stop."""

        def stop(self) -> None:
            raise OSError("no connection")

    sound = Part()
    b = bench(NESTED, parts={"lamp": Broken(), "arm": sound})
    b.tick()
    getattr(b.operator, command)()
    b.tick()
    assert sound.stops == 1
    assert b.last("error") == [("error", "", "OSError")]
    assert b.run.notes[""] == "OSError: no connection"


def test_rule_8_a_part_that_cannot_stop_is_an_error_of_what_would_start_on_it(bench):
    class Broken:
        """Cannot stop."""

        def stop(self) -> None:
            raise OSError("no connection")

    b = bench(NESTED, parts={"base": Broken()})
    b.tick()
    assert b.run.outcome == "error"
    assert b.records("error")[0] == ("error", "chase/inner/drive", "OSError")


def test_rule_8_a_mapped_error_is_an_outcome(bench):
    b = bench(SEQUENCE.replace("other: a}", "other: a, error: b}"))
    b.tick()
    b.end("a", RuntimeError("broken"))
    b.tick()
    assert b.active == ["b"]


def test_rule_8_an_undeclared_outcome_is_an_error(bench):
    class Liar(Action):
        """Returns what it does not declare."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Run:
            yield
            return "finished"

    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Liar, next: {done: .x}}\n"
    b = bench(text, states=(Liar,), scripted=False)
    b.tick(2)
    assert b.run.outcome == "error"
    assert b.records("error") == [("error", "a", "UndeclaredOutcome")]


class Unprintable(Exception):
    """Cannot be written out."""

    def __str__(self) -> str:
        raise ValueError("no text")

    __repr__ = __str__


ODD_YIELDS = {
    "a number": (lambda: 5, "TypeError"),
    "a signal nobody declared": (lambda: On("nowhere"), "LookupError"),
    "what is no name": (lambda: On(["user.pose"]), "TypeError"),
    "no instant": (lambda: Until(None), "TypeError"),
}


@pytest.mark.parametrize("odd", ODD_YIELDS)
@pytest.mark.parametrize("first", [True, False], ids=["at once", "later"])
@pytest.mark.parametrize("kind", [Action, Monitor])
def test_rule_8_a_yield_that_means_nothing_is_an_error_at_once(bench, odd, first, kind):
    make, error = ODD_YIELDS[odd]
    closed = []

    class Odd(kind):
        """Yields something odd."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Run:
            try:
                if not first:
                    yield
                yield make()
                yield
            finally:
                closed.append(self)
            return "done"

    form = "watch" if kind is Monitor else "do"
    text = f"chart: c\noutcomes: [x]\nstates:\n  a: {{{form}: Odd, next: {{done: .x}}}}\n"
    b = bench(text, states=(Odd,), scripted=False)
    b.tick(1 if first else 2)
    assert b.run.outcome == "error"
    assert b.records("error") == [("error", "a", error)]
    assert len(closed) == 1


ODD_ENDS = {
    "nothing": None,
    "three things": ("done", {}, {}),
    "a list of outputs": ("done", ["value"]),
    "a number of outputs": ("done", 5),
    "other outputs": ("done", {"other": 1.0}),
    "no outputs": "done",
    "outputs where there are none": ("failed", {"value": 1.0}),
    "something that cannot be printed": Unprintable(),
    "what cannot be frozen": ("done", {"value": []}),
}


@pytest.mark.parametrize("odd", ODD_ENDS)
@pytest.mark.parametrize("instant", [True, False], ids=["instant", "with steps"])
def test_rule_8_a_result_of_the_wrong_shape_is_an_error(bench, odd, instant):
    class Odd(Action):
        """Ends with something odd."""

        outcomes = ("done", "failed")
        outputs = {"done": {"value": float}}

        if instant:

            def run(self, ctx: Context) -> Run:
                return ODD_ENDS[odd]
        else:

            def run(self, ctx: Context) -> Run:
                yield
                return ODD_ENDS[odd]

    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Odd, next: {done: .x, failed: .x}}\n"
    b = bench(text, states=(Odd,), scripted=False)
    b.tick(2)
    assert b.run.outcome == "error"
    assert len(b.records("error")) == 1


def test_rule_8_an_error_that_cannot_be_printed_is_an_error_like_any_other(bench):
    b = bench(SEQUENCE)
    b.end("a", Unprintable())
    b.tick()
    assert b.run.outcome == "error"
    assert b.run.notes == {"a": "Unprintable"}


@pytest.mark.parametrize("where", ["__init__", "run", "a step"])
def test_rule_8_a_stray_stop_iteration_is_no_outcome(bench, where):
    class Stray(Action):
        """Raises what only a generator's end should."""

        outcomes = ("done",)

        def __init__(self) -> None:
            if where == "__init__":
                raise StopIteration("done")

        if where == "a step":

            def run(self, ctx: Context) -> Run:
                yield
                raise StopIteration("done")
        else:

            def run(self, ctx: Context) -> Run:
                raise StopIteration("done")

    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Stray, next: {done: .x}}\n"
    b = bench(text, states=(Stray,), scripted=False)
    b.tick(2)
    assert b.run.outcome == "error"
    assert b.records("error") == [("error", "a", "RuntimeError")]


def test_rule_8_nothing_is_retried_silently(bench):
    b = bench(SEQUENCE.replace("other: a}", "other: a, error: .x}"))
    b.tick()
    b.end("a", RuntimeError("broken"))
    b.tick()
    assert b.run.outcome == "x"
    assert b.records("enter").count(("enter", "a")) == 1


# -- rule 9: data ----------------------------------------------------------------------------------

DATA = """
chart: c
outcomes: [x]
outputs: {x: {goal: number}}
data: {goal: {type: number, initial: 0}}
states:
  give: {do: Give, out: {value: goal}, next: {done: use, failed: use, other: give}}
  use: {do: Use, in: {value: goal}, next: {done: .x, failed: give, other: .x}}
"""


def test_rule_9_outputs_appear_at_the_transition_and_inputs_are_read_at_entry(bench):
    b = bench(DATA)
    b.tick()
    b.end("give", "done", value=4.0)
    b.tick()
    assert b.script.inputs["use"] == {"value": 4.0}
    b.end("use", "done")
    b.tick()
    assert b.run.results == {"goal": 4.0}


def test_rule_9_outputs_of_losers_timeouts_and_failed_tries_are_dropped(bench):
    text = """
chart: c
outcomes: [x]
data: {goal: {type: number, initial: 0}}
states:
  both:
    any:
      one: {watch: See, next: {seen: .on, lost: .on}}
      two: {watch: Tell, out: {value: goal}, next: {seen: .on, lost: .on}}
    next: {on: use}
  use: {do: Use, in: {value: goal}, next: {done: .x, failed: .x, other: .x}}
"""
    b = bench(text)
    b.tick()
    b.end("both/two", "seen", value=9.0)
    b.end("both/one", "seen")
    b.tick()
    assert b.script.inputs["use"] == {"value": 0}


def test_rule_9_under_all_the_outputs_of_all_children_appear_when_it_ends(bench):
    text = """
chart: c
outcomes: [x]
outputs: {x: {a: number, b: number}}
data: {a: {type: number, initial: 0}, b: {type: number, initial: 0}}
states:
  both:
    all:
      one: {do: Give, out: {value: a}}
      two: {watch: Tell, out: {value: b}}
    next: {done: .x}
"""
    b = bench(text)
    b.tick()
    b.end("both/one", "done", value=1.0)
    b.tick()
    assert not b.records("data")
    b.end("both/two", "seen", value=2.0)
    b.tick()
    assert b.run.results == {"a": 1.0, "b": 2.0}


def test_rule_9_what_others_could_change_is_refused(bench):
    b = bench(DATA)
    b.tick()
    b.end("give", "done", value=[1, 2])
    b.tick()
    assert b.run.outcome == "error"
    assert b.records("error") == [("error", "give", "TypeError")]


class Grid:
    """A field of numbers, as an array is: whoever has it can change it."""

    def __init__(self, *numbers: float) -> None:
        self.numbers = list(numbers)


class FrozenGrid(Grid):
    """The same, which nobody can change."""


class Level(Enum):
    """A value of a fixed set."""

    LOW = 1


class Reading(NamedTuple):
    """A tuple with names."""

    grid: Grid
    level: Level


class Tenth(float):
    """A number of another library."""


class GiveAny(Action):
    """An action with an output of any type."""

    outcomes = ("done", "failed", "other")
    outputs = {"done": {"value": object}}

    def run(self, ctx):
        yield
        return "done", {"value": None}


def test_rule_9_freezers_reach_into_tuples_and_what_cannot_change_passes(bench):
    text = DATA.replace("do: Give", "do: GiveAny")
    freezers = {Grid: lambda grid: FrozenGrid(*grid.numbers)}
    b = bench(text, states=(GiveAny,), freezers=freezers)
    b.tick()
    given = (Grid(1.0), (Tenth(0.1), Level.LOW, True, b"", None), Reading(Grid(), Level.LOW))
    b.end("give", "done", value=given)
    b.tick()
    grid, others, reading = b.script.inputs["use"]["value"]
    assert type(grid) is type(reading.grid) is FrozenGrid
    assert others is given[1]
    assert reading.level is Level.LOW


def test_rule_9_what_can_be_changed_is_refused_inside_a_tuple_too(bench):
    b = bench(DATA)
    b.tick()
    b.end("give", "done", value=(1.0, (2.0, [3.0])))
    b.tick()
    assert b.records("error") == [("error", "give", "TypeError")]


USED = """
chart: outer
outcomes: [x]
outputs: {x: {result: number}}
data: {result: {type: number, initial: 7}}
states:
  sub: {use: inner, in: {start: result}, out: {answer: result}, next: {ok: .x}}
---
chart: inner
inputs: {start: number}
outcomes: [ok]
outputs: {ok: {answer: number}}
data: {answer: {type: number, initial: 0}, result: {type: number, initial: 3}}
states:
  use: {do: Use, in: {value: start}, next: {done: give, failed: give, other: give}}
  give: {do: Give, out: {value: answer}, next: {done: .ok, failed: .ok, other: use}}
"""


def test_rule_9_a_used_chart_has_data_of_its_own(bench):
    b = bench(USED)
    b.tick()
    assert b.script.inputs["sub/use"] == {"value": 7}
    b.end("sub/use", "done")
    b.end("sub/give", "done", value=5.0)
    b.tick()
    assert b.run.results == {"result": 5.0}
    assert b.run.value_of("result", "sub") == 3


# -- rule 11: the operator -------------------------------------------------------------------------


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


def test_rule_11_a_running_chart_is_replaced_without_a_break(bench):
    b = bench(SEQUENCE)
    b.tick(2)
    started = b.records("enter")
    new = load_text(
        SEQUENCE.replace("a: {do: Do, next: {done: b,", "a: {do: Do, next: {done: c,")
        + "  c: {do: Do, next: {done: .x, failed: .x, other: .x}}\n"
    )
    machine = b.bind(next(iter(new.values())))
    generator = b.run.nodes["a"].generator
    assert b.operator.replace(machine) == []
    b.tick()
    assert b.records("enter") == started
    assert b.run.nodes["a"].generator is generator
    b.end("a", "done")
    b.tick()
    assert ("move", "", "a", "done", "c") in b.last()


def test_rule_11_a_replacement_that_changes_what_runs_is_refused(bench):
    b = bench(SEQUENCE)
    b.tick()
    gone = load_text(
        SEQUENCE.replace("  a: {do: Do,", "  z: {do: Do,")
        .replace("other: a", "other: z")
        .replace("done: a", "done: z")
    )
    other = load_text(SEQUENCE.replace("a: {do: Do,", "a: {do: Drive,"))
    for library in (gone, other):
        refused = b.operator.replace(b.bind(next(iter(library.values()))))
        assert refused
        assert "'a'" in refused[0]


def test_rule_11_a_replacement_that_commands_a_part_which_is_missing_is_refused(bench):
    b = bench(SEQUENCE, parts={})
    b.tick()
    assert replaced(b, SEQUENCE.replace("b: {do: Do,", "b: {do: Drive,"))[0] == [
        "'b' commands 'base', which this run does not have"
    ]


def test_rule_11_new_children_of_an_active_any_are_entered_next_tick(bench):
    b = bench(TWO_GUARDS)
    b.tick()
    new = load_text(TWO_GUARDS + "  more: {do: Do, next: {done: .x, failed: .x, other: .x}}\n")
    assert b.operator.replace(b.bind(next(iter(new.values())))) == []
    b.tick()
    assert "more" in b.active


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


def test_rule_12_on_its_way_through_three_locked_containers_an_outcome_asks_once(bench):
    b = bench(NESTED)
    b.tick()
    for path in ("chase/inner/drive", "chase/inner", "chase"):
        assert b.operator.lock(path) is None
    b.end("chase/inner/drive", "done")
    b.tick()
    assert b.operator.waiting() == {"chase/inner/drive": "done"}
    assert b.operator.consent("chase/inner/drive") is None
    b.tick()
    moves = [record[1:] for record in b.last("move")]
    assert moves == [("", "chase", "again", "chase")]
    asked = [record for record in b.records("note") if "asks" in record[2]]
    assert len(asked) == 1


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


def replaced(b, text):
    """Ask for the replacement of the bench's chart by `text`; why not, and the machine."""
    machine = b.bind(next(iter(load_text(text).values())))
    return b.operator.replace(machine), machine


def test_rule_11_a_chart_can_be_replaced_before_its_first_tick_but_not_after_its_end(bench):
    b = bench(SEQUENCE)
    assert replaced(b, NESTED)[0] == []
    b.tick()
    assert b.active == ["chase/danger", "chase/inner/near", "chase/inner/drive"]
    b.operator.stop()
    b.tick()
    assert replaced(b, NESTED)[0] == ["the run has ended"]


def test_rule_11_nothing_is_replaced_while_something_is_chosen_and_not_yet_begun(bench):
    b = bench(SEQUENCE)
    b.tick()
    b.operator.pause()
    b.operator.force("a", "done")
    b.tick()
    assert replaced(b, SEQUENCE)[0] == ["'b' waits; replace when it has gone on"]


def test_rule_11_rules_that_are_replaced_are_looked_at(bench):
    text = """
chart: c
outcomes: [x, y]
any:
  a: {do: Do}
  b: {do: Do}
when:
  - {outcome: x, if: {b: done}}
"""
    b = bench(text)
    b.tick()
    b.end("a", "done")
    b.tick()
    assert replaced(b, text + "  - {outcome: y, if: {a: done}}\n")[0] == []
    b.tick()
    assert b.run.outcome == "y"


def test_rule_11_kept_outcomes_and_their_outputs_live_through_a_replacement(bench):
    text = """
chart: c
outcomes: [x]
outputs: {x: {a: number}}
data: {a: {type: number, initial: 0}, b: {type: number, initial: 0}}
states:
  both:
    all:
      one: {do: Give, out: {value: a}}
      two: {watch: Tell, out: {value: b}}
    next: {done: .x}
"""
    b = bench(text)
    b.tick()
    b.end("both/one", "done", value=1.0)
    b.tick()
    more = text.replace("    next: {done", "      three: {do: Do}\n    next: {done")
    assert replaced(b, more)[0] == []
    b.tick()
    assert b.active == ["both/two", "both/three"]
    b.end("both/two", "seen", value=2.0)
    b.tick()
    assert b.run.results == {"a": 1.0}


def test_rule_11_what_has_ended_inside_a_box_stays_so_through_a_replacement(bench):
    text = """
chart: c
outcomes: [x]
any:
  first:
    any:
      a: {do: Do}
    when: [{outcome: on, if: {a: done}}]
  second: {do: Do}
when: [{outcome: x, if: {first: on, second: done}}]
"""
    b = bench(text)
    b.tick()
    b.end("first/a", "done")
    b.tick()
    assert replaced(b, text.replace("a: {do: Do}", "a: {do: Do}\n      b: {do: Do}"))[0] == []
    b.tick()
    assert b.active == ["second"]
    b.end("second", "done")
    b.tick()
    assert b.run.outcome == "x"


def test_rule_11_data_whose_type_has_changed_is_not_carried_over(bench):
    b = bench(DATA)
    b.tick()
    refused, _ = replaced(b, DATA.replace("{type: number, initial: 0}", "{type: text, initial: a}"))
    assert refused == ["'goal' of 'c' is a number and would be a text"]


ALONE = """
chart: c
outcomes: [x]
states:
  a: {do: Do, retry: {times: 3, on: other}, next: {done: .x, failed: .x, other: .x}}
"""
LIMITED = ALONE.replace("do: Do,", "do: Do, timeout: 1 s,").replace(
    "next: {", "next: {timeout: .x, "
)


@pytest.mark.parametrize("old", [ALONE, LIMITED])
def test_rule_11_a_timeout_that_is_replaced_counts_from_the_entry_in_chart_time(bench, old):
    b = bench(old)
    b.tick()
    b.end("a", "other")
    b.tick(2)  # the second try
    b.operator.pause()
    b.tick(10)
    b.operator.resume()
    b.tick()
    refused, _ = replaced(b, LIMITED.replace("1 s", "1.5 s"))
    assert refused == []
    b.tick()
    assert b.run.nodes["a"].deadline == 1_500_000_000
    assert b.run.board.chart_now == 4 * 10**8


# -- rule 12: autonomy -----------------------------------------------------------------------------

ASKING = """
chart: c
outcomes: [x, gone]
any:
  guard: {watch: See, next: {seen: .gone, lost: .gone}}
  work:
    do: Do
    autonomy: {done: high}
    next: {done: .x, failed: .x, other: .x}
  beside: {do: Do, next: {done: .x, failed: .x, other: .x}}
"""


def test_rule_12_an_outcome_is_taken_at_once_iff_it_requires_less_than_the_level(bench):
    for level, waits in ((None, False), (3, False), (2, True), (0, True)):
        b = bench(ASKING, level=level)
        b.tick()
        b.end("work", "done")
        b.tick()
        assert (b.run.outcome is None) == waits


def test_rule_12_while_an_outcome_waits_guards_are_stepped_and_other_actions_are_not(bench):
    b = bench(ASKING, level=2)
    b.tick()
    b.end("work", "done")
    assert b.tick() == ["guard", "work"]
    assert b.tick() == ["guard"]
    b.end("guard", "seen")
    b.tick()
    assert b.run.outcome == "gone"


def test_rule_12_consent_acts_at_the_nodes_place_so_a_guard_wins(bench):
    b = bench(ASKING, level=2)
    b.tick()
    b.end("work", "done")
    b.tick()
    assert b.operator.consent("work") is None
    b.end("guard", "seen")
    b.tick()
    assert b.run.outcome == "gone"
    b = bench(ASKING, level=2)
    b.tick()
    b.end("work", "done")
    b.tick()
    b.operator.consent("work")
    b.tick()
    assert b.run.outcome == "x"


def test_rule_12_refusal_is_a_further_try(bench):
    b = bench(ASKING, level=2)
    b.tick()
    b.end("work", "done")
    b.tick()
    b.operator.refuse("work")
    b.tick(2)
    assert b.records("enter").count(("enter", "work")) == 2
    assert b.tick() == ["guard", "work", "beside"]


def test_rule_12_a_refusal_does_not_count_as_one_of_the_tries(bench):
    node = "{do: Do, autonomy: {done: high}, retry: {times: 1, on: failed}"
    ways = "{done: .x, failed: .x, other: .x}"
    text = f"chart: c\noutcomes: [x]\nstates:\n  a: {node}, next: {ways}}}\n"
    b = bench(text, level=2)
    b.tick()
    for _ in range(3):
        b.end("a", "done")
        b.tick()
        b.operator.refuse("a")
        b.tick(2)
    b.end("a", "failed")
    b.tick(2)
    assert b.run.outcome is None  # the one further try
    b.end("a", "failed")
    b.tick()
    assert b.run.outcome == "x"


def test_rule_12_a_lock_on_a_path_holds_none_whose_name_only_begins_alike(bench):
    text = """
chart: c
outcomes: [x]
states:
  a:
    all:
      b: {do: Do}
      bc: {do: Do}
    next: {done: .x}
"""
    b = bench(text)
    b.tick()
    assert b.operator.lock("a/b") is None
    b.end("a/bc", "done")
    b.end("a/b", "done")
    b.tick(2)
    assert b.operator.waiting() == {"a/b": "done"}


def test_rule_12_retry_comes_before_autonomy(bench):
    text = ASKING.replace(
        "autonomy: {done: high}", "autonomy: {failed: high}\n    retry: {times: 1, on: failed}"
    )
    b = bench(text, level=2)
    b.tick()
    b.end("work", "failed")
    b.tick()
    assert b.operator.waiting() == {}
    b.end("work", "failed")
    b.tick()
    assert b.operator.waiting() == {"work": "failed"}


def test_rule_12_what_follows_in_another_branch_of_the_any_waits_too(bench):
    text = """
chart: c
outcomes: [x]
any:
  work: {do: Do, autonomy: {done: high}, next: {done: .x, failed: .x, other: .x}}
  beside:
    states:
      a: {do: Do, timeout: 200 ms, next: {timeout: b, done: b, failed: .x, other: .x}}
      b: {do: Do, timeout: 200 ms, next: {timeout: a, done: a, failed: .x, other: .x}}
"""
    b = bench(text, level=2)
    b.tick()
    b.end("work", "done")
    b.tick()
    assert b.tick(4) == []
    assert b.active == []  # a is over by its timeout, b has not begun
    b.operator.refuse("work")
    b.tick()
    assert b.tick() == ["work", "beside/b"]


def test_rule_12_what_was_chosen_together_with_a_node_that_waits_does_not_begin(bench):
    text = """
chart: c
outcomes: [x]
states:
  first: {do: Do, next: {done: both, failed: .x, other: .x}}
  both:
    any:
      one: {do: Do, autonomy: {done: high}, next: {done: .x, failed: .x, other: .x}}
      two: {do: Do, next: {done: .x, failed: .x, other: .x}}
"""
    b = bench(text, level=2)
    b.tick()
    b.end("first", "done")
    b.end("both/one", "done")
    assert b.tick() == ["first", "both/one"]
    assert b.tick() == []


def test_rule_12_each_of_two_that_wait_in_one_any_can_be_let_go(bench):
    text = """
chart: c
outcomes: [x, y]
any:
  one: {use: helper, autonomy: {ok: high}, next: {ok: .x}}
  two: {use: helper, autonomy: {ok: high}, next: {ok: .y}}
---
chart: helper
outcomes: [ok]
any:
  guard: {watch: See, next: {seen: .ok, lost: .ok}}
  work: {do: Do, next: {done: .ok, failed: .ok, other: .ok}}
"""
    for path, outcome in (("one", "x"), ("two", "y")):
        b = bench(text, level=2)
        b.tick()
        b.end("one/guard", "seen")
        b.tick()
        b.end("two/guard", "seen")
        b.tick()
        assert set(b.operator.waiting()) == {"one", "two"}
        b.operator.consent(path)
        b.tick()
        assert b.run.outcome == outcome
    b = bench(text, level=2)
    b.tick()
    b.end("one/guard", "seen")
    b.end("two/guard", "seen")
    b.tick()
    b.operator.refuse("one")
    assert b.tick(3) == []  # its further try waits for the other one
    b.operator.refuse("two")
    b.tick()
    assert b.tick() == ["one/guard", "one/work", "two/guard", "two/work"]


def test_rule_12_timeouts_beside_a_node_that_waits_run_also_where_outcomes_are_kept(bench):
    text = """
chart: c
outcomes: [x, y]
any:
  work: {do: Do, autonomy: {done: high}, next: {done: .x, failed: .x, other: .x}}
  beside:
    any:
      slow: {do: Do, timeout: 300 ms}
    when:
      - {outcome: late, if: {slow: timeout}}
    next: {late: .y}
"""
    b = bench(text, level=2)
    b.tick()
    b.end("work", "done")
    b.tick(3)
    assert b.run.outcome == "y"


def test_rule_12_each_entry_of_a_container_has_all_the_tries_of_what_is_in_it(bench):
    text = """
chart: c
outcomes: [x]
states:
  outer:
    states:
      sub: {use: helper, retry: {times: 1, on: bad}, next: {ok: .again, bad: .again}}
    next: {again: between}
  between: {do: Do, next: {done: outer, failed: .x, other: .x}}
---
chart: helper
outcomes: [ok, bad]
states:
  work: {do: Do, retry: {times: 1, on: other}, next: {done: .ok, failed: .bad, other: .bad}}
"""
    b = bench(text)
    b.tick()
    for _ in range(2):
        for _ in range(2):
            b.end("outer/sub/work", "other")
            b.end("outer/sub/work", "failed")
            b.tick(4)
        assert b.active == ["between"]
        b.end("between", "done")
        b.tick(2)
    assert b.records("enter").count(("enter", "outer/sub")) == 5
    assert b.records("enter").count(("enter", "outer/sub/work")) == 9


def test_rule_12_what_waits_waits_no_longer_once_its_container_is_closed(bench):
    text = """
chart: c
outcomes: [x]
states:
  one:
    any:
      guard: {watch: See, next: {seen: .on, lost: .on}}
      follow:
        states:
          look: {watch: See, autonomy: {seen: high}, next: {seen: .x, lost: .x}}
        next: {x: .x}
    next: {on: two, x: .x}
  two: {do: Do, next: {done: .x, failed: .x, other: one}}
"""
    b = bench(text, level=2)
    b.tick()
    b.end("one/follow/look", "seen")
    b.tick()
    assert b.operator.waiting() == {"one/follow/look": "seen"}
    b.end("one/guard", "seen")
    b.tick()
    assert b.operator.waiting() == {}
    assert "not active" in b.operator.force("one/follow/look", "seen")
    assert b.operator.replace(b.bind(b.chart)) == []


class Listen(Action):
    """Notes what it hears."""

    outcomes = ("done",)
    reads = {"voice": None}
    heard: list = []

    def run(self, ctx: Context) -> Run:
        while True:
            self.heard.append((ctx.now, ctx.value("voice")))
            yield On("voice")


def listening(bench, **given):
    """A chart of which `listen` waits for samples; the tick after it has begun to."""
    Listen.heard.clear()
    board = Board(declare([Measured("voice"), Measured("other")]))
    text = """
chart: c
outcomes: [x]
any:
  work: {do: Give, autonomy: {failed: high}, next: {done: .x, failed: .x, other: .x}}
  listen: {do: Listen, next: {done: .x}}
"""
    b = bench(text, states=(Listen,), board=board, **given)
    b.run.put_in("listen", Substitute(Listen, {}))
    b.tick()
    return b


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


def test_rule_11_a_state_that_waits_for_a_signal_goes_on_waiting_through_a_replacement(bench):
    b = listening(bench)
    new = b.bind(b.chart)
    assert b.operator.replace(new) == []
    b.tick(3)
    assert Listen.heard == [(0, None)]
    b.run.board.put("voice", "hello", b.now)
    b.tick(3)
    assert [value for _, value in Listen.heard] == [None, "hello"]


def test_rule_11_a_pause_alone_wakes_nobody(bench):
    b = listening(bench)
    b.operator.pause()
    b.run.board.put("other", "hello", b.now)
    b.tick(3)
    b.operator.resume()
    b.tick(3)
    assert Listen.heard == [(0, None)]


@pytest.mark.parametrize("late", [0, 1])
def test_rule_12_a_sample_that_comes_while_an_action_has_no_turn_is_noticed_later(bench, late):
    b = listening(bench, level=2)
    b.end("work", "failed")
    b.tick(late)
    b.run.board.put("voice", "hello", b.now)
    b.tick(3)
    assert len(Listen.heard) == 1
    b.operator.refuse("work")
    b.tick(4)
    assert [value for _, value in Listen.heard] == [None, "hello"]


# -- rules 13 to 15 --------------------------------------------------------------------------------


def test_rule_14_runs_of_one_machine_share_nothing(bench):
    first, second = bench(DATA), bench(DATA)
    second.run = ChartRun(first.machine, stand_ins=second.script.stand_ins)
    first.tick()
    second.tick()
    before = list(second.run.trace.lines())
    first.end("give", "done", value=4.0)
    first.tick()
    assert first.active == ["use"]
    assert first.run.value_of("goal") == 4.0
    assert second.active == ["give"]
    assert second.run.value_of("goal") == 0
    assert list(second.run.trace.lines()) == before
    second.end("give", "done", value=5.0)
    second.tick()
    assert second.script.inputs["use"] == {"value": 5.0}
    assert first.run.value_of("goal") == 4.0


def test_rule_14_runs_share_nothing(bench):
    one, two = bench(NESTED), bench(NESTED)
    one.tick()
    two.tick()
    one.operator.stop()
    one.tick()
    two.end("chase/danger", "seen")
    two.tick()
    assert one.run.outcome == "stopped"
    assert two.active == ["escape/clear", "escape/flee"]


def test_rule_15_notes_and_messages_are_not_in_the_hash(bench):
    hashes = []
    for text in ("one", "another"):
        b = bench(SEQUENCE)
        b.tick()
        b.run.note(b.run.nodes[""], text)
        b.end("a", RuntimeError(text))
        b.tick()
        hashes.append(b.run.trace.sha256())
    assert hashes[0] == hashes[1]
