"""Distances of a rectangle that moves beside a disc and between walls, in the rectangle's frame.

The rectangle lies about the origin, its sides parallel to the axes, with half sides `a` and `b`; m.
Within a step everything moves straight in this frame, so that a step with little rotation is swept
without gaps.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hw import compiled

Array = NDArray[np.float64]
WAY_M, TINY = 0.02, 1e-9
"""Step in which free ways are measured, and distances that do not count, m."""


@compiled
def point_distance(a: float, b: float, x: float, y: float) -> float:
    """Distance of a point to the rectangle; 0 inside."""
    return math.hypot(max(abs(x) - a, 0.0), max(abs(y) - b, 0.0))


@compiled
def way_distance(a: float, b: float, x0: float, y0: float, x1: float, y1: float) -> float:
    """Least distance to the rectangle of a point that moves from (x0, y0) to (x1, y1).

    The nearest point of the way is one of its ends, or is nearest to a corner of the rectangle,
    unless the way crosses the rectangle.
    """
    if way_meets(a, b, x0, y0, x1, y1):
        return 0.0
    dx, dy = x1 - x0, y1 - y0
    square = dx * dx + dy * dy
    least = min(point_distance(a, b, x0, y0), point_distance(a, b, x1, y1))
    if square == 0.0:
        return least
    for i in range(4):
        cx = a if i < 2 else -a
        cy = b if i % 2 else -b
        along = ((cx - x0) * dx + (cy - y0) * dy) / square
        if 0.0 < along < 1.0:
            least = min(least, abs((cx - x0) * dy - (cy - y0) * dx) / math.sqrt(square))
    return least


@compiled
def way_meets(a: float, b: float, x0: float, y0: float, x1: float, y1: float) -> bool:
    """True if a point that moves from (x0, y0) to (x1, y1) meets the rectangle.

    By separating axes: the rectangle's two, and the one across the way.
    """
    if min(x0, x1) > a or max(x0, x1) < -a or min(y0, y1) > b or max(y0, y1) < -b:
        return False
    dx, dy = x1 - x0, y1 - y0
    off: bool = abs(x0 * dy - y0 * dx) <= a * abs(dy) + b * abs(dx)
    return off


@compiled
def ways_cross(first: Any, second: Any) -> bool:
    """True if two segments (x0, y0, x1, y1) have a point in common, but for parallel ones."""
    ax, ay = first[2] - first[0], first[3] - first[1]
    bx, by = second[2] - second[0], second[3] - second[1]
    cx, cy = second[0] - first[0], second[1] - first[1]
    across = ax * by - ay * bx
    if across == 0.0:
        return False
    along, beside = (cx * by - cy * bx) / across, (cx * ay - cy * ax) / across
    meet: bool = 0.0 <= along <= 1.0 and 0.0 <= beside <= 1.0
    return meet


@compiled
def meets_walls(a: float, b: float, before: Any, after: Any, walls: Array) -> bool:
    """True if the rectangle, moving from one pose to the next, touches a wall.

    Poses are (x, y, cos yaw, sin yaw) in the map, walls the edges (n, 4) of closed rings there. The
    first touch of two polygons is that of a corner: one of the walls on its way through the
    rectangle's frame, or one of the rectangle on its way through the map.
    """
    x0, y0, c0, s0 = before
    x1, y1, c1, s1 = after
    reach = math.hypot(a, b) + math.hypot(x1 - x0, y1 - y0)
    for n in range(len(walls)):
        wall = walls[n]
        if segment_distance(wall, x0, y0) > reach:
            continue
        px, py, qx, qy = wall[0] - x0, wall[1] - y0, wall[0] - x1, wall[1] - y1
        if way_meets(
            a, b, c0 * px + s0 * py, c0 * py - s0 * px, c1 * qx + s1 * qy, c1 * qy - s1 * qx
        ):
            return True
        for i in range(4):
            u = a if i < 2 else -a
            v = b if i % 2 else -b
            way = (
                x0 + c0 * u - s0 * v, y0 + s0 * u + c0 * v,
                x1 + c1 * u - s1 * v, y1 + s1 * u + c1 * v,
            )  # fmt: skip
            if ways_cross(way, wall):
                return True
    return False


@compiled
def segment_distance(segment: Any, x: float, y: float) -> float:
    """Distance of a point to a segment (x0, y0, x1, y1)."""
    dx, dy = segment[2] - segment[0], segment[3] - segment[1]
    px, py = x - segment[0], y - segment[1]
    square = dx * dx + dy * dy
    along = 0.0 if square == 0.0 else min(1.0, max(0.0, (px * dx + py * dy) / square))
    return math.hypot(px - along * dx, py - along * dy)


@compiled
def overlaps_walls(a: float, b: float, pose: Any, walls: Array) -> bool:
    """True if the standing rectangle at (x, y, cos yaw, sin yaw) has a wall's edge in it."""
    x, y, c, s = pose
    for n in range(len(walls)):
        px, py, qx, qy = walls[n][0] - x, walls[n][1] - y, walls[n][2] - x, walls[n][3] - y
        if way_meets(a, b, c * px + s * py, c * py - s * px, c * qx + s * qy, c * qy - s * qx):
            return True
    return False


@compiled
def free_way(walls: Array, start: Any, heading: Any, keep: float, longest: float) -> float:
    """How far one can go straight from `start` (x, y) until a wall is nearer than `keep`.

    Who starts nearer to a wall can go on as long as no wall comes nearer.
    """
    gone, least = 0.0, keep
    while gone < longest:
        x, y = start[0] + gone * heading[0], start[1] + gone * heading[1]
        left = math.inf
        for n in range(len(walls)):
            left = min(left, segment_distance(walls[n], x, y))
        if gone == 0.0:
            least = min(least, left)
        elif left < least - TINY:
            return max(0.0, gone - WAY_M)
        gone += WAY_M
    return longest
