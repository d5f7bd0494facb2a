"""Where to go while the user walks: out of danger for Escape, out of the way for Chase."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit

from behaviors.rollout import Array, crowding, drives, forecasts, tracks
from behaviors.situation import Situation
from hw.geometry import Outline, Pose2
from hw.room import Point
from states.navigation.clearance import distance_to_nearest

KEEP_S = 0.2
"""A new Escape pose has to be safe earlier by this, s, to be worth a change of mind."""

RINGS = (0.6, 1.2, 2.0)
DIRECTIONS = 16
"""Places to make room at: so many directions on rings about the robot, m."""
TOUCH, DREAD = 1.8, 10.0
"""Nearer than TOUCH m to the user counts DREAD times more."""
OPEN, CORNERED = 2.5, 6.0
"""Places nearer to a wall than OPEN m cost CORNERED times the square of what is missing."""
EFFORT = 0.5
"""What a metre of driving costs."""
AROUND = np.array(
    [
        (radius * math.cos(angle), radius * math.sin(angle))
        for radius in RINGS
        for angle in (math.tau * step / DIRECTIONS for step in range(DIRECTIONS))
    ]
)


def way_out(
    now: Situation,
    goals: Sequence[Pose2],
    present: Pose2 | None,
    outline: Outline | None = None,
) -> Pose2 | None:
    """The Escape pose from which the user is safe soonest, without a touch on the way.

    If every way ends in a touch, the one with most room, as long as there is time to warn the
    user later; None if there is not. `present` is the goal under way, one of `goals`; `outline`
    that of rover and arm, if the arm is out.
    """
    if not goals:
        return None
    environment, settings = now.environment, now.settings
    places = [(goal.x, goal.y) for goal in goals]
    ways = drives(now, places, environment.navigation.escape.max_speed)
    found = forecasts(now, ways, tracks(now, settings.user.likely), outline)
    if found.touch_after.max() < settings.escape.warning:
        return None
    numbers = (found.safe_after.tolist(), found.gap.tolist(), found.touch_after.tolist())
    ranked = []
    for i, (safe_after, gap, touch_after) in enumerate(zip(*numbers, strict=True)):
        kept = KEEP_S if goals[i] is present else 0.0
        touches = touch_after < math.inf
        rank = (-gap, safe_after) if touches else (safe_after - kept, -gap)
        ranked.append((touches, *rank, i))
    planner = now.planners["escape"]
    return next((goals[i] for *_, i in sorted(ranked) if ways.keeps_off(i, planner)), None)


def place_with_room(now: Situation, band: tuple[float, float], present: Point | None) -> Point:
    """Of places around the robot, the one from which the walk stays within the band best.

    `band` is the least and the greatest distance wanted, m; `present` the place under way.
    If none keeps off the walls, the robot brakes.
    """
    environment, pose, user = now.environment, now.pose, now.settings.user
    stay = (now.rest.x, now.rest.y)
    fixed = (stay,) if present is None else (stay, present)
    places = np.concatenate((np.array(fixed), AROUND + np.array((pose.x, pose.y))))
    ways = drives(now, places, environment.navigation.chase.max_speed)
    user_tracks = tracks(now, (*user.likely, *user.possible))
    costs = crowding(ways.ways, user_tracks, *band, TOUCH, DREAD)
    costs += _efforts(places, pose.x, pose.y, environment.walls)
    order = np.argsort(costs, kind="stable").tolist()
    for planner in (now.planners["chase"], now.planners["escape"]):
        for i in order:
            if ways.keeps_off(i, planner):
                return float(places[i, 0]), float(places[i, 1])
    return stay


@njit(cache=True)
def _efforts(places: Array, x: float, y: float, walls: Array) -> Array:
    """What it costs to drive to each place, and to be near to a wall there, (n,)."""
    found = np.empty(len(places))
    for i in range(len(places)):
        px, py = places[i, 0], places[i, 1]
        cornered = max(0.0, OPEN - distance_to_nearest(px, py, walls))
        found[i] = EFFORT * math.hypot(px - x, py - y) + CORNERED * cornered * cornered
    return found


def warm_up() -> None:
    """Compile, or load from the cache, everything that a tick may need."""
    from behaviors import rollout as forecast
    from states.navigation import visibility

    forecast.warm_up()
    visibility.warm_up()
    _efforts(np.ones((1, 2)), 0.0, 0.0, np.ones((1, 4)))
