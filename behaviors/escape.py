"""Escape: its trigger, the Escape poses, and the drive to one of them (paper 4.4.3)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from behaviors.prediction import is_met_braking, time_aside
from behaviors.profile import EscapeSettings, Settings
from behaviors.situation import (
    ESCAPE_POSES,
    ESCAPE_REQUIRED,
    ESCAPE_SAFE,
    WAYS,
    Situation,
    settings_of,
    situation,
)
from engine import Action, Context, Monitor, On, Run
from hw import OLD_S, STILL, Joints, Pose2, Twist2, UserPose, wrap
from states import SubsystemName
from states.environment import ARM_JOINTS, Environment
from states.navigation import is_there, user_disc
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


def all_poses(escape: EscapeSettings, user: UserPose, base: Pose2) -> Iterator[Pose2]:
    """All Escape poses in order: away from the user, yaw kept (R106, R107, R110)."""
    away = math.atan2(base.y - user.body.y, base.x - user.body.x)
    for distance in escape.distances:
        for angle in escape.angles:
            x = base.x + distance * math.cos(away + angle)
            y = base.y + distance * math.sin(away + angle)
            yield Pose2(x, y, base.yaw)


def poses(
    settings: Settings, planner: GlobalPlanner, user: UserPose, base: Pose2
) -> tuple[Pose2, ...]:
    """The Escape poses that are free by Escape's own planner, in order (R105, R108)."""
    return tuple(free_poses(settings, planner, user, base))


def free_poses(
    settings: Settings, planner: GlobalPlanner, user: UserPose, base: Pose2
) -> Iterator[Pose2]:
    """As `poses`, but nothing is computed before the first of them is asked for."""
    import numpy as np

    found = tuple(all_poses(settings.escape, user, base))
    free = planner.are_free(np.array([(pose.x, pose.y) for pose in found])).tolist()
    yield from (pose for pose, is_free in zip(found, free, strict=True) if is_free)


class EscapeRequired(Monitor):
    """`required` when the user could walk into the robot, which then has to escape (R62, R104)."""

    outcomes = ("required",)
    reads = {ESCAPE_REQUIRED: OLD_S}

    def run(self, ctx: Context) -> Run:
        news = On(ESCAPE_REQUIRED)
        while not ctx.value(ESCAPE_REQUIRED):
            yield news
        return "required"


class Flee(Action):
    """Drive to an Escape pose, as fast as possible and without turning (R109-R111).

    The arm stays as it is, and its outline is taken into account. Once every drive is predicted to
    end in a touch within the profile's `warning`, the stop sign is shown while the robot drives on
    (R114). `safe`: the danger is over, at an Escape pose, or, if the profile allows it, on the way
    (R112). An Escape that began without danger, after a failure of Chase, has to reach its pose.
    `no_pose`: no Escape pose is free. `no_way`: none can be reached. While the pose of robot or
    user or the user's velocity is unknown the base brakes until the tracking guard ends the state.
    """

    outcomes = ("safe", "no_pose", "no_way")
    reads = {**WAYS, ESCAPE_POSES: OLD_S, ESCAPE_SAFE: OLD_S, ARM_JOINTS: OLD_S}
    commands = ("base", "vr")

    def run(self, ctx: Context) -> Run:
        from behaviors.straight_drive import command_towards

        base, vr, goal, planner = ctx.part("base"), ctx.part("vr"), None, None
        warned = False
        on_the_way = settings_of(ctx).escape.safe_on_the_way and not ctx.value(ESCAPE_SAFE)
        try:
            while True:
                now = situation(ctx, "escape")
                if now is None:
                    base.release("escape")
                    yield None
                    continue
                subsystem = now.environment.navigation.escape
                if planner is not now.planners["escape"]:
                    planner = now.planners["escape"]
                    goal = _still_in_reach(now, goal)
                there = goal is not None and is_there(now.pose, now.twist, goal, subsystem)
                safe = ctx.value(ESCAPE_SAFE)
                if safe and (there or (on_the_way and _can_stop(now))):
                    return "safe"
                if there and not safe:
                    goal = None
                free = ctx.value(ESCAPE_POSES) or ()
                arm = ctx.value(ARM_JOINTS)
                goal, touches = choose(now, free, goal, None if arm is None else arm.joints)
                if goal is None:
                    return "no_way" if free else "no_pose"
                if touches and not warned:
                    vr.inform(True)
                    warned = True
                command = command_towards(now, (goal.x, goal.y), "escape")
                base.drive(now.slowed(command, "escape"), "escape")
                yield None
        finally:
            base.release("escape")
            if warned:
                vr.inform(False)


def _can_stop(now: Situation) -> bool:
    """True if the place where the robot would come to rest is free."""
    return now.planners["escape"].is_free((now.rest.x, now.rest.y))


def choose(
    now: Situation, free: Sequence[Pose2], goal: Pose2 | None, joints: Joints | None
) -> tuple[Pose2 | None, bool]:
    """The pose to drive to, by the profile's `order`, and whether a touch has to be reckoned with.

    None if none can be reached. `free` are the free Escape poses, `goal` is the pose driven to so
    far, `joints` are the arm's, rad, if known.
    """
    escape = now.settings.escape
    if escape.order == "given":
        return goal or _first_in_reach(now, free), False
    from behaviors.dodge import is_caught, safest_goal

    outline = now.environment.outline(joints)
    goals = (*(() if goal is None else (goal,)), *free)
    best, touch_after = safest_goal(now, goals, goal, outline)
    due = touch_after < escape.warning + now.environment.delay
    return best, due or is_caught(now, free, outline)


def can_get_away(now: Situation) -> bool:
    """True if there is a pose to which Escape could drive."""
    free = free_poses(now.settings, now.planners["escape"], now.user, now.pose)
    return choose(now, tuple(free), None, None)[0] is not None


def _still_in_reach(now: Situation, goal: Pose2 | None) -> Pose2 | None:
    """The goal, unless a scanned obstacle now blocks the way to it."""
    here, planner = (now.pose.x, now.pose.y), now.planners["escape"]
    return goal if goal is not None and planner.allows(here, (goal.x, goal.y)) else None


def _first_in_reach(now: Situation, free: Sequence[Pose2]) -> Pose2 | None:
    planner = now.planners["escape"]
    disc = user_disc(now.user, now.environment.navigation.escape)
    here = (now.pose.x, now.pose.y)
    return next((goal for goal in free if planner.allows(here, (goal.x, goal.y), disc)), None)
