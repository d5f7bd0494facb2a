"""A drive of Haptic's second choice, through a gap between the user and a column."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from cobodeck.testing.testing import ChartTester
from hw.geometry import Pose2
from hw.scene.scene import load_scene
from hw.sim.world import World

CHART = """
chart: close
outcomes: [over]
data: {goal: {type: Pose2, initial: none}}
states:
  choose:
    do: ChooseChasePose
    out: {pose: goal}
    next: {chosen: drive, none: .over}
  drive:
    do: DriveTo
    with: {subsystem: haptic, clearance: escape}
    in: {goal: goal}
    next: {arrived: .over, no_path: .over, stuck: .over, lost: .over}
"""
SCENE = """
scene: gap
room:
  outer: [[0.0, 0.0], [11.5, 0.0], [11.5, 10.1], [0.0, 10.1]]
  walls:
    - [[6.65, 0.0], [6.85, 0.0], [6.85, 4.0], [6.65, 4.0]]
    - [[6.65, 7.28], [6.85, 7.28], [6.85, 10.1], [6.65, 10.1]]
  columns: [[[6.6, 4.02], [6.9, 4.02], [6.9, 4.52], [6.6, 4.52]]]
robot: {{file: rbkairos_ur10, start: {{x: {x}, y: {y}, yaw: 2.479}}}}
"""
USER = """
user: standing
repeat: false
start: {x: 7.062, y: 6.573, yaw: -0.7}
steps: [{request: {hold: 60}}]
"""
KEPT = 0.77
"""Escape's inflation, m."""
GOAL = Pose2(7.732, 5.116, 2.479)


@pytest.mark.requirement(42, 149)
@pytest.mark.parametrize("start", [(4.3, 6.1), (4.5785, 6.0125), (4.5, 6.04)])
def test_held_off_the_user_it_does_not_touch_the_column(
    sim: ChartTester, tmp_path: Path, start: tuple[float, float]
) -> None:
    """The safety chain takes the part towards the user out of a velocity; the rest leads aside."""
    files = {"chart": CHART, "scene": SCENE.format(x=start[0], y=start[1]), "user": USER}
    for name, text in files.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    chart, scene, user = (str(tmp_path / f"{name}.yaml") for name in files)
    sim.start(chart, {"choose": ("chosen", {"pose": GOAL})}, scene=scene, user=user)
    plant, room = sim.loop.plant, load_scene(scene).room
    assert isinstance(plant, World)
    nearest = math.inf
    while sim.outcome is None:
        sim.tick()
        pose = plant.base.pose
        nearest = min(nearest, room.clearance(pose.x, pose.y))

    assert plant.robot.footprint.half_diagonal <= nearest < KEPT - 0.01  # it was led aside
