"""Which cell of the Chase space to wait at: the paper's choice (4.4.2) and ours."""

from __future__ import annotations

import random
from collections.abc import Sequence

import numpy as np

from behaviors.choice import cheapest
from behaviors.person import risks, way_risks
from behaviors.situation import (
    Array,
    ChaseRing,
    Situation,
    placed,
    timed_cells,
    weighted_cells,
)
from hw.scene import Point
from states.navigation.local import rest_to_rest

LEAST_WEIGHT = 1e-9
"""In place of a weight of 0, by which nothing can be divided: a tolerance of rounding."""


def chase_place(now: Situation, ring: ChaseRing) -> Point | None:
    """The free cell of least cost that can be reached, m, in the map; None if there is none.

    Of the free cells about as many as the profile's `cells` are looked at, evenly by what they cost
    of response: the risk of each is work. Of places that are worth nearly as much, one over their
    cost, by the profile's `tie`, the one with the shortest path is chosen.
    """
    cells = free_cells(now, timed_cells(now.environment, now.settings, ring))
    cells = cells[np.argsort(cells[:, 2], kind="stable")]
    some = cells[:: max(1, len(cells) // now.settings.chase.cells)]
    return least_cost(now, cells_with_risk(now, some))


def least_cost(now: Situation, cells: Array) -> Point | None:
    """Of the cells (n, 3), x, y and cost, s, in the map, the cheapest that can be reached.

    Of those within the `tie` of the cheapest it is the one with the shortest path.
    """
    costs: list[float] = cells[:, 2].tolist()
    first = _in_reach(now, cells, costs)
    if first is None:
        return None
    equal = cells[1.0 / cells[:, 2] >= 1.0 / costs[first] - now.settings.chase.tie]
    return _place(equal, _in_reach(now, equal, [0.0] * len(equal)))


def cells_with_risk(now: Situation, cells: Array) -> Array:
    """The cells (n, 3) in the map, to whose cost, s, that of the user walking off is added.

    It is the profile's `risk` times what waiting there and the drive there are expected to cost.
    """
    subsystem, limits = now.environment.navigation.chase, now.environment.limits
    lengths = np.hypot(cells[:, 0] - now.pose.x, cells[:, 1] - now.pose.y)
    times = rest_to_rest(lengths, subsystem.max_speed, limits.base_acceleration)
    risk = risks(now, cells[:, :2]) + way_risks(now, cells[:, :2], subsystem.user_radius, times)
    return np.column_stack((cells[:, :2], cells[:, 2] + now.settings.chase.risk * risk))


def chase_cell(
    now: Situation,
    ring: ChaseRing,
    best_angle: float,
    best_radius: float,
    sample: int | None = None,
) -> Point | None:
    """The paper's choice: the free cell of the largest weight that can be reached (R96).

    Of equal ones the one with the shortest path. With `sample`, a seed, the order is random,
    weighted by the weights, and the same for the same pose of the user. m, in the map.
    """
    cells = free_cells(now, weighted_cells(ring, best_angle, best_radius))
    weights: list[float] = cells[:, 2].tolist()
    if sample is None:
        levels = [-weight for weight in weights]
    else:
        levels = _sampled(weights, random.Random(repr((sample, now.user.body))))
    return _place(cells, _in_reach(now, cells, levels))


def _sampled(weights: Sequence[float], chance: random.Random) -> list[float]:
    """What sorts candidates at random by their weights.

    Sorting by u^(1 / weight), u uniform, descending, is weighted sampling without replacement
    (Efraimidis and Spirakis 2006).
    """
    return [-(chance.random() ** (1.0 / max(weight, LEAST_WEIGHT))) for weight in weights]


def free_cells(now: Situation, cells: Array) -> Array:
    """The free ones of the cells (n, 3) around the user, in the map (R93, R100)."""
    there = placed(cells, now.user.body)
    return there[now.planners["chase"].are_free(there[:, :2].copy())]


def _in_reach(now: Situation, cells: Array, levels: Sequence[float]) -> int | None:
    """Index of the cell of the lowest level in reach, of equal ones by the shortest path."""
    planner, here = now.planners["chase"], (now.pose.x, now.pose.y)
    places: list[Point] = cells[:, :2].tolist()

    def total(i: int) -> tuple[float, float] | None:
        x, y = places[i]
        path = planner.plan(here, (x, y), now.user_disc("chase", (x, y)))
        return None if path is None else (levels[i], path.length)

    lengths = np.hypot(cells[:, 0] - here[0], cells[:, 1] - here[1]).tolist()
    return cheapest(list(zip(levels, lengths, strict=True)), total, tries=now.settings.chase.tries)


def _place(cells: Array, chosen: int | None) -> Point | None:
    return None if chosen is None else (float(cells[chosen, 0]), float(cells[chosen, 1]))
