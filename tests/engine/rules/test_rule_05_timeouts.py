"""Rule 5 of engine/README.md: timeouts."""

from __future__ import annotations

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
