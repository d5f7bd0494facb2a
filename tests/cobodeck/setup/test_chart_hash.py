"""The hash of a chart counts all that it does, and no breakpoint."""

from __future__ import annotations

from pathlib import Path

import pytest

from cobodeck.setup.setup import open_setup

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


@pytest.mark.requirement(21)
def test_breakpoints_are_not_in_the_hash(tmp_path: Path) -> None:
    found = {}
    inner = tmp_path / "inner.yaml"
    for name, chart, used in (
        ("plain", CHART, INNER),
        ("broken", CHART.replace("{do: P", "{break: true, do: P"), INNER + "    break: true\n"),
        ("other", CHART, INNER + "    about: it\n"),
    ):
        file = tmp_path / "c.yaml"
        file.write_text(chart)
        inner.write_text(used)
        found[name] = open_setup(str(file), robot="rbkairos_ur10").chart_sha256
    assert found["plain"] == found["broken"] != found["other"]
