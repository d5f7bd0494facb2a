"""Places outside the user's zones that the robot can reach when no Chase pose is free."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from behaviors.choice import cheapest
from behaviors.escape import in_zone, poses
from behaviors.situation import Situation
from hw import Pose2
from hw.scene import Point
from states import SubsystemName

KEEPS: SubsystemName = "haptic"
"""Whose distance from the user the way out keeps: nearer the safety chain lets no drive pass."""


def is_outside(now: Situation) -> bool:
    """True if the robot is outside both Escape zones, with their hysteresis."""
    escape = now.settings.escape
    return not in_zone(escape, now.user, now.pose, escape.hysteresis)


def way_out(now: Situation) -> Point | None:
    """The place outside both zones with the shortest path around the user; None without one.

    m, in the map.
    """
    places = _free_places(now)
    return _cheapest(now, places, [0.0] * len(places))


def refuge(now: Situation) -> Point | None:
    """The waiting place of least cost outside both zones, m, in the map; None to stay.

    The cost is the drive, and the profile's `risk` of the drive and of standing there. A place that
    is not better than the present one by what is `worth` a drive is none, unless there is no free
    Escape pose here, where an approaching user would corner the robot.
    """
    import numpy as np

    from behaviors.person import risks, way_risks

    here, chase = (now.pose.x, now.pose.y), now.settings.chase
    places = [here, *_free_places(now)]
    there, apart = np.array(places), now.environment.navigation.named(KEEPS).user_radius
    times = np.hypot(there[:, 0] - here[0], there[:, 1] - here[1]) / chase.leave.speed
    risk = risks(now, there) + way_risks(now, there, apart, times)
    costs = (chase.risk * risk).tolist()
    stays = is_outside(now) and poses(now.settings, now.planners["escape"], now.user, now.pose)
    most = costs[0] - chase.leave.worth if stays else None
    return _cheapest(now, places[1:], costs[1:], most)


def _cheapest(
    now: Situation, places: Sequence[Point], costs: Sequence[float], below: float | None = None
) -> Point | None:
    """The place with the least cost, s, that can be reached; None without one `below` that.

    The slow drive there is added to the costs.
    """
    here, leave = (now.pose.x, now.pose.y), now.settings.chase.leave

    def total(i: int) -> float | None:
        disc = now.user_disc(KEEPS, places[i])
        path = now.planners["escape"].plan(here, places[i], disc)
        if path is None or path.length > leave.farthest:
            return None
        return costs[i] + path.length / leave.speed

    crow = [math.dist(place, here) / leave.speed for place in places]
    best = cheapest([c + t for c, t in zip(costs, crow, strict=True)], total, below)
    return None if best is None else places[best]


def _free_places(now: Situation) -> list[Point]:
    import numpy as np

    places = list(_places(now))
    free = now.planners["escape"].are_free(np.array(places).reshape(-1, 2)).tolist()
    return [place for place, is_free in zip(places, free, strict=True) if is_free]


def _places(now: Situation) -> Iterator[Point]:
    escape, body, leave = now.settings.escape, now.user.body, now.settings.chase.leave
    for radius in leave.circles:
        for step in range(leave.directions):
            angle = step * math.tau / leave.directions
            place = Pose2(body.x + radius * math.cos(angle), body.y + radius * math.sin(angle))
            if not in_zone(escape, now.user, place, escape.hysteresis):
                yield place.x, place.y
