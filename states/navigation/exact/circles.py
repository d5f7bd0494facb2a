"""Free parts of circles among inflated polygons; see `clearance` for discs and sides. m, rad."""

from __future__ import annotations

import math

import numpy as np

from hw import compiled
from states.navigation.exact.clearance import (
    TOLERANCE,
    TURN,
    Array,
    distance_to_side,
    is_clear,
    is_inside_rings,
)

_THIN = 1e-5  # an arc blocked over less than this, rad, is 1e-10 m deep: touched, not entered
_ANGLE_TOLERANCE = 1e-9


@compiled
def near(x: float, y: float, reach: float, discs: Array, sides: Array) -> tuple[Array, Array]:
    """The corners and sides whose inflation comes within `reach` of a point."""
    near_discs = np.empty((len(discs), 3))
    count = 0
    for i in range(len(discs)):
        if math.hypot(x - discs[i, 0], y - discs[i, 1]) < reach + discs[i, 2]:
            near_discs[count] = discs[i]
            count += 1
    near_sides = np.empty((len(sides), 6))
    side_count = 0
    for i in range(len(sides)):
        if distance_to_side(x, y, sides[i]) < reach + sides[i, 4]:
            near_sides[side_count] = sides[i]
            side_count += 1
    return near_discs[:count], near_sides[:side_count]


@compiled
def circle_crossings(
    x: float, y: float, radius: float, discs: Array, sides: Array, slack: float
) -> Array:
    """Angles at which a circle crosses the inflations, each made smaller by `slack`; sorted.

    With a disc of radius r at distance d the circle of radius R meets its edge at the angles
    +- acos((R^2 + d^2 - r^2) / (2 R d)) from the direction to it (law of cosines); with the edge of
    a band at the angles from the side's normal where R cos(angle) is the distance to that edge.
    """
    angles = np.empty(2 * len(discs) + 4 * len(sides))
    count = 0
    for i in range(len(discs)):
        dx, dy, reach = discs[i, 0] - x, discs[i, 1] - y, discs[i, 2] - slack
        apart = math.hypot(dx, dy)
        double = 2.0 * radius * apart
        if double == 0.0:
            continue
        cosine = (radius * radius + apart * apart - reach * reach) / double
        if abs(cosine) < 1.0:
            middle, half = math.atan2(dy, dx), math.acos(cosine)
            angles[count], angles[count + 1] = middle - half, middle + half
            count += 2
    for i in range(len(sides)):
        ex, ey = sides[i, 2] - sides[i, 0], sides[i, 3] - sides[i, 1]
        normal = math.atan2(ex, -ey)
        apart = (x - sides[i, 0]) * math.cos(normal) + (y - sides[i, 1]) * math.sin(normal)
        for sign in (-1.0, 1.0):
            cosine = (sign * (sides[i, 4] - slack) - apart) / radius
            if abs(cosine) < 1.0:
                half = math.acos(cosine)
                angles[count], angles[count + 1] = normal - half, normal + half
                count += 2
    for i in range(count):
        angles[i] %= TURN
    return np.sort(angles[:count])


@compiled
def blocked_arcs(
    x: float, y: float, radius: float, discs: Array, sides: Array
) -> tuple[Array, bool]:
    """The parts of a circle that are not free, (k, 2) first angle and width.

    Returns:
        The arcs, and whether any part of the circle is free.
    """
    near_discs, near_sides = near(x, y, radius, discs, sides)
    angles = circle_crossings(x, y, radius, near_discs, near_sides, TOLERANCE)
    if len(angles) == 0:
        angles = np.zeros(1)
    arcs = np.empty((len(angles), 2))
    count = 0
    some_free = False
    for i in range(len(angles)):
        following = angles[i + 1] if i + 1 < len(angles) else angles[0] + TURN
        width = following - angles[i]
        middle = angles[i] + 0.5 * width
        mx, my = x + radius * math.cos(middle), y + radius * math.sin(middle)
        if width < _THIN:
            continue
        if is_clear(mx, my, near_discs, near_sides) and is_inside_rings(mx, my, sides):
            some_free = True
            continue
        if count > 0 and abs(arcs[count - 1, 0] + arcs[count - 1, 1] - angles[i]) < _THIN:
            arcs[count - 1, 1] = following - arcs[count - 1, 0]
            continue
        arcs[count, 0], arcs[count, 1] = angles[i], width
        count += 1
    return arcs[:count], some_free


@compiled
def arc_is_free(start: float, sweep: float, arcs: Array) -> bool:
    """True if the arc from `start` counter-clockwise over `sweep`, rad, meets no blocked arc."""
    for i in range(len(arcs)):
        ahead = (arcs[i, 0] - start) % TURN
        if TURN - ahead < _ANGLE_TOLERANCE:
            ahead = 0.0
        if ahead < sweep - _ANGLE_TOLERANCE:
            return False
        if ahead + arcs[i, 1] > TURN + _ANGLE_TOLERANCE:
            return False
    return True
