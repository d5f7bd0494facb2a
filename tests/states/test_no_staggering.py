"""On a floor where the wheels slip the robot arrives without going to and fro (R81)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from behaviors.profile import load_profile
from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.robot import load_robot
from hw.room import Room
from states.site import Site

ROOM = Room(outer=((0.0, 0.0), (12.0, 0.0), (12.0, 9.0), (0.0, 9.0)))
DT = 1.0 / 30.0
NEAR = 0.5


def slipped(pose: Pose2, wheels: Twist2, slip: np.ndarray) -> Pose2:
    """Where a base gets to whose wheels slip along, across and in turns."""
    along, across, turn = 1.0 + slip
    moved = Twist2(wheels.vx * along, wheels.vy * across, wheels.wz * turn)
    way = moved.rotated(pose.yaw + 0.5 * moved.wz * DT)
    return Pose2(pose.x + way.vx * DT, pose.y + way.vy * DT, wrap(pose.yaw + moved.wz * DT))


def turns_back(site: Site, start: Pose2, goal: Pose2, rng: np.random.Generator) -> int:
    """Changes of direction by more than a right angle in the last half metre of a drive.

    The pose is tracked, the velocity that of the wheels.
    """
    driver = site.driver("haptic", site.static_planners["haptic"])
    driver.go_to(goal)
    pose, wheels, slip = start, STILL, np.zeros(3)
    before, changes = None, 0
    for _ in range(round(30.0 / DT)):
        wheels = driver.command(pose, wheels, None, DT)
        if driver.status == "arrived":
            assert pose.distance_to(goal) <= site.navigation.haptic.tolerance
            return changes
        # slip stays for a while: patches of floor, up to 30 % of the way
        slip = np.clip(0.9 * slip + rng.normal(0.0, 0.1, 3), -0.3, 0.3)
        pose = slipped(pose, wheels, slip)
        if pose.distance_to(goal) < NEAR and wheels.speed > 0.02:
            going = math.atan2(wheels.vy, wheels.vx) + pose.yaw
            changes += before is not None and abs(wrap(going - before)) > 0.5 * math.pi
            before = going
    raise AssertionError("the robot did not arrive")


@pytest.mark.requirement(79, 81)
@pytest.mark.parametrize("name", ["paper", "tuned"])
def test_a_slipping_robot_changes_direction_at_most_twice_near_its_goal(name: str) -> None:
    site = load_profile(name).site(ROOM, load_robot("rbkairos_ur10"))
    rng = np.random.default_rng(81)
    for _ in range(30):
        start, goal = (
            Pose2(rng.uniform(1.5, 10.5), rng.uniform(1.5, 7.5), rng.uniform(-3.0, 3.0))
            for _ in "ab"
        )
        assert turns_back(site, start, goal, rng) <= 2
