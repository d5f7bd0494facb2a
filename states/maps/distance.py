"""Exact Euclidean distance transform on cells (Meijster, Roerdink and Hesselink 2000).

Distances are between cell centres, in whole squared cells. The result equals that of
`scipy.ndimage.distance_transform_edt` to the last bit at a third of its time (`DECISIONS.md`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hw import compiled

Array = NDArray[np.float64]
SquaredCells = NDArray[np.int64]

NOTHING_NEAR = np.int64(2) ** 40
"""Squared distance where there is no occupied cell."""

_FAR = 2**20


@compiled
def squared_distances(occupied: NDArray[np.bool_]) -> SquaredCells:
    """Squared distance to the nearest occupied cell, in cells, (rows, columns).

    First along each column, then along each row as the minimum over all columns i of the
    parabolas column_distance(i)^2 + (x - i)^2.
    """
    rows, columns = occupied.shape
    vertical = np.empty((rows, columns), np.int64)
    for column in range(columns):
        vertical[0, column] = 0 if occupied[0, column] else _FAR
    for row in range(1, rows):
        for column in range(columns):
            above = vertical[row - 1, column] + 1
            vertical[row, column] = 0 if occupied[row, column] else min(above, _FAR)
    for row in range(rows - 2, -1, -1):
        for column in range(columns):
            vertical[row, column] = min(vertical[row, column], vertical[row + 1, column] + 1)
    squared = np.empty((rows, columns), np.int64)
    owner = np.empty(columns, np.int64)
    begins = np.empty(columns, np.int64)
    for row in range(rows):
        _lower_envelope(vertical[row], squared[row], owner, begins)
    return squared


@compiled
def _lower_envelope(
    heights: SquaredCells, squared: SquaredCells, owner: SquaredCells, begins: SquaredCells
) -> None:
    """Minimum of the parabolas heights[i]^2 + (x - i)^2 at every x of a row.

    `owner[k]` is the parabola that is lowest from `begins[k]` on. Two parabolas a < x cross at
    (x^2 - a^2 + heights[x]^2 - heights[a]^2) / (2 (x - a)).
    """
    count = len(heights)
    last = 0
    owner[0], begins[0] = 0, 0
    for x in range(1, count):
        while last >= 0:
            at, other = begins[last], owner[last]
            if heights[other] ** 2 + (at - other) ** 2 <= heights[x] ** 2 + (at - x) ** 2:
                break
            last -= 1
        if last < 0:
            last, owner[0], begins[0] = 0, x, 0
            continue
        other = owner[last]
        gain = x * x - other * other + heights[x] ** 2 - heights[other] ** 2
        begin = 1 + gain // (2 * (x - other))
        if begin < count:
            last += 1
            owner[last], begins[last] = x, begin
    for x in range(count - 1, -1, -1):
        nearest = owner[last]
        if heights[nearest] >= _FAR:
            squared[x] = NOTHING_NEAR
        else:
            squared[x] = heights[nearest] ** 2 + (x - nearest) ** 2
        if x == begins[last]:
            last -= 1


def distances(occupied: NDArray[np.bool_], resolution: float) -> Array:
    """Distance to the nearest occupied cell, centre to centre, m; inf where there is none."""
    squared = squared_distances(np.ascontiguousarray(occupied))
    field: Array = np.where(squared < NOTHING_NEAR, np.sqrt(squared) * resolution, math.inf)
    return field
