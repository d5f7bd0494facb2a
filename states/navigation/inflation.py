"""What a distance to an obstacle costs (costmap_2d's inflation).

Distances come in whole squared cells, so that one table per inflation turns them into costs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from states.maps.distance import SquaredCells
from states.navigation.clearance import check_radius

FREE = 0
INSCRIBED = 253
LETHAL = 254
NO_INFORMATION = 255

Costs = NDArray[np.uint8]


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
