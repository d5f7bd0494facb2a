"""The arm of a robot: from its file, or from its URDF, with its mount, calibration and prop."""

from __future__ import annotations

from hw.robot import RobotModel
from states.arm.model import Manipulator, load_manipulator
from states.arm.urdf_arm import described_arm


def manipulator_of(robot: RobotModel) -> Manipulator:
    """The arm of a robot file, or of its URDF, with its mount, calibration and prop.

    Raises:
        FileError: the URDF is wrong, or its arm is not laid out like a UR arm.
        ValueError: the robot has no arm.
    """
    model, held = robot.arm, robot.prop
    if model is None or held is None:
        raise ValueError(f"robot {robot.name} has no arm")
    arm = load_manipulator().with_tool(held)
    height, described = model.mount_height, model.urdf
    if height != arm.mount.xyz[2]:
        arm = arm.mounted(height)
    if described is not None:
        arm = described_arm(described, arm)
    chain = model.calibration
    return arm if chain is None else arm.calibrated(chain)
