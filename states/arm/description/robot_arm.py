"""The arm of a robot: from its file, or from its URDF, with its mount, calibration and prop."""

from __future__ import annotations

import numpy as np

from hw.model import RobotModel
from states.arm.kinematics import OUTSIDE, CollisionChecker, Manipulator, Surroundings


def manipulator_of(robot: RobotModel) -> Manipulator:
    """The arm of a robot file, or of its URDF, with its mount, calibration and prop.

    Raises:
        FileError: the URDF is wrong, or its arm is not the one that the file names.
        ValueError: the robot has no arm.
    """
    model, held = robot.arm, robot.prop
    if model is None or held is None:
        raise ValueError(f"robot {robot.name} has no arm")
    arm = Manipulator(model.model, model.mount, robot.chassis, held)
    if model.urdf is not None:
        from states.arm.description.urdf_arm import described_arm

        arm = described_arm(model.urdf, arm)
    chain = model.calibration
    return arm if chain is None else arm.calibrated(chain)


def folded_contact(robot: RobotModel) -> str | None:
    """Where the folded arm comes too near to itself, rover or floor; None if it does not.

    Such an arm could neither be planned for nor fold itself.

    Raises:
        FileError: as `manipulator_of`.
    """
    if robot.arm is None:
        return None
    checker = CollisionChecker.of(manipulator_of(robot), Surroundings.empty())
    gap, first, second = checker.tightest(np.array(robot.parked))
    if gap >= checker.margin:
        return None
    beside = "the rover or the floor" if second == OUTSIDE else second
    near = f"is {gap * 1e3:.0f} mm from" if gap > 0.0 else f"is {-gap * 1e3:.0f} mm deep in"
    return (
        f"folded, its {first} {near} {beside}: mount and the prop's `parked` do not fit; "
        "`cobodeck reach --park` finds poses"
    )
