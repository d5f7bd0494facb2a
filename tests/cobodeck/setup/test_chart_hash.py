"""The hash of a chart counts all that it does, and no breakpoint."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cobodeck.setup.setup import open_setup
from engine.chart.load import load_text

CHART = """chart: c
outcomes: [x]
states:
  park: {do: ParkArm, next: {parked: sub, failed: .x, error: .x}}
  sub: {use: inner, next: {done: .x}}
"""
INNER = """chart: inner
outcomes: [done]
states:
  hold:
    do: HoldProp
    next: {error: .done}
"""


@pytest.mark.usefixtures("without_shipped_charts")
@pytest.mark.requirement(21)
def test_breakpoints_are_not_in_the_hash(tmp_path: Path) -> None:
    file = tmp_path / "c.yaml"
    file.write_text(CHART)
    (tmp_path / "inner.yaml").write_text(INNER)
    setup, found = open_setup(str(file), robot="rbkairos_ur10"), {}
    for name, chart, used in (
        ("plain", CHART, INNER),
        ("broken", CHART.replace("{do: P", "{break: true, do: P"), INNER + "    break: true\n"),
        ("other", CHART, INNER + "    about: it\n"),
    ):
        library = {**load_text(chart), **load_text(used)}
        found[name] = replace(setup, chart=library["c"], library=library).chart_sha256

    assert setup.chart_sha256 == found["plain"]
    assert found["plain"] == found["broken"] != found["other"]
