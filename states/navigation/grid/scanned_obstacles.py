"""Scanned obstacles that are not on the map, as planners need them: cells, boxes, distances.

All subsystems plan with the same obstacles. Marks are dilated by one cell, so that noise within a
cell changes nothing and planners are rebuilt only when something has changed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hw import compiled
from hw.scene import Ring
from states.maps import Grid, Mask, distances
from states.navigation.exact import Array

if TYPE_CHECKING:
    from states.navigation.exact import ExactPlanner

Cells = NDArray[np.int64]
CellWindow = tuple[slice, slice]

LARGEST_BOX_M = 0.5
"""Longest side of a box; longer obstacles are split, or their box would cover free floor."""
FULL = 0.75
"""Share of marked cells from which on a box is not split."""
MOST_BOXES = 24
"""Most boxes, so that a planner among polygons is rebuilt within a tick; else they get larger."""


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Occupied cells of a grid, as sorted numbers row * columns + column.

    `reach` is the largest distance at which any subsystem takes account of obstacles, m.
    """

    grid: Grid
    cells: Cells
    reach: float
    exact: dict[float, ExactPlanner] = field(default_factory=dict, repr=False)
    """Planners among polygons that include them, by inflation; made when first needed."""

    def __bool__(self) -> bool:
        return len(self.cells) > 0

    @cached_property
    def _fields(self) -> dict[Grid, tuple[CellWindow, Array]]:
        return {}

    def distances_on(self, grid: Grid) -> tuple[CellWindow, Array]:
        """A window of a grid, and in it the distances to the nearest obstacle cell's centre, m."""
        if grid not in self._fields:
            self._fields[grid] = self._field(grid)
        return self._fields[grid]

    def _field(self, grid: Grid) -> tuple[CellWindow, Array]:
        rows, columns = self._on(grid)
        if not len(rows):
            return (slice(0, 0), slice(0, 0)), np.empty((0, 0))
        more = math.ceil(self.reach / grid.resolution) + 1
        low, left = max(0, rows.min() - more), max(0, columns.min() - more)
        high = min(grid.rows, rows.max() + more + 1)
        right = min(grid.columns, columns.max() + more + 1)
        mask = np.zeros((high - low, right - left), np.bool_)
        mask[rows - low, columns - left] = True
        return (slice(low, high), slice(left, right)), distances(mask, grid.resolution)

    def _on(self, grid: Grid) -> tuple[Cells, Cells]:
        """Rows and columns of the cells on another grid."""
        rows, columns = np.divmod(self.cells, self.grid.columns)
        if grid == self.grid:
            return rows, columns
        x = self.grid.x + (columns + 0.5) * self.grid.resolution
        y = self.grid.y + (rows + 0.5) * self.grid.resolution
        rows = np.floor((y - grid.y) / grid.resolution).astype(np.int64)
        columns = np.floor((x - grid.x) / grid.resolution).astype(np.int64)
        inside = (rows >= 0) & (rows < grid.rows) & (columns >= 0) & (columns < grid.columns)
        return rows[inside], columns[inside]

    @cached_property
    def boxes(self) -> tuple[Ring, ...]:
        """Axis-aligned boxes that cover all cells, and little else."""
        if not self:
            return ()
        rows, columns = np.divmod(self.cells, self.grid.columns)
        corner = (int(rows.min()), int(columns.min()))
        mask = np.zeros((rows.max() - corner[0] + 1, columns.max() - corner[1] + 1), np.bool_)
        mask[rows - corner[0], columns - corner[1]] = True
        largest, full = LARGEST_BOX_M / self.grid.resolution, FULL
        found = list(_boxes(mask, largest, full))
        while len(found) > MOST_BOXES:
            largest, full = 2.0 * largest, 0.0
            found = list(_boxes(mask, largest, full))
        return tuple(self._ring(corner, box) for box in found)

    def _ring(self, corner: tuple[int, int], box: tuple[int, int, int, int]) -> Ring:
        size, grid = self.grid.resolution, self.grid
        low, high = (grid.y + (corner[0] + row) * size for row in box[:2])
        left, right = (grid.x + (corner[1] + column) * size for column in box[2:])
        return (left, low), (right, low), (right, high), (left, high)


def _boxes(mask: Mask, largest: float, full: float) -> Iterator[tuple[int, int, int, int]]:
    """Boxes (rows from, to, columns from, to) of each component, split until small or full."""
    from scipy import ndimage

    labels, _ = ndimage.label(mask, np.ones((3, 3)))
    for number, area in enumerate(ndimage.find_objects(labels), 1):
        corner = area[0].start, area[1].start
        yield from _cut(labels[area] == number, corner, largest, full)


def _cut(
    mask: Mask, corner: tuple[int, int], largest: float, full: float
) -> Iterator[tuple[int, int, int, int]]:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return
    mask = mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    row, column = corner[0] + int(rows[0]), corner[1] + int(columns[0])
    height, width = mask.shape
    if max(height, width) <= largest or (full and mask.mean() >= full):
        yield row, row + height, column, column + width
    elif height >= width:
        half = height // 2
        yield from _cut(mask[:half], (row, column), largest, full)
        yield from _cut(mask[half:], (row + half, column), largest, full)
    else:
        half = width // 2
        yield from _cut(mask[:, :half], (row, column), largest, full)
        yield from _cut(mask[:, half:], (row, column + half), largest, full)


class ShownObstacles:
    """The obstacles published last, kept as long as the marked cells still agree with them."""

    def __init__(self, grid: Grid, reach: float) -> None:
        self.obstacles = Obstacles(grid, np.empty(0, np.int64), reach)
        self._nothing = self.obstacles
        self._grown: Mask = np.zeros(grid.rows * grid.columns, np.bool_)
        self._marked = self.obstacles.cells

    def update(self, marked: Cells) -> None:
        """Publish the marked cells if the obstacles no longer agree with them.

        They agree while each marked cell is among the obstacles, and each cell marked at the last
        publication still has a marked one among itself and its neighbours.
        """
        grid = self.obstacles.grid
        if len(marked) == len(self._marked) == 0:
            return
        if len(marked) and holds(marked, self._marked, self._grown, grid.columns):
            return
        self._grown[self.obstacles.cells] = False
        self._marked = marked
        self.obstacles = self._nothing
        if len(marked):
            cells = grown(marked, grid.rows, grid.columns)
            self._grown[cells] = True
            self.obstacles = Obstacles(grid, cells, self._nothing.reach)


@compiled
def holds(marked: Cells, before: Cells, known: Mask, columns: int) -> bool:
    """True if each marked cell is known, and each one marked before has one within a cell of it."""
    for cell in marked:
        if not known[cell]:
            return False
    now = set(marked)
    for cell in before:
        near = False
        for up in (-columns, 0, columns):
            for across in (-1, 0, 1):
                near = near or cell + up + across in now
        if not near:
            return False
    return True


def grown(marked: Cells, rows: int, columns: int) -> Cells:
    """The cells and their eight neighbours on the grid, sorted, without duplicates."""
    row, column = np.divmod(marked, columns)
    steps = np.array((-1, 0, 1))
    row = np.clip(row[:, None, None] + steps[None, :, None], 0, rows - 1)
    column = np.clip(column[:, None, None] + steps[None, None, :], 0, columns - 1)
    found: Cells = np.unique(row * columns + column)
    return found
