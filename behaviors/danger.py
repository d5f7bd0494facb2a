"""Danger: whether the user is about to walk into the robot (paper 4.4.3, R104, R112)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from behaviors.escape_poses import free_poses
from behaviors.profile import EscapeSettings, Settings
from behaviors.situation import Situation
from hw import STILL, Pose2, Twist2, UserPose, wrap
from states import SubsystemName
from states.environment import Environment

if TYPE_CHECKING:
    from behaviors.person import Clearing
    from states.navigation import GlobalPlanner

    Ways = Mapping[SubsystemName, GlobalPlanner]


def in_zone(escape: EscapeSettings, user: UserPose, base: Pose2, margin: float = 0.0) -> bool:
    """True if the robot's centre is in one of the user's two zones (R104), grown by `margin`, m."""
    dx, dy = base.x - user.body.x, base.y - user.body.y
    distance = math.hypot(dx, dy)
    if distance >= max(escape.ahead, escape.around) + margin:
        return False
    view = user.head_yaw if escape.view == "head" else user.body.yaw
    bearing = wrap(math.atan2(dy, dx) - view)
    reach = escape.ahead if abs(bearing) <= escape.half_view else escape.around
    return distance < reach + margin


def is_required(
    environment: Environment,
    settings: Settings,
    planner: GlobalPlanner,
    user: UserPose,
    base: Pose2,
    velocity: Twist2,
    twist: Twist2,
) -> bool:
    """True if the user moves, and the robot is in a zone or about to be walked into (R104).

    `planner` is Escape's, `twist` the robot's velocity in the base frame. By the profile's
    `trigger` a zone alone is no danger; a user approaching a robot that cannot get away is one.
    """
    escape = settings.escape
    if velocity.speed < escape.moving:
        return False
    if escape.trigger == "zones" and in_zone(escape, user, base):
        return True
    if not escape.predict:
        return False
    from behaviors.person import Clearing

    rules = Clearing.of(environment, settings)
    if will_be_reached(rules, user.body, base, velocity, twist.rotated(base.yaw)):
        return True
    if escape.trigger == "zones":
        return False
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
    braking = twist.speed * twist.speed / (2.0 * rules.acceleration)
    near = rules.contact + settings.user.margins.touch
    return user.body.distance_to(base) > near + velocity.speed * within + braking


def _is_caught(now: Situation, calm: float = 0.0) -> bool:
    from behaviors.dodge import is_caught

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
    """True if the danger is over, with hysteresis (R112); arguments as for `is_required`.

    No contact is predicted, and, if zones are what triggers, the robot is outside both.
    """
    escape = settings.escape
    if escape.trigger == "zones" and in_zone(escape, user, base, escape.hysteresis):
        return False
    if not escape.predict:
        return True
    from behaviors.person import Clearing

    calm, rules = settings.user.margins.calm, Clearing.of(environment, settings)
    later = rules._replace(
        contact=rules.contact + escape.hysteresis, reaction=rules.reaction + calm
    )
    motion, slower = twist.rotated(base.yaw), rules.acceleration * escape.reaction
    for driven in (motion, _braked(motion, slower)):
        if velocity.speed >= escape.moving and will_be_reached(
            later, user.body, base, velocity, driven
        ):
            return False
    if escape.trigger == "zones":
        return True
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
    from behaviors.person import time_left

    apart = (base.x - user.x, base.y - user.y)
    walks, drives = (velocity.vx, velocity.vy), (motion.vx, motion.vy)
    return time_left(apart, walks, drives, rules) < 0.0
