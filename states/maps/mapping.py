"""Maps from scans with known poses: how often beams ended in each cell, and passed through it.

A cell is occupied if at least a quarter of the scans that observed it ended there, else free: at
grazing angles beams often pass through cells of a wall, and people who walk by are rarely seen at
the same place. A cell counts once per scan, as an end if any beam ends in it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hw import Pose2, compiled
from states.maps.distance import Array
from states.maps.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyMap

Counts = NDArray[np.int32]
CellValues = NDArray[Any]
Corner = tuple[int, int]
"""Column and row of the lower left cell, counted from the origin of the map."""

RESOLUTION = 0.05
"""The side of a cell, m."""
FARTHEST = 30.0
"""Beams are followed up to here, m; farther ends are too sparse to form walls."""
OCCUPIED_SHARE = 0.25
"""A cell is a wall if at least this share of the scans that observed it ended in it."""
LARGEST = 200_000_000
"""Most cells of a map."""
_ROOM = 100
"""Cells added beyond what is needed when the grid grows."""


class Mapper:
    """Accumulates scans; `map` returns the map they show so far."""

    def __init__(self, resolution: float = RESOLUTION, farthest: float = FARTHEST) -> None:
        self._cell, self._farthest = resolution, farthest
        self._corner: Corner = (0, 0)
        self._counts: Counts = np.zeros((0, 0, 4), np.int32)  # ends, passes, scan of either
        self._scans = 0

    def add(self, origin: tuple[float, float], ends: Array) -> None:
        """Add a scan: position of its sensor, and end points of its beams (n, 2), in the map, m.

        Raises:
            ValueError: the map would be too large, because the scan is far from the others.
        """
        if len(ends) == 0:
            return
        start = np.array(origin, dtype=np.float64)
        self._cover(start, ends)
        self._scans += 1
        corner = np.array(self._corner, dtype=np.float64)
        _count(
            self._counts, start / self._cell - corner, ends / self._cell - corner, self._scans,
            self._farthest / self._cell,
        )  # fmt: skip

    def map(self) -> OccupancyMap:
        """The map of the cells observed so far.

        Raises:
            ValueError: no scan was taken.
        """
        seen = self._counts[..., 0] + self._counts[..., 1]
        rows_seen, columns_seen = np.flatnonzero(seen.any(1)), np.flatnonzero(seen.any(0))
        if not len(rows_seen):
            raise ValueError("no scan was taken; a map needs one at least")
        first_row, first_column = int(rows_seen[0]), int(columns_seen[0])
        part = np.s_[first_row : rows_seen[-1] + 1, first_column : columns_seen[-1] + 1]
        share = self._counts[part][..., 0] / np.maximum(seen[part], 1)
        known = np.where(share >= OCCUPIED_SHARE, OCCUPIED, FREE)
        values = np.where(seen[part] > 0, known, UNKNOWN).astype(np.int16)
        values.setflags(write=False)
        x = (self._corner[0] + first_column) * self._cell
        y = (self._corner[1] + first_row) * self._cell
        return OccupancyMap(values, self._cell, Pose2(x, y))

    def _cover(self, start: Array, ends: Array) -> None:
        """Grow the grid to cover the scan."""
        low = np.maximum(np.minimum(start, ends.min(axis=0)), start - self._farthest)
        high = np.minimum(np.maximum(start, ends.max(axis=0)), start + self._farthest)
        self._counts, self._corner = covering(
            self._counts, self._corner, low / self._cell, high / self._cell, 0
        )


def covering(
    cells: CellValues, corner: Corner, low: Array, high: Array, fill: float
) -> tuple[CellValues, Corner]:
    """Cells (rows, columns, …) grown to cover the box from `low` to `high`, if necessary.

    `corner` is column and row of the lower left cell; `low` and `high` are x, y in cells.

    Raises:
        ValueError: there would be too many.
    """
    (first_column, first_row), (last_column, last_row) = (
        np.floor(place).astype(np.int64).tolist() for place in (low, high)
    )
    rows, columns = cells.shape[:2]
    column, row = corner if rows else (first_column, first_row)
    left, below = _more(column - first_column), _more(row - first_row)
    right, above = _more(last_column + 1 - column - columns), _more(last_row + 1 - row - rows)
    if not (left or below or right or above):
        return cells, (column, row)
    if (rows + below + above) * (columns + left + right) > LARGEST:
        raise ValueError(f"the map would have more than {LARGEST} cells")
    edges = [(below, above), (left, right)] + [(0, 0)] * (cells.ndim - 2)
    return np.pad(cells, edges, constant_values=fill), (column - left, row - below)


def _more(lacking: int) -> int:
    return lacking + _ROOM if lacking > 0 else 0


@compiled
def _count(counts: Counts, start: Array, ends: Array, scan: int, farthest: float) -> None:
    """Count a scan, end points first, so that its beams do not count as passing through them."""
    for i in range(len(ends)):
        if math.hypot(ends[i, 0] - start[0], ends[i, 1] - start[1]) <= farthest:
            cell = counts[math.floor(ends[i, 1]), math.floor(ends[i, 0])]
            if cell[2] != scan:
                cell[0] += 1
                cell[2] = scan
    for i in range(len(ends)):
        _pass(counts, start, ends[i], scan, farthest)


@compiled
def _pass(counts: Counts, start: Array, end: Array, scan: int, farthest: float) -> None:
    """Traverse the cells of a beam, all but the last (Amanatides and Woo 1987)."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    share = min(1.0, farthest / length) if length > 0.0 else 0.0
    column, row = math.floor(start[0]), math.floor(start[1])
    last_column = math.floor(start[0] + share * dx)
    last_row = math.floor(start[1] + share * dy)
    step_x, step_y = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
    to_x = (column + (dx > 0.0) - start[0]) / dx if dx != 0.0 else math.inf
    to_y = (row + (dy > 0.0) - start[1]) / dy if dy != 0.0 else math.inf
    each_x = abs(1.0 / dx) if dx != 0.0 else math.inf
    each_y = abs(1.0 / dy) if dy != 0.0 else math.inf
    for _ in range(abs(last_column - column) + abs(last_row - row)):
        cell = counts[row, column]
        if cell[2] != scan and cell[3] != scan:
            cell[1] += 1
            cell[3] = scan
        if to_x < to_y:
            to_x += each_x
            column += step_x
        else:
            to_y += each_y
            row += step_y
