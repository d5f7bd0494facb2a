"""Rule 12 of engine/README.md: autonomy."""

from __future__ import annotations

import pytest

from tests.engine.rules.charts import NESTED, Listen, listening


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
