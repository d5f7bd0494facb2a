"""Path searches of other packages on the same cells: from each cell to its eight neighbours.

They know directions in steps of 45 degrees only, so that their paths are up to 8 % too long however
fine the cells are.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import networkx
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from hw.scene import Point
from states.maps import Grid

Mask = NDArray[np.bool_]
PathLength = Callable[[Point, Point], float]
"""From a start to a goal, m: the length of the way from cell to cell, with both ends."""

_STEPS = ((0, 1, 1.0), (1, 0, 1.0), (1, 1, math.sqrt(2.0)), (1, -1, math.sqrt(2.0)))


def by_dijkstra(free: Mask, grid: Grid) -> PathLength:
    """The one-to-all search of scipy, which has no goal and no heuristic."""
    first, last, cost = _edges(free)
    size = free.size
    graph = sparse.coo_array((cost * grid.resolution, (first, last)), shape=(size, size)).tocsr()

    def search(start: int, goal: int) -> float:
        return float(sparse.csgraph.dijkstra(graph, directed=False, indices=start)[goal])

    return _with_ends(search, grid)


def by_a_star(free: Mask, grid: Grid) -> PathLength:
    """A* of networkx, led by the distance as the crow flies."""
    first, last, cost = _edges(free)
    graph = networkx.Graph()
    edges = zip(first.tolist(), last.tolist(), (cost * grid.resolution).tolist(), strict=True)
    graph.add_weighted_edges_from(edges)
    columns = free.shape[1]

    def beeline(a: int, b: int) -> float:
        rows, across = a // columns - b // columns, a % columns - b % columns
        return grid.resolution * math.hypot(rows, across)

    def search(start: int, goal: int) -> float:
        return float(networkx.astar_path_length(graph, start, goal, beeline, "weight"))

    return _with_ends(search, grid)


PATH_PEERS: dict[str, tuple[Callable[[Mask, Grid], PathLength], float]] = {
    "scipy dijkstra": (by_dijkstra, 0.0),
    "networkx A*": (by_a_star, 0.1),
}
"""By package: makes a search for free cells; and the smallest cells that it is given, m."""


def _edges(free: Mask) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Pairs of free neighbours, and their distances in cells; no step between blocked corners."""
    rows, columns = free.shape
    number = np.arange(free.size).reshape(free.shape)
    firsts, lasts, costs = [], [], []
    for down, right, cost in _STEPS:
        here = (slice(0, rows - down), slice(max(0, -right), columns - max(0, right)))
        there = (slice(down, rows), slice(max(0, right), columns - max(0, -right)))
        both = free[here] & free[there]
        if down and right:
            both &= free[here[0], there[1]] & free[there[0], here[1]]
        firsts.append(number[here][both])
        lasts.append(number[there][both])
        costs.append(np.full(int(both.sum()), cost))
    return np.concatenate(firsts), np.concatenate(lasts), np.concatenate(costs)


def _with_ends(search: Callable[[int, int], float], grid: Grid) -> PathLength:
    def length(start: Point, goal: Point) -> float:
        nodes, rest = [], 0.0
        for place in (start, goal):
            cell = grid.cell(*place)
            assert cell is not None
            nodes.append(cell[0] * grid.columns + cell[1])
            rest += math.dist(place, grid.center(*cell))
        return search(*nodes) + rest

    return length
