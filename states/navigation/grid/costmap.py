"""Costmaps in layers, with costmap_2d's values and names.

The static layer is the map on cells and is shared by all subsystems; each inflates it by its own
values, and adds what scanners have shown (`unmapped`). The user needs no cells (see `visibility`).
Poses of non-zero cost are dropped (R77, R100).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hw import Pose2
from hw.scene import Point
from states.maps import UNKNOWN, Array, Field, Grid, Mask, OccupancyMap, distances, fill_rings
from states.navigation.grid.inflation import FREE, LETHAL, NO_INFORMATION, Costs, Inflation, inflate
from states.navigation.grid.scanned_obstacles import Obstacles

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
        # -1 (unknown) is 255 as a byte, above every threshold unless it is the unknown value
        values = map_.values.astype(np.int64) % 256
        costs = np.zeros(values.shape)
        if not self.trinary_costmap:
            costs = np.trunc(values / self.lethal_cost_threshold * LETHAL)
        costs = np.where(values >= self.lethal_cost_threshold, LETHAL, costs)
        unknown = NO_INFORMATION if self.track_unknown_space else FREE
        costs = np.where(values == self.unknown_cost_value % 256, unknown, costs)
        return costs.astype(np.uint8)


@dataclass(frozen=True)
class StaticLayer:
    """A map before any inflation: costs of the cells of a grid, (rows, columns).

    `walls`, of a drawn room, give distances finer than a cell; `keepouts` marks cells of keepout
    zones.
    """

    grid: Grid
    costs: Costs
    walls: Field | None = None
    keepouts: Mask | None = None

    @classmethod
    def of(
        cls,
        static: OccupancyMap,
        grid: Grid,
        keepouts: Sequence[Ring] = (),
        walls: Field | None = None,
    ) -> StaticLayer:
        """A map on the cells of a grid; keepout zones are lethal like walls."""
        drawn = StaticValues().costs(static)
        costs = sample(drawn, static.resolution, static.map_from_corner, grid)
        kept = np.zeros(costs.shape, np.bool_)
        for ring in keepouts:
            kept |= fill_rings(grid, [ring])
        costs[kept] = LETHAL
        return cls(grid, costs, walls, kept)

    @cached_property
    def distances(self) -> Array:
        """Distance of each cell to the nearest lethal one, centre to centre, m, (rows, columns).

        A drawn wall counts as if a lethal cell began at its side: half a cell is added.
        """
        size, lethal = self.grid.resolution, self.costs == LETHAL
        found = distances(lethal, size)
        if self.walls is None or self.keepouts is None:
            return found
        xs, ys = self.grid.centers()
        x, y = np.meshgrid(xs, ys)
        places = np.column_stack((x.ravel(), y.ravel()))
        exact = self.walls.distances(Pose2(0.0, 0.0), places).reshape(found.shape)
        found = np.where(exact < self.walls.table.reach, exact + 0.5 * size, found)
        found = np.minimum(found, distances(self.keepouts, size))
        return np.where(lethal, 0.0, found)

    def among(self, obstacles: Obstacles) -> Array:
        """`distances` with obstacles added; exact up to the obstacles' `reach`."""
        area, near = obstacles.distances_on(self.grid)
        field = self.distances.copy()
        np.minimum(field[area], near, out=field[area])
        return field


class Costmap:
    """The costs of one navigation subsystem; computed once (R36)."""

    def __init__(self, ground: StaticLayer, inflation: Inflation) -> None:
        self.ground, self.grid, self.inflation = ground, ground.grid, inflation
        self.costs: Costs = ground.costs.copy()
        inflate(self.costs, ground.distances, *inflation.values(self.grid.resolution))

    def with_obstacles(self, obstacles: Obstacles) -> Costs:
        """The costs with obstacles added: the higher cost counts (R38)."""
        area, near = obstacles.distances_on(self.grid)
        costs = self.costs.copy()
        inflate(costs[area], near, *self.inflation.values(self.grid.resolution))
        return costs


def sample(costs: Costs, resolution: float, map_from_corner: Pose2, grid: Grid) -> Costs:
    """Costs of a map at the cell centres of a grid; unknown outside the map."""
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
