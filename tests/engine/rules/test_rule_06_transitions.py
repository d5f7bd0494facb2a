"""Rule 6 of engine/README.md: transitions."""

from __future__ import annotations

from tests.engine.rules.charts import NESTED, SEQUENCE


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
