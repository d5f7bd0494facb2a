"""The nearest free place, to which a robot leaves an inflation that it stands in; m, in the map."""

from __future__ import annotations

import math

import numpy as np

from hw import compiled
from states.navigation.exact.circles import circle_crossings, near
from states.navigation.exact.clearance import (
    TOLERANCE,
    Array,
    distance_to_nearest,
    is_clear,
    is_inside_rings,
    passes_disc,
    sees,
)


@compiled
def notches(discs: Array, sides: Array) -> Array:
    """Free points where the edges of two inflations meet, (k, 2).

    The nearest free place lies on the edge of one inflation or at such a point.
    """
    found = np.empty((64, 2))
    count = 0
    for i in range(len(discs) + len(sides)):
        if i < len(discs):
            x, y, radius = discs[i]
            near_discs, near_sides = near(x, y, radius, discs, sides)
            angles = circle_crossings(x, y, radius, near_discs, near_sides, 0.5 * TOLERANCE)
            places = circle_points(x, y, radius, angles)
        else:
            side = sides[i - len(discs)]
            x, y = 0.5 * (side[0] + side[2]), 0.5 * (side[1] + side[3])
            half = 0.5 * math.hypot(side[2] - side[0], side[3] - side[1])
            near_discs, near_sides = near(x, y, half + side[4], discs, sides)
            places = band_meetings(side, near_sides)
        for x, y in places:
            if not (is_clear(x, y, near_discs, near_sides) and is_inside_rings(x, y, sides)):
                continue
            if not is_clear(x, y, discs, sides):
                continue
            if count == len(found):
                found = np.concatenate((found, np.empty_like(found)))
            found[count, 0], found[count, 1] = x, y
            count += 1
    return found[:count].copy()


@compiled
def circle_points(x: float, y: float, radius: float, angles: Array) -> Array:
    """Points of a circle at the given angles, (k, 2)."""
    points = np.empty((len(angles), 2))
    for i in range(len(angles)):
        points[i, 0] = x + radius * math.cos(angles[i])
        points[i, 1] = y + radius * math.sin(angles[i])
    return points


@compiled
def band_meetings(side: Array, sides: Array) -> Array:
    """Where the two edges of one side's band cross those of the others, (k, 2)."""
    points = np.empty((4 * len(sides), 2))
    count = 0
    ex, ey = side[2] - side[0], side[3] - side[1]
    length = math.hypot(ex, ey)
    for other in sides:
        fx, fy = other[2] - other[0], other[3] - other[1]
        cross = ex * fy - ey * fx
        if abs(cross) <= 1e-9 * length * math.hypot(fx, fy):  # or no length at all
            continue
        for one in (-side[4], side[4]):
            px, py = side[0] - one * ey / length, side[1] + one * ex / length
            for two in (-other[4], other[4]):
                size = math.hypot(fx, fy)
                qx, qy = other[0] - two * fy / size, other[1] + two * fx / size
                part = ((qx - px) * fy - (qy - py) * fx) / cross
                points[count, 0], points[count, 1] = px + part * ex, py + part * ey
                count += 1
    return points[:count]


@compiled
def candidates(x: float, y: float, discs: Array, sides: Array) -> Array:
    """The nearest points to (x, y) on the edge of each single inflation, (k, 2)."""
    points = np.empty((len(discs) + 2 * len(sides), 2))
    count = 0
    for disc in discs:
        dx, dy = x - disc[0], y - disc[1]
        apart = math.hypot(dx, dy)
        if apart < 1e-12:
            dx, dy, apart = 1.0, 0.0, 1.0
        points[count, 0] = disc[0] + disc[2] * dx / apart
        points[count, 1] = disc[1] + disc[2] * dy / apart
        count += 1
    for side in sides:
        ex, ey = side[2] - side[0], side[3] - side[1]
        length = math.hypot(ex, ey)
        across = ((x - side[0]) * -ey + (y - side[1]) * ex) / length
        for edge in (-side[4], side[4]):
            points[count, 0] = x - (edge - across) * ey / length
            points[count, 1] = y + (edge - across) * ex / length
            count += 1
    return points[:count]


@compiled
def on_right_side(x: float, y: float, sides: Array) -> Array:
    """The sides of the rings on whose free side (x, y) is: in the outer one, outside the others."""
    kept = np.empty_like(sides)
    count, first = 0, 0
    for i in range(len(sides)):
        if i + 1 < len(sides) and sides[i + 1, 5] == sides[first, 5]:
            continue
        ring = sides[first : i + 1].copy()
        outer = ring[0, 5] == 0.0
        ring[:, 5] = 0.0
        if is_inside_rings(x, y, ring) == outer:
            kept[count : count + len(ring)] = sides[first : i + 1]
            count += len(ring)
        first = i + 1
    return kept[:count]


@compiled
def nearest_free(
    x: float, y: float, discs: Array, sides: Array, meetings: Array, user: Array
) -> Array:
    """The nearest free place that is reached in a straight line, x, y; empty if there is none.

    The line comes no nearer to a wall or to the user than the robot is already, and crosses no
    side of a ring that the robot is on the free side of. `user` is x, y, radius; radius 0: none.
    """
    around = np.concatenate((discs, user.reshape(1, 3))) if user[2] > 0.0 else discs
    places = np.concatenate((meetings, candidates(x, y, around, sides)))
    if user[2] > 0.0:
        angles = circle_crossings(user[0], user[1], user[2], discs, sides, 0.5 * TOLERANCE)
        places = np.concatenate((places, circle_points(user[0], user[1], user[2], angles)))
    kept = on_right_side(x, y, sides)
    limit = 0.0
    if len(kept) == len(sides):
        limit = distance_to_nearest(x, y, sides)
    user_reach = min(user[2], math.hypot(x - user[0], y - user[1])) - TOLERANCE
    order = np.argsort(np.hypot(places[:, 0] - x, places[:, 1] - y))
    for i in order:
        px, py = places[i]
        if not (is_clear(px, py, around, sides) and is_inside_rings(px, py, sides)):
            continue
        if not passes_disc(x, y, px, py, user[0], user[1], user_reach):
            continue
        if sees(x, y, px, py, discs, kept, limit):
            found: Array = places[i].copy()
            return found
    return np.empty(0)
