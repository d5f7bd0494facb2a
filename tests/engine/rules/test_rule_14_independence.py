"""Rule 14 of engine/README.md: no state is shared."""

from __future__ import annotations

from engine.run.chart_run import ChartRun
from tests.engine.rules.charts import DATA, NESTED


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
