"""Parked poses that the search finds: inside, clear, quick, and the same each time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hw.model.arm import load_arm
from hw.model.prop import load_prop
from hw.model.robot import RobotModel, load_robot
from states.arm.description.robot_arm import manipulator_of
from states.arm.kinematics.collision import CollisionChecker, Surroundings, extent
from states.arm.planning import parking
from states.arm.planning.parking import CLEARANCE, ParkingSearch


def robot_with(arm: str, prop: str) -> RobotModel:
    robot = load_robot("rbkairos_ur10", prop=load_prop(prop).on("ur10"))
    return replace(robot, arm=replace(robot.arm, model=load_arm(arm)))


@pytest.mark.requirement(46, 87)
@pytest.mark.parametrize(
    ("arm", "prop", "kept"),
    [
        ("ur5e", "prop", 60),
        pytest.param("ur5e", "prop", 300, marks=pytest.mark.slow),
        pytest.param("ur10", "gripped", 300, marks=pytest.mark.slow),
    ],
)
def test_found_poses_are_inside_clear_and_in_order(
    arm: str, prop: str, kept: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parking, "DRAWN", 20_000)
    monkeypatch.setattr(parking, "KEPT", kept)
    robot = robot_with(arm, prop)
    found = ParkingSearch(robot, seed=3).best()
    assert len(found) >= 2
    model = manipulator_of(robot)
    checker = CollisionChecker.of(model, Surroundings.empty())
    outline = robot.footprint
    for pose in found:
        assert checker.clearance(np.array(pose.joints))[0] == pytest.approx(pose.clearance)
        assert pose.clearance >= CLEARANCE
        ahead, back, left, right = extent(model, np.array(pose.joints))
        room = min(outline.half_length - max(ahead, back), outline.half_width - max(left, right))
        assert pose.room == pytest.approx(room - outline.foam)
        assert pose.room >= 0.0
        assert pose.reached > 0.8
    assert [pose.time for pose in found] == sorted(pose.time for pose in found)
    assert ParkingSearch(robot, seed=3).best() == found


def test_an_arm_that_does_not_fit_is_not_parked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parking, "DRAWN", 2_000)
    robot = robot_with("ur20", "prop")
    narrow = replace(robot.footprint, length=0.5, width=0.4, enclosing_radius=0.5)
    assert ParkingSearch(replace(robot, footprint=narrow)).best() == []
