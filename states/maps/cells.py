"""Grids of square cells in the map, and polygons drawn on them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hw import Pose2, compiled
from hw.scene import Point
from states.maps.distance import Array
from states.maps.occupancy import FREE, OCCUPIED, OccupancyMap

Ring = Sequence[Point]
Mask = NDArray[np.bool_]
MOST_CELLS = 50_000_000
"""Largest number of cells of a grid: a costmap with its distances takes some 40 bytes for each."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Cells along the axes of the map: side of a cell, m, counts, and lower left corner, m."""

    resolution: float
    rows: int
    columns: int
    x: float = 0.0
    y: float = 0.0

    def cell(self, x: float, y: float) -> tuple[int, int] | None:
        """Row and column of the cell at a place; None outside and for NaN."""
        if not (math.isfinite(x) and math.isfinite(y)):
            return None
        row = math.floor((y - self.y) / self.resolution)
        column = math.floor((x - self.x) / self.resolution)
        return (row, column) if 0 <= row < self.rows and 0 <= column < self.columns else None

    def center(self, row: int, column: int) -> Point:
        """The centre of a cell, m."""
        return self.x + (column + 0.5) * self.resolution, self.y + (row + 0.5) * self.resolution

    def centers(self) -> tuple[Array, Array]:
        """The x of every column and the y of every row, m."""
        xs = self.x + (np.arange(self.columns, dtype=np.float64) + 0.5) * self.resolution
        ys = self.y + (np.arange(self.rows, dtype=np.float64) + 0.5) * self.resolution
        return xs, ys


def grid_over(rings: Iterable[Ring], resolution: float, margin: float = 0.0) -> Grid:
    """The grid that covers all rings and `margin`, m, around them.

    Raises:
        ValueError: it has more than `MOST_CELLS`.
    """
    xs, ys = zip(*(point for ring in rings for point in ring), strict=True)
    x, y = min(xs) - margin, min(ys) - margin
    columns = math.ceil((max(xs) + margin - x) / resolution - 1e-9)
    rows = math.ceil((max(ys) + margin - y) / resolution - 1e-9)
    if rows * columns > MOST_CELLS:
        raise ValueError(
            f"{max(xs) - min(xs):g} x {max(ys) - min(ys):g} m are {rows * columns:.2g} cells of "
            f"{resolution:g} m; {MOST_CELLS:.2g} are possible"
        )
    return Grid(resolution, rows, columns, x, y)


def fill_rings(grid: Grid, rings: Sequence[Ring]) -> Mask:
    """Cells whose centre lies inside the first ring and outside all others."""
    rows = []
    for number, ring in enumerate(rings):
        for i, corner in enumerate(ring):
            rows.append((*ring[i - 1], *corner, 0.0, float(number)))
    return _fill(*grid.centers(), np.array(rows, dtype=np.float64))


def room_map(
    outer: Ring, obstacles: Sequence[Ring], resolution: float, margin: float = 0.3
) -> OccupancyMap:
    """The occupancy map of a known room: cells whose centre is not on the floor are occupied.

    Obstacles thinner than a cell and a half also occupy the cells that their sides cross.
    """
    grid = grid_over([outer], resolution, margin)
    occupied = ~fill_rings(grid, [outer, *obstacles])
    for ring in obstacles:
        if _mean_width(ring) < 1.5 * resolution:
            for i, (x, y) in enumerate(ring):
                _mark_line(occupied, grid, ring[i - 1], (x, y))
    values = np.where(occupied, OCCUPIED, FREE).astype(np.int16)
    values.setflags(write=False)
    return OccupancyMap(values, resolution, Pose2(grid.x, grid.y))


@compiled
def is_inside_rings(x: float, y: float, sides: Array) -> bool:
    """True inside the outer ring and outside all others, by the even-odd rule per ring."""
    ring, odd = 0.0, False
    for i in range(len(sides)):
        if sides[i, 5] != ring:
            if odd != (ring == 0.0):
                return False
            ring, odd = sides[i, 5], False
        y1, y2 = sides[i, 1], sides[i, 3]
        if (y1 > y) != (y2 > y):
            x1, x2 = sides[i, 0], sides[i, 2]
            if x < x1 + (y - y1) * (x2 - x1) / (y2 - y1):
                odd = not odd
    return odd == (ring == 0.0)


@compiled
def _fill(xs: Array, ys: Array, sides: Array) -> Mask:
    """`is_inside_rings` of every centre, by scan lines: a side flips all cells left of it.

    Work is that of the cells in each ring's box, not of cells times sides.
    """
    mask = np.zeros((len(ys), len(xs)), np.bool_)
    flips = np.zeros((len(ys), len(xs) + 1), np.bool_)
    first = 0
    while first < len(sides):
        last = first
        while last < len(sides) and sides[last, 5] == sides[first, 5]:
            last += 1
        box = _flip(flips, xs, ys, sides[first:last])
        for row in range(box[0], box[1]):
            odd = False
            for column in range(box[3], box[2] - 1, -1):
                odd = odd != flips[row, column]
                flips[row, column] = False
                if odd and column > 0:
                    mask[row, column - 1] = first == 0
        first = last
    return mask


@compiled
def _flip(flips: Mask, xs: Array, ys: Array, ring: Array) -> tuple[int, int, int, int]:
    """Mark how many columns lie left of each side; the box: rows from, to, first and last mark."""
    low, high, left, right = len(ys), 0, len(xs), 0
    for i in range(len(ring)):
        x1, y1, x2, y2 = ring[i, 0], ring[i, 1], ring[i, 2], ring[i, 3]
        from_row = np.searchsorted(ys, min(y1, y2))
        to_row = np.searchsorted(ys, max(y1, y2))
        for row in range(from_row, to_row):
            at = np.searchsorted(xs, x1 + (ys[row] - y1) * (x2 - x1) / (y2 - y1))
            flips[row, at] = not flips[row, at]
            left, right = min(left, at), max(right, at)
        if from_row < to_row:
            low, high = min(low, from_row), max(high, to_row)
    return low, high, left, right


def _mean_width(ring: Ring) -> float:
    twice_area = around = 0.0
    for i, (x, y) in enumerate(ring):
        before_x, before_y = ring[i - 1]
        twice_area += before_x * y - x * before_y
        around += math.hypot(x - before_x, y - before_y)
    return abs(twice_area) / around if around > 0.0 else 0.0


def _mark_line(mask: Mask, grid: Grid, start: Point, end: Point) -> None:
    steps = max(1, math.ceil(2.0 * math.dist(start, end) / grid.resolution))
    for i in range(steps + 1):
        part = i / steps
        cell = grid.cell(
            start[0] + part * (end[0] - start[0]), start[1] + part * (end[1] - start[1])
        )
        if cell is not None:
            mask[cell] = True
