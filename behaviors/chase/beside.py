"""Where to drive beside a walking user: margin on the way, and a comfortable distance."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from behaviors.choice import cheapest
from behaviors.person import (
    Array,
    Clearing,
    Rollouts,
    cornered,
    haste,
    lacking,
    lines_of_walk,
    off_the_band,
    predict_user,
    roll_out,
)
from behaviors.profile import RoomSettings
from behaviors.situation import Situation
from hw.scene import Point
from states import SubsystemName
from states.navigation import GlobalPlanner


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
    keeps: tuple[SubsystemName, ...] = ("chase", "escape")
    for name in keeps:
        best = _best(costs.tolist(), rollouts, now.planners[name])
        if best is not None:
            return (float(places[best, 0]), float(places[best, 1])), name
    return stay, "escape"


def _best(costs: Sequence[float], rollouts: Rollouts, planner: GlobalPlanner) -> int | None:
    """Index of the drive of the least cost that keeps off walls; None without one."""
    return cheapest(costs, lambda i: costs[i] if rollouts.keeps_off(i, planner) else None)


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
