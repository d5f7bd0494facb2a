"""Beams that lead off the map, and what they say of a place at its border.

A robot that leaves a map sees what the map does not show. That may look like some other place of
the map, with every right: rooms of a building are alike. Where its wheels have led it, these beams
end beyond the known floor, and no wall is in their way: they neither support that place nor speak
against it.
"""

from __future__ import annotations

import math

from hw import Pose2, compiled
from states.maps import Array, Field, Table, distance_at, is_floor

BEYOND, EXPLAINED = 0.15, 0.6
"""Least share of beams that lead off the map, and of those that do or end on walls, from a place at
which a robot is leaving the map."""
_BEAMS = 60
"""Largest number of beams that are followed."""


def is_leaving(field: Field, points: Array, map_from_base: Pose2, fits: float) -> bool:
    """True if the map ends where points (n, 2) of the base frame go on, and else agrees with them.

    A beam agrees if it ends within `fits` of a wall, m.
    """
    some = points[:: math.ceil(max(1, len(points)) / _BEAMS)]
    pose = field.map_from_corner.inverse() @ map_from_base
    beyond, on_walls = _counted(some, (pose.x, pose.y, pose.yaw), field.table, fits)
    return beyond >= BEYOND * len(some) and beyond + on_walls >= EXPLAINED * len(some)


@compiled
def _counted(
    points: Array, pose: tuple[float, float, float], table: Table, fits: float
) -> tuple[int, int]:
    """Number of beams that lead off the map, and of those that end on walls."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    beyond = on_walls = 0
    for i in range(len(points)):
        dx = c * points[i, 0] - s * points[i, 1]
        dy = s * points[i, 0] + c * points[i, 1]
        if distance_at(pose[0] + dx, pose[1] + dy, table)[0] < fits:
            on_walls += 1
        elif not is_floor(pose[0] + dx, pose[1] + dy, table):
            beyond += not _is_crossed((pose[0], pose[1]), (dx, dy), table)
    return beyond, on_walls


@compiled
def _is_crossed(start: tuple[float, float], way: tuple[float, float], table: Table) -> bool:
    """True if a wall is on the way: looked for every half cell, and three quarters of one wide.

    Between the centres of two wall cells that meet at a corner the distance is half a cell.
    """
    steps = math.ceil(2.0 * math.hypot(way[0], way[1]) / table.cell)
    for k in range(1, steps):
        share = k / steps
        x, y = start[0] + share * way[0], start[1] + share * way[1]
        if distance_at(x, y, table)[0] < 0.75 * table.cell:
            return True
    return False
