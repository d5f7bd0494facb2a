"""Rule 4 as amended: several monitors end in one tick, and one of them decides."""

from __future__ import annotations

from itertools import permutations

import pytest


def test_rule_4_c_an_outer_target_does_not_overrule_priority(bench):
    text = """
chart: c
outcomes: [x]
states:
  box:
    states:
      part:
        any:
          urgent: {watch: See, priority: 1, next: {seen: .on, lost: .on}}
          far: {watch: See, next: {seen: .x, lost: .x}}
        next: {on: escape, x: .x}
      escape: {do: Do, next: {done: .x, failed: .x, other: .x}}
"""
    b = bench(text)
    b.tick()
    b.end("box/part/far", "seen")
    b.end("box/part/urgent", "seen")
    b.tick()
    assert b.active == ["box/escape"]
    b = bench(text.replace("priority: 1, ", ""))
    b.tick()
    b.end("box/part/far", "seen")
    b.end("box/part/urgent", "seen")
    b.tick()
    assert b.run.outcome == "x"  # between equals the outer transition goes first


def test_rule_4_c_a_guard_lost_inside_its_container_does_not_come_back(bench):
    text = """
chart: c
outcomes: [x, y]
states:
  box:
    states:
      part:
        any:
          middle: {watch: See, next: {seen: .again, lost: .again}}
          inner:
            any:
              urgent: {watch: See, priority: 1, next: {seen: .on, lost: .on}}
              far: {watch: See, next: {seen: .x, lost: .x}}
            next: {on: .again, x: .x}
        next: {again: part, x: .x}
    next: {x: .x}
"""
    b = bench(text)
    b.tick()
    for path in ("box/part/middle", "box/part/inner/urgent", "box/part/inner/far"):
        b.end(path, "seen")
    b.tick()
    # `far` leads out of all, further than `middle`; but `urgent` has overruled it
    assert b.run.outcome is None
    assert ("exit", "box/part/inner/far", "lost") in b.last()
    assert ("exit", "box/part/inner/urgent", "lost") in b.last()
    assert ("exit", "box/part/middle", "outcome") in b.last()


@pytest.mark.parametrize("order", list(permutations((0, 1, 2))))
def test_rule_4_c_of_three_guards_the_highest_priority_stays(bench, order):
    guards = "".join(
        f"  g{n}: {{watch: See, priority: {rank}, next: {{seen: .o{rank}, lost: .o{rank}}}}}\n"
        for n, rank in enumerate(order)
    )
    b = bench(f"chart: c\noutcomes: [o0, o1, o2]\nany:\n{guards}")
    b.tick()
    for path in ("g0", "g1", "g2"):
        b.end(path, "seen")
    b.tick()
    assert b.run.outcome == "o2"


KEPT = """
chart: c
outcomes: [both, direct]
any:
  first: {watch: See, priority: 5}
  second: {watch: See}
  stop: {watch: See, priority: 1, next: {seen: .direct, lost: .direct}}
when:
  - {outcome: both, if: {first: seen, second: seen}}
  - {outcome: both, if: {first: lost}}
  - {outcome: both, if: {second: lost}}
"""


def test_rule_4_b_a_kept_guard_does_not_compete(bench):
    b = bench(KEPT)
    b.tick()
    b.end("first", "seen")  # kept; its priority counts for nothing
    b.end("stop", "seen")
    b.tick()
    assert b.run.outcome == "direct"


def test_rule_4_b_a_list_competes_as_the_best_of_its_causes(bench):
    b = bench(KEPT)
    b.tick()
    for path in ("first", "second", "stop"):
        b.end(path, "seen")
    b.tick()
    assert b.run.outcome == "both"  # 5 of `first` against 1 of `stop`
    b = bench(KEPT.replace("priority: 1", "priority: 9"))
    b.tick()
    for path in ("first", "second", "stop"):
        b.end(path, "seen")
    b.tick()
    assert b.run.outcome == "direct"
    exits = [record[1:] for record in b.last("exit")]
    assert exits[:3] == [("first", "lost"), ("second", "lost"), ("stop", "outcome")]


def test_rule_4_b_causes_kept_earlier_do_not_count(bench):
    b = bench(KEPT)
    b.tick()
    b.end("first", "seen")
    b.tick()
    b.end("second", "seen")
    b.end("stop", "seen")
    b.tick()
    assert b.run.outcome == "direct"  # 1 of `stop` against 0 of `second`


def test_rule_4_a_a_guard_that_the_timeout_forbids_does_not_compete(bench):
    text = """
chart: c
outcomes: [out, late]
states:
  box:
    states:
      part:
        any:
          urgent: {watch: See, priority: 1, next: {seen: .on, lost: .on}}
          leave: {watch: See, next: {seen: .out, lost: .out}}
        next: {on: more, out: .out}
      more: {do: Do, next: {done: .out, failed: .out, other: .out}}
    timeout: 200 ms
    next: {timeout: .late, out: .out}
"""
    b = bench(text)
    b.tick(2)
    b.end("box/part/urgent", "seen")
    b.end("box/part/leave", "seen")
    b.tick()
    assert b.run.outcome == "out"
    assert ("exit", "box/part/urgent", "lost") in b.last()


def test_rule_4_d_the_outer_transition_then_the_outer_monitor_decide(bench):
    text = """
chart: c
outcomes: [x, y]
any:
  left:
    any:
      deep: {watch: See, priority: 9, next: {seen: .x, lost: .x}}
    next: {x: .x}
  shallow: {watch: See, next: {seen: .y, lost: .y}}
"""
    b = bench(text)
    b.tick()
    b.end("left/deep", "seen")
    b.end("shallow", "seen")
    b.tick()
    assert b.run.outcome == "y"  # priority holds inside one container only


def test_rule_4_losers_are_recorded_in_document_order(bench):
    text = """
chart: c
outcomes: [x, y]
any:
  left:
    any:
      low: {watch: See, next: {seen: .x, lost: .x}}
      high: {watch: See, priority: 1, next: {seen: .x, lost: .x}}
    next: {x: .x}
  last: {watch: See, next: {seen: .x, lost: .x}}
  winner: {watch: See, priority: 1, next: {seen: .y, lost: .y}}
"""
    b = bench(text)
    b.tick()
    for path in ("winner", "last", "left/high", "left/low"):
        b.end(path, "seen")
    b.tick()
    assert b.run.outcome == "y"
    exits = [record[1:] for record in b.last("exit")]
    lost = ["left/low", "left/high", "last"]
    assert exits[:4] == [*((path, "lost") for path in lost), ("winner", "outcome")]


def test_rule_4_what_nested_lists_end_in_one_pass_ends_in_document_order(bench):
    text = """
chart: c
outcomes: [done]
all:
  deep:
    all:
      one: {watch: See}
      two: {watch: See}
  last: {watch: See}
  box:
    all:
      three: {watch: See}
"""
    b = bench(text)
    b.tick()
    for path in ("last", "box/three", "deep/two", "deep/one"):
        b.end(path, "seen")
    b.tick()
    assert b.run.outcome == "done"
    ends = [record[1] for record in b.last("outcome")]
    assert ends == ["deep/one", "deep/two", "deep", "last", "box/three", "box", ""]


def test_rule_4_a_list_that_matches_records_its_children_in_document_order(bench):
    text = """
chart: c
outcomes: [x]
any:
  third: {watch: See}
  first: {watch: See, priority: 9}
  inner:
    any:
      deep: {watch: See}
    when: [{outcome: on, if: {deep: seen}}]
  second: {watch: See, priority: 1}
when:
  - {outcome: x, if: {first: seen, second: lost, third: seen, inner: on}}
"""
    b = bench(text)
    b.tick()
    for path, outcome in (
        ("second", "lost"),
        ("first", "seen"),
        ("inner/deep", "seen"),
        ("third", "seen"),
    ):
        b.end(path, outcome)
    b.tick()
    ended = [record[1] for record in b.last("outcome")]
    assert ended == ["third", "first", "inner/deep", "inner", "second", ""]


LOSING = """
chart: c
outcomes: [both, direct]
outputs: {both: {d: number}, direct: {d: number}}
data: {d: {type: number, initial: 0}, e: {type: number, initial: 0}}
states:
  box:
    any:
      told: {watch: Tell, out: {value: d}}
      stop: {watch: See, priority: 1, next: {seen: .direct, lost: .direct}}
    when:
      - {outcome: both, if: {told: seen}}
      - {outcome: both, if: {told: lost}}
    next: {both: .both, direct: .direct}
"""


@pytest.mark.parametrize(
    ("priority", "outcome", "written"), [(1, "direct", 0.0), (-1, "both", 2.5)]
)
def test_rule_9_outputs_of_a_list_that_loses_are_not_written(bench, priority, outcome, written):
    b = bench(LOSING.replace("priority: 1", f"priority: {priority}"))
    b.tick()
    b.end("box/told", "seen", value=2.5)
    b.end("box/stop", "seen")
    b.tick()
    assert (b.run.outcome, b.run.results["d"]) == (outcome, written)
    assert len(b.records("data")) == (written > 0)


def test_rule_4_to_ask_how_a_list_ends_changes_nothing(bench):
    """Nothing is carried out where it is decided (`engine.machine.deciding`)."""
    b = bench(LOSING)
    b.tick()
    box, told = b.run.nodes["box"], b.run.nodes["box/told"]
    route = b.run.judge.conclude(told, ("seen", {"value": 1.5}))
    assert b.run.judge.match(box, [route]).outcome == "both"
    assert (box.kept, told.pending) == ({}, ())


def test_rule_9_outputs_of_lists_that_match_within_each_other_are_all_written(bench):
    text = """
chart: c
outcomes: [done]
outputs: {done: {d: number, e: number}}
data: {d: {type: number, initial: 0}, e: {type: number, initial: 0}}
all:
  inner:
    all:
      deep: {watch: Tell, out: {value: d}}
      deeper:
        any:
          deepest: {watch: Tell, out: {value: e}}
        when: [{outcome: on, if: {deepest: seen}}]
"""
    b = bench(text)
    b.tick()
    b.end("inner/deep", "seen", value=1.5)
    b.end("inner/deeper/deepest", "seen", value=2.5)
    b.tick()
    assert b.run.outcome == "done"
    assert b.run.results == {"d": 1.5, "e": 2.5}


def test_rule_4_of_two_that_end_the_same_child_of_a_list_one_is_recorded_as_lost(bench):
    text = """
chart: c
outcomes: [done]
all:
  inner:
    any:
      near: {watch: See, next: {seen: .on, lost: .on}}
      deep:
        any:
          far: {watch: See, next: {seen: .on, lost: .on}}
        next: {on: .on}
  other: {do: Do}
"""
    b = bench(text)
    b.tick()
    b.end("inner/near", "seen")
    b.end("inner/deep/far", "seen")
    b.tick()
    assert b.active == ["other"]
    assert ("outcome", "inner/deep/far", "seen") in b.last()
    assert ("exit", "inner/deep/far", "lost") in b.last()
    assert ("exit", "inner/near", "outcome") in b.last()
