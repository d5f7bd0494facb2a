"""A goal that is chosen can be driven to: choosing keeps farther from the user than driving."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from behaviors import haptic
from behaviors.chase.waiting_place import chase_place
from behaviors.profile.profile import Profile
from behaviors.situation.chase_ring import ChaseRing
from behaviors.situation.present_situation import Situation
from hw.geometry import STILL, Pose2, Pose3
from hw.samples import UserPose
from hw.scene.room import Disc
from hw.scene.scene import load_scene
from states.navigation.planners import driver_of

LAB = load_scene("lab_b").room


def situations(make: Callable[..., Situation], profile: Profile, count: int) -> Iterator[Situation]:
    """Robot and user anywhere in the room, near to each other."""
    chance = random.Random("ways")
    while count:
        user = Pose2(chance.uniform(0.5, 11.0), chance.uniform(0.5, 9.6), chance.uniform(-3, 3))
        away, angle = chance.uniform(1.3, 3.0), chance.uniform(-math.pi, math.pi)
        robot = Pose2(user.x + away * math.cos(angle), user.y + away * math.sin(angle), angle)
        if LAB.clearance(user.x, user.y) >= 0.5 and LAB.clearance(robot.x, robot.y) >= 0.8:
            count -= 1
            yield make(profile, robot, UserPose(user, user.yaw), room=LAB)


def has_way(now: Situation, name: Any, goal: Pose2) -> bool:
    driver, body = driver_of(now.environment, name, now.planners[name]), now.user.body
    driver.go_to(goal)
    disc = Disc(body.x, body.y, now.environment.navigation.named(name).user_radius)
    driver.command(now.pose, STILL, disc, now.environment.period)
    return driver.status != "blocked"


def test_each_chase_pose_chosen_has_a_way(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    found = 0
    for now in situations(situation_of, tuned, 80):
        place = chase_place(now, ChaseRing.of(now.settings.chase))
        if place is not None:
            found += 1
            assert has_way(now, "chase", Pose2(*place, now.pose.yaw)), (now.pose, now.user)
    assert found > 26


def test_each_haptic_pose_in_reach_has_a_way(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    found = 0
    for now in situations(situation_of, tuned, 150):
        body = now.user.body
        deep = Pose3.from_yaw(*body.transform(0.85, 0.0), 1.5, body.yaw)
        free = haptic.poses(now.settings, now.planners["haptic"], deep)
        for goal in haptic.reachable(now, "haptic", free):
            found += 1
            assert has_way(now, "haptic", goal), (now.pose, now.user, goal)
    assert found > 100


@pytest.mark.parametrize(
    ("away", "goal", "radius"),
    [(5.0, 5.0, 1.62), (1.61, 5.0, 1.61), (5.0, 1.605, 1.605), (1.2, 5.0, 1.6), (5.0, 1.3, 1.6)],
)
def test_the_disc_kept_from_the_user_grows_over_neither_robot_nor_goal(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    away: float,
    goal: float,
    radius: float,
) -> None:
    user = Pose2(10.0, 10.0)
    now = situation_of(tuned, Pose2(10.0 + away, 10.0), UserPose(user, 0.0))

    assert now.user_disc("haptic", (10.0, 10.0 + goal)) == Disc(10.0, 10.0, pytest.approx(radius))
