"""Robot and user at one instant: what nearly every decision looks at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from behaviors.settings import Settings
from engine.state import Context
from hw.geometry import Pose2, Twist2
from hw.samples import UserPose
from states.site import Site

AGE_S = 0.15
"""Poses and velocities are used up to this age, s."""

READS: Mapping[str, float | None] = {
    "site": None,
    "settings": None,
    "base.pose": AGE_S,
    "base.twist": AGE_S,
    "user.pose": AGE_S,
    "user.velocity": AGE_S,
}
"""What a state must declare to ask for a situation."""


@dataclass(frozen=True, slots=True, eq=False)
class Situation:
    """`pose` and `twist` are the robot's, map_from_base and its velocity in the base frame.

    `user` is the user's pose and `velocity` their velocity in the map, turn of the body as wz.
    """

    site: Site
    settings: Settings
    pose: Pose2
    twist: Twist2
    user: UserPose
    velocity: Twist2

    @property
    def distance(self) -> float:
        """From the user's body to the robot's centre, m."""
        return self.pose.distance_to(self.user.body)

    @property
    def rest(self) -> Pose2:
        """Where the robot comes to rest if it brakes now."""
        return self.site.standstill(self.pose, self.twist)


def situation(ctx: Context) -> Situation | None:
    """The present situation; None while something is unknown or too old."""
    pose, twist = ctx.value("base.pose"), ctx.value("base.twist")
    user, velocity = ctx.value("user.pose"), ctx.value("user.velocity")
    if pose is None or twist is None or user is None or velocity is None:
        return None
    return Situation(ctx.value("site"), ctx.value("settings"), pose, twist, user, velocity)
