"""Where to wait: how much a place is in the way of a person who may set off in any direction.

A person walks where there is floor to walk on. For each direction the line of walk from where they
stand is compared with the place: the time that they need to reach the robot against the time that
the robot needs to move aside or, with a wall there, to the other side of the line.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from behaviors.person.drives import Array
from behaviors.person.lines import free_lengths
from behaviors.person.margin import Clearing
from behaviors.situation import Situation
from hw import compiled, example
from hw.scene import Point


def risks(now: Situation, places: Sequence[Point] | Array) -> Array:
    """Expected cost of waiting, s, at each place (n, 2) in the map, (n,); 0: never too late.

    It is the lack of margin, and what an Escape costs for each direction without any.

    Directions count by the area of floor in them: with goals spread evenly over the floor, the
    chance of a direction is proportional to its squared length. Where there is no room on either
    side, the robot is in the way for the whole of what is looked ahead.
    """
    body, walks, margin = now.user.body, now.settings.user.walks, now.settings.user.margins
    rules = Clearing.of(now.environment, now.settings)
    rules = rules._replace(reaction=walks.noticed + now.environment.delay)
    angles = np.arange(walks.directions) * math.tau / walks.directions
    lengths = free_lengths(body.x, body.y, angles, now.environment.walls, walks.farthest)
    there, user = np.array(places, dtype=np.float64).reshape(-1, 2), (body.x, body.y, body.yaw)
    ways = _ways(there, user, angles, lengths, rules.contact, walks.pace, walks.turn_rate)
    asides = _asides(there, angles, ways, rules.contact)
    free = now.planners["escape"].are_free(asides.reshape(-1, 2)).reshape(-1, 2)
    return _risks(len(there), ways, lengths, free, rules, margin.waiting, margin.escape)


def way_risks(now: Situation, places: Array, apart: float, times: Array) -> Array:
    """Expected cost of the drives to the places (n, 2), s, (n,), should the user set off meanwhile.

    It is the mean of the risk of standing at points of the way, which is straight, but no nearer to
    the user than `apart`, m, times the chance that they set off within the drive's time (n,), s.
    """
    shares = np.array(now.settings.user.walks.on_the_way)
    body, here = now.user.body, np.array((now.pose.x, now.pose.y))
    user = np.array((body.x, body.y))
    off = here + shares[:, None] * (places - here)[:, None, :] - user
    distances = np.maximum(np.hypot(off[..., 0], off[..., 1]), 1e-9)[..., None]
    points = user + off * np.maximum(1.0, apart / distances)
    found = risks(now, points.reshape(-1, 2)).reshape(-1, len(shares)).mean(axis=1)
    chances: Array = found * -np.expm1(-times / now.settings.user.walks.stands)
    return chances


@compiled
def _ways(
    places: Array,
    user: tuple[float, float, float],
    angles: Array,
    lengths: Array,
    contact: float,
    pace: float,
    turn_rate: float,
) -> Array:
    """The lines of walk that lead into a robot at one of the places, (n, 4).

    Number of the place and of the direction; time until the user, turning first, would touch the
    robot, s; and how far the place is to the left of the line, m.
    """
    found, count = np.empty((len(places) * len(angles), 4)), 0
    for i in range(len(places)):
        dx, dy = places[i, 0] - user[0], places[i, 1] - user[1]
        for j in range(len(angles)):
            c, s = math.cos(angles[j]), math.sin(angles[j])
            along, lateral = c * dx + s * dy, c * dy - s * dx
            if along <= 0.0 or abs(lateral) >= contact:
                continue
            reach = along - math.sqrt(contact * contact - lateral * lateral)
            if reach > lengths[j]:
                continue
            turn = abs((angles[j] - user[2] + math.pi) % math.tau - math.pi)
            available = max(0.0, reach) / pace + turn / turn_rate
            found[count, 0], found[count, 1] = i, j
            found[count, 2], found[count, 3] = available, lateral
            count += 1
    return found[:count]


@compiled
def _asides(places: Array, angles: Array, ways: Array, contact: float) -> Array:
    """Where the robot would move aside to, (ways, 2 sides, 2), in the map.

    On either side of a line of walk it is the point at `contact` from the line, beside the place.
    """
    found = np.empty((len(ways), 2, 2))
    for k in range(len(ways)):
        i, j, lateral = int(ways[k, 0]), int(ways[k, 1]), ways[k, 3]
        c, s = math.cos(angles[j]), math.sin(angles[j])
        for side in range(2):
            wanted = contact if side == 0 else -contact
            found[k, side, 0] = places[i, 0] - s * (wanted - lateral)
            found[k, side, 1] = places[i, 1] + c * (wanted - lateral)
    return found


@compiled
def _risks(
    count: int,
    ways: Array,
    lengths: Array,
    free: NDArray[np.bool_],
    rules: Clearing,
    wanted: float,
    escape: float,
) -> Array:
    """See `risks`, for `count` places; `free` tells which places aside are, (ways, 2 sides)."""
    found = np.zeros(count)
    for k in range(len(ways)):
        i, length, lateral = int(ways[k, 0]), lengths[int(ways[k, 1])], ways[k, 3]
        needed = rules.lookahead
        for side in range(2):
            if free[k, side]:
                away = rules.contact - lateral if side == 0 else rules.contact + lateral
                aside = math.sqrt(2.0 * away / rules.acceleration)
                needed = min(needed, rules.reaction + aside)
        left = ways[k, 2] - needed
        if left < wanted:
            found[i] += length * length * (wanted - left + escape * (left < 0.0))
    return found / np.sum(lengths * lengths)


@example
def _example() -> None:
    angles, place = np.zeros(1), np.ones((1, 2))
    lengths = free_lengths(0.0, 0.0, angles, np.ones((1, 4)), 8.0)
    ways = _ways(place, (0.0, 0.0, 0.0), angles, lengths, 1.0, 1.0, 1.0)
    _asides(place, angles, ways, 1.0)
    _risks(
        1,
        ways,
        lengths,
        np.ones((len(ways), 2), dtype=np.bool_),
        Clearing(1.0, 0.1, 1.0, 3.0),
        0.3,
        0.5,
    )
