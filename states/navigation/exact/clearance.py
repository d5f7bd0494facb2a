"""Free space for the robot's centre among inflated polygons: tests of points, lines and arcs.

An inflated polygon is a disc around each corner and a band along each side, however polygons touch
or overlap. Nothing is merged or sampled, so there are no degenerate cases: a place is free if it is
at least the radius, less TOLERANCE, away from every corner and side, inside the outer ring and
outside all others. Passages of exactly twice the radius are open.

Arrays: `discs` (n, 3) x, y, radius; `sides` (m, 6) x1, y1, x2, y2, radius, ring number; ring 0 is
the outer one, the robot stays outside all others; the sides of a ring are consecutive. m, rad.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hw import compiled
from hw.scene import Point
from states.maps import is_inside_rings as is_inside_rings

Array = NDArray[np.float64]
Circle = tuple[float, float, float]
"""x, y, radius; m."""
Triple = tuple[float, float, float]
"""A pose or a velocity."""

TOLERANCE = 1e-6
"""Depth inside an inflation up to which a place still counts as free, m."""

TURN = 2.0 * math.pi


def check_radius(radius: float) -> None:
    """Refuse an inflation that would let the robot through walls.

    Raises:
        ValueError: it is negative or not finite.
    """
    if not 0.0 <= radius < math.inf:
        raise ValueError(f"inflation of {radius:g} m; a finite length of 0 m or more is needed")


@compiled
def turn_between(first: float, second: float) -> float:
    """Angle from one direction to another, in [-pi, pi), rad."""
    return (second - first + math.pi) % TURN - math.pi


@compiled
def distance_to_segment(x: float, y: float, x1: float, y1: float, x2: float, y2: float) -> float:
    """Distance of a point to the segment between two others, m."""
    dx, dy = x2 - x1, y2 - y1
    square = dx * dx + dy * dy
    along = 0.0
    if square > 0.0:
        along = min(1.0, max(0.0, ((x - x1) * dx + (y - y1) * dy) / square))
    return math.hypot(x - x1 - along * dx, y - y1 - along * dy)


@compiled
def distance_to_side(x: float, y: float, side: Array) -> float:
    """Distance of a point to a side, m."""
    return float(distance_to_segment(x, y, side[0], side[1], side[2], side[3]))


@compiled
def distance_to_nearest(x: float, y: float, sides: Array) -> float:
    """Distance of a point to the nearest side, m."""
    nearest = math.inf
    for i in range(len(sides)):
        nearest = min(nearest, distance_to_side(x, y, sides[i]))
    return nearest


@compiled
def is_clear(x: float, y: float, discs: Array, sides: Array) -> bool:
    """True if far enough from every corner and side, whether inside or outside the rings."""
    for i in range(len(discs)):
        dx, dy = x - discs[i, 0], y - discs[i, 1]
        reach = discs[i, 2] - TOLERANCE
        if dx * dx + dy * dy < reach * reach:
            return False
    for i in range(len(sides)):
        reach = sides[i, 4] - TOLERANCE
        x1, y1, x2, y2 = sides[i, 0], sides[i, 1], sides[i, 2], sides[i, 3]
        if x < min(x1, x2) - reach or x > max(x1, x2) + reach:
            continue
        if y < min(y1, y2) - reach or y > max(y1, y2) + reach:
            continue
        if distance_to_side(x, y, sides[i]) < reach:
            return False
    return True


@compiled
def is_free(x: float, y: float, discs: Array, sides: Array) -> bool:
    """True if inside the outer ring, outside all others, and far enough from all sides."""
    return is_inside_rings(x, y, sides) and is_clear(x, y, discs, sides)


@compiled
def is_free_beside(place: Point, user: Circle, discs: Array, sides: Array) -> bool:
    """`is_free`, and outside the user's disc (radius 0: no user); False for NaN."""
    x, y = place
    if math.hypot(x - user[0], y - user[1]) < user[2] - TOLERANCE:
        return False
    return math.isfinite(x) and math.isfinite(y) and is_free(x, y, discs, sides)


@compiled
def are_free(  # noqa: C901 - written out, see below
    places: Array, discs: Array, sides: Array
) -> NDArray[np.bool_]:
    """`is_free` of each of the places (n, 2): (n,).

    It is written out, with the boxes of the sides computed once: for thousands of places calls
    and boxes take as long as the rest.
    """
    found, boxes = np.zeros(len(places), dtype=np.bool_), _boxes(sides)
    for k in range(len(places)):
        x, y = places[k, 0], places[k, 1]
        ring, odd, free = 0.0, False, True
        for i in range(len(sides)):
            if sides[i, 5] != ring:
                free = odd == (ring == 0.0)
                if not free:
                    break
                ring, odd = sides[i, 5], False
            y1, y2 = sides[i, 1], sides[i, 3]
            if (y1 > y) != (y2 > y):
                x1, x2 = sides[i, 0], sides[i, 2]
                if x < x1 + (y - y1) * (x2 - x1) / (y2 - y1):
                    odd = not odd
        if not free or odd != (ring == 0.0):
            continue
        for i in range(len(discs)):
            dx, dy, reach = x - discs[i, 0], y - discs[i, 1], discs[i, 2] - TOLERANCE
            if dx * dx + dy * dy < reach * reach:
                free = False
                break
        for i in range(len(sides) if free else 0):
            left, right, low, high = boxes[i, 0], boxes[i, 1], boxes[i, 2], boxes[i, 3]
            if x < left or x > right or y < low or y > high:
                continue
            if distance_to_side(x, y, sides[i]) < sides[i, 4] - TOLERANCE:
                free = False
                break
        found[k] = free
    return found


@compiled
def _boxes(sides: Array) -> Array:
    """Least and greatest x, least and greatest y of each side, grown by its radius, (m, 4)."""
    boxes = np.empty((len(sides), 4))
    for i in range(len(sides)):
        x1, y1, x2, y2, reach = sides[i, 0], sides[i, 1], sides[i, 2], sides[i, 3], sides[i, 4]
        reach -= TOLERANCE
        boxes[i, 0], boxes[i, 1] = min(x1, x2) - reach, max(x1, x2) + reach
        boxes[i, 2], boxes[i, 3] = min(y1, y2) - reach, max(y1, y2) + reach
    return boxes


@compiled
def passes_disc(
    px: float, py: float, qx: float, qy: float, x: float, y: float, reach: float
) -> bool:
    """True if the segment p-q stays at least `reach` away from the point (x, y)."""
    if reach <= 0.0:
        return True
    dx, dy = qx - px, qy - py
    fx, fy = x - px, y - py
    square = dx * dx + dy * dy
    along = fx * dx + fy * dy
    if along > 0.0 and square > 0.0:
        along = min(1.0, along / square)
        fx -= along * dx
        fy -= along * dy
    return fx * fx + fy * fy >= reach * reach


@compiled
def sees(
    px: float, py: float, qx: float, qy: float, discs: Array, sides: Array, limit: float
) -> bool:
    """True if the robot may go straight from p to q, which must both be free.

    Between free ends a segment comes too near to a side only at the side's corners, or by crossing
    it. `limit` caps the radii, for leaving an inflation; math.inf otherwise.
    """
    x_low, x_high = min(px, qx), max(px, qx)
    y_low, y_high = min(py, qy), max(py, qy)
    for i in range(len(discs)):
        x, y = discs[i, 0], discs[i, 1]
        reach = min(discs[i, 2], limit) - TOLERANCE
        if x < x_low - reach or x > x_high + reach or y < y_low - reach or y > y_high + reach:
            continue
        if not passes_disc(px, py, qx, qy, x, y, reach):
            return False
    for i in range(len(sides)):
        x1, y1, x2, y2 = sides[i, 0], sides[i, 1], sides[i, 2], sides[i, 3]
        if max(x1, x2) < x_low or min(x1, x2) > x_high:
            continue
        if max(y1, y2) < y_low or min(y1, y2) > y_high:
            continue
        if lines_cross(px, py, qx, qy, sides[i]):
            return False
    return True


@compiled
def comes_no_nearer(px: float, py: float, qx: float, qy: float, sides: Array, slack: float) -> bool:
    """True if p-q keeps from each side its radius less `slack`, or p's own distance if less.

    From the corner that two sides share it keeps p's distance to the nearer of them: who starts too
    near to a wall may pass its end no nearer than that, though farther from the side around it.
    """
    line = np.array((px, py, qx, qy))
    for i in range(len(sides)):
        side = sides[i]
        reach = side[4] - slack
        if (
            max(px, qx) < min(side[0], side[2]) - reach
            or min(px, qx) > max(side[0], side[2]) + reach
        ):
            continue
        if (
            max(py, qy) < min(side[1], side[3]) - reach
            or min(py, qy) > max(side[1], side[3]) + reach
        ):
            continue
        reach = min(reach, distance_to_side(px, py, side)) - TOLERANCE
        if lines_cross(px, py, qx, qy, side):
            return False
        if distance_to_side(qx, qy, side) < reach and is_beside(qx, qy, side):
            return False
        for x, y in ((side[0], side[1]), (side[2], side[3])):
            near = distance_to_side(x, y, line)
            if near < reach and near < distance_at_corner(px, py, x, y, sides) - TOLERANCE:
                return False
    return True


@compiled
def is_beside(x: float, y: float, side: Array) -> bool:
    """True if the nearest point of a side to (x, y) is none of its ends."""
    dx, dy = side[2] - side[0], side[3] - side[1]
    along = (x - side[0]) * dx + (y - side[1]) * dy
    return bool(0.0 < along < dx * dx + dy * dy)


@compiled
def distance_at_corner(px: float, py: float, x: float, y: float, sides: Array) -> float:
    """Distance of p to the nearest of the sides that end in the corner (x, y), m."""
    nearest = math.inf
    for i in range(len(sides)):
        side = sides[i]
        if (side[0] == x and side[1] == y) or (side[2] == x and side[3] == y):
            nearest = min(nearest, distance_to_side(px, py, side))
    return nearest


@compiled
def leg_comes_no_nearer(start: Point, end: Point, user: Circle, sides: Array, slack: float) -> bool:
    """True if a straight leg keeps the distances to all sides, less `slack`, and to the user.

    As in `comes_no_nearer`, a leg that begins too near to something keeps the distance that it
    begins with.
    """
    (px, py), (qx, qy), (x, y, radius) = start, end, user
    reach = min(radius, math.hypot(px - x, py - y)) - TOLERANCE
    return passes_disc(px, py, qx, qy, x, y, reach) and comes_no_nearer(
        px, py, qx, qy, sides, slack
    )


@compiled
def first_way(
    start: Point, ways: Array, user: Circle, sides: Array, slack: float, spare: float
) -> int:
    """`GlobalPlanner.first_allowed`."""
    for i in range(len(ways)):
        there, end = (ways[i, 0], ways[i, 1]), (ways[i, 2], ways[i, 3])
        if not leg_comes_no_nearer(start, there, user, sides, slack):
            continue
        if not leg_comes_no_nearer(there, end, user, sides, slack):
            continue
        at = 4 if spare < math.inf else 10
        while at < 10 and comes_no_nearer(
            ways[i, 0], ways[i, 1], ways[i, at], ways[i, at + 1], sides, spare
        ):
            at += 2
        if at == 10:
            return i
    return len(ways)


@compiled
def rays_come_no_nearer(start: Point, ends: Array, user: Circle, sides: Array) -> bool:
    """`leg_comes_no_nearer` of the straight legs from one place to each of some ends (n, 2)."""
    for i in range(len(ends)):
        if not leg_comes_no_nearer(start, (ends[i, 0], ends[i, 1]), user, sides, 0.0):
            return False
    return True


@compiled
def line_comes_no_nearer(line: Array, user: Circle, sides: Array) -> bool:
    """`leg_comes_no_nearer` of each leg of a line, (n, 3) with x and y first."""
    for i in range(len(line) - 1):
        start, end = (line[i, 0], line[i, 1]), (line[i + 1, 0], line[i + 1, 1])
        if not leg_comes_no_nearer(start, end, user, sides, 0.0):
            return False
    return True


@compiled
def lines_cross(px: float, py: float, qx: float, qy: float, side: Array) -> bool:
    """True if the segment p-q crosses a side.

    The ends of each lie on different sides of the other: the cross products have different signs.
    """
    dx, dy = qx - px, qy - py
    one = dx * (side[1] - py) - dy * (side[0] - px)
    two = dx * (side[3] - py) - dy * (side[2] - px)
    if (one > 0.0) == (two > 0.0):
        return False
    ex, ey = side[2] - side[0], side[3] - side[1]
    start = ex * (py - side[1]) - ey * (px - side[0])
    end = ex * (qy - side[1]) - ey * (qx - side[0])
    return bool((start > 0.0) != (end > 0.0))
