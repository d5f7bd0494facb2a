"""Escape: its states, and the choice among the Escape poses (paper 4.4.3)."""

from __future__ import annotations

from collections.abc import Sequence

from behaviors.escape_poses import free_poses
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
from hw import OLD_S, Joints, Pose2
from states.environment import ARM_JOINTS
from states.navigation import DRIVES, BaseDrive, is_there, user_disc


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
    reads = {**WAYS, **DRIVES, ESCAPE_POSES: OLD_S, ESCAPE_SAFE: OLD_S, ARM_JOINTS: OLD_S}
    commands = ("base", "vr")

    def run(self, ctx: Context) -> Run:
        vr, goal, planner, warned = ctx.part("vr"), None, None, False
        on_the_way = settings_of(ctx).escape.safe_on_the_way and not ctx.value(ESCAPE_SAFE)
        drives = BaseDrive(ctx, "escape", "escape", patience=None, straight=True)
        try:
            with drives as drive:
                while True:
                    now = situation(ctx, "escape")
                    if now is None:
                        drive.rest()
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
                    drive.towards(goal, now=now.around)
                    yield None
        finally:
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
    from behaviors.dodge import is_caught
    from behaviors.escape_goal import safest_goal

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
