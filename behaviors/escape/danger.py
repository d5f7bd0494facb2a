"""Danger: whether the user is about to walk into the robot (paper 4.4.3, R104, R112)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from behaviors import person
from behaviors.escape.escape_poses import free_poses
from behaviors.profile import Settings
from behaviors.situation import Situation
from hw import STILL, Pose2, Twist2, UserPose
from states import SubsystemName
from states.environment import Environment

if TYPE_CHECKING:
    from behaviors.person import Clearing
    from states.navigation import GlobalPlanner

    Ways = Mapping[SubsystemName, GlobalPlanner]


def is_required(
    environment: Environment,
    settings: Settings,
    planner: GlobalPlanner,
    user: UserPose,
    base: Pose2,
    velocity: Twist2,
    twist: Twist2,
) -> bool:
    """True if the user moves and is about to walk into the robot, or, cornered, soon will be.

    `planner` is Escape's, `twist` the robot's velocity in the base frame.
    """
    escape = settings.escape
    if velocity.speed < escape.moving:
        return False
    rules = person.Clearing.of(environment, settings)
    if will_be_reached(rules, user.body, base, velocity, twist.rotated(base.yaw)):
        return True
    if _is_far(rules, settings, user, base, velocity, twist):
        return False
    ways: Ways = {"escape": planner}
    return _is_caught(Situation(environment, settings, base, twist, user, velocity, ways))


def _is_far(
    rules: Clearing,
    settings: Settings,
    user: UserPose,
    base: Pose2,
    velocity: Twist2,
    twist: Twist2,
    calm: float = 0.0,
) -> bool:
    """True if the user cannot come into contact before a sign that is shown now stops them.

    It is a bound, for both walking straight at each other and the robot braking.
    """
    within = settings.user.walks.stops + settings.user.window + rules.reaction + calm
    braking = (twist.vx * twist.vx + twist.vy * twist.vy) / (2.0 * rules.acceleration)
    near = rules.contact + settings.user.margins.touch
    return user.body.distance_to(base) > near + velocity.speed * within + braking


def _is_caught(now: Situation, calm: float = 0.0) -> bool:
    from behaviors.escape.pursuit import is_caught

    free = free_poses(now.settings, now.planners["escape"], now.user, now.pose)
    return is_caught(now, free, calm=calm)


def is_safe(
    environment: Environment,
    settings: Settings,
    planner: GlobalPlanner,
    user: UserPose,
    base: Pose2,
    velocity: Twist2,
    twist: Twist2,
) -> bool:
    """True if no contact is predicted any more, with hysteresis (R112).

    Arguments as for `is_required`.
    """
    escape = settings.escape
    calm, rules = settings.user.margins.calm, person.Clearing.of(environment, settings)
    later = rules._replace(
        contact=rules.contact + escape.hysteresis, reaction=rules.reaction + calm
    )
    motion, slower = twist.rotated(base.yaw), rules.acceleration * escape.reaction
    for driven in (motion, _braked(motion, slower)):
        if velocity.speed >= escape.moving and will_be_reached(
            later, user.body, base, velocity, driven
        ):
            return False
    if _is_far(rules, settings, user, base, velocity, twist, calm):
        return True
    ways: Ways = {"escape": planner}
    now = Situation(environment, settings, base, twist, user, velocity, ways)
    return not _is_caught(now, calm)


def _braked(twist: Twist2, by: float) -> Twist2:
    """A velocity whose speed has been reduced by so much, m/s."""
    share = max(0.0, 1.0 - by / max(twist.speed, 1e-9))
    return Twist2(share * twist.vx, share * twist.vy)


def will_be_reached(
    rules: Clearing, user: Pose2, base: Pose2, velocity: Twist2, motion: Twist2 = STILL
) -> bool:
    """True if the robot has no margin left on the line that the user walks straight on.

    `velocity` is the user's, who walks, `motion` the robot's, both in the map frame.
    """
    apart = (base.x - user.x, base.y - user.y)
    walks, drives = (velocity.vx, velocity.vy), (motion.vx, motion.vy)
    return person.time_left(apart, walks, drives, rules) < 0.0
