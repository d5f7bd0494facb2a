"""A base whose wheels slip still comes to rest within its tolerance without staggering (R81)."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest

from behaviors.profile import load_profile
from hw.geometry import Pose2, Twist2
from hw.robot import load_robot
from hw.room import Room
from states.site import Navigation, Site

PERIOD = 1.0 / 30.0
NEAR = 0.6
"""Where direction changes are counted, m from the goal."""
GOAL = Pose2(8.0, 5.0, 1.2)
STARTS = [Pose2(2.0, 2.0, 0.0), Pose2(5.0, 8.0, 3.0), Pose2(9.5, 2.0, -1.5), Pose2(3.0, 5.0, 1.2)]


def site_with(tolerance: float) -> Site:
    room = Room(outer=((0.0, 0.0), (12.0, 0.0), (12.0, 10.0), (0.0, 10.0)))
    site = load_profile("paper").site(room, load_robot("rbkairos_ur10"))
    haptic = replace(site.navigation.haptic, tolerance=tolerance)
    chase, escape = site.navigation.chase, site.navigation.escape
    return replace(site, navigation=Navigation(chase=chase, haptic=haptic, escape=escape))


def drive(site: Site, start: Pose2, slip: float, seed: int) -> tuple[Pose2, int, bool]:
    """Where a slipping base comes to rest, how often it turned back near the goal, and whether.

    What is commanded is lost by up to `slip`, differently along and across and in every tick, and
    turns the base a little; the measured twist is that of the slipping base.
    """
    chance, driver = random.Random(seed), site.driver("haptic", site.static_planners["haptic"])
    driver.go_to(GOAL)
    pose, twist, changes, sense = start, Twist2(0.0), 0, 0
    for _ in range(1200):
        command = driver.command(pose, twist, None, PERIOD)
        if driver.status == "arrived":
            return pose, changes, True
        along, across = (1.0 - slip * chance.random() for _ in range(2))
        wz = command.wz * (1.0 - slip * chance.random()) + 0.05 * slip * chance.gauss(0.0, 1.0)
        twist = Twist2(command.vx * along, command.vy * across, wz)
        motion = twist.rotated(pose.yaw)
        before = pose.distance_to(GOAL)
        pose = Pose2(
            pose.x + motion.vx * PERIOD, pose.y + motion.vy * PERIOD, pose.yaw + wz * PERIOD
        )
        moved = before - pose.distance_to(GOAL)
        if before < NEAR and abs(moved) > 1e-4:
            now = 1 if moved > 0.0 else -1
            changes += sense not in (0, now)
            sense = now
    return pose, changes, False


@pytest.mark.requirement(79, 81, 146)
@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("tolerance", [0.2, 0.3])
@pytest.mark.parametrize("slip", [0.0, 0.1, 0.3])
def test_a_slipping_base_turns_back_at_most_twice_near_its_goal(
    tolerance: float, slip: float, start: Pose2
) -> None:
    for seed in range(3):
        pose, changes, arrived = drive(site_with(tolerance), start, slip, seed)

        assert arrived
        assert pose.distance_to(GOAL) <= tolerance
        assert abs(math.remainder(pose.yaw - GOAL.yaw, math.tau)) <= 0.1 + 1e-9
        assert changes <= 2
