"""The flange in plain Python, against the compiled kinematics of the planners."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hw.model import inverted
from hw.model.calibration import load_calibration
from hw.model.flange import FlangeChain
from hw.model.robot import load_robot
from states.arm.description.robot_arm import manipulator_of
from states.arm.kinematics.kinematics import forward, pose_matrix


@pytest.mark.parametrize("calibration", [None, "robotnik_ur10"])
@pytest.mark.parametrize("name", ["rbkairos_ur10", "rbkairos_ur5e"])
def test_the_flange_is_where_the_kinematics_of_the_planners_have_it(
    name: str, calibration: str | None
) -> None:
    robot = load_robot(name)
    arm = robot.arm
    assert arm is not None
    if calibration is not None:
        arm = replace(arm, calibration=load_calibration(calibration))
    own = manipulator_of(replace(robot, arm=arm))
    chain = FlangeChain(arm)
    for joints in np.random.default_rng(1).uniform(-3.0, 3.0, (50, 6)):
        flange = forward(own, joints) @ inverted(own.tip)
        assert pose_matrix(chain.on_rover(tuple(joints))) == pytest.approx(flange, abs=1e-9)
        on_base = inverted(own.base) @ flange
        assert pose_matrix(chain.on_base(tuple(joints))) == pytest.approx(on_base, abs=1e-9)
