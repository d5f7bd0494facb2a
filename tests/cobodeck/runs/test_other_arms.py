"""Robots with other arms: what `study` asks is served, and a reach of each arm is told."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cobodeck.__main__ import main
from cobodeck.terminal.console import OK
from hw.model.arm import arm_names, load_arm

HW = Path(__file__).resolve().parents[3] / "hw"


def study(folder: Path, robot: str, height: str) -> Path:
    """The scene `study` with another robot and DEEPs of this height, m."""
    user = (HW / "users/study.yaml").read_text().replace("height: 1.5", f"height: {height}")
    (folder / "someone.yaml").write_text(user)
    scene = (HW / "scenes/study.yaml").read_text().replace("rbkairos_ur10", robot)
    (folder / "room.yaml").write_text(scene.replace("source: study", "source: ./someone.yaml"))
    return folder / "room.yaml"


@pytest.mark.slow
@pytest.mark.requirement(17, 143, 147)
@pytest.mark.parametrize(("robot", "height"), [("rbkairos_ur10e", "1.5"), ("rbkairos_ur5e", "1.0")])
def test_all_touches_of_the_study_are_served(
    robot: str, height: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = study(tmp_path, robot, height)
    arguments = ["--scene", str(scene), "--requests", "14", "--json"]
    assert main(["simulate", "cobodeck", *arguments]) == OK
    found = json.loads(capsys.readouterr().out)
    assert (found["requests"], found["served"], found["contacts"]) == (14, 14, 0)
    assert found["prop_error_m"]["max"] <= 0.005


@pytest.mark.requirement(147)
@pytest.mark.parametrize("arm", sorted(arm_names()))
def test_the_reach_of_every_arm_is_told(
    arm: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = (HW / "robots/rbkairos_ur10.yaml").read_text().replace("model: ur10 ", f"model: {arm} ")
    (tmp_path / "own.yaml").write_text(robot)
    asked = ["--height", "0.5:1.1:0.3", "--distance", "0.65:1.05:0.2", "--json"]
    code = main(["reach", "--robot", str(tmp_path / "own.yaml"), *asked])
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert (code == OK) == any(row["share"] > 0.0 for row in rows)
    dh = load_arm(arm).dh
    if abs(dh.a2 + dh.a3) > 0.5:  # a shorter one hardly reaches beyond a base that is a metre long
        assert code == OK
