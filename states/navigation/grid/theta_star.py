"""Lazy Theta*: any-angle shortest paths on a grid (Nash, Koenig, Tovey 2010).

Like A* on 8 neighbours, but each cell takes its neighbour's parent as its own, assuming a line of
sight, which is checked only when the cell is expanded. Start and goal are places, not cells; all
other corners of the path are cell centres. Coordinates are in cells, x along columns.
"""

from __future__ import annotations

import heapq
import math

import numpy as np
from numpy.typing import NDArray

from hw import compiled
from states.navigation.exact import TOLERANCE, Array, UserDisc, line_crosses_ray, passes_disc

Mask = NDArray[np.bool_]
Integers = NDArray[np.int64]


@compiled
def line_is_free(free: Mask, px: float, py: float, qx: float, qy: float) -> bool:
    """True if all cells that the segment p-q passes through are free; corners may be touched."""
    column, row = math.floor(px), math.floor(py)
    last_column, last_row = math.floor(qx), math.floor(qy)
    rows, columns = free.shape
    dx, dy = qx - px, qy - py
    step_column, step_row = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
    per_column = abs(1.0 / dx) if dx != 0.0 else math.inf
    per_row = abs(1.0 / dy) if dy != 0.0 else math.inf
    next_column = (column + (dx > 0.0) - px) / dx if dx != 0.0 else math.inf
    next_row = (row + (dy > 0.0) - py) / dy if dy != 0.0 else math.inf
    for _ in range(abs(last_column - column) + abs(last_row - row) + 1):
        if not (0 <= row < rows and 0 <= column < columns and free[row, column]):
            return False
        if row == last_row and column == last_column:
            return True
        if abs(next_column - next_row) < 1e-9:
            column, row = column + step_column, row + step_row
            next_column, next_row = next_column + per_column, next_row + per_row
        elif next_column < next_row:
            column, next_column = column + step_column, next_column + per_column
        else:
            row, next_row = row + step_row, next_row + per_row
    return True


@compiled
def may_go(free: Mask, px: float, py: float, qx: float, qy: float, user: UserDisc) -> bool:
    """True if the line is free of blocked cells and of the user, on the allowed side."""
    if not passes_disc(px, py, qx, qy, user.x, user.y, user.radius - TOLERANCE):
        return False
    if line_crosses_ray(px, py, qx, qy, user):
        return False
    return line_is_free(free, px, py, qx, qy)


@compiled
def place_of(node: int, columns: int, ends: Array) -> tuple[float, float]:
    """Position of a node: its cell's centre, or the goal in the goal's cell; -1 is the start."""
    if node < 0:
        return ends[0, 0], ends[0, 1]
    if node == math.floor(ends[1, 1]) * columns + math.floor(ends[1, 0]):
        return ends[1, 0], ends[1, 1]
    return node % columns + 0.5, node // columns + 0.5


@compiled
def settle(
    node: int, free: Mask, cost: Array, parent: Integers, closed: Mask, ends: Array, user: UserDisc
) -> bool:
    """Make sure that a node sees its parent, else take its best closed neighbour as the parent."""
    columns = free.shape[1]
    x, y = place_of(node, columns, ends)
    px, py = place_of(parent[node], columns, ends)
    if may_go(free, px, py, x, y, user):
        return True
    best = math.inf
    for step in range(8):
        other = neighbour(node, step, free)
        if other < 0 or not closed.ravel()[other]:
            continue
        ox, oy = place_of(other, columns, ends)
        through = cost[other] + math.hypot(ox - x, oy - y)
        if through < best and may_go(free, ox, oy, x, y, user):
            best, parent[node] = through, other
    cost[node] = best
    return best < math.inf


@compiled
def neighbour(node: int, step: int, free: Mask) -> int:
    """The free cell one step away (0..7 round the node), or -1; no diagonal past a blocked cell."""
    rows, columns = free.shape
    row, column = node // columns, node % columns
    up = (0, 1, 1, 1, 0, -1, -1, -1)[step]
    across = (1, 1, 0, -1, -1, -1, 0, 1)[step]
    to_row, to_column = row + up, column + across
    if not (0 <= to_row < rows and 0 <= to_column < columns and free[to_row, to_column]):
        return -1
    if not (free[row, to_column] and free[to_row, column]):
        return -1
    return int(to_row * columns + to_column)


@compiled
def theta_star(free: Mask, ends: Array, user: UserDisc) -> Array:
    """The path from start to goal, (k, 2); empty if there is none.

    Args:
        free: cells the robot's centre may be in.
        ends: start and goal, (2, 2), in free cells.
        user: disc to keep out of, and the ray not to cross.
    """
    rows, columns = free.shape
    cost = np.full(rows * columns, math.inf)
    parent = np.full(rows * columns, -1, np.int64)
    closed = np.zeros((rows, columns), np.bool_)
    first = math.floor(ends[0, 1]) * columns + math.floor(ends[0, 0])
    last = math.floor(ends[1, 1]) * columns + math.floor(ends[1, 0])
    goal_x, goal_y = ends[1]
    x, y = place_of(first, columns, ends)
    cost[first] = math.hypot(x - ends[0, 0], y - ends[0, 1])
    heap = [(cost[first], first)]
    while len(heap) > 0:
        _, node = heapq.heappop(heap)
        if closed.ravel()[node] or not settle(node, free, cost, parent, closed, ends, user):
            continue
        closed.ravel()[node] = True
        if node == last:
            return walk_back(node, columns, parent, ends)
        px, py = place_of(parent[node], columns, ends)
        before = cost[parent[node]] if parent[node] >= 0 else 0.0
        for step in range(8):
            other = neighbour(node, step, free)
            if other < 0 or closed.ravel()[other]:
                continue
            ox, oy = place_of(other, columns, ends)
            if math.hypot(ox - user.x, oy - user.y) < user.radius - TOLERANCE:
                continue
            through = before + math.hypot(ox - px, oy - py)
            if through < cost[other] - 1e-12:
                cost[other], parent[other] = through, parent[node]
                heapq.heappush(heap, (through + math.hypot(goal_x - ox, goal_y - oy), other))
    return np.empty((0, 2))


@compiled
def walk_back(node: int, columns: int, parent: Integers, ends: Array) -> Array:
    """Start, the corners from start to the node's parent, goal."""
    count, walker = 0, parent[node]
    while walker >= 0:
        count, walker = count + 1, parent[walker]
    path = np.empty((count + 2, 2))
    path[0], path[-1] = ends[0], ends[1]
    walker = parent[node]
    for i in range(count, 0, -1):
        path[i, 0], path[i, 1] = place_of(walker, columns, ends)
        walker = parent[walker]
    return path


@compiled
def shortcut(free: Mask, path: Array, user: UserDisc) -> Array:
    """The path without corners whose neighbours see each other."""
    kept = path.copy()
    count = 1
    at = 0
    while at < len(path) - 1:
        next_at = at + 1
        for to in range(len(path) - 1, at + 1, -1):
            if may_go(free, path[at, 0], path[at, 1], path[to, 0], path[to, 1], user):
                next_at = to
                break
        kept[count] = path[next_at]
        count, at = count + 1, next_at
    return kept[:count]
