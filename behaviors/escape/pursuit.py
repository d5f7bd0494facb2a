"""Pursuit: whether a user who keeps walking at the robot catches it (paper 4.4.4)."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from behaviors.person import pursued, roll_out
from behaviors.situation import Situation
from hw import Outline, Pose2


def caught_within(now: Situation) -> float:
    """Time before a predicted touch at which an approaching user is warned, s.

    It is their stopping time, and the delays until their walk is detected and the sign is shown.
    """
    user = now.settings.user
    return user.walks.stops + user.window + now.environment.delay


def is_caught(
    now: Situation, goals: Iterable[Pose2], outline: Outline | None = None, calm: float = 0.0
) -> bool:
    """True if a user who keeps walking at the robot touches it soon on every drive.

    They approach it now, or soon will along their arc; prediction alone would assume that each of
    their turns is the last. The `goals` are evaluated only if braking does not avoid a touch. With
    `calm`, s, as hysteresis it stays true for so much longer, and for twice the angle.
    """
    heads_at = now.settings.user.walks.heads_at
    if not walks_at_it(now, heads_at if calm <= 0.0 else 2.0 * heads_at):
        return False
    speed, rest, within = now.environment.navigation.escape.max_speed, now.rest, caught_within(now)
    within += calm
    if pursued(now, roll_out(now, [(rest.x, rest.y)], speed), outline)[0] >= within:
        return False
    rollouts = roll_out(now, [(goal.x, goal.y) for goal in goals], speed)
    later = np.flatnonzero(pursued(now, rollouts, outline) >= within).tolist()
    return not any(rollouts.keeps_off(i, now.planners["escape"]) for i in later)


def walks_at_it(now: Situation, within: float) -> bool:
    """True if the user walks within so many rad of the direction to the robot, or soon will.

    Their bend is taken to go on for a while, if it leads towards the robot.
    """
    body, velocity = now.user.body, now.velocity
    if velocity.speed <= 0.0:
        return False
    heads = Pose2(body.x, body.y, math.atan2(velocity.vy, velocity.vx))
    off = heads.bearing_to(now.pose)
    walks = now.settings.user.walks  # what turns faster is the tail of a turn on the spot
    bend = math.copysign(1.0, off) * max(-walks.bend_most, min(walks.bend_most, velocity.wz))
    return abs(off) - max(0.0, bend) * walks.bend_for < within
