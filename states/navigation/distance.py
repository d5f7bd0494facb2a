"""Exact Euclidean distance transform, and what a distance costs (costmap_2d's inflation).

Distances are counted between cell centres in whole squared cells, so they are exact and one table
per inflation turns them into costs (Meijster, Roerdink and Hesselink 2000).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from states.navigation.clearance import Array, check_radius

FREE = 0
INSCRIBED = 253
LETHAL = 254
NO_INFORMATION = 255

Costs = NDArray[np.uint8]
SquaredCells = NDArray[np.int64]

NOTHING_NEAR = np.int64(2) ** 40
"""Squared cells from a cell to the nearest obstacle where there is no obstacle."""

_FAR = 2**20


@njit(cache=True)
def squared_distances(occupied: NDArray[np.bool_]) -> SquaredCells:
    """Squared distance to the nearest occupied cell, (rows, columns), in cells."""
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


@njit(cache=True)
def _lower_envelope(
    heights: SquaredCells, squared: SquaredCells, owner: SquaredCells, begins: SquaredCells
) -> None:
    """Least of the parabolas heights[i]^2 + (x - i)^2 at every x of one row."""
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


@dataclass(frozen=True, slots=True)
class Inflation:
    """How near to an obstacle costs how much, with costmap_2d's names; m, 1/m.

    With a `cost_scaling_factor` above ln(252) / (inflation_radius - inscribed_radius) the cost
    falls below 1, that is to nothing, before the radius: 10.15 for 1.0 m and 0.455 m.

    Raises:
        ValueError: a radius is negative or not finite.
    """

    inflation_radius: float = 0.55
    inscribed_radius: float = 0.455
    cost_scaling_factor: float = 3.0
    inflate_unknown: bool = False

    def __post_init__(self) -> None:
        check_radius(self.inflation_radius)
        check_radius(self.inscribed_radius)

    def cost(self, distance: float) -> int:
        """Cost at a true distance from an obstacle, not rounded to cells."""
        if distance <= 0.0:
            return LETHAL
        if distance <= self.inscribed_radius:
            return INSCRIBED
        if distance > self.inflation_radius:
            return FREE
        return int(252.0 * math.exp(self.cost_scaling_factor * (self.inscribed_radius - distance)))

    def table(self, resolution: float) -> Costs:
        """Cost by squared distance in cells, up to the radius rounded up to whole cells."""
        reach = math.ceil(self.inflation_radius / resolution)
        metres = np.sqrt(np.arange(reach * reach + 1)) * resolution
        decay = np.exp(self.cost_scaling_factor * (self.inscribed_radius - metres))
        costs = np.where(metres <= self.inscribed_radius, INSCRIBED, 252.0 * np.minimum(1.0, decay))
        costs[0] = LETHAL
        return costs.astype(np.uint8)


@njit(cache=True)
def inflate(costs: Costs, squared: SquaredCells, table: Costs, inflate_unknown: bool) -> Costs:
    """Costs raised to what the distance costs; unknown cells only where that is certain."""
    raised = costs.copy()
    least_over_unknown = 1 if inflate_unknown else INSCRIBED
    for row in range(costs.shape[0]):
        for column in range(costs.shape[1]):
            if squared[row, column] >= len(table):
                continue
            cost = table[squared[row, column]]
            if costs[row, column] == NO_INFORMATION:
                if cost >= least_over_unknown:
                    raised[row, column] = cost
            elif cost > costs[row, column]:
                raised[row, column] = cost
    return raised
