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
SLOWLY = 0.8
"""Speed at which a robot leaves the zones of a user who stands, m/s."""
WORTH_S = 0.5
"""How much better another place has to be for a robot that is outside the zones already, s."""
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
        if planner.is_free(place) and _can_be_reached(now, place):
            return place
    return None


def refuge(now: Situation) -> Point | None:
    """The place to wait at that costs least of all outside both zones; None to stay.

    m, in the map. What it costs is the drive, as the crow flies and at SLOWLY, and the profile's
    `risk` of the drive and of standing there. A place that is no better by WORTH_S than the present
    one is not worth a drive.
    """
    import numpy as np

    from behaviors.waiting import risks, way_risks

    here, planner = (now.pose.x, now.pose.y), now.planners["escape"]
    places = [here, *(place for place in _places(now) if planner.is_free(place))]
    there, apart = np.array(places), now.environment.navigation.named(KEEPS).user_radius
    times = np.hypot(there[:, 0] - here[0], there[:, 1] - here[1]) / SLOWLY
    risk = risks(now, there) + way_risks(now, there, apart, times)
    costs = (times + now.settings.chase.risk * risk).tolist()
    stay = costs[0] - WORTH_S if is_outside(now) else math.inf
    for cost, place in sorted(zip(costs[1:], places[1:], strict=True)):
        if cost >= stay:
            return None
        if _can_be_reached(now, place):
            return place
    return None


def _can_be_reached(now: Situation, place: Point) -> bool:
    disc = now.user_disc(KEEPS, place)
    path = now.planners["escape"].plan((now.pose.x, now.pose.y), place, disc)
    return path is not None and path.length <= FARTHEST


def _places(now: Situation) -> Iterator[Point]:
    escape, body = now.settings.escape, now.user.body
    for radius in RADII:
        for step in range(DIRECTIONS):
            angle = step * math.tau / DIRECTIONS
            place = Pose2(body.x + radius * math.cos(angle), body.y + radius * math.sin(angle))
            if not in_zone(escape, now.user, place, escape.hysteresis):
                yield place.x, place.y
