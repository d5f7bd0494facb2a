"""Masses of an arm and where they are, from its file alone: for tests of its physics."""

from __future__ import annotations

import numpy as np

from hw.model.robot import RobotModel

GRAVITY = 9.81


def turned(axis: int, angle: float) -> np.ndarray:
    """A rotation about x, y or z, (4, 4)."""
    found, (i, j) = np.eye(4), ((1, 2), (2, 0), (0, 1))[axis]
    found[i, i] = found[j, j] = np.cos(angle)
    found[j, i], found[i, j] = np.sin(angle), -np.sin(angle)
    return found


def frame(placement) -> np.ndarray:
    """A frame in the link before it, (4, 4); roll, pitch, yaw about fixed axes."""
    roll, pitch, yaw = placement.rpy
    found = turned(2, yaw) @ turned(1, pitch) @ turned(0, roll)
    found[:3, 3] = placement.xyz
    return found


def points(robot: RobotModel, joints) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Mass, kg, centre, m, and inertia about it, kg m2, of links and prop, in the rover's frame."""
    at, found, arm = frame(robot.arm.mount), [], robot.arm.model
    links = zip(arm.dh.placements(), joints, arm.masses.values(), strict=True)
    for placement, angle, link in links:
        at = at @ frame(placement) @ turned(2, angle)
        xx, yy, zz, xy, xz, yz = link.inertia
        own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        found.append((link.mass, (at @ [*link.center, 1.0])[:3], at[:3, :3] @ own @ at[:3, :3].T))
    prop = robot.prop
    found.append((prop.mass, (at @ [*prop.center_of_mass, 1.0])[:3], np.zeros((3, 3))))
    return found


def height_energy(robot: RobotModel, joints) -> float:
    """The potential energy of arm and prop, J."""
    return sum(mass * GRAVITY * center[2] for mass, center, _ in points(robot, joints))


def gravity_torques(robot: RobotModel, joints, h: float = 1e-5) -> list[float]:
    """The torques that hold the arm, Nm: the slope of its potential energy."""
    found = []
    for n in range(len(joints)):
        up, down = list(joints), list(joints)
        up[n] += h
        down[n] -= h
        found.append((height_energy(robot, up) - height_energy(robot, down)) / (2.0 * h))
    return found


def shoulder_pendulum(robot: RobotModel) -> tuple[float, float, float]:
    """All beyond the shoulder lift as one body that turns about its axis, the other joints at 0.

    Returns its inertia about that axis, kg m2, its mass times the distance of its centre, kg m, and
    the angle of the joint at which it hangs down, rad.
    """
    arm = robot.arm.model
    first, second = arm.dh.placements()[:2]
    axis_frame = frame(robot.arm.mount) @ frame(first) @ frame(second)
    axis, pivot, inertia, moment = axis_frame[:3, 2], axis_frame[:3, 3], 0.0, np.zeros(3)
    for mass, center, own in points(robot, (0.0,) * 6)[1:]:
        arm_of = (center - pivot) - axis * np.dot(axis, center - pivot)
        inertia += axis @ own @ axis + mass * np.dot(arm_of, arm_of)
        moment += mass * arm_of
    inside = axis_frame[:3, :3].T @ moment
    down = axis_frame[:3, :3].T @ [0.0, 0.0, -1.0]
    hangs = np.arctan2(down[1], down[0]) - np.arctan2(inside[1], inside[0])
    return float(inertia), float(np.linalg.norm(moment)), float(hangs)
