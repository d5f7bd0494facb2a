"""Danger: whether the user is about to walk into the robot (paper 4.4.3, R104, R112)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from behaviors.escape_poses import free_poses
from behaviors.person import is_met_braking, time_aside
from behaviors.profile import EscapeSettings, Settings
from behaviors.situation import Situation
from hw import STILL, Pose2, Twist2, UserPose, wrap
from states import SubsystemName
from states.environment import Environment
from states.signals import time_to_contact

if TYPE_CHECKING:
    from states.navigation import GlobalPlanner

    Ways = Mapping[SubsystemName, GlobalPlanner]

CATCH_FROM, CATCH_S = 1.6, 1.8
"""Pursuit is checked only if the user could be within CATCH_FROM, m, in CATCH_S, s."""
CALM_S = 0.1
"""Time margin, s, with which a danger is over …"""
BRAKED_S = 0.15
"""… even after braking for this long, s, until Chase drives on."""
LOOKAHEAD_S = 3.0
"""Predicted contacts later than this are ignored, s."""


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
    if will_be_reached(environment, escape, user.body, base, velocity, twist.rotated(base.yaw)):
        return True
    if escape.trigger == "zones":
        return False
    if _is_far(user, base, velocity):
        return False
    ways: Ways = {"escape": planner}
    return _is_caught(Situation(environment, settings, base, twist, user, velocity, ways))


def _is_far(user: UserPose, base: Pose2, velocity: Twist2, calm: float = 0.0) -> bool:
    """True if the user is too far away to catch the robot soon."""
    return user.body.distance_to(base) > CATCH_FROM + (CATCH_S + calm) * velocity.speed


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
    later = replace(
        escape, contact=escape.contact + escape.hysteresis, reaction=escape.reaction + CALM_S
    )
    motion, slower = twist.rotated(base.yaw), environment.limits.base_acceleration * BRAKED_S
    for driven in (motion, _braked(motion, slower)):
        if will_be_reached(environment, later, user.body, base, velocity, driven):
            return False
    if escape.trigger == "zones":
        return True
    if _is_far(user, base, velocity, CALM_S):
        return True
    ways: Ways = {"escape": planner}
    now = Situation(environment, settings, base, twist, user, velocity, ways)
    return not _is_caught(now, CALM_S)


def _braked(twist: Twist2, by: float) -> Twist2:
    """A velocity whose speed has been reduced by so much, m/s."""
    share = max(0.0, 1.0 - by / max(twist.speed, 1e-9))
    return Twist2(share * twist.vx, share * twist.vy)


def will_be_reached(
    environment: Environment,
    escape: EscapeSettings,
    user: Pose2,
    base: Pose2,
    velocity: Twist2,
    motion: Twist2 = STILL,
) -> bool:
    """True if the user, walking straight on, would reach the robot before it could move aside.

    `velocity` is the user's, `motion` the robot's, both in the map frame. There is no danger if
    both can go on as they do. Else the robot keeps its motion for the profile's `reaction` and then
    drives off sideways, to whichever side takes less time; beside the user, or ahead and as fast,
    it is its own motion that takes it into their line, and it brakes. Late poses and commands add
    to its reaction, uncertain poses to the distance `contact` that the user's line has to keep from
    its centre.
    """
    speed, contact = velocity.speed, escape.contact + environment.user_margin
    if speed < escape.moving:
        return False
    x, y = base.x - user.x, base.y - user.y
    relative = (velocity.vx - motion.vx, velocity.vy - motion.vy)
    if not time_to_contact((-x, -y), relative, contact) < LOOKAHEAD_S:
        return False
    c, s = velocity.vx / speed, velocity.vy / speed
    along, lateral = c * x + s * y, c * y - s * x  # off the user's line, to its left
    closing, drift = speed - c * motion.vx - s * motion.vy, c * motion.vy - s * motion.vx
    reaction = escape.reaction + environment.delay
    acceleration = environment.limits.base_acceleration
    if along <= 0.0 or closing <= 0.0:
        return is_met_braking((x, y), velocity, motion, contact, reaction, acceleration)
    aside = time_aside(lateral + reaction * drift, drift, contact, acceleration)
    reach = along - math.sqrt(max(0.0, contact * contact - lateral * lateral))
    return max(0.0, reach) < closing * (reaction + aside)
