"""The arm of the robot file, of the profiles and of the arm file are one."""

from __future__ import annotations

import pytest

from behaviors.profile.profile import load_profile
from hw.model.robot import load_robot
from hw.scene.room import Room
from states.arm.kinematics.model import Manipulator
from states.environment.environment import Environment

ROBOT = load_robot("rbkairos_ur10")
ROOM = Room(outer=((0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 9.0)))


def test_robot_file_and_arm_file_agree(arm: Manipulator) -> None:
    assert ROBOT.arm.lower == arm.shape.lower
    assert ROBOT.arm.upper == arm.shape.upper
    assert ROBOT.arm.max_speed == arm.shape.max_speed
    assert ROBOT.arm.mount == arm.mount
    assert ROBOT.prop == arm.tool
    bumper = next(box for box in arm.body if box.name == "bumper")
    assert bumper.high[:2] == (ROBOT.footprint.half_length, ROBOT.footprint.half_width)
    assert bumper.low[:2] == (-ROBOT.footprint.half_length, -ROBOT.footprint.half_width)


@pytest.mark.requirement(46)
def test_the_parked_poses_are_those_that_were_checked_for_the_bumper_frame(
    arm: Manipulator,
) -> None:
    def parked(profile: str) -> tuple[float, ...]:
        environment: Environment = load_profile(profile).environment(ROOM, ROBOT)
        return environment.workspace.parked

    assert ROBOT.parked == parked("tuned") == arm.tool.parked
    assert parked("paper") == arm.tool.parked_paper
