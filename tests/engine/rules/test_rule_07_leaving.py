"""Rule 7 of engine/README.md: leaving."""

from __future__ import annotations

import pytest

from engine.state import Action, Context, Monitor, Run
from tests.engine.rules.charts import NESTED, TWO_GUARDS


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
