"""A drive of Haptic's second choice, through a gap between the user and a column."""

from __future__ import annotations

from pathlib import Path

import pytest

from cobodeck.testing import ChartTester
from hw.geometry import Pose2
from hw.scene import load_scene

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
room: lab_b
robot: {{file: rbkairos_ur10, start: {{x: {x}, y: {y}, yaw: 2.479}}}}
"""
USER = """
user: standing
repeat: false
start: {x: 7.06, y: 6.57, yaw: -0.7}
steps: [{request: {hold: 60}}]
"""
GOAL = Pose2(7.732, 5.116, 2.479)


@pytest.mark.requirement(42, 149)
@pytest.mark.parametrize("start", [(4.3, 6.1), (3.6, 6.33), (4.3, 5.6)])
def test_held_off_the_user_it_does_not_touch_the_column(
    sim: ChartTester, tmp_path: Path, start: tuple[float, float]
) -> None:
    """The safety chain takes the part towards the user out of a velocity; the rest leads aside."""
    for name, text in (("chart", CHART), ("scene", SCENE.format(x=start[0], y=start[1])), ("user", USER)):
        (tmp_path / f"{name}.yaml").write_text(text)
    sim.start(
        str(tmp_path / "chart.yaml"),
        {"choose": ("chosen", {"pose": GOAL})},
        scene=str(tmp_path / "scene.yaml"),
        user=str(tmp_path / "user.yaml"),
    )
    room, nearest = load_scene("lab_b").room, 9.0
    while sim.outcome is None and sim.now < 20.0:
        sim.tick()
        pose = sim.loop.plant.base.pose
        nearest = min(nearest, room.clearance(pose.x, pose.y))
    print(sim.now, nearest, sim.outcome, sim.path(), sim.metrics()["wall_hits"], pose)
    assert nearest>.725
