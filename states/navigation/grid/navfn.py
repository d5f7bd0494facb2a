"""The planner `navfn`: a potential grown from the start, descended along its gradient.

ROS's global_planner in its default form: 4 neighbours, a quadratic approximation of the arrival
time of a wave front, cell costs 3 * cost + 50 up to 252; the path follows the gradient in steps of
half a cell, next to obstacles the lowest neighbour. Two of its defects are left out: its buffers
lose cells in large rooms, and a vanishing gradient ends in "no plan" (here: the lowest neighbour).
"""

from __future__ import annotations

import heapq
import math

import numpy as np

from hw import compiled
from states.navigation.exact import Array
from states.navigation.grid.inflation import NO_INFORMATION, Costs

NEUTRAL_COST = 50.0
COST_FACTOR = 3.0
"""ROS's global_planner: a cell of cost c costs COST_FACTOR c + NEUTRAL_COST to cross."""
STEP = 0.5
"""Length of one step down the gradient, cells."""


@compiled
def crossing_cost(cost: int, lethal_cost: int, allow_unknown: bool) -> float:
    """Cost of crossing a cell; infinite if it is blocked."""
    if cost >= lethal_cost - 1 and not (allow_unknown and cost == NO_INFORMATION):
        return math.inf
    return float(min(COST_FACTOR * cost + NEUTRAL_COST, lethal_cost - 1.0))


@compiled
def arrival(potential: Array, row: int, column: int, cost: float) -> float:
    """Potential of a cell from its neighbours: arrival of a plane wave, by a parabola.

    With the lower neighbours' potentials `low` and low + d, a plane wave through both arrives at
    low + (d + sqrt(2 cost^2 - d^2)) / 2; the polynomial in d / cost is ROS's approximation of it.
    If d >= cost the wave comes from one side only.
    """
    rows, columns = potential.shape
    left = potential[row, column - 1] if column > 0 else math.inf
    right = potential[row, column + 1] if column < columns - 1 else math.inf
    below = potential[row - 1, column] if row > 0 else math.inf
    above = potential[row + 1, column] if row < rows - 1 else math.inf
    across, along = min(left, right), min(below, above)
    low, difference = min(across, along), abs(across - along)
    if not difference < cost:
        return float(low + cost)
    part = difference / cost
    return float(low + cost * (-0.2301 * part * part + 0.5307 * part + 0.7040))


@compiled
def potential_from(crossing: Array, start: tuple[int, int], goal: tuple[int, int]) -> Array:
    """Potential of every cell until the goal's neighbours are reached; infinite elsewhere."""
    rows, columns = crossing.shape
    potential = np.full((rows, columns), math.inf)
    settled = np.zeros((rows, columns), np.bool_)
    potential[start] = 0.0
    heap = [(0.0, start[0], start[1])]
    stop = math.inf
    while len(heap) > 0:
        value, row, column = heapq.heappop(heap)
        if value > stop:
            break
        if settled[row, column]:
            continue
        settled[row, column] = True
        if (row, column) == goal:
            # the gradient at the goal needs the cells around it as well
            stop = value + 3.0 * crossing[goal]
        for up, across in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            r, c = row + up, column + across
            if not (0 <= r < rows and 0 <= c < columns) or settled[r, c]:
                continue
            if crossing[r, c] == math.inf:
                continue
            new = arrival(potential, r, c, crossing[r, c])
            if new < potential[r, c]:
                potential[r, c] = new
                heapq.heappush(heap, (new, r, c))
    return potential


@compiled
def slope(potential: Array, row: int, column: int) -> tuple[float, float]:
    """Unit vector down the potential at a cell's centre, x and y; (0, 0) if it has none."""
    rows, columns = potential.shape
    if not (0 < row < rows - 1 and 0 < column < columns - 1):
        return 0.0, 0.0
    left, right = potential[row, column - 1], potential[row, column + 1]
    below, above = potential[row - 1, column], potential[row + 1, column]
    dx, dy = left - right, below - above
    length = math.hypot(dx, dy)
    if not 0.0 < length < math.inf:
        return 0.0, 0.0
    return dx / length, dy / length


@compiled
def gradient_at(potential: Array, x: float, y: float) -> tuple[float, float]:
    """Direction down the potential at a place in cells, interpolated between four centres.

    (0, 0) next to an obstacle or to a cell that was not reached.
    """
    column, row = math.floor(x - 0.5), math.floor(y - 0.5)
    rows, columns = potential.shape
    if not (1 <= row < rows - 2 and 1 <= column < columns - 2):
        return 0.0, 0.0
    across, along = x - 0.5 - column, y - 0.5 - row
    gx = gy = 0.0
    for r in range(2):
        for c in range(2):
            if potential[row + r, column + c] == math.inf:
                return 0.0, 0.0
            weight = (along if r else 1.0 - along) * (across if c else 1.0 - across)
            dx, dy = slope(potential, row + r, column + c)
            if dx == 0.0 and dy == 0.0 and potential[row + r, column + c] > 0.0:
                return 0.0, 0.0
            gx, gy = gx + weight * dx, gy + weight * dy
    length = math.hypot(gx, gy)
    return (gx / length, gy / length) if length > 1e-6 else (0.0, 0.0)


@compiled
def lowest_neighbour(potential: Array, row: int, column: int) -> tuple[int, int]:
    """The lowest of a cell and its 8 neighbours, without diagonal steps past a blocked cell."""
    rows, columns = potential.shape
    best = (row, column)
    for up in range(-1, 2):
        for across in range(-1, 2):
            r, c = row + up, column + across
            if not (0 <= r < rows and 0 <= c < columns) or potential[r, c] >= potential[best]:
                continue
            if potential[row, c] < math.inf and potential[r, column] < math.inf:
                best = (r, c)
    return best


@compiled
def descend(potential: Array, ends: Array) -> Array:
    """The path from start to goal, (k, 2) in cells, descended from the goal; empty if it fails."""
    start_x, start_y = ends[0]
    x, y = ends[1]
    if potential[math.floor(y), math.floor(x)] == math.inf:
        return np.empty((0, 2))
    limit = 8 * potential.size
    path = np.empty((64, 2))
    path[0] = ends[1]
    count = 1
    while math.hypot(x - start_x, y - start_y) > 1.5 and count < limit:
        row, column = math.floor(y), math.floor(x)
        before = potential[row, column]
        dx, dy = gradient_at(potential, x, y)
        next_x, next_y = x + STEP * dx, y + STEP * dy
        if (dx == 0.0 and dy == 0.0) or potential[math.floor(next_y), math.floor(next_x)] > before:
            lowest_row, lowest_column = lowest_neighbour(potential, row, column)
            if lowest_row == row and lowest_column == column:
                return np.empty((0, 2))
            next_x, next_y = lowest_column + 0.5, lowest_row + 0.5
        x, y = next_x, next_y
        if count == len(path) - 1:
            path = np.concatenate((path, np.empty_like(path)))
        path[count, 0], path[count, 1] = x, y
        count += 1
    if count >= limit:
        return np.empty((0, 2))
    path[count] = ends[0]
    return path[: count + 1][::-1].copy()


@compiled
def crossing_costs(costs: Costs, lethal_cost: int, allow_unknown: bool) -> Array:
    """Cost of crossing each cell; the outermost cells are blocked."""
    rows, columns = costs.shape
    crossing = np.full((rows, columns), math.inf)
    for row in range(1, rows - 1):
        for column in range(1, columns - 1):
            crossing[row, column] = crossing_cost(costs[row, column], lethal_cost, allow_unknown)
    return crossing
