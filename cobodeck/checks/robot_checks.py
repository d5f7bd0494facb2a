"""A robot: its outline, how its arm is folded, and what one reach asks of the arm."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from cobodeck.fitness import BAD, FIT, CheckResult
from cobodeck.terminal import FAILED
from hw import Pose2, Pose3
from hw.model import RobotModel
from hw.scene import Room

if TYPE_CHECKING:
    from behaviors.profile import Profile
    from states.arm import Workspace
    from states.arm.kinematics import Effort
    from states.arm.planning import Plan

HEIGHT, DISTANCES = 1.2, (1.0, 0.9, 0.8, 0.7)
"""Where the DEEP of the reach lies: height, and distances that are tried in turn, m."""
BEHIND = 0.85
"""Distance of the user from it, m."""
STEP_S = 0.01
_HALL = Room(outer=((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)))
_HERE = Pose2(5.0, 5.0)


def outline(robot: RobotModel) -> Iterator[CheckResult]:
    """Its sides and its radii (R3)."""
    body = robot.footprint
    about = (
        f"{robot.name}: {body.length:g} x {body.width:g} m with its foam, corners "
        f"{body.half_diagonal:.3f} m from its centre, {body.enclosing_radius:g} m kept"
    )
    yield CheckResult("robot", FIT, about)


def folded(robot: RobotModel, profile: Profile) -> Iterator[CheckResult]:
    """Clearance of the arm as the profile folds it."""
    if robot.arm is None:
        return
    import numpy as np

    from states.arm.description import manipulator_of
    from states.arm.kinematics import CollisionChecker, Surroundings
    from states.arm.planning import CLEARANCE

    held = profile.body(robot)
    arm = manipulator_of(held)
    checker = CollisionChecker.of(arm, Surroundings.empty())
    clear, *where = checker.tightest(np.array(held.parked))
    told = f"folded with {arm.tool.name} it is {clear * 1e3:.0f} mm clear ({' and '.join(where)})"
    yield CheckResult(f"arm {arm.name}", FIT if clear >= CLEARANCE else BAD, told)


def free(robot: RobotModel) -> Iterator[CheckResult]:
    """Whether the arm, folded as its file says, touches itself, rover or floor."""
    from states.arm.description import folded_contact

    contact = folded_contact(robot)
    if contact is not None:
        yield CheckResult("arm", BAD, contact, said=f"robot {robot.name}: {contact}", code=FAILED)


def numeric(robot: RobotModel) -> Iterator[CheckResult]:
    """That the inverse kinematics of an arm by URDF are slow."""
    if robot.arm is None or robot.arm.model.dh is not None:
        return
    from states.arm.description import manipulator_of
    from states.arm.kinematics import slowness

    arm = manipulator_of(robot)
    yield CheckResult(f"arm {arm.name}", FIT, slowness(arm.shape))
    for first, second in arm.grown:
        told = f"contact of {first} with {second} is not seen: their capsules always overlap"
        yield CheckResult(f"arm {arm.name}", FIT, told)


def reach(robot: RobotModel, profile: Profile) -> Iterator[CheckResult]:
    """Time, torque, momentum and power of a reach to a level DEEP."""
    if robot.arm is None:
        return
    held = profile.body(robot)
    found = _reach(profile.environment(_HALL, held).workspace)
    if found is None:
        about = f"no level DEEP {HEIGHT:g} m high is reached from {DISTANCES[-1]:g} m"
        yield CheckResult("reach", BAD, about)
        return
    distance, plan = found
    taken = plan.trajectory.duration
    told = f"a level DEEP {HEIGHT:g} m high, {distance:g} m ahead, in {taken:.2f} s"
    moved = _effort(held, plan)
    if moved is None:
        yield CheckResult("reach", FIT, f"{told}; its file has no masses")
    else:
        yield _asked(moved, robot, told)


def _reach(workspace: Workspace) -> tuple[float, Plan] | None:
    from states.arm import ArmSituation
    from states.arm.planning import Plan, ended, in_turn

    for distance in DISTANCES:
        x, y = _HERE.transform(distance, 0.0)
        user = Pose2(x + BEHIND, y, math.pi)
        deep = Pose3.from_yaw(x, y, HEIGHT, math.pi)
        situation = ArmSituation(_HERE, user, workspace.parked)
        found = ended(in_turn(workspace.reaching(situation, deep)))
        if isinstance(found, Plan):
            return distance, found
    return None


def _effort(held: RobotModel, plan: Plan) -> Effort | None:
    """What a plan asks of the arm; None if the masses of its links are not known."""
    import numpy as np

    from states.arm.description import manipulator_of
    from states.arm.kinematics import Bodies, effort

    arm, trajectory = manipulator_of(held), plan.trajectory
    if not arm.shape.masses:
        return None
    times = np.arange(0.0, trajectory.duration, STEP_S)
    return effort(arm, Bodies.of(arm), *trajectory.at(times))


def _asked(moved: Effort, robot: RobotModel, told: str) -> CheckResult:
    assert robot.arm is not None
    limits = robot.arm.installation
    share = float((abs(moved.torque) / robot.arm.model.max_torque).max())
    momentum, power = float(moved.momentum.max()), float(moved.power.max())
    text = (
        f"{told}, with {share:.0%} of the torque of its weakest joint, {momentum:.1f} kg m/s and "
        f"{power:.0f} W; its installation allows {limits.momentum:g} kg m/s and {limits.power:g} W"
    )
    fits = share <= 1.0 and momentum <= limits.momentum and power <= limits.power
    return CheckResult("reach", FIT if fits else BAD, text)
