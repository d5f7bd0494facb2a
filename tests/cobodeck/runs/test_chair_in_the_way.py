"""A robot that is driven at a chair: what summary, JSON and picture say of it, at both tiers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main

STATES = """from engine.state import Action, Context, Run
from hw.geometry import Pose2

class Ahead(Action):
    \"\"\"Gives the place beyond the chair.\"\"\"
    outcomes = ("there",)
    outputs = {"there": {"goal": Pose2}}
    def run(self, ctx: Context) -> Run:
        return "there", {"goal": Pose2(8.0, 5.0)}
        yield
"""
CHART = """chart: beyond
outcomes: [arrived, lost]
data: {goal: {type: Pose2, initial: none}}
states:
  ahead: {do: Ahead, out: {goal: goal}, next: {there: go}}
  go:
    do: DriveTo
    with: {subsystem: chase}
    in: {goal: goal}
    next: {arrived: .arrived, no_path: go, stuck: go, lost: .lost}
"""
HALL, CORRIDOR = 10.0, 2.6
"""Widths of a room with a way round a chair in its middle, and of one without, m."""
CHAIR = 5.0
"""Both coordinates of the chair, m."""


def driven(folder: Path, width: float, tier: int, capsys: Any, *more: str) -> tuple[str, str]:
    """Drive from x = 2 to 8 m with a chair in between; output and messages."""
    low, high = CHAIR - width / 2, CHAIR + width / 2
    (folder / "pyproject.toml").write_text(
        '[project.entry-points."cobodeck.states"]\nown = "own_driving.states"\n'
    )
    (folder / "own_driving").mkdir(exist_ok=True)
    (folder / "own_driving" / "states.py").write_text(STATES)
    (folder / "own_driving" / "beyond.yaml").write_text(CHART)
    (folder / "way.yaml").write_text(
        "scene: way\n"
        f"room: {{outer: [[-4, {low}], [10, {low}], [10, {high}], [-4, {high}]]}}\n"
        f"robot: {{start: {{x: 2, y: {CHAIR}, yaw: 0}}}}\n"
        "user: {source: away.yaml, start: {x: -3.3, y: 5, yaw: 0}}\n"
        f"objects:\n  - {{kind: chair, at: [{CHAIR}, {CHAIR}]}}\n"
    )
    (folder / "away.yaml").write_text("user: away\nrepeat: false\nsteps: [stand: 600]\n")
    asked = ["simulate", "beyond", "--scene", "way.yaml", "--tier", str(tier), "--duration", "20"]
    assert main([*asked, *more]) == 0
    found = capsys.readouterr()
    return found.out, found.err


@pytest.mark.parametrize("width", [CORRIDOR, pytest.param(HALL, marks=pytest.mark.slow)])
def test_without_scanners_the_chair_is_run_into_and_that_is_told(
    folder: Path, capsys: pytest.CaptureFixture[str], width: float
) -> None:
    figures = json.loads(driven(folder, width, 1, capsys, "--json")[0])

    assert (figures["objects_seen"], figures["ended"]) == (False, "time")
    (hit,) = figures["hits"]
    assert (hit["what"], hit["x"], hit["y"]) == ("chair_1", CHAIR, CHAIR)
    assert hit["count"] == figures["object_hits"] > 0
    assert figures["stuck"][0]["near"] == "chair_1"
    shown = driven(folder, width, 1, capsys)[0]
    assert "chair_1 at (5.0" in shown
    assert "not seen: tier 1 has no scanners" in shown
    assert "ended as asked: the time is up" in shown


@pytest.mark.slow
def test_with_scanners_it_stops_before_the_chair_and_says_what_blocks(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figures = json.loads(driven(folder, CORRIDOR, 2, capsys, "--json")[0])

    assert (figures["objects_seen"], figures["object_hits"], figures["hits"]) == (True, 0, [])
    assert figures["stuck"][0]["near"] == "chair_1"
    assert figures["stuck"][0]["gap_m"] > 0.0


@pytest.mark.slow
def test_with_scanners_and_room_it_goes_round(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figures = json.loads(driven(folder, HALL, 2, capsys, "--json")[0])

    assert (figures["outcome"], figures["ended"]) == ("arrived", "outcome")
    assert (figures["object_hits"], figures["stuck"]) == (0, [])


@pytest.mark.slow
def test_the_picture_has_the_chair_and_the_hit(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    driven(folder, CORRIDOR, 1, capsys, "--record", "way.mcap")
    assert main(["render", "way.mcap", "-o", "way.svg"]) == 0

    drawn = (folder / "way.svg").read_text()
    assert "chair_1" in drawn
    assert "not on the map" in drawn
