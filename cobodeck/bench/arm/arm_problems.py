"""Seeded problems for the arm, and what a profile asks of its moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from behaviors.profile import load_profile
from hw.model import MotionLimits
from states.arm.kinematics import Array, Manipulator, Surroundings
from states.arm.planning import ANGLES

SEED = 42


@dataclass(frozen=True, slots=True, eq=False)
class ReachProblem:
    """A planning problem: rover_from_deep (4, 4) and the obstacles."""

    deep: Array
    around: Surroundings


def problems(count: int) -> list[ReachProblem]:
    """Seeded DEEPs ahead of the rover, from the paper's seven directions."""
    rng = np.random.default_rng(SEED)
    return [_problem(rng) for _ in range(count)]


def _problem(rng: np.random.Generator) -> ReachProblem:
    height, distance = rng.uniform(0.5, 1.6), rng.uniform(0.8, 1.2)
    yaw, pitch = np.pi - rng.choice(ANGLES), rng.uniform(-np.radians(20), np.radians(20))
    (cy, sy), (cp, sp) = (np.cos(yaw), np.sin(yaw)), (np.cos(pitch), np.sin(pitch))
    deep = np.eye(4)
    deep[:3, :3] = [[cy * cp, -sy, cy * sp], [sy * cp, cy, sy * sp], [-sp, 0.0, cp]]
    deep[:3, 3] = distance, 0.0, height
    person = deep[:2, 3] - 0.85 * np.array([cy, sy])
    while True:
        radius, angle, away = rng.uniform(0.05, 0.15), rng.uniform(-1.7, 1.7), rng.uniform(0.7, 1.2)
        pillar = away * np.array([np.cos(angle), np.sin(angle)])
        outside = np.maximum(np.abs(pillar) - [0.565, 0.455], 0.0)
        if np.hypot(*outside) > radius + 0.02 and np.hypot(*(pillar - deep[:2, 3])) > radius + 0.2:
            break
    cylinders = np.array([[*person, 0.5, 0.0, 1.8], [*pillar, radius, 0.0, 2.5]])
    return ReachProblem(deep, Surroundings(np.zeros((0, 6)), cylinders))


def limits_of(profile: str) -> MotionLimits:
    """The limits of the arm's moves in a profile."""
    robot = load_profile(profile).robot
    tool = np.inf if robot.tool_speed is None else robot.tool_speed
    return MotionLimits(arm_acceleration=robot.arm_acceleration, tool_speed=tool)


def parked(arm: Manipulator, profile: str) -> Array:
    """The parked pose of a profile, (6,), rad."""
    own = load_profile(profile).robot.parked(arm.name)
    return np.array(arm.tool.parked if own is None else own)
