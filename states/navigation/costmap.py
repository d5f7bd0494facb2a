"""Costmaps in layers, with costmap_2d's values and names.

Static layer from a map, obstacle layer from laser scans, inflation over both; then keepouts, which
are not inflated. Known rooms and the user need no cells (see `visibility`): this is for scanned
clutter, and for the rule that poses of non-zero cost are dropped (R77, R100).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hw.geometry import Pose2
from hw.room import Disc, Point, contains
from states.maps.cells import Grid, fill_rings
from states.maps.distance import squared_distances
from states.maps.occupancy import UNKNOWN, OccupancyMap
from states.navigation.inflation import FREE, LETHAL, NO_INFORMATION, Costs, Inflation, inflate

Ring = Sequence[Point]


@dataclass(frozen=True, slots=True)
class StaticValues:
    """How a map's values become costs (costmap_2d's static layer)."""

    track_unknown_space: bool = True
    lethal_cost_threshold: int = 100
    unknown_cost_value: int = UNKNOWN
    trinary_costmap: bool = True

    def costs(self, map_: OccupancyMap) -> Costs:
        """Cost of every cell of a map, (rows, columns)."""
        # a map's unknown is 255 as a byte, above every threshold unless it is named as unknown
        values = map_.values.astype(np.int64) % 256
        costs = np.zeros(values.shape)
        if not self.trinary_costmap:
            costs = np.trunc(values / self.lethal_cost_threshold * LETHAL)
        costs = np.where(values >= self.lethal_cost_threshold, LETHAL, costs)
        unknown = NO_INFORMATION if self.track_unknown_space else FREE
        costs = np.where(values == self.unknown_cost_value % 256, unknown, costs)
        return costs.astype(np.uint8)


@dataclass(frozen=True, slots=True)
class SpeedZone:
    """An area in which the robot goes no faster than `speed`, m/s."""

    ring: tuple[Point, ...]
    speed: float


class Costmap:
    """The costs of one navigation subsystem's global or local map; computed once (R36).

    `obstacles` are the costs of an `ObstacleLayer` on the same cells.
    """

    def __init__(
        self,
        grid: Grid,
        inflation: Inflation,
        *,
        static: OccupancyMap | None = None,
        values: StaticValues | None = None,
        obstacles: Costs | None = None,
        keepouts: Sequence[Ring] = (),
        speed_zones: Sequence[SpeedZone] = (),
    ) -> None:
        self.inflation = inflation
        self.grid = grid
        self.speed_zones = tuple(speed_zones)
        costs = np.full((grid.rows, grid.columns), FREE, np.uint8)
        if static is not None:
            drawn = (values or StaticValues()).costs(static)
            costs = sample(drawn, static.resolution, static.map_from_corner, grid)
        if obstacles is not None:
            costs = with_maximum(costs, obstacles)
        squared = squared_distances(costs == LETHAL)
        table = inflation.table(grid.resolution)
        self.costs: Costs = inflate(costs, squared, table, inflation.inflate_unknown)
        for ring in keepouts:
            self.costs[fill_rings(grid, [ring])] = LETHAL

    def cost(self, x: float, y: float, user: Disc | None = None) -> int:
        """Cost of a place, with the user's inflated body; unknown outside the map."""
        cell = self.grid.cell(x, y)
        cost = NO_INFORMATION if cell is None else int(self.costs[cell])
        if user is None:
            return cost
        distance = math.hypot(x - user.x, y - user.y) - user.radius
        return max(cost, self.inflation.cost(distance))

    def speed_limit(self, x: float, y: float) -> float:
        """The lowest limit of the zones a place lies in, m/s; inf outside of all."""
        inside = (zone.speed for zone in self.speed_zones if contains(zone.ring, x, y))
        return min(inside, default=math.inf)


def with_maximum(master: Costs, layer: Costs) -> Costs:
    """The higher cost of both, where the layer knows one (`combination_method` 1)."""
    above = (layer != NO_INFORMATION) & ((master == NO_INFORMATION) | (layer > master))
    combined: Costs = np.where(above, layer, master)
    return combined


def both(whole: Costmap, local: Costmap) -> Costs:
    """The costs of the whole map, raised where the local one is higher (R38).

    The cells of the local one must lie on those of the whole.
    """
    costs, grid, window = whole.costs.copy(), whole.grid, local.grid
    row = round((window.y - grid.y) / grid.resolution)
    column = round((window.x - grid.x) / grid.resolution)
    low, left = max(0, row), max(0, column)
    high = max(low, min(grid.rows, row + window.rows))
    right = max(left, min(grid.columns, column + window.columns))
    inside = local.costs[low - row : high - row, left - column : right - column]
    part = costs[low:high, left:right]
    part[:] = with_maximum(part, inside)
    return costs


def sample(costs: Costs, resolution: float, map_from_corner: Pose2, grid: Grid) -> Costs:
    """The costs of another grid at the cell centres of this one; unknown outside of it."""
    xs, ys = grid.centers()
    corner_from_map = map_from_corner.inverse()
    c, s = math.cos(corner_from_map.yaw), math.sin(corner_from_map.yaw)
    along = corner_from_map.x + c * xs[None, :] - s * ys[:, None]
    across = corner_from_map.y + s * xs[None, :] + c * ys[:, None]
    # a centre on the border of two cells, up to rounding, belongs to the upper one
    column = np.floor(along / resolution + 1e-9).astype(np.int64)
    row = np.floor(across / resolution + 1e-9).astype(np.int64)
    inside = (row >= 0) & (row < costs.shape[0]) & (column >= 0) & (column < costs.shape[1])
    found = np.full((grid.rows, grid.columns), NO_INFORMATION, np.uint8)
    found[inside] = costs[row[inside], column[inside]]
    return found
