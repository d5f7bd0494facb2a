"""Places outside the user's zones that the robot can reach when no Chase pose is free."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from behaviors.danger import in_zone
from behaviors.escape_poses import poses
from behaviors.situation import Situation
from hw import Pose2
from hw.scene import Point
from states import SubsystemName

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
    """The place outside both zones with the shortest path around the user; None without one.

    m, in the map.
    """
    places = _free_places(now)
    return _cheapest(now, places, [0.0] * len(places))


def refuge(now: Situation) -> Point | None:
    """The waiting place of least cost outside both zones, m, in the map; None to stay.

    The cost is the drive, at SLOWLY, and the profile's `risk` of the drive and of standing there. A
    place that is no better by WORTH_S than the present one is not worth a drive, unless there is no
    free Escape pose here, where an approaching user would corner the robot.
    """
    import numpy as np

    from behaviors.person import risks, way_risks

    here = (now.pose.x, now.pose.y)
    places = [here, *_free_places(now)]
    there, apart = np.array(places), now.environment.navigation.named(KEEPS).user_radius
    times = np.hypot(there[:, 0] - here[0], there[:, 1] - here[1]) / SLOWLY
    risk = risks(now, there) + way_risks(now, there, apart, times)
    costs = (now.settings.chase.risk * risk).tolist()
    stays = is_outside(now) and poses(now.settings, now.planners["escape"], now.user, now.pose)
    most = costs[0] - WORTH_S if stays else math.inf
    return _cheapest(now, places[1:], costs[1:], most)


def _cheapest(
    now: Situation, places: Sequence[Point], costs: Sequence[float], most: float = math.inf
) -> Point | None:
    """The place with the least cost, s, below `most`, that can be reached; None without one.

    The drive at SLOWLY is added to the costs. It is no shorter than as the crow flies, so that
    paths are planned only to places that may still be the best.
    """
    here, best = (now.pose.x, now.pose.y), None
    bounds = [
        cost + math.dist(place, here) / SLOWLY for cost, place in zip(costs, places, strict=True)
    ]
    for i in sorted(range(len(places)), key=bounds.__getitem__):
        if bounds[i] >= most:
            break
        cost = costs[i] + _way_length(now, places[i]) / SLOWLY
        if cost < most:
            best, most = places[i], cost
    return best


def _way_length(now: Situation, place: Point) -> float:
    """Length of the path around the user, m; infinite without one, or if beyond FARTHEST."""
    path = now.planners["escape"].plan((now.pose.x, now.pose.y), place, now.user_disc(KEEPS, place))
    return math.inf if path is None or path.length > FARTHEST else path.length


def _free_places(now: Situation) -> list[Point]:
    import numpy as np

    places = list(_places(now))
    free = now.planners["escape"].are_free(np.array(places).reshape(-1, 2)).tolist()
    return [place for place, is_free in zip(places, free, strict=True) if is_free]


def _places(now: Situation) -> Iterator[Point]:
    escape, body = now.settings.escape, now.user.body
    for radius in RADII:
        for step in range(DIRECTIONS):
            angle = step * math.tau / DIRECTIONS
            place = Pose2(body.x + radius * math.cos(angle), body.y + radius * math.sin(angle))
            if not in_zone(escape, now.user, place, escape.hysteresis):
                yield place.x, place.y
