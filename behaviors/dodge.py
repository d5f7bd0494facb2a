"""Where to drive beside a walking user, to make room in Chase; whether they catch the robot."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from behaviors.person import (
    Array,
    Clearing,
    cornered,
    haste,
    lacking,
    lines_of_walk,
    off_the_band,
    predict_user,
    pursued,
    roll_out,
)
from behaviors.profile import RoomSettings, WalkSettings
from behaviors.situation import Situation
from hw import Outline, Pose2
from hw.scene import Point
from states import SubsystemName


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
    walks = Pose2(body.x, body.y, math.atan2(velocity.vy, velocity.vx))
    off = walks.bearing_to(now.pose)
    bend = math.copysign(1.0, off) * _bend(now.settings.user.walks, velocity.wz)
    return abs(off) - max(0.0, bend) * now.settings.user.walks.bend_for < within


def _bend(walks: WalkSettings, rate: float) -> float:
    """The turn rate of a walker's bend, rad/s; what is more is the tail of a turn on the spot."""
    return max(-walks.bend_most, min(walks.bend_most, rate))


def place_with_room(
    now: Situation, band: tuple[float, float], present: Point | None
) -> tuple[Point, SubsystemName]:
    """The place around the robot that best keeps margin on the way, and a band beside the user.

    `band` is the smallest and the largest distance wanted, m; `present` the current goal. Besides,
    the subsystem whose distances from walls the drive keeps. If every drive comes too near to
    walls, it is the place where the robot comes to rest.
    """
    here, stay, room = (now.pose.x, now.pose.y), (now.rest.x, now.rest.y), now.settings.user.beside
    fixed = (stay,) if present is None else (stay, present)
    places = np.concatenate((np.array(fixed), _around(room, here)))
    rollouts = roll_out(now, places, now.environment.navigation.chase.max_speed)
    costs = _costs(now, rollouts.trajectories, band)
    costs += room.walls * cornered(places, now.environment.walls, room.open)
    costs += room.effort * np.hypot(places[:, 0] - here[0], places[:, 1] - here[1])
    order = np.argsort(costs, kind="stable").tolist()
    keeps: tuple[SubsystemName, ...] = ("chase", "escape")
    for name in keeps:
        for i in order:
            if rollouts.keeps_off(i, now.planners[name]):
                return (float(places[i, 0]), float(places[i, 1])), name
    return stay, "escape"


def _costs(now: Situation, drives: Array, band: tuple[float, float]) -> Array:
    """Cost of drives beside the user, (n,): lack of margin, distances off the band, haste, m2.

    The worst line of a walker counts. A user who turns on the spot may set off at any angle of the
    turn, and the mean counts: the turn mostly ends beyond the robot, and the way out is behind it.
    """
    user, body, room = now.settings.user, now.user.body, now.settings.user.beside
    rules, lines = Clearing.of(now.environment, now.settings), lines_of_walk(now)
    lacks = lacking(drives, lines, user.margins.wanted, rules)
    walks = now.velocity.speed >= now.settings.escape.moving
    found: Array = room.lack * (lacks.max(axis=1) if walks else lacks.mean(axis=1))
    lines = predict_user(now, (*user.likely, *user.possible))
    found += off_the_band(drives, lines, *band, room.beyond, room.close, room.dread)
    found += room.haste * haste(drives, (body.x, body.y), room.turn, rules.acceleration)
    return found


def _around(room: RoomSettings, centre: Point) -> Array:
    """The candidates around a place, (n, 2)."""
    angles = np.arange(room.directions) * math.tau / room.directions
    circle = np.column_stack((np.cos(angles), np.sin(angles)))
    found: Array = (np.array(room.rings)[:, None, None] * circle).reshape(-1, 2) + np.array(centre)
    return found
