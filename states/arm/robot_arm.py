"""The arm of a robot: from its file, or from its URDF, with its mount, calibration and prop."""

from __future__ import annotations

from hw.robot import RobotModel
from states.arm.model import Manipulator
from states.arm.urdf_arm import described_arm


def manipulator_of(robot: RobotModel) -> Manipulator:
    """The arm of a robot file, or of its URDF, with its mount, calibration and prop.

    Raises:
        FileError: the URDF is wrong, or its arm is not the one that the file names.
        ValueError: the robot has no arm.
    """
    model, held = robot.arm, robot.prop
    if model is None or held is None:
        raise ValueError(f"robot {robot.name} has no arm")
    arm = Manipulator.of(model.shape, model.mount, robot.chassis, held)
    if model.urdf is not None:
        arm = described_arm(model.urdf, arm)
    chain = model.calibration
    return arm if chain is None else arm.calibrated(chain)
