"""What a distance to an obstacle costs (costmap_2d's inflation).

Distances are known once for all subsystems; each inflates by its own values.
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

ROUNDING = 1e-9


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

    def values(self, resolution: float) -> tuple[float, float, float, bool]:
        """What `inflate` takes; the radius is rounded up to whole cells, as costmap_2d does."""
        reach = math.ceil(self.inflation_radius / resolution - ROUNDING) * resolution
        kept, factor = float(self.inscribed_radius), float(self.cost_scaling_factor)
        return reach, kept, factor, self.inflate_unknown


@njit(cache=True)
def inflate(
    costs: Costs,
    distances: Array,
    reach: float,
    inscribed: float,
    factor: float,
    inflate_unknown: bool,
) -> None:
    """Raise costs, in place, to what the distance of each cell costs.

    Unknown cells are raised only where that is certain. Distances are from centre to centre, m.
    """
    least_over_unknown = 1 if inflate_unknown else INSCRIBED
    for row in range(costs.shape[0]):
        for column in range(costs.shape[1]):
            metres = distances[row, column]
            if metres > reach + ROUNDING:
                continue
            cost = LETHAL
            if metres > inscribed:
                cost = int(252.0 * min(1.0, math.exp(factor * (inscribed - metres))))
            elif metres > 0.0:
                cost = INSCRIBED
            if costs[row, column] == NO_INFORMATION:
                if cost >= least_over_unknown:
                    costs[row, column] = cost
            elif cost > costs[row, column]:
                costs[row, column] = cost
