"""The obstacle layer: what laser scans have shown, marked and cleared cell by cell.

costmap_2d's names and order: first every beam clears the cells it passed (R51), then every end
point is marked. Two things differ, both on purpose: a beam without return clears as far as
`raytrace_range` (there, people who left stay as ghosts), and marks that no beam could refresh are
dropped after `mark_lifetime`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from hw.geometry import Pose2
from hw.room import Disc, Point
from hw.samples import Scan
from states.maps.cells import Grid, fill_rings
from states.navigation.clearance import Array
from states.navigation.inflation import FREE, LETHAL, NO_INFORMATION, Costs

T = TypeVar("T", bound=np.generic)


@dataclass(frozen=True, slots=True)
class ObstacleValues:
    """How far beams mark and clear, m; how long a mark stays unseen, s."""

    obstacle_range: float = 2.5
    raytrace_range: float = 3.0
    marking: bool = True
    clearing: bool = True
    inf_clears: bool = True
    mark_lifetime: float = 10.0


class ObstacleLayer:
    """Cells that beams marked (lethal) or passed (free); the others are unknown.

    A `rolling` layer keeps the sensor in its middle (R37).
    """

    def __init__(
        self, grid: Grid, values: ObstacleValues | None = None, *, rolling: bool = False
    ) -> None:
        self.grid = grid
        self.rolling = rolling
        self._values = values or ObstacleValues()
        self.costs: Costs = np.full((grid.rows, grid.columns), NO_INFORMATION, np.uint8)
        self._marked_ns: NDArray[np.int64] = np.zeros(self.costs.shape, np.int64)

    def see(
        self, map_from_sensor: Pose2, scan: Scan, stamp_ns: int, ignore: Disc | None = None
    ) -> None:
        """Take one scan.

        Args:
            map_from_sensor: where the sensor was.
            scan: ranges in m; inf: nothing there; NaN and what is not above 0 is skipped.
            stamp_ns: when.
            ignore: end points in this disc are not marked: somebody known better than by cells.
        """
        if self.rolling:
            self._roll(self.grid.about(map_from_sensor.x, map_from_sensor.y))
        values = self._values
        ranges = np.array(scan.ranges, dtype=np.float64)
        angles = (
            map_from_sensor.yaw + scan.start + scan.step * np.arange(len(ranges), dtype=np.float64)
        )
        if not values.inf_clears:
            ranges[np.isinf(ranges)] = math.nan
        place = ((map_from_sensor.x - self.grid.x), (map_from_sensor.y - self.grid.y))
        if values.clearing:
            reach = values.raytrace_range
            _clear(self.costs, self.grid.resolution, place, ranges, angles, reach)
        if values.marking:
            ends = _ends(place, ranges, angles, values.obstacle_range)
            if ignore is not None:
                off = np.hypot(
                    ends[:, 0] + self.grid.x - ignore.x, ends[:, 1] + self.grid.y - ignore.y
                )
                ends = ends[off > ignore.radius]
            _mark(self.costs, self._marked_ns, self.grid.resolution, ends, stamp_ns)
        self.forget(stamp_ns)

    def forget(self, now_ns: int) -> None:
        """Drop marks older than their lifetime."""
        lifetime = self._values.mark_lifetime
        if math.isfinite(lifetime):
            old = (self.costs == LETHAL) & (self._marked_ns < now_ns - int(lifetime * 1e9))
            self.costs[old] = NO_INFORMATION

    def free_footprint(self, ring: Sequence[Point]) -> None:
        """Clear where the robot itself stands; the ring is its outline in the map, m."""
        self.costs[fill_rings(self.grid, [ring])] = FREE

    def _roll(self, grid: Grid) -> None:
        if grid == self.grid:
            return
        by_column = round((grid.x - self.grid.x) / grid.resolution)
        by_row = round((grid.y - self.grid.y) / grid.resolution)
        self.costs = _shifted(self.costs, by_row, by_column, NO_INFORMATION)
        self._marked_ns = _shifted(self._marked_ns, by_row, by_column, 0)
        self.grid = grid


@njit(cache=True)
def _clear(
    costs: Costs,
    resolution: float,
    place: tuple[float, float],
    ranges: Array,
    angles: Array,
    reach: float,
) -> None:
    for i in range(len(ranges)):
        if not ranges[i] > 0.0:
            continue
        far = min(ranges[i], reach)
        x, y = place[0] + far * math.cos(angles[i]), place[1] + far * math.sin(angles[i])
        _clear_line(
            costs, place[0] / resolution, place[1] / resolution, x / resolution, y / resolution
        )


@njit(cache=True)
def _clear_line(costs: Costs, x1: float, y1: float, x2: float, y2: float) -> None:
    """Free the cells that a line passes, in cells, except the one it ends in (Bresenham)."""
    column, row = math.floor(x1), math.floor(y1)
    last_column, last_row = math.floor(x2), math.floor(y2)
    across, up = abs(last_column - column), abs(last_row - row)
    step_column = 1 if last_column > column else -1
    step_row = 1 if last_row > row else -1
    error = across - up
    while column != last_column or row != last_row:
        if 0 <= row < costs.shape[0] and 0 <= column < costs.shape[1]:
            costs[row, column] = FREE
        twice = 2 * error
        if twice > -up:
            error -= up
            column += step_column
        if twice < across:
            error += across
            row += step_row


@njit(cache=True)
def _ends(place: tuple[float, float], ranges: Array, angles: Array, reach: float) -> Array:
    ends = np.empty((len(ranges), 2))
    count = 0
    for i in range(len(ranges)):
        if 0.0 < ranges[i] < reach:
            ends[count, 0] = place[0] + ranges[i] * math.cos(angles[i])
            ends[count, 1] = place[1] + ranges[i] * math.sin(angles[i])
            count += 1
    return ends[:count]


@njit(cache=True)
def _mark(
    costs: Costs, marked_ns: NDArray[np.int64], resolution: float, ends: Array, stamp_ns: int
) -> None:
    for x, y in ends:
        row, column = math.floor(y / resolution), math.floor(x / resolution)
        if 0 <= row < costs.shape[0] and 0 <= column < costs.shape[1]:
            costs[row, column] = LETHAL
            marked_ns[row, column] = stamp_ns


def _shifted(old: NDArray[T], by_row: int, by_column: int, fill: int) -> NDArray[T]:
    new = np.full_like(old, fill)
    rows, columns = old.shape
    if abs(by_row) < rows and abs(by_column) < columns:
        to_row, to_column = max(0, -by_row), max(0, -by_column)
        from_row, from_column = max(0, by_row), max(0, by_column)
        height, width = rows - abs(by_row), columns - abs(by_column)
        new[to_row : to_row + height, to_column : to_column + width] = old[
            from_row : from_row + height, from_column : from_column + width
        ]
    return new


def warm_up() -> None:
    """Compile, or load from the cache, what a scan needs."""
    layer = ObstacleLayer(Grid(0.1, 10, 10), rolling=True)
    layer.see(Pose2(0.5, 0.5), Scan("", 0.0, 0.1, (0.3, math.inf)), 0)
    layer.free_footprint(((0.0, 0.0), (0.2, 0.0), (0.2, 0.2)))
