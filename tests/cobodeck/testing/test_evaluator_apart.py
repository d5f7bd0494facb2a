"""Escape situations are counted by their geometry, whatever the chart makes of them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from cobodeck.testing.testing import ChartTester
from hw.geometry import wrap

HALL = (
    "scene: h\nroom: {outer: [[0, 0], [12, 0], [12, 12], [0, 12]]}\n"
    "robot: {start: {x: 6, y: 6, yaw: 0}}\n"
)
PASSES = (
    "user: passer\nrepeat: false\nstart: {x: 1.5, y: 4.7, yaw: 0}\nsteps:\n"
    "  - walk: {x: 10.5, y: 4.7, speed: 1.0}\n"
    "  - walk: {x: 10.5, y: 1.5, speed: 1.0}\n"
    "  - walk: {x: 10.5, y: 4.7, speed: 1.0}\n"
    "  - walk: {x: 1.5, y: 4.7, speed: 1.0}\n"
)
"""1.3 m beside a robot that stands: in view for a moment, then beside for a while; twice."""
ALONE = (
    "chart: alone\noutcomes: [done]\nany:\n"
    "  watch: {watch: UserLost, next: {lost: .done}}\n"
    "  faults: {watch: FaultRaised, next: {raised: .done}}\n"
)
"""A chart without Escape that moves nothing."""


def begin(sim: ChartTester, folder: Path, chart: str, script: dict[str, Any] | None = None) -> None:
    (folder / "hall.yaml").write_text(HALL)
    (folder / "passer.yaml").write_text(PASSES)
    files = {"scene": str(folder / "hall.yaml"), "user": str(folder / "passer.yaml")}
    (folder / "alone.yaml").write_text(ALONE)
    sim.start(chart.replace("alone", str(folder / "alone.yaml")), script or {}, **files)


def in_a_zone(x: float) -> bool:
    """The walker at (x, 4.7) looks along +x; the robot stands at (6, 6)."""
    dx, dy = 6.0 - x, 1.3
    away, off = math.hypot(dx, dy), abs(wrap(math.atan2(dy, dx)))
    return away < 1.5 or (away < 2.5 and off <= math.pi / 5)


@pytest.mark.requirement(104, 128)
def test_without_any_escape_in_the_chart_the_situations_are_counted(
    sim: ChartTester, tmp_path: Path
) -> None:
    begin(sim, tmp_path, "alone")

    sim.wait(28)

    assert sim.metrics is not None
    figures = sim.metrics()
    assert figures["situations"] == 4
    inside_m = sum(in_a_zone(1.5 + 0.001 * n) for n in range(9000)) * 0.001
    assert figures["time_to_safety_s"]["mean"] == pytest.approx(inside_m / 2 / 1.0, abs=0.07)
    assert figures["contacts"] == 0


@pytest.mark.requirement(104)
def test_with_the_trigger_silenced_the_situations_are_counted_and_no_escape_is(
    sim: ChartTester, tmp_path: Path
) -> None:
    """CoboDeck's own chart whose monitor of danger says nothing, and a robot that cannot drive."""
    silent = {"chase/danger": [], "chase/follow/park": [], "chase/tracking": []}
    begin(sim, tmp_path, "cobodeck", silent)

    sim.wait(13)  # the first pass; parking the arm is given up after 15 s

    assert sim.metrics is not None
    assert sim.metrics()["situations"] == 2
    assert sim.path("chase", "escape") == ["chase"]


@pytest.mark.requirement(104)
def test_a_signal_that_cries_wolf_makes_escapes_but_no_situations(
    sim: ChartTester, tmp_path: Path
) -> None:
    (tmp_path / "far.yaml").write_text(
        "user: far\nrepeat: false\nstart: {x: 1.5, y: 1.5, yaw: 3.1}\nsteps: [{stand: 20}]\n"
    )
    (tmp_path / "hall.yaml").write_text(HALL)
    script = {"chase/danger": ["required"] * 3}
    files = {"scene": str(tmp_path / "hall.yaml"), "user": str(tmp_path / "far.yaml")}
    sim.start("cobodeck", script, **files)

    sim.wait(10)

    assert sim.metrics is not None
    assert sim.path("escape")
    assert sim.metrics()["situations"] == 0
    assert sim.metrics()["time_to_safety_s"]["mean"] is None
