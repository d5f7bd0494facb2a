"""Common tangents of discs: the straight parts of a shortest path among inflated polygons.

Such a path consists of straight lines that touch corner discs and of arcs on those discs (Laumond
1987; Liu and Arimoto, "Path planning using a tangent graph", 1992). A *state* is a disc and a sense
of turning around it, 2 * disc + (1 if counter-clockwise else 0). m, rad; in the map.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hw import compiled
from hw.scene import Point
from states.navigation.exact.circles import arc_is_free
from states.navigation.exact.clearance import (
    TOLERANCE,
    TURN,
    Array,
    Circle,
    passes_disc,
    sees,
)

Integers = NDArray[np.int64]


class InflatedRoom(NamedTuple):
    """The fixed part of a planner; see `clearance` for discs and sides.

    `corners` are the discs with a free arc: no path can bend around the others.
    `arcs[arc_at[i]:arc_at[i + 1]]` are the blocked arcs of corner i. The tangents that leave
    state s are `link_at[s]:link_at[s + 1]` in `link_to` (state) and `links` (E, 7): from x, y,
    to x, y, angle on the first disc, angle on the second, length.
    """

    corners: Array
    discs: Array
    sides: Array
    arc_at: Integers
    arcs: Array
    link_at: Integers
    link_to: Integers
    links: Array


class UserDisc(NamedTuple):
    """The user's disc in one query (radius 0: none) and a ray from it that no path may cross."""

    x: float
    y: float
    radius: float
    ray_x: float
    ray_y: float


@compiled
def tangent(first: Array, turn: float, second: Array, next_turn: float, line: Array) -> bool:
    """The tangent that leaves a disc turning one way and meets another; turns: +1 ccw, -1 cw.

    Writes x, y of both ends, the angles of both on their discs, and the length into `line`; False
    if one disc contains the other.

    A direction u that passes a disc counter-clockwise has its centre at distance r to the left.
    So along u the second centre lies next_turn r2 - turn r1 to the left of the first (`across`)
    and sqrt(d^2 - across^2) ahead (`along`), which is the length: u is the direction between the
    centres turned by -asin(across / d). The ends are the centres less turn r times u's left normal.
    """
    dx, dy = second[0] - first[0], second[1] - first[1]
    apart = math.hypot(dx, dy)
    across = next_turn * second[2] - turn * first[2]
    if apart < TOLERANCE or abs(across) > apart + 2.0 * TOLERANCE:
        return False
    along = math.sqrt(max(0.0, apart * apart - across * across))
    cosine, sine = along / apart, max(-1.0, min(1.0, across / apart))
    ux, uy = (dx * cosine + dy * sine) / apart, (dy * cosine - dx * sine) / apart
    line[0] = first[0] + turn * first[2] * uy
    line[1] = first[1] - turn * first[2] * ux
    line[2] = second[0] + next_turn * second[2] * uy
    line[3] = second[1] - next_turn * second[2] * ux
    line[4] = math.atan2(-turn * ux, turn * uy)
    line[5] = math.atan2(-next_turn * ux, next_turn * uy)
    line[6] = math.hypot(line[2] - line[0], line[3] - line[1])
    return True


@compiled
def sweep_between(start: float, end: float, turn: float) -> float:
    """Angle swept from one angle to another in a sense of turning, in [0, 2 pi)."""
    sweep = (turn * (end - start)) % TURN
    return 0.0 if TURN - sweep < 1e-9 else sweep


@compiled
def link_world(
    corners: Array, discs: Array, sides: Array, arc_at: Integers, arcs: Array
) -> InflatedRoom:
    """Find all tangents between fixed corners along which the robot may go."""
    count = len(corners)
    link_at = np.zeros(2 * count + 1, np.int64)
    link_to = np.empty(64, np.int64)
    links = np.empty((64, 7))
    line = np.empty(7)
    size = 0
    for state in range(2 * count):
        i, turn = state // 2, 2.0 * (state % 2) - 1.0
        for target in range(2 * count):
            j, next_turn = target // 2, 2.0 * (target % 2) - 1.0
            if i == j or not tangent(corners[i], turn, corners[j], next_turn, line):
                continue
            if not arc_is_free(line[4], 0.0, arcs[arc_at[i] : arc_at[i + 1]]):
                continue
            if not arc_is_free(line[5], 0.0, arcs[arc_at[j] : arc_at[j + 1]]):
                continue
            if not sees(line[0], line[1], line[2], line[3], discs, sides, math.inf):
                continue
            if size == len(links):
                link_to = np.concatenate((link_to, np.empty_like(link_to)))
                links = np.concatenate((links, np.empty_like(links)))
            link_to[size], links[size] = target, line
            size += 1
        link_at[state + 1] = size
    return InflatedRoom(
        corners, discs, sides, arc_at, arcs, link_at, link_to[:size].copy(), links[:size].copy()
    )


@compiled
def separating_ray(start: Point, goal: Point, user: Circle, side: int) -> Point:
    """Unit vector of a ray from the user that paths on `side` must not cross; (0, 0): any side.

    It points to the middle of the arc around the user, from start to goal, on the other side.
    """
    if side == 0 or user[2] == 0.0:
        return 0.0, 0.0
    first = math.atan2(start[1] - user[1], start[0] - user[0])
    last = math.atan2(goal[1] - user[1], goal[0] - user[0])
    other = (TURN - (side * (last - first)) % TURN) / 2.0
    return math.cos(first - side * other), math.sin(first - side * other)


@compiled
def line_crosses_ray(px: float, py: float, qx: float, qy: float, user: UserDisc) -> bool:
    """True if the segment p-q crosses the ray that separates the two sides of the user."""
    one = user.ray_x * (py - user.y) - user.ray_y * (px - user.x)
    two = user.ray_x * (qy - user.y) - user.ray_y * (qx - user.x)
    if (one > 0.0) == (two > 0.0):
        return False
    part = one / (one - two)
    x, y = px + part * (qx - px) - user.x, py + part * (qy - py) - user.y
    return x * user.ray_x + y * user.ray_y > 0.0


@compiled
def passes_user(px: float, py: float, qx: float, qy: float, user: UserDisc) -> bool:
    """True if the segment p-q keeps clear of the user, on the allowed side."""
    if not passes_disc(px, py, qx, qy, user.x, user.y, user.radius - TOLERANCE):
        return False
    return not line_crosses_ray(px, py, qx, qy, user)


@compiled
def goes_straight(
    px: float, py: float, qx: float, qy: float, user: UserDisc, discs: Array, sides: Array
) -> bool:
    """True if the robot may go straight from p to q, both free, on the user's allowed side."""
    return passes_user(px, py, qx, qy, user) and sees(px, py, qx, qy, discs, sides, math.inf)


@compiled
def arc_crosses_ray(disc: Array, start: float, sweep: float, user: UserDisc) -> bool:
    """True if an arc, counter-clockwise from `start`, crosses the ray."""
    if user.ray_x == 0.0 and user.ray_y == 0.0:
        return False
    fx, fy = disc[0] - user.x, disc[1] - user.y
    along = fx * user.ray_x + fy * user.ray_y
    across = fy * user.ray_x - fx * user.ray_y
    if abs(across) > disc[2]:
        return False
    half = math.sqrt(disc[2] * disc[2] - across * across)
    for far in (along - half, along + half):
        if far > 0.0:
            angle = math.atan2(far * user.ray_y - fy, far * user.ray_x - fx)
            if (angle - start) % TURN < sweep:
                return True
    return False
