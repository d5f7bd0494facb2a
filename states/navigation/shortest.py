"""The shortest way through the tangents of fixed corners, the user's disc, start and goal.

Start and goal are discs of radius 0. The tangents between fixed corners were found once, see
`tangents`; those of start, goal and the moving user are looked for when the search asks for them.
"""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from states.navigation.clearance import (
    TOLERANCE,
    TURN,
    Array,
    arc_is_free,
    blocked_arcs,
    passes_disc,
    sees,
)
from states.navigation.tangents import (
    Integers,
    User,
    World,
    arc_crosses_ray,
    line_crosses_ray,
    sweep_between,
    tangent,
)


class Scene(NamedTuple):
    """One query: `discs` are the fixed corners, then user, start and goal.

    `user_arcs` are the blocked arcs of the user's disc; row i of `user_on_disc` is the arc of
    corner i that the user blocks.
    """

    world: World
    user: User
    discs: Array
    user_arcs: Array
    user_on_disc: Array


class Tree(NamedTuple):
    """What the search knows of each tangent: may it be used, cost to its far end, from where."""

    status: NDArray[np.int8]
    cost: Array
    parent: Integers
    state: Integers
    lines: Array


_UNKNOWN, _OPEN, _BLOCKED = 0, 1, 2


@njit(cache=True)
def make_scene(
    world: World, user: User, start: tuple[float, float], goal: tuple[float, float]
) -> Scene:
    """Add user, start and goal to the fixed corners."""
    count = len(world.corners)
    discs = np.zeros((count + 3, 3))
    discs[:count] = world.corners
    discs[count, 0], discs[count, 1], discs[count, 2] = user.x, user.y, user.radius
    discs[count + 1, 0], discs[count + 1, 1] = start
    discs[count + 2, 0], discs[count + 2, 1] = goal
    user_on_disc = np.zeros((count, 2))
    if user.radius == 0.0:
        return Scene(world, user, discs, np.empty((0, 2)), user_on_disc)
    user_arcs, _ = blocked_arcs(user.x, user.y, user.radius, world.discs, world.sides)
    for i in range(count):
        x, y, radius = world.corners[i]
        dx, dy, reach = user.x - x, user.y - y, user.radius - TOLERANCE
        apart = math.hypot(dx, dy)
        if apart + radius <= reach:
            user_on_disc[i, 1] = TURN
        elif abs(radius - reach) < apart < radius + reach:
            cosine = (radius * radius + apart * apart - reach * reach) / (2.0 * radius * apart)
            half = math.acos(max(-1.0, min(1.0, cosine)))
            user_on_disc[i] = math.atan2(dy, dx) - half, 2.0 * half
    return Scene(world, user, discs, user_arcs, user_on_disc)


@njit(cache=True)
def turn_is_free(disc: int, first: float, sweep: float, scene: Scene) -> bool:
    """Is an arc, counter-clockwise from `first`, free of walls and user, on the allowed side?"""
    count = len(scene.world.corners)
    if disc > count:
        return True
    if disc == count:
        if not arc_is_free(first, sweep, scene.user_arcs):
            return False
    else:
        world = scene.world
        if not arc_is_free(first, sweep, world.arcs[world.arc_at[disc] : world.arc_at[disc + 1]]):
            return False
        blocked = scene.user_on_disc[disc : disc + 1]
        if blocked[0, 1] > 0.0 and not arc_is_free(first, sweep, blocked):
            return False
    return sweep == 0.0 or not arc_crosses_ray(scene.discs[disc], first, sweep, scene.user)


@njit(cache=True)
def line_is_free(line: Array, source: int, target: int, scene: Scene) -> bool:
    """May the robot go along a tangent from disc `source` to disc `target`?"""
    world, user = scene.world, scene.user
    px, py, qx, qy = line[0], line[1], line[2], line[3]
    if not turn_is_free(source, line[4], 0.0, scene):
        return False
    if not turn_is_free(target, line[5], 0.0, scene):
        return False
    if not passes_disc(px, py, qx, qy, user.x, user.y, user.radius - TOLERANCE):
        return False
    if line_crosses_ray(px, py, qx, qy, user):
        return False
    return sees(px, py, qx, qy, world.discs, world.sides, math.inf)


@njit(cache=True)
def check_slot(slot: int, state: int, target: int, scene: Scene, tree: Tree) -> None:
    """Find out once whether a tangent exists and is free."""
    world, user = scene.world, scene.user
    i, turn = state // 2, 2.0 * (state % 2) - 1.0
    j, next_turn = target // 2, 2.0 * (target % 2) - 1.0
    tree.status[slot] = _BLOCKED
    if slot < len(world.links):
        line = world.links[slot]
        reach = user.radius - TOLERANCE
        if not passes_disc(line[0], line[1], line[2], line[3], user.x, user.y, reach):
            return
        if line_crosses_ray(line[0], line[1], line[2], line[3], user):
            return
        tree.lines[slot] = line
        tree.status[slot] = _OPEN
        return
    found = tangent(scene.discs[i], turn, scene.discs[j], next_turn)
    if found is not None and line_is_free(found, i, j, scene):
        tree.lines[slot] = found
        tree.status[slot] = _OPEN


@njit(cache=True)
def try_slot(
    slot: int, target: int, origin: int, scene: Scene, tree: Tree, heap: list[tuple[float, int]]
) -> None:
    """Go on from the end of the tangent `origin` along the tangent `slot`, if that is better."""
    state = tree.state[origin]
    if tree.status[slot] == _UNKNOWN:
        check_slot(slot, state, target, scene, tree)
    if tree.status[slot] == _BLOCKED:
        return
    disc, turn = state // 2, 2.0 * (state % 2) - 1.0
    arrival, departure = tree.lines[origin, 5], tree.lines[slot, 4]
    sweep, first = 0.0, departure
    if scene.discs[disc, 2] > 0.0:
        sweep = sweep_between(arrival, departure, turn)
        first = arrival if turn > 0.0 else departure
    cost = tree.cost[origin] + scene.discs[disc, 2] * sweep + tree.lines[slot, 6]
    if cost >= tree.cost[slot] or not turn_is_free(disc, first, sweep, scene):
        return
    tree.cost[slot], tree.parent[slot], tree.state[slot] = cost, origin, target
    goal = scene.discs[-1]
    rest = math.hypot(goal[0] - tree.lines[slot, 2], goal[1] - tree.lines[slot, 3])
    heapq.heappush(heap, (cost + rest, slot))


@njit(cache=True)
def expand(origin: int, scene: Scene, tree: Tree, heap: list[tuple[float, int]]) -> None:
    """Try everything that can follow the tangent `origin`.

    Slots: the links of the world, then for N discs: 4 N from each state to the user's two states,
    2 N to the goal, 4 N from the user's states to each state, 2 N from the start.
    """
    links, discs = len(scene.world.links), len(scene.discs)
    user, start, goal = discs - 3, discs - 2, discs - 1
    state = tree.state[origin]
    disc = state // 2
    try_slot(links + 4 * discs + state, 2 * goal, origin, scene, tree, heap)
    if disc < user:
        for slot in range(scene.world.link_at[state], scene.world.link_at[state + 1]):
            try_slot(slot, scene.world.link_to[slot], origin, scene, tree, heap)
    if disc != user and scene.user.radius > 0.0:
        for turn in range(2):
            try_slot(links + 2 * state + turn, 2 * user + turn, origin, scene, tree, heap)
    if disc in (user, start):
        base = links + 6 * discs + 2 * discs * (state % 2)
        if disc == start:
            base = links + 10 * discs
        for target in range(2 * user):
            try_slot(base + target, target, origin, scene, tree, heap)


@njit(cache=True)
def trace(slot: int, tree: Tree) -> tuple[Array, Integers]:
    """The tangents from the start to a slot, and the states they lead to."""
    count, walker = 0, slot
    while tree.parent[walker] >= 0:
        count, walker = count + 1, tree.parent[walker]
    lines, states = np.empty((count, 7)), np.empty(count, np.int64)
    for i in range(count):
        lines[count - 1 - i], states[count - 1 - i] = tree.lines[slot], tree.state[slot]
        slot = tree.parent[slot]
    return lines, states


@njit(cache=True)
def shortest(scene: Scene) -> tuple[float, Array, Integers]:
    """A* over the tangents.

    Returns:
        Length (math.inf: no way), the tangents in order (k, 7), and the state each leads to.
    """
    links, discs = len(scene.world.links), len(scene.discs)
    size = links + 12 * discs + 1
    root = size - 1
    tree = Tree(
        np.zeros(size, np.int8),
        np.full(size, math.inf),
        np.full(size, -1, np.int64),
        np.zeros(size, np.int64),
        np.zeros((size, 7)),
    )
    tree.cost[root], tree.state[root] = 0.0, 2 * (discs - 2)
    closed = np.zeros(size, np.bool_)
    heap = [(0.0, root)]
    while len(heap) > 0:
        _, slot = heapq.heappop(heap)
        if closed[slot]:
            continue
        closed[slot] = True
        if tree.state[slot] == 2 * (discs - 1):
            return tree.cost[slot], *trace(slot, tree)
        expand(slot, scene, tree, heap)
    return math.inf, np.empty((0, 7)), np.empty(0, np.int64)
