"""Choosing where to drive beside a walking user, to make room in Chase."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from behaviors.person import (
    SETS_OFF_S,
    STOPPED_S,
    Array,
    Rollouts,
    crowding,
    efforts,
    haste,
    lateness,
    predict_user,
    pursued,
    roll_out,
)
from behaviors.situation import TURN_ROOM, Situation
from hw import Outline, Pose2, Twist2
from hw.scene import Point
from states import SubsystemName

CAUGHT_S = STOPPED_S + 0.3
"""Time before a predicted touch at which an approaching user is warned, s: their stopping time, and
the delay until their walk is detected."""
HEADING = math.radians(20.0)
"""A user whose heading is within this of the bearing to the robot counts as approaching, rad."""
TURNING_S, BEND = 0.5, 1.2
"""Look-ahead along the user's arc, s. Turn rates are clamped to BEND, rad/s; anything faster is the
tail of a turn on the spot."""

RINGS = (0.6, 1.2, 2.0)
DIRECTIONS = 16
"""Candidate places to make room: rings around the robot, m, with this many directions each."""
TOUCH, DREAD = 1.8, 10.0
"""For distances to the user below TOUCH, m, the squared deficit is added DREAD times."""
HASTE = 4.0
"""Weight of approaching the user faster than the robot can brake."""
LATE, EARLY_S = 30.0, 0.4
"""Weight of squared lateness in clearing the user's path; desired time margin, s."""
PACE, SETS_OFF = 1.3, 0.2
"""Assumed speed of a user who sets off after a turn, m/s; and below which they stand, m/s."""
STRAIGHT = ("constant_velocity",)
"""Predictors of a user who sets off after a turn on the spot."""
BENDS = 0.25
"""Turn rate of a walking user above which a tighter bend is predicted, too, rad/s."""
AROUND = np.array(
    [
        (radius * math.cos(angle), radius * math.sin(angle))
        for radius in RINGS
        for angle in (math.tau * step / DIRECTIONS for step in range(DIRECTIONS))
    ]
)


def is_caught(
    now: Situation, goals: Iterable[Pose2], outline: Outline | None = None, calm: float = 0.0
) -> bool:
    """True if a user who keeps walking at the robot touches it within CAUGHT_S on every drive.

    They approach it now, or soon will along their arc; prediction alone would assume that each of
    their turns is the last. The `goals` are evaluated only if braking does not avoid a touch. With
    `calm`, s, as hysteresis it stays true for so much longer, and for HEADING more.
    """
    if not walks_at_it(now, HEADING if calm <= 0.0 else 2.0 * HEADING):
        return False
    speed, rest = now.environment.navigation.escape.max_speed, now.rest
    within = CAUGHT_S + calm + now.environment.delay
    if pursued(now, roll_out(now, [(rest.x, rest.y)], speed), outline)[0] >= within:
        return False
    rollouts = roll_out(now, [(goal.x, goal.y) for goal in goals], speed)
    later = np.flatnonzero(pursued(now, rollouts, outline) >= within).tolist()
    return not any(rollouts.keeps_off(i, now.planners["escape"]) for i in later)


def walks_at_it(now: Situation, within: float) -> bool:
    """True if the user walks within so many rad of the direction to the robot, or soon will.

    Their bend is taken to go on for TURNING_S, if it leads towards the robot.
    """
    body, velocity = now.user.body, now.velocity
    if velocity.speed <= 0.0:
        return False
    walks = Pose2(body.x, body.y, math.atan2(velocity.vy, velocity.vx))
    off = walks.bearing_to(now.pose)
    bend = math.copysign(1.0, off) * max(-BEND, min(BEND, velocity.wz))
    return abs(off) - max(0.0, bend) * TURNING_S < within


def place_with_room(
    now: Situation, band: tuple[float, float], present: Point | None
) -> tuple[Point, SubsystemName]:
    """The place around the robot that best keeps the predicted distance to the user in a band.

    `band` is the smallest and the largest distance wanted, m; `present` the current goal. Besides,
    the subsystem whose distances from walls the drive keeps. If every drive comes too near to
    walls, it is the place where the robot comes to rest.
    """
    environment, pose, user = now.environment, now.pose, now.settings.user
    stay = (now.rest.x, now.rest.y)
    fixed = (stay,) if present is None else (stay, present)
    places = np.concatenate((np.array(fixed), AROUND + np.array((pose.x, pose.y))))
    rollouts = roll_out(now, places, environment.navigation.chase.max_speed)
    predictions = predict_user(now, (*user.likely, *user.possible))
    costs = crowding(rollouts.trajectories, predictions, *band, TOUCH, DREAD)
    costs += LATE * _lateness(now, rollouts)
    body, acceleration = now.user.body, environment.limits.base_acceleration
    costs += HASTE * haste(rollouts.trajectories, (body.x, body.y), TURN_ROOM, acceleration)
    costs += efforts(places, pose.x, pose.y, environment.walls)
    order = np.argsort(costs, kind="stable").tolist()
    keeps: tuple[SubsystemName, ...] = ("chase", "escape")
    for name in keeps:
        for i in order:
            if rollouts.keeps_off(i, now.planners[name]):
                return (float(places[i, 0]), float(places[i, 1])), name
    return stay, "escape"


def _lateness(now: Situation, rollouts: Rollouts) -> Array:
    """Squared lateness of the drives in clearing the paths that the user may take, (n,), s2.

    The worst path of a walker counts. A user who turns on the spot may set off at any angle of the
    turn, and the mean counts: the turn mostly ends beyond the robot, and the way out is behind it.
    """
    likely = now.settings.user.likely
    reaction = now.settings.escape.reaction + now.environment.delay + EARLY_S
    walks = (
        [predict_user(now, (*likely, *_bend(now)))]
        if now.velocity.speed >= SETS_OFF
        else [predict_user(_set_off(now, after), STRAIGHT) for after in SETS_OFF_S]
    )
    contact, acceleration = now.settings.escape.contact, now.environment.limits.base_acceleration
    found = [lateness(rollouts.trajectories, w, contact, reaction, acceleration) for w in walks]
    mean: Array = np.mean(found, axis=0)
    return mean


def _bend(now: Situation) -> tuple[str, ...]:
    """The predictor of a walking user whose bend becomes tighter; none for one who goes straight.

    A user who is turning is likely to turn further. Assuming bends of people who walk straight,
    too, doubled the number of Escapes beside them.
    """
    rate = now.velocity.wz
    if abs(rate) < BENDS:
        return ()
    return ("turns_left",) if rate > 0.0 else ("turns_right",)


def _set_off(now: Situation, after: float) -> Situation:
    """The situation in which a user who turns has walked off to where they face `after` s later."""
    yaw = now.user.body.yaw + after * now.velocity.wz
    return replace(now, velocity=Twist2(PACE * math.cos(yaw), PACE * math.sin(yaw)))
