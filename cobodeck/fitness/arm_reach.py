"""What `doctor` says about the arm of a robot: how it is folded, and what one reach asks of it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from cobodeck.fitness.room_fitness import BAD, FIT, DoctorLine
from hw import Pose2, Pose3
from hw.model import RobotModel
from hw.scene import Room
from states.arm import ArmSituation, Workspace
from states.arm.description import manipulator_of
from states.arm.kinematics import (
    Bodies,
    CollisionChecker,
    CollisionModel,
    Effort,
    KinematicChain,
    Surroundings,
    effort,
)
from states.arm.planning import CLEARANCE, Plan, ended, in_turn

if TYPE_CHECKING:
    from behaviors.profile import Profile

HEIGHT, DISTANCES = 1.2, (1.0, 0.9, 0.8, 0.7)
"""Where the DEEP of the reach lies: height, and distances that are tried in turn, m."""
BEHIND = 0.85
"""Distance of the user from it, m."""
STEP_S = 0.01
_HALL = Room(outer=((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)))
_HERE = Pose2(5.0, 5.0)


def arm_checks(robot: RobotModel, profile: Profile) -> Iterator[DoctorLine]:
    """Clearance of the folded arm, and time, torque, momentum and power of a reach."""
    if robot.arm is None:
        return
    held = profile.body(robot)
    arm = manipulator_of(held)
    assert held.arm is not None
    checker = CollisionChecker.of(CollisionModel.of(arm), Surroundings.empty())
    clear, *where = checker.tightest(np.array(held.arm.parked))
    what = f"arm {arm.name}"
    told = f"folded with {arm.tool.name} it is {clear * 1e3:.0f} mm clear ({' and '.join(where)})"
    yield what, FIT if clear >= CLEARANCE else BAD, told
    reach = _reach(profile.environment(_HALL, held).workspace)
    if reach is None:
        yield "reach", BAD, f"no level DEEP {HEIGHT:g} m high is reached from {DISTANCES[-1]:g} m"
        return
    distance, plan = reach
    trajectory = plan.trajectory
    told = f"a level DEEP {HEIGHT:g} m high, {distance:g} m ahead, in {trajectory.duration:.2f} s"
    if not arm.masses:
        yield "reach", FIT, f"{told}; its file has no masses"
        return
    times = np.arange(0.0, trajectory.duration, STEP_S)
    moved = effort(KinematicChain.of(arm), Bodies.of(arm.masses, arm.tool), *trajectory.at(times))
    yield _asked(moved, robot, told)


def _reach(workspace: Workspace) -> tuple[float, Plan] | None:
    for distance in DISTANCES:
        x, y = _HERE.transform(distance, 0.0)
        user = Pose2(x + BEHIND, y, np.pi)
        deep = Pose3.from_yaw(x, y, HEIGHT, np.pi)
        situation = ArmSituation(_HERE, user, workspace.parked)
        found = ended(in_turn(workspace.reaching(situation, deep)))
        if isinstance(found, Plan):
            return distance, found
    return None


def _asked(moved: Effort, robot: RobotModel, told: str) -> DoctorLine:
    assert robot.arm is not None
    limits = robot.arm.installation
    share = float((np.abs(moved.torque) / robot.arm.shape.max_torque).max())
    momentum, power = float(moved.momentum.max()), float(moved.power.max())
    text = (
        f"{told}, with {share:.0%} of the torque of its weakest joint, {momentum:.1f} kg m/s and "
        f"{power:.0f} W; its installation allows {limits.momentum:g} kg m/s and {limits.power:g} W"
    )
    fits = share <= 1.0 and momentum <= limits.momentum and power <= limits.power
    return "reach", FIT if fits else BAD, text
