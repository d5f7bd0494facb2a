"""A map of cells as a measurable floor, see `space.Floor`.

As in costmap_2d only occupied cells are inflated; unknown ones are neither free nor obstacles.
Walls begin at the faces of occupied cells. Results are accurate to about a cell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hw import compiled
from states.floors.usable_space import LEAST_PIECE, Obstacle, Passage, Quarter, obstacle_in
from states.maps import FREE, OCCUPIED, Mask, OccupancyMap, distances
from states.navigation.exact import Array

RegionLabels = NDArray[np.int64]

_ROUNDING = 1e-9
_ANGLES = 24


@dataclass(frozen=True)
class MapFloor:
    """See `space.Floor`."""

    map: OccupancyMap

    @cached_property
    def free(self) -> Mask:
        """Free cells, (rows, columns)."""
        found: Mask = self.map.values == FREE
        return found

    @cached_property
    def distance(self) -> Array:
        """Distance of each cell's centre to the nearest wall, m, (rows, columns)."""
        resolution = self.map.resolution
        return distances(self.map.values >= OCCUPIED, resolution) - 0.5 * resolution

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Bounds of the free cells, m."""
        rows, columns = np.nonzero(self.free)
        if not len(rows):
            return 0.0, 0.0, 0.0, 0.0
        size = self.map.resolution
        corners = [
            self.map.map_from_corner.transform(float(column) * size, float(row) * size)
            for row in (rows.min(), rows.max() + 1)
            for column in (columns.min(), columns.max() + 1)
        ]
        xs, ys = zip(*corners, strict=True)
        return min(xs), min(ys), max(xs), max(ys)

    @property
    def free_m2(self) -> float:
        """Area of the free cells."""
        return self.map.area()

    def usable(self, inflation: float) -> Mask:
        """Cells that the robot's centre can be in."""
        found: Mask = self.free & (self.distance >= inflation - _ROUNDING)
        return found

    def usable_m2(self, inflation: float) -> float:
        """Area of the usable cells."""
        return float(np.count_nonzero(self.usable(inflation))) * self.map.resolution**2

    def pieces(self, inflation: float) -> tuple[float, ...]:
        """Areas of the connected pieces, largest first."""
        counts = np.bincount(self._labels(inflation).ravel())[1:]
        areas = sorted((counts * self.map.resolution**2).tolist(), reverse=True)
        return tuple(areas)

    def closed_passages(self, inflation: float) -> tuple[Passage, ...]:
        """The widest passages that would connect the pieces: a spanning tree, narrowest first.

        Passages that would connect a piece to itself, around an obstacle, are not among them.
        """
        labels = self._labels(inflation)
        order = np.argsort(-self.distance, axis=None, kind="stable")
        order = order[self.free.ravel()[order]]
        found = [self._passage(cell) for cell in _meetings(labels, order).tolist()]
        return tuple(sorted(found, key=lambda passage: (passage.width, passage.start)))

    def is_clear(self, x: Array, y: Array, clearance: float) -> NDArray[np.bool_]:
        """True for places on usable cells; False on unknown cells and outside."""
        corner_from_map = self.map.map_from_corner.inverse()
        c, s = math.cos(corner_from_map.yaw), math.sin(corner_from_map.yaw)
        rows, columns = self.map.values.shape
        column = np.floor((corner_from_map.x + c * x - s * y) / self.map.resolution).astype(int)
        row = np.floor((corner_from_map.y + s * x + c * y) / self.map.resolution).astype(int)
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        found = np.zeros(x.shape, dtype=np.bool_)
        found[inside] = self.usable(clearance)[row[inside], column[inside]]
        return found

    def quarter(self, inflation: float, radius: float) -> Quarter | None:
        """Tried every 15 degrees and in each cell: a quarter fits if it covers no unusable cell."""
        from scipy.signal import correlate

        cells = round(radius / self.map.resolution)
        used = self.usable(inflation)
        if not used.any():
            return None
        rows, columns = (slice(i.min(), i.max() + 1) for i in np.nonzero(used))
        blocked = np.pad(~used[rows, columns], cells, constant_values=True).astype(np.float64)
        for turn in range(_ANGLES):
            angle = math.tau * turn / _ANGLES
            inside = correlate(blocked, _quarter(cells, angle), mode="valid", method="fft")
            if inside.min() < 0.5:
                row, column = divmod(int(inside.argmin()), inside.shape[1])
                corner, size = self.map.map_from_corner, self.map.resolution
                middle = (columns.start + column + 0.5) * size, (rows.start + row + 0.5) * size
                return Quarter(*corner.transform(*middle), angle + corner.yaw, radius)
        return None

    def obstacles_at(self, quarter: Quarter, inflation: float) -> tuple[Obstacle, ...]:
        """Groups of occupied cells that touch each other."""
        import shapely
        from scipy.ndimage import find_objects, label

        labels, _ = label(self.map.values >= OCCUPIED, structure=np.ones((3, 3)))
        rows, columns = np.nonzero(labels)
        x, y = self._places(rows.astype(np.float64) + 0.5, columns.astype(np.float64) + 0.5)
        away = shapely.distance(shapely.Polygon(quarter.corners()), shapely.points(x, y))
        near = np.unique(labels[rows, columns][away < inflation])
        boxes = find_objects(labels)
        found = [self._obstacle(*boxes[number - 1]) for number in near.tolist()]
        return tuple(
            sorted(found, key=lambda one: math.hypot(one.x - quarter.x, one.y - quarter.y))
        )

    def _obstacle(self, rows: slice, columns: slice) -> Obstacle:
        x, y = self._places(
            np.array([rows.start, rows.stop, rows.start, rows.stop], np.float64),
            np.array([columns.start, columns.start, columns.stop, columns.stop], np.float64),
        )
        return obstacle_in((x.min(), y.min(), x.max(), y.max()))

    def _places(self, rows: Array, columns: Array) -> tuple[Array, Array]:
        """Places in the map, m, of rows and columns counted in cells from the corner."""
        corner, size = self.map.map_from_corner, self.map.resolution
        c, s = math.cos(corner.yaw), math.sin(corner.yaw)
        x, y = size * columns, size * rows
        return corner.x + c * x - s * y, corner.y + s * x + c * y

    def _labels(self, inflation: float) -> RegionLabels:
        """The number of each cell's piece, from 1; 0 for none."""
        from scipy.ndimage import label

        found = label(self.usable(inflation), structure=np.ones((3, 3)))[0].astype(np.int64)
        small = np.bincount(found.ravel()) * self.map.resolution**2 < LEAST_PIECE
        names = np.where(small, 0, np.cumsum(~small))
        names -= names[0]
        names[0] = 0
        labels: RegionLabels = np.where(small, 0, names)[found]
        return labels

    def _passage(self, cell: int) -> Passage:
        row, column = divmod(cell, self.map.values.shape[1])
        x, y = self.map.center(row, column)
        return Passage((x, y), (x, y), 2.0 * float(self.distance[row, column]))


def _quarter(cells: int, angle: float) -> Array:
    """1 for the cells of a quarter of a circle around the centre, within one cell."""
    across = np.arange(-cells, cells + 1)
    x, y = np.meshgrid(across, across)
    radius = np.hypot(x, y)
    bearing = (np.arctan2(y, x) - angle + _ROUNDING) % math.tau
    inside = (radius <= cells - 1) & ((bearing <= 0.5 * math.pi) | (radius == 0))
    quarter: Array = inside.astype(np.float64)
    return quarter


@compiled
def _root(parents: RegionLabels, cell: int) -> int:
    while parents[cell] != cell:
        parents[cell] = parents[parents[cell]]
        cell = parents[cell]
    return cell


@compiled
def _planted(pieces: RegionLabels) -> tuple[RegionLabels, RegionLabels]:
    """Parents and owners of cells when each piece is a set with one root (union-find)."""
    parents = np.full(pieces.size, -1, np.int64)
    owners = np.zeros(pieces.size, np.int64)
    first = np.full(pieces.max() + 1, -1, np.int64)
    for cell in range(pieces.size):
        piece = pieces[cell]
        if piece > 0:
            if first[piece] < 0:
                first[piece] = cell
            parents[cell] = first[piece]
            owners[cell] = piece
    return parents, owners


@compiled
def _meetings(labels: RegionLabels, order: RegionLabels) -> RegionLabels:
    """Cells at which growing pieces meet, with cells added widest first (a watershed).

    Kruskal's algorithm on cells: each meeting joins two pieces by the widest connection there is.
    """
    rows, columns = labels.shape
    pieces = labels.ravel()
    parents, owners = _planted(pieces)
    found = np.empty(pieces.max() + 1, np.int64)
    count = 0
    for cell in order:
        if pieces[cell] > 0:
            continue
        parents[cell] = cell
        row, column = cell // columns, cell % columns
        for r in range(max(0, row - 1), min(rows, row + 2)):
            for c in range(max(0, column - 1), min(columns, column + 2)):
                if parents[r * columns + c] < 0:
                    continue
                one, two = _root(parents, cell), _root(parents, r * columns + c)
                if one != two and owners[one] > 0 and owners[two] > 0:
                    found[count] = cell
                    count += 1
                parents[two] = one
                owners[one] = max(owners[one], owners[two])
    return found[:count]
