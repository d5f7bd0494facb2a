"""Costs by the distance to obstacles (costmap_2d's inflation).

The distances are shared by all subsystems; each inflates with its own values.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hw import compiled
from states.navigation.exact import Array, check_radius

FREE = 0
INSCRIBED = 253
LETHAL = 254
NO_INFORMATION = 255

Costs = NDArray[np.uint8]

ROUNDING = 1e-9
"""Tolerance of rounding errors, in cells and in m."""


@dataclass(frozen=True, slots=True)
class Inflation:
    """Parameters of the costs around obstacles, with costmap_2d's names; m, 1/m.

    The cost is 253 up to `inscribed_radius`, then 252 exp(-factor * (distance - inscribed_radius)),
    truncated, up to `inflation_radius`. With a `cost_scaling_factor` above ln(252) /
    (inflation_radius - inscribed_radius) it falls below 1, that is to 0, before the radius: 10.15
    for 1.0 m and 0.455 m.

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

    def values(self, resolution: float) -> tuple[float, float, float, bool]:
        """Arguments of `inflate`; the radius is rounded up to whole cells, as in costmap_2d."""
        reach = math.ceil(self.inflation_radius / resolution - ROUNDING) * resolution
        kept, factor = float(self.inscribed_radius), float(self.cost_scaling_factor)
        return reach, kept, factor, self.inflate_unknown


@compiled
def inflate(
    costs: Costs,
    distances: Array,
    reach: float,
    inscribed: float,
    factor: float,
    inflate_unknown: bool,
) -> None:
    """Raise costs, in place, to the cost at each cell's distance, centre to centre, m.

    Unknown cells are raised only to lethal or inscribed costs, unless `inflate_unknown`.
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
