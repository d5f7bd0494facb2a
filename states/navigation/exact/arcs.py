"""The shortest path as points: its arcs are drawn as circumscribed polylines."""

from __future__ import annotations

import math

import numpy as np

from hw import compiled
from hw.scene import Point
from states.navigation.exact.clearance import TOLERANCE, Array, Circle, is_clear
from states.navigation.exact.tangent_search import PathQuery, make_query, shortest
from states.navigation.exact.tangents import InflatedRoom, Integers, UserDisc, sweep_between

DRAWING_ERROR = 5e-4
"""Largest distance of the polyline outside an arc of usual size, m."""


@compiled
def parts_of_arc(disc: Array, start: float, sweep: float, query: PathQuery) -> int:
    """Number of tangents with which an arc is drawn; more where another inflation is close.

    Neighbouring tangents of a circle at an angle a apart meet at radius / cos(a / 2), which is
    `DRAWING_ERROR` outside of it for a = 2 acos(radius / (radius + DRAWING_ERROR)).
    """
    radius = disc[2]
    if abs(radius * sweep) < TOLERANCE:
        return 0
    step = 2.0 * math.acos(radius / (radius + DRAWING_ERROR))
    parts = math.ceil(abs(sweep) / max(0.05, min(0.5, step)))
    user = query.user
    for _ in range(6):
        clear = True
        part = sweep / parts
        far = radius / math.cos(0.5 * part)
        for k in range(parts):
            angle = start + (k + 0.5) * part
            x, y = disc[0] + far * math.cos(angle), disc[1] + far * math.sin(angle)
            off_user = math.hypot(x - user.x, y - user.y) >= user.radius - TOLERANCE
            clear &= off_user and is_clear(x, y, query.world.discs, query.world.sides)
        if clear:
            break
        parts *= 2
    return parts


@compiled
def draw(lines: Array, states: Integers, query: PathQuery) -> Array:
    """The path as points and the radius of the bend from each to the next, (k, 3).

    Arcs are drawn by their tangents, from outside, so that the polyline never cuts a corner.
    """
    bends = len(lines) - 1
    sweeps, parts = np.empty(bends), np.empty(bends, np.int64)
    for i in range(bends):
        turn = 2.0 * (states[i] % 2) - 1.0
        sweeps[i] = turn * sweep_between(lines[i, 5], lines[i + 1, 4], turn)
        parts[i] = parts_of_arc(query.discs[states[i] // 2], lines[i, 5], sweeps[i], query)
    points = np.empty((2 + 2 * bends + parts.sum(), 3))
    points[:, 2] = math.inf
    points[0, 0], points[0, 1] = lines[0, 0], lines[0, 1]
    count = 1
    for i in range(bends):
        x, y, radius = query.discs[states[i] // 2]
        points[count, 0], points[count, 1] = lines[i, 2], lines[i, 3]
        count += 1
        if parts[i] == 0:
            continue
        part = sweeps[i] / parts[i]
        far = radius / math.cos(0.5 * part)
        points[count - 1, 2] = radius
        for k in range(parts[i]):
            angle = lines[i, 5] + (k + 0.5) * part
            points[count, 0] = x + far * math.cos(angle)
            points[count, 1] = y + far * math.sin(angle)
            points[count, 2] = radius
            count += 1
        points[count, 0], points[count, 1] = lines[i + 1, 0], lines[i + 1, 1]
        count += 1
    points[count, 0], points[count, 1] = lines[-1, 2], lines[-1, 3]
    return points[: count + 1]


@compiled
def shortest_path(
    world: InflatedRoom, user: Circle, ray: Point, start: Point, goal: Point
) -> tuple[float, Array]:
    """Length of the shortest path and its points, see `draw`; infinite and none without one."""
    around = UserDisc(user[0], user[1], user[2], ray[0], ray[1])
    query = make_query(world, around, start, goal)
    length, lines, states = shortest(query)
    if not math.isfinite(length):
        return math.inf, np.empty((0, 3))
    return length, draw(lines, states, query)
