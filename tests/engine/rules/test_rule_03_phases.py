"""Rule 3 of engine/README.md: phases of a tick."""

from __future__ import annotations

from tests.engine.rules.charts import NESTED, TWO_GUARDS


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
