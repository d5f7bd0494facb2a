"""Robot and user at one instant: the input of nearly every decision."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from behaviors.profile import Settings
from behaviors.situation.keys import SETTINGS, settings_of
from engine import Context
from hw import Pose2, Twist2, UserPose
from hw.scene import Disc, Point
from states import SubsystemName
from states.environment import ENVIRONMENT, Environment, environment_of, extrapolated_state
from states.navigation import PLANNERS, planner_of

if TYPE_CHECKING:
    from states.navigation import GlobalPlanner

READS: Mapping[str, float | None] = {ENVIRONMENT: None, SETTINGS: None, **extrapolated_state.READS}
"""`reads` of a state that asks for a situation."""
WAYS: Mapping[str, float | None] = {**READS, **PLANNERS}
"""`reads` of a state that asks for a situation with planners."""

CHANGES = tuple(extrapolated_state.READS)
"""The signals that a situation depends on: a state that watches it waits for news of these."""


@dataclass(frozen=True, slots=True, eq=False)
class Situation:
    """Robot and user now, with environment, settings and planners.

    `pose` is map_from_base, `twist` the robot's velocity in the base frame, `user` the user's pose
    in the map, `velocity` the user's in the map frame, with the body's turn rate as wz. `share` is
    the fraction of the speed that the age of the poses admits. `planners` are those requested, by
    subsystem.
    """

    environment: Environment
    settings: Settings
    pose: Pose2
    twist: Twist2
    user: UserPose
    velocity: Twist2
    planners: Mapping[SubsystemName, GlobalPlanner]
    share: float = 1.0

    @property
    def distance(self) -> float:
        """From the user's body to the robot's centre, m."""
        return self.pose.distance_to(self.user.body)

    @property
    def rest(self) -> Pose2:
        """Where the robot comes to rest if it brakes now, map_from_base."""
        return self.environment.standstill(self.pose, self.twist)

    @property
    def around(self) -> extrapolated_state.RobotAndUser:
        """Robot and user as local planners take them."""
        walking = (self.velocity.vx, self.velocity.vy)
        return extrapolated_state.RobotAndUser(
            self.pose, self.twist, self.user, walking, self.share
        )

    def user_disc(self, name: SubsystemName, goal: Point) -> Disc:
        """The disc around the user that a subsystem's path to this goal avoids, in the map.

        It is grown by the profile's `spare`, but never so far that it would cover robot or goal.
        """
        body, radius = self.user.body, self.environment.navigation.named(name).user_radius
        return Disc(body.x, body.y, radius).grown(
            self.settings.user.margins.spare, (self.pose.x, self.pose.y), goal
        )


def situation(ctx: Context, *subsystems: SubsystemName) -> Situation | None:
    """The current situation with these planners; None while any of it is unknown or too old."""
    robot, person = extrapolated_state.robot(ctx), extrapolated_state.user(ctx)
    if robot is None or person is None:
        return None
    (pose, twist, share), (user, velocity, admissible) = robot, person
    if velocity is None:
        return None
    planners = {}
    for name in subsystems:
        planner = planner_of(ctx, name)
        if planner is None:
            return None
        planners[name] = planner
    share = min(share, admissible)
    environment, settings = environment_of(ctx), settings_of(ctx)
    return Situation(environment, settings, pose, twist, user, velocity, planners, share)
