"""A* over the common tangents of corner discs, the user's disc, start and goal.

Start and goal are discs of radius 0. The tangents between fixed corners are known beforehand, see
`tangents`; those of start, goal and the moving user are found when the search needs them. m, rad.
"""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hw import compiled
from states.navigation.exact.circles import arc_is_free, blocked_arcs
from states.navigation.exact.clearance import TOLERANCE, TURN, Array, sees
from states.navigation.exact.tangents import (
    InflatedRoom,
    Integers,
    UserDisc,
    arc_crosses_ray,
    passes_user,
    sweep_between,
    tangent,
)


class PathQuery(NamedTuple):
    """One query: `discs` are the fixed corners, then user, start and goal.

    `user_arcs` are the blocked arcs of the user's disc; row i of `user_on_disc` is the arc of
    corner i that the user blocks.
    """

    world: InflatedRoom
    user: UserDisc
    discs: Array
    user_arcs: Array
    user_on_disc: Array


class SearchTree(NamedTuple):
    """The state of the search, per tangent: whether it is usable, cost to its far end, predecessor.

    `lines` holds the tangents that are not among the world's links.
    """

    status: NDArray[np.int8]
    cost: Array
    parent: Integers
    state: Integers
    lines: Array


_UNKNOWN, _OPEN, _BLOCKED = 0, 1, 2


@compiled
def make_query(
    world: InflatedRoom, user: UserDisc, start: tuple[float, float], goal: tuple[float, float]
) -> PathQuery:
    """Add user, start and goal to the fixed corners."""
    count = len(world.corners)
    discs = np.zeros((count + 3, 3))
    discs[:count] = world.corners
    discs[count, 0], discs[count, 1], discs[count, 2] = user.x, user.y, user.radius
    discs[count + 1, 0], discs[count + 1, 1] = start
    discs[count + 2, 0], discs[count + 2, 1] = goal
    user_on_disc = np.zeros((count, 2))
    if user.radius == 0.0:
        return PathQuery(world, user, discs, np.empty((0, 2)), user_on_disc)
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
    return PathQuery(world, user, discs, user_arcs, user_on_disc)


@compiled
def turn_is_free(disc: int, first: float, sweep: float, query: PathQuery) -> bool:
    """True if an arc, counter-clockwise from `first`, meets neither walls nor user nor the ray."""
    count = len(query.world.corners)
    if disc > count:
        return True
    if disc == count:
        if not arc_is_free(first, sweep, query.user_arcs):
            return False
    else:
        world = query.world
        if not arc_is_free(first, sweep, world.arcs[world.arc_at[disc] : world.arc_at[disc + 1]]):
            return False
        blocked = query.user_on_disc[disc : disc + 1]
        if blocked[0, 1] > 0.0 and not arc_is_free(first, sweep, blocked):
            return False
    return sweep == 0.0 or not arc_crosses_ray(query.discs[disc], first, sweep, query.user)


@compiled
def passes_walls(line: Array, source: int, target: int, query: PathQuery) -> bool:
    """True if a tangent from disc `source` to disc `target` keeps clear of all walls."""
    if not turn_is_free(source, line[4], 0.0, query):
        return False
    if not turn_is_free(target, line[5], 0.0, query):
        return False
    world = query.world
    return sees(line[0], line[1], line[2], line[3], world.discs, world.sides, math.inf)


@compiled
def line_of(slot: int, query: PathQuery, tree: SearchTree) -> Array:
    """The tangent of a slot, as `tangents.tangent` gives it."""
    links = query.world.links
    line: Array = links[slot] if slot < len(links) else tree.lines[slot - len(links)]
    return line


@compiled
def try_slots(
    begin: int,
    end: int,
    first_target: int,
    origin: int,
    query: PathQuery,
    tree: SearchTree,
    heap: list[tuple[float, int]],
) -> None:
    """Relax the slots from `begin` to `end` from the far end of the tangent `origin`.

    Links of the world have their own target states, the other slots lead to `first_target` and so
    on. Whether a tangent exists and keeps clear of the user is determined once. Walls are checked
    only when the search reaches a tangent, see `shortest`: most tangents of start and goal are
    never reached.
    """
    discs, user, links, link_to = query.discs, query.user, query.world.links, query.world.link_to
    status, costs, lines = tree.status, tree.cost, tree.lines
    state = tree.state[origin]
    disc, turn = state // 2, 2.0 * (state % 2) - 1.0
    radius, cost_so_far = discs[disc, 2], costs[origin]
    arrival = line_of(origin, query, tree)[5]
    goal_x, goal_y = discs[-1, 0], discs[-1, 1]
    for slot in range(begin, end):
        is_link = slot < len(links)
        target = link_to[slot] if is_link else first_target + slot - begin
        line = links[slot] if is_link else lines[slot - len(links)]
        if status[slot] == _UNKNOWN:
            exists = is_link
            if not is_link:
                next_turn = 2.0 * (target % 2) - 1.0
                exists = tangent(discs[disc], turn, discs[target // 2], next_turn, line)
            if exists and passes_user(line[0], line[1], line[2], line[3], user):
                status[slot] = _OPEN
            else:
                status[slot] = _BLOCKED
        if status[slot] == _BLOCKED:
            continue
        sweep, first = 0.0, line[4]
        if radius > 0.0:
            sweep = sweep_between(arrival, line[4], turn)
            first = arrival if turn > 0.0 else line[4]
        cost = cost_so_far + radius * sweep + line[6]
        if cost >= costs[slot]:
            continue
        if radius > 0.0 and not turn_is_free(disc, first, sweep, query):
            continue
        costs[slot], tree.parent[slot], tree.state[slot] = cost, origin, target
        rest = math.hypot(goal_x - line[2], goal_y - line[3])
        heapq.heappush(heap, (cost + rest, slot))


@compiled
def expand(origin: int, query: PathQuery, tree: SearchTree, heap: list[tuple[float, int]]) -> None:
    """Relax everything that can follow the tangent `origin`.

    Slots: the links of the world, then for N discs: 2 N to the goal, 2 N from the start and, only
    where there is a user, 4 N from each state to the user's two and 4 N from these to each state.
    """
    links, discs = len(query.world.links), len(query.discs)
    user, start, goal = discs - 3, discs - 2, discs - 1
    state = tree.state[origin]
    disc = state // 2
    to_goal = links + state
    try_slots(to_goal, to_goal + 1, 2 * goal, origin, query, tree, heap)
    if disc < user:
        link_at = query.world.link_at
        try_slots(link_at[state], link_at[state + 1], 0, origin, query, tree, heap)
    if disc == start:
        away = links + 2 * discs
        try_slots(away, away + 2 * user, 0, origin, query, tree, heap)
    if disc == user:
        away = links + 8 * discs + 2 * discs * (state % 2)
        try_slots(away, away + 2 * user, 0, origin, query, tree, heap)
    elif query.user.radius > 0.0:
        to_user = links + 4 * discs + 2 * state
        try_slots(to_user, to_user + 2, 2 * user, origin, query, tree, heap)


@compiled
def trace(slot: int, query: PathQuery, tree: SearchTree) -> tuple[Array, Integers]:
    """The tangents from the start to a slot, and the states they lead to."""
    count, walker = 0, slot
    while tree.parent[walker] >= 0:
        count, walker = count + 1, tree.parent[walker]
    lines, states = np.empty((count, 7)), np.empty(count, np.int64)
    for i in range(count):
        lines[count - 1 - i], states[count - 1 - i] = line_of(slot, query, tree), tree.state[slot]
        slot = tree.parent[slot]
    return lines, states


@compiled
def shortest(query: PathQuery) -> tuple[float, Array, Integers]:
    """A* over the tangents; those that are not links are checked against walls when reached.

    Returns:
        Length (infinite: no path), the tangents in order (k, 7), and the state each leads to.
    """
    links, discs = len(query.world.links), len(query.discs)
    slots = 12 * discs if query.user.radius > 0.0 else 4 * discs
    root = links + slots
    size = root + 1
    tree = SearchTree(
        np.zeros(size, np.int8),
        np.full(size, math.inf),
        np.full(size, -1, np.int64),
        np.zeros(size, np.int64),
        np.zeros((slots + 1, 7)),
    )
    tree.cost[root], tree.state[root] = 0.0, 2 * (discs - 2)
    closed = np.zeros(size, np.bool_)
    heap = [(0.0, root)]
    while len(heap) > 0:
        _, slot = heapq.heappop(heap)
        if closed[slot]:
            continue
        closed[slot] = True
        if links <= slot < root:
            source, target = tree.state[tree.parent[slot]] // 2, tree.state[slot] // 2
            if not passes_walls(line_of(slot, query, tree), source, target, query):
                continue
        if tree.state[slot] == 2 * (discs - 1):
            return tree.cost[slot], *trace(slot, query, tree)
        expand(slot, query, tree, heap)
    return math.inf, np.empty((0, 7)), np.empty(0, np.int64)
