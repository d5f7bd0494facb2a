"""Where to go while the user walks: out of danger for Escape, out of the way for Chase."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from behaviors.forecast import Forecasts, crowding, forecasts, tracks
from behaviors.situation import Situation
from hw.geometry import Pose2
from hw.room import Point
from states.navigation.visibility import ExactPlanner
from states.site import Site

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


def way_out(now: Situation, goals: Sequence[Pose2], present: Pose2 | None) -> Pose2 | None:
    """The Escape pose from which the user is safe soonest, without a touch on the way.

    If every way ends in a touch, the one with most room, as long as there is time to warn the
    user later; None if there is not. `present` is the goal under way, one of `goals`.
    """
    if not goals:
        return None
    site, settings = now.site, now.settings
    places = [(goal.x, goal.y) for goal in goals]
    max_speed = site.navigation.escape.max_speed
    found = forecasts(now, places, tracks(now, settings.user.likely), max_speed)
    if found.touch_after.max() < settings.escape.warning:
        return None
    numbers = (found.safe_after.tolist(), found.gap.tolist(), found.touch_after.tolist())
    ranked = []
    for i, (safe_after, gap, touch_after) in enumerate(zip(*numbers, strict=True)):
        kept = KEEP_S if goals[i] is present else 0.0
        touches = touch_after < math.inf
        rank = (-gap, safe_after) if touches else (safe_after - kept, -gap)
        ranked.append((touches, *rank, i))
    planner = site.planner("escape")
    return next((goals[i] for *_, i in sorted(ranked) if found.keeps_off(i, planner)), None)


def place_with_room(now: Situation, band: tuple[float, float], present: Point | None) -> Point:
    """Of places around the robot, the one from which the walk stays within the band best.

    `band` is the least and the greatest distance wanted, m; `present` the place under way.
    If none keeps off the walls, the robot brakes.
    """
    site, pose, user = now.site, now.pose, now.settings.user
    stay = (now.rest.x, now.rest.y)
    places = [stay, *(() if present is None else (present,)), *_around(pose)]
    user_tracks = tracks(now, (*user.likely, *user.possible))
    found = forecasts(now, places, user_tracks, site.navigation.chase.max_speed)
    crowded = crowding(found.apart, *band, TOUCH, DREAD).tolist()
    costs = [
        cost + EFFORT * math.dist(place, (pose.x, pose.y))
        for cost, place in zip(crowded, places, strict=True)
    ]
    for planner in (site.planner("chase"), site.planner("escape")):
        best = _cheapest(site, planner, found, costs)
        if best is not None:
            return best
    return stay


def _cheapest(
    site: Site, planner: ExactPlanner, found: Forecasts, costs: Sequence[float]
) -> Point | None:
    """The best place that keeps off the walls, when nearness to walls is counted, too."""
    best, least = None, math.inf
    for cost, i in sorted((cost, i) for i, cost in enumerate(costs)):
        if cost >= least:
            break
        place = found.places[i]
        cornered = max(0.0, OPEN - site.room.clearance(*place))
        total = cost + CORNERED * cornered * cornered
        if total < least and found.keeps_off(i, planner):
            best, least = place, total
    return best


def _around(pose: Pose2) -> Iterator[Point]:
    for distance in RINGS:
        for step in range(DIRECTIONS):
            angle = 2.0 * math.pi * step / DIRECTIONS
            yield pose.x + distance * math.cos(angle), pose.y + distance * math.sin(angle)


def warm_up() -> None:
    """Compile, or load from the cache, everything that a tick may need."""
    from behaviors import forecast
    from states.navigation import visibility

    forecast.warm_up()
    visibility.warm_up()
