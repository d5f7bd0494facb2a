"""Where to wait: how much a place is in the way of a person who may set off in any direction.

A person walks where there is floor to walk on. For each direction the line of walk from where they
stand is compared with the place: the time that they need to reach the robot against the time that
the robot needs to move aside or, with a wall there, to the other side of the line.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from behaviors.rollout import Array
from behaviors.situation import Situation
from hw.room import Point

DIRECTIONS = 36
"""Number of directions of walk that are looked at."""
PACE, TURN_RATE = 1.5, 3.0
"""Speed of walking, m/s, and of turning beforehand, rad/s, of the person who is reckoned with."""
NOTICED_S = 0.4
"""Time until a person's setting off is noticed and the robot starts, s."""
SPARE_S = 0.3
"""Time by which the robot should be early, s."""
ESCAPE_S = 0.5
"""What a direction costs besides, s, in which the robot would be too late, not just hardly early:
who walks there raises an Escape."""
LONGEST = 8.0
"""Longest line of walk that is looked at, m."""
TRAPPED_S = 3.0
"""Time to move aside, s, where there is no room on either side."""


def risks(now: Situation, places: Sequence[Point] | Array) -> Array:
    """Expected cost of waiting, s, at each place (n, 2) in the map, (n,); 0: never too late.

    It is the lack of time to get aside, and ESCAPE_S for each Escape.

    Directions count by the area of floor in them: with goals spread evenly over the floor, the
    chance of a direction is proportional to its squared length.
    """
    body, escape = now.user.body, now.settings.escape
    angles = np.arange(DIRECTIONS) * math.tau / DIRECTIONS
    lengths = _lengths(body.x, body.y, angles, now.environment.walls)
    there = np.array(places, dtype=np.float64).reshape(-1, 2)
    asides = _asides(there, (body.x, body.y), angles, escape.contact)
    planner = now.planners["escape"]
    free = planner.are_free(asides.reshape(-1, 2)).reshape(asides.shape[:3])
    return _risks(
        there, (body.x, body.y, body.yaw), angles, lengths, free, escape.contact,
        now.environment.limits.base_acceleration,
    )  # fmt: skip


@njit(cache=True)
def _lengths(x: float, y: float, angles: Array, walls: Array) -> Array:
    """Length of the free ray from x, y in each direction, m, at most LONGEST."""
    found = np.empty(len(angles))
    for i in range(len(angles)):
        c, s, length = math.cos(angles[i]), math.sin(angles[i]), LONGEST
        for j in range(len(walls)):
            ax, ay = walls[j, 0] - x, walls[j, 1] - y
            dx, dy = walls[j, 2] - walls[j, 0], walls[j, 3] - walls[j, 1]
            cross = c * dy - s * dx
            if cross == 0.0:
                continue
            along, share = (ax * dy - ay * dx) / cross, (ax * s - ay * c) / cross
            if 0.0 <= share <= 1.0 and 0.0 <= along < length:
                length = along
        found[i] = length
    return found


@njit(cache=True)
def _asides(places: Array, user: tuple[float, float], angles: Array, contact: float) -> Array:
    """Where the robot would move aside to, (places, directions, 2 sides, 2), in the map.

    On either side of a line of walk it is the point at `contact` from the line, beside the place.
    """
    found = np.empty((len(places), len(angles), 2, 2))
    for i in range(len(places)):
        dx, dy = places[i, 0] - user[0], places[i, 1] - user[1]
        for j in range(len(angles)):
            c, s = math.cos(angles[j]), math.sin(angles[j])
            lateral = c * dy - s * dx  # to the left of the line
            for side in range(2):
                wanted = contact if side == 0 else -contact
                found[i, j, side, 0] = places[i, 0] - s * (wanted - lateral)
                found[i, j, side, 1] = places[i, 1] + c * (wanted - lateral)
    return found


@njit(cache=True)
def _risks(
    places: Array,
    user: tuple[float, float, float],
    angles: Array,
    lengths: Array,
    free: NDArray[np.bool_],
    contact: float,
    acceleration: float,
) -> Array:
    """See `risks`; `free` tells which of the places aside are, (places, directions, 2 sides)."""
    found = np.zeros(len(places))
    total = np.sum(lengths * lengths)
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
            available = max(0.0, reach) / PACE + turn / TURN_RATE
            needed = TRAPPED_S
            for side in range(2):
                if free[i, j, side]:
                    aside = contact - lateral if side == 0 else contact + lateral
                    needed = min(needed, NOTICED_S + math.sqrt(2.0 * aside / acceleration))
            late = needed + SPARE_S - available
            if late > 0.0:
                found[i] += lengths[j] * lengths[j] * (late + ESCAPE_S * (late > SPARE_S))
        found[i] /= total
    return found


def warm_up() -> None:
    """Compile the kernels, or load them from the cache."""
    angles, place = np.zeros(1), np.ones((1, 2))
    lengths = _lengths(0.0, 0.0, angles, np.ones((1, 4)))
    asides = _asides(place, (0.0, 0.0), angles, 1.0)
    free = np.ones(asides.shape[:3], dtype=np.bool_)
    _risks(place, (0.0, 0.0, 0.0), angles, lengths, free, 1.0, 1.0)
