"""Places outside the user's zones that the robot can reach when no Chase pose is free."""

from __future__ import annotations

import math
from collections.abc import Iterator

from behaviors.escape import in_zone
from behaviors.situation import Situation
from hw.geometry import Pose2
from hw.room import Point
from states.subsystems import SubsystemName

RADII = (1.9, 2.9, 3.4, 4.2, 5.2)
DIRECTIONS = 24
"""Candidates: circles around the user, m, with this many directions each."""
KEEPS: SubsystemName = "haptic"
"""Whose distance from the user the way out keeps: nearer the safety chain lets no drive pass."""
FARTHEST = 8.0
"""Longest path to a refuge, m."""


def is_outside(now: Situation) -> bool:
    """True if the robot is outside both Escape zones, with their hysteresis."""
    escape = now.settings.escape
    return not in_zone(escape, now.user, now.pose, escape.hysteresis)


def way_out(now: Situation) -> Point | None:
    """The nearest place outside both zones that can be reached around the user; None without one.

    m, in the map. Distances count as the crow flies; the path may be longer.
    """
    planner, here = now.planners["escape"], (now.pose.x, now.pose.y)
    for place in sorted(_places(now), key=lambda place: math.dist(place, here)):
        if not planner.is_free(place):
            continue
        path = planner.plan(here, place, now.user_disc(KEEPS, place))
        if path is not None and path.length <= FARTHEST:
            return place
    return None


def _places(now: Situation) -> Iterator[Point]:
    escape, body = now.settings.escape, now.user.body
    for radius in RADII:
        for step in range(DIRECTIONS):
            angle = step * math.tau / DIRECTIONS
            place = Pose2(body.x + radius * math.cos(angle), body.y + radius * math.sin(angle))
            if not in_zone(escape, now.user, place, escape.hysteresis):
                yield place.x, place.y
