"""Rule 4 of engine/README.md: deciding."""

from __future__ import annotations

from tests.engine.rules.charts import NESTED, TWO_GUARDS


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
