"""Distance fields, to which scans are matched: distance and gradient to the nearest wall.

In drawn rooms the distance is exact: each cell of a table lists the sides that can be nearest to a
place in it. On scanned maps it is interpolated between the centres of cells, which places a wall
within half a cell. Tables count from the lower left corner of the map, wherever that lies.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hw import Pose2, compiled
from hw.scene import Room
from states.maps.cells import Grid, Mask, fill_rings
from states.maps.distance import Array, distances
from states.maps.occupancy import FREE, UNKNOWN, OccupancyMap, Values

Indices = NDArray[np.int32]

REACH = 2.0
"""Distances are capped at this, m: `laser_likelihood_max_dist` of amcl."""
OCCUPIED_FROM = 65
"""Cells of this value or more are walls."""

_FINEST = 0.1  # m, cells of drawn rooms; finer ones list no fewer sides
_MOST_WORK = 5e7  # sides times cells of a table
_BLOCK = 8  # cells along the side of a block, for which sides are sorted out together


class Table(NamedTuple):
    """A field as compiled code reads it; coordinates count from its corner, m.

    Drawn: the sides that can be nearest in cell i are `sides[listed[first[i]:first[i + 1]]]`; a
    side is x, y of its start, its direction and its length. Scanned: `nearest` (rows, columns)
    holds the distances at the centres of cells. Unused arrays are empty. `floor` (rows, columns)
    marks the cells whose centre is on the floor; empty if that is unknown.
    """

    cell: float
    rows: int
    columns: int
    reach: float
    sides: Array
    first: Indices
    listed: Indices
    nearest: Array
    floor: Mask


@dataclass(frozen=True, eq=False)
class Field:
    """Distances to the walls of a map; `sigma` is the uncertainty of the walls themselves, m."""

    map_from_corner: Pose2
    table: Table
    sigma: float = 0.0

    @cached_property
    def free(self) -> Array:
        """Places on the floor (n, 2), one per cell, from the corner as in the table, m."""
        row, column = np.nonzero(self.table.floor)
        return self.table.cell * (np.stack([column, row], axis=1).astype(np.float64) + 0.5)

    def distances(self, map_from_base: Pose2, points: Array) -> Array:
        """Distance to the nearest wall of points (n, 2) of the base frame, (n,), m."""
        pose = self.map_from_corner.inverse() @ map_from_base
        return distances_of(points, pose.x, pose.y, pose.yaw, self.table)


def room_field(room: Room, reach: float = REACH) -> Field:
    """The field of a drawn room, exact up to `reach`, m."""
    x_low, y_low, x_high, y_high = room.bounds
    corner = Pose2(x_low - reach, y_low - reach)
    width, height = x_high - x_low + 2.0 * reach, y_high - y_low + 2.0 * reach
    cell = max(_FINEST, math.sqrt(width * height * len(room.segments) / _MOST_WORK))
    rows, columns = math.ceil(height / cell), math.ceil(width / cell)
    ends = np.array(room.segments, dtype=np.float64) - np.array([corner.x, corner.y] * 2)
    along = ends[:, 2:] - ends[:, :2]
    length = np.hypot(along[:, 0], along[:, 1])
    kept = length > 0.0
    parts = (ends[kept, :2], along[kept] / length[kept, None], length[kept, None])
    sides = np.ascontiguousarray(np.hstack(parts))
    first, listed = _candidates(sides, cell, rows, columns, reach)
    grid = Grid(cell, rows, columns, corner.x, corner.y)
    floor = fill_rings(grid, [room.outer, *room.obstacles])
    return Field(
        corner, Table(cell, rows, columns, reach, sides, first, listed, np.empty((0, 0)), floor)
    )


def map_field(map_: OccupancyMap, reach: float = REACH) -> Field:
    """The field of a scanned map, its walls known to half a cell.

    Only faces count as walls, so that scans are matched to the face of a thick wall. As in a drawn
    room, distances go on outside the map up to `reach`: outermost cells are walls on both sides.
    """
    size = map_.resolution
    border = math.ceil(reach / size) + 1  # the outer half cell is not interpolated
    values = np.pad(map_.values, border, constant_values=UNKNOWN)
    nearest = np.minimum(distances(_faces(values), size), reach)
    none, nobody = np.empty((0, 5)), np.empty(0, np.int32)
    rows, columns = values.shape
    table = Table(size, rows, columns, reach, none, nobody, nobody, nearest, values == FREE)
    corner = map_.map_from_corner @ Pose2(-border * size, -border * size)
    return Field(corner, table, 0.5 * size)


def _faces(values: Values) -> Mask:
    """Occupied cells next to a free one; all occupied ones if there is no such cell.

    The outermost cells are unknown.
    """
    occupied = values >= OCCUPIED_FROM
    from scipy.ndimage import binary_dilation

    beside = binary_dilation(values == FREE, np.ones((3, 3)))
    faces: Mask = occupied & beside
    return faces if faces.any() else occupied


@compiled
def distance_at(x: float, y: float, table: Table) -> tuple[float, float, float]:
    """Distance of a place to the nearest wall, m, and its gradient.

    Beyond `reach` and outside the table it is `reach`, with gradient 0.
    """
    if len(table.nearest) > 0:
        return _interpolated(x, y, table)
    column, row = math.floor(x / table.cell), math.floor(y / table.cell)
    if not (0 <= column < table.columns and 0 <= row < table.rows):
        return table.reach, 0.0, 0.0
    cell = int(row) * table.columns + int(column)
    best, side, dx, dy = table.reach * table.reach, -1, 0.0, 0.0
    for k in range(table.first[cell], table.first[cell + 1]):
        i = table.listed[k]
        off_x, off_y = _off(x, y, table.sides[i])
        square = off_x * off_x + off_y * off_y
        if square < best:
            best, side, dx, dy = square, i, off_x, off_y
    if side < 0:
        return table.reach, 0.0, 0.0
    distance = math.sqrt(best)
    if distance > 1e-9:
        return distance, dx / distance, dy / distance
    # on a side the difference has no direction: take the side's normal
    return distance, -table.sides[side, 3], table.sides[side, 2]


@compiled
def is_floor(x: float, y: float, table: Table) -> bool:
    """Is the centre of the place's cell on the floor? True if the floor is unknown."""
    if len(table.floor) == 0:
        return True
    column, row = math.floor(x / table.cell), math.floor(y / table.cell)
    if not (0 <= column < table.columns and 0 <= row < table.rows):
        return False
    return bool(table.floor[int(row), int(column)])


@compiled
def distances_of(points: Array, x: float, y: float, yaw: float, table: Table) -> Array:
    """`distance_at` of points (n, 2) seen from a pose, (n,), m."""
    found = np.empty(len(points))
    c, s = math.cos(yaw), math.sin(yaw)
    for i in range(len(points)):
        px, py = points[i, 0], points[i, 1]
        found[i] = distance_at(x + c * px - s * py, y + s * px + c * py, table)[0]
    return found


@compiled
def _off(x: float, y: float, side: Array) -> tuple[float, float]:
    """Vector from the nearest point of a side to a place."""
    dx, dy = x - side[0], y - side[1]
    along = min(max(dx * side[2] + dy * side[3], 0.0), side[4])
    return dx - along * side[2], dy - along * side[3]


@compiled
def _interpolated(x: float, y: float, table: Table) -> tuple[float, float, float]:
    u, v = x / table.cell - 0.5, y / table.cell - 0.5
    column, row = math.floor(u), math.floor(v)
    if not (0 <= column < table.columns - 1 and 0 <= row < table.rows - 1):
        return table.reach, 0.0, 0.0
    i, j = int(row), int(column)
    u, v = u - column, v - row
    a, b = table.nearest[i, j], table.nearest[i, j + 1]
    c, d = table.nearest[i + 1, j], table.nearest[i + 1, j + 1]
    low, high = a + u * (b - a), c + u * (d - c)
    slope = (1.0 - v) * (b - a) + v * (d - c)
    return low + v * (high - low), slope / table.cell, (high - low) / table.cell


@compiled
def _candidates(
    sides: Array, cell: float, rows: int, columns: int, reach: float
) -> tuple[Indices, Indices]:
    """The sides that can be nearest to some place of each cell, in rows of cells.

    Places are within half a diagonal h of the centre, so distances to sides differ from those at
    the centre by at most h: a side farther from the centre than the nearest one by 2 h is nearest
    to no place of the cell. Each block of cells is looked at first, in the same way, and its cells
    look only at what remains.
    """
    half = 0.5 * math.sqrt(2.0) * cell
    first = np.zeros(rows * columns + 1, np.int32)
    listed = np.empty(1024, np.int32)
    count = 0
    everyone = np.arange(len(sides), dtype=np.int32)
    across = (columns + _BLOCK - 1) // _BLOCK
    near = [everyone] * across
    wide = _BLOCK * cell
    for row in range(rows):
        if row % _BLOCK == 0:
            y = (row + 0.5 * _BLOCK) * cell
            for block in range(across):
                x = (block + 0.5) * wide
                near[block] = _nearest(sides, everyone, x, y, _BLOCK * half, reach)
        for column in range(columns):
            x, y = (column + 0.5) * cell, (row + 0.5) * cell
            for i in _nearest(sides, near[column // _BLOCK], x, y, half, reach):
                if count == len(listed):
                    listed = np.concatenate((listed, np.empty_like(listed)))
                listed[count] = i
                count += 1
            first[row * columns + column + 1] = count
    return first, listed[:count].copy()


@compiled
def _nearest(
    sides: Array, among: Indices, x: float, y: float, half: float, reach: float
) -> Indices:
    """Those sides that can be nearest to, and within `reach` of, a place `half` around a centre."""
    own = np.empty(len(among))
    limit = reach + half
    for k in range(len(among)):
        dx, dy = _off(x, y, sides[among[k]])
        own[k] = math.sqrt(dx * dx + dy * dy)
        limit = min(limit, own[k] + 2.0 * half)
    return among[own <= limit + 1e-9]
