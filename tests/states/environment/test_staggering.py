"""A base that slips still comes to rest within its tolerance, without going to and fro (R81)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from behaviors.profile.profile import load_profile
from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.model.robot import load_robot
from hw.model.sensor_errors import Slip
from hw.safety.separation import Velocity
from hw.scene.room import Room
from hw.sim.slip import FLOOR, SlipperyFloor, slide
from states.environment.environment import Environment
from states.navigation.planners import driver_of

DT = 1.0 / 30.0
NEAR = 0.6
"""Where changes of direction are counted, m from the goal."""
LINOLEUM, WORN = Slip(), Slip(along=0.1, across=0.2, turning=0.1, patchy=0.15)


def environment_with(profile: str, tolerance: float | None = None) -> Environment:
    room = Room(outer=((0.0, 0.0), (12.0, 0.0), (12.0, 10.0), (0.0, 10.0)))
    environment = load_profile(profile).environment(room, load_robot("rbkairos_ur10"))
    if tolerance is None:
        return environment
    haptic = replace(environment.navigation.haptic, tolerance=tolerance)
    return replace(environment, navigation=replace(environment.navigation, haptic=haptic))


class Body:
    """A body on a floor, moved by wheels."""

    def __init__(self, slip: Slip, start: Pose2, seed: int) -> None:
        self._floor, self._floors = SlipperyFloor(slip, seed), np.zeros(1, FLOOR)
        self._floor.lay(self._floors, start)

    @property
    def pose(self) -> Pose2:
        return Pose2(*self._floors["place"][0].tolist())

    def move(self, wheels: Velocity, before: Velocity, after: Velocity) -> None:
        """Move by distances and between velocities, base frame at half of the rotation."""
        dx, dy, turn = wheels
        slide(self._floors[0], -0.5 * turn, before, (dx, dy, turn, after))
        self._floor.draw(self._floors)


def turns_back(environment: Environment, start: Pose2, goal: Pose2, floor: Body) -> int:
    """Changes of direction by more than a right angle near the goal, from seeing to standing there.

    The pose is that of the body, the velocity that of the wheels.
    """
    driver = driver_of(environment, "haptic", environment.static_planners["haptic"])
    driver.go_to(goal)
    wheels, before, changes = STILL, None, 0
    for _ in range(round(40.0 / DT)):
        pose, old = floor.pose, wheels
        wheels = driver.command(pose, wheels, None, DT)
        if driver.status == "arrived":
            assert pose.distance_to(goal) <= environment.navigation.haptic.tolerance
            assert (
                abs(wrap(pose.yaw - goal.yaw)) <= environment.navigation.haptic.yaw_tolerance + 1e-9
            )
            return changes
        floor.move((wheels.vx * DT, wheels.vy * DT, wheels.wz * DT), values(old), values(wheels))
        if pose.distance_to(goal) < NEAR and wheels.speed > 0.02:
            going = math.atan2(wheels.vy, wheels.vx) + pose.yaw
            changes += before is not None and abs(wrap(going - before)) > 0.5 * math.pi
            before = going
    raise AssertionError("the robot did not arrive")


def values(twist: Twist2) -> tuple[float, float, float]:
    return twist.vx, twist.vy, twist.wz


@pytest.mark.requirement(79, 81, 146)
@pytest.mark.parametrize("slip", [LINOLEUM, WORN], ids=["linoleum", "worn"])
@pytest.mark.parametrize(
    ("profile", "tolerance"), [("paper", None), ("tuned", None), ("paper", 0.3)]
)
@pytest.mark.few(2)
def test_a_slipping_base_turns_back_at_most_twice_near_its_goal(
    profile: str, tolerance: float | None, slip: Slip
) -> None:
    environment, rng = environment_with(profile, tolerance), np.random.default_rng(81)
    for seed in range(20):
        start, goal = (
            Pose2(rng.uniform(1.5, 10.5), rng.uniform(1.5, 8.5), rng.uniform(-3.0, 3.0))
            for _ in "ab"
        )
        assert turns_back(environment, start, goal, Body(slip, start, seed)) <= 2
