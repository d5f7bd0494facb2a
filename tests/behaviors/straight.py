"""The command of a straight drive at one instant."""

from __future__ import annotations

from behaviors.situation import Situation
from hw import Pose2, Twist2
from hw.scene import Point
from states import SubsystemName
from states.navigation import straight_driver_of, user_disc


def command_towards(now: Situation, goal: Point, name: SubsystemName) -> Twist2:
    driver = straight_driver_of(now.environment, name, now.planners[name])
    driver.go_to(Pose2(*goal))
    disc = user_disc(now.user, now.environment.navigation.named(name))
    return driver.command(now.pose, now.twist, disc, now.environment.period)
