"""Cornering: the next bend of a line taken on a larger circle that contains the obstacle's disc.

The shortest path bends as tightly as the obstacle's disc; a faster one swings wide, touches the
disc once, at the apex, and keeps its speed. A circle of radius rho that is tangent to the disc at
the apex and contains it has its centre rho - radius from the disc's centre, opposite to the apex;
it keeps at least the clearance of the disc's edge. The best circle depends on the robot's present
velocity: many are tried, and the one with the least time to the goal is taken. m, s, rad; in the
map.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hw import compiled
from states.navigation.exact import Array, sweep_between, tangent
from states.navigation.local.speed_profile import SpeedLimits, pace_of, travel_time

ARC_PARTS = 8
"""Number of tangents by which an arc is drawn."""
ROUNDS = 5
"""Rounds of the search around the best circle."""
WIDEST_SWEEP = 4.5
"""Bends that turn by more than this are not considered, rad."""
SMALLEST_CIRCLE = 0.01
"""Least radius of a circle, m."""
TRIES = 18 + 6 + 1 + 4 * ROUNDS
"""Circles tried: a grid, those ahead of the robot, the last one, and the search."""


class Bend(NamedTuple):
    """The first bend of a line: its disc, sense of turning (+1 ccw), entry angle and sweep, rad.

    `rest` is the index of the first point after the bend.
    """

    x: float
    y: float
    radius: float
    turn: float
    entry: float
    sweep: float
    rest: int


@compiled
def first_bend(line: Array) -> Bend | None:
    """The first bend of a line that begins straight or on the bend; None if there is no bend."""
    if len(line) < 3:
        return None
    ax, ay = line[1, 0] - line[0, 0], line[1, 1] - line[0, 1]
    last = 1
    while last + 1 < len(line) - 1 and line[last, 2] < math.inf:
        last += 1
    if math.hypot(ax, ay) < 1e-9:
        ax, ay = line[2, 0] - line[1, 0], line[2, 1] - line[1, 1]
    bx, by = line[last + 1, 0] - line[last, 0], line[last + 1, 1] - line[last, 1]
    if math.hypot(bx, by) < 1e-9:
        bx, by = line[last, 0] - line[last - 1, 0], line[last, 1] - line[last - 1, 1]
    sx, sy = line[last, 0] - line[1, 0], line[last, 1] - line[1, 1]
    if last == 1:
        sx, sy = bx, by
    turn = 1.0 if ax * sy - ay * sx > 0.0 else -1.0
    length = math.hypot(ax, ay)
    radius = line[1, 2] if last > 1 else 0.0
    x, y = line[1, 0] - turn * radius * ay / length, line[1, 1] + turn * radius * ax / length
    entry = math.atan2(-turn * ax, turn * ay)
    leave = math.atan2(-turn * bx, turn * by)
    return Bend(x, y, radius, turn, entry, sweep_between(entry, leave, turn), last + 1)


@compiled
def widen_into(new: Array, line: Array, rest: int, turn: float, circle: Array) -> bool:
    """Write the way around a circle to the point `rest` into a line; False if it has no tangent.

    What follows that point is left alone.
    """
    scratch = np.zeros((4, 7))  # one array is allocated faster than four
    start, end, first, second = scratch[0], scratch[1], scratch[2], scratch[3]
    start[:2], end[:2] = line[0, :2], line[rest, :2]
    if not tangent(start, 1.0, circle, turn, first) or not tangent(circle, turn, end, 1.0, second):
        return False
    sweep = sweep_between(first[5], second[4], turn)
    if sweep > WIDEST_SWEEP:
        return False
    new[0] = line[0]
    new[0, 2] = math.inf
    part = sweep / ARC_PARTS
    far = circle[2] / math.cos(0.5 * part)
    new[1, 0], new[1, 1] = first[2], first[3]
    for k in range(ARC_PARTS):
        angle = first[5] + turn * (k + 0.5) * part
        new[2 + k, 0] = circle[0] + far * math.cos(angle)
        new[2 + k, 1] = circle[1] + far * math.sin(angle)
    new[2 + ARC_PARTS, 0], new[2 + ARC_PARTS, 1] = second[0], second[1]
    new[1 : 2 + ARC_PARTS, 2], new[2 + ARC_PARTS, 2] = circle[2], math.inf
    return True


@compiled
def room_to_widen(line: Array, rest: int) -> Array:
    """A line for `widen_into`, with all that follows the circle."""
    new = np.empty((ARC_PARTS + 3 + len(line) - rest, 3))
    new[3 + ARC_PARTS :] = line[rest:]
    return new


@compiled
def widened(line: Array, rest: int, turn: float, circle: Array) -> Array | None:
    """The line around a circle (x, y, radius) to its point `rest`; None if there is no tangent."""
    new = room_to_widen(line, rest)
    return new if widen_into(new, line, rest, turn, circle) else None


@compiled
def time_from(line: Array, vx: float, vy: float, pace: SpeedLimits) -> float:
    """Time to the end from the robot's present velocity, s.

    Only the component along the line is used; braking the one across it costs |across| / a more. A
    component that points backwards costs double: it is braked, and its distance driven again.
    """
    dx, dy = line[1, 0] - line[0, 0], line[1, 1] - line[0, 1]
    length = math.hypot(dx, dy)
    if length < 1e-9 and len(line) > 2:
        dx, dy = line[2, 0] - line[0, 0], line[2, 1] - line[0, 1]
        length = math.hypot(dx, dy)
    if length == 0.0:
        return math.hypot(vx, vy) / pace.acceleration
    along, across = (vx * dx + vy * dy) / length, (vy * dx - vx * dy) / length
    loss = abs(across) / pace.acceleration
    if along < 0.0:
        loss -= 2.0 * along / pace.acceleration
    return float(loss + travel_time(line, max(0.0, along), pace))


@compiled
def time_along(line: Array, vx: float, vy: float, rates: Array) -> float:
    """`time_from` with the limits of a drive, see `speed_profile.pace_of`."""
    return time_from(line, vx, vy, pace_of(rates))


@compiled
def touch(bend: Bend, rho: float, apex: float, circle: Array) -> None:
    """Set the circle (x, y, radius) that contains the bend's disc and touches it at the apex."""
    circle[0] = bend.x - (rho - bend.radius) * math.cos(apex)
    circle[1] = bend.y - (rho - bend.radius) * math.sin(apex)
    circle[2] = rho


@compiled
def circle_time(
    circle: Array,
    line: Array,
    bend: Bend,
    motion: tuple[float, float],
    pace: SpeedLimits,
    new: Array,
) -> float:
    """Time to the end with the first bend on this circle, s; infinite if it cannot be driven.

    `new` is from `room_to_widen`.
    """
    if circle[2] < SMALLEST_CIRCLE or not widen_into(new, line, bend.rest, bend.turn, circle):
        return math.inf
    return time_from(new, motion[0], motion[1], pace)


@compiled
def circles_ahead(line: Array, bend: Bend, motion: tuple[float, float]) -> Array:
    """Circles, (k, 2) radius and apex, that the present velocity leads onto without a kink.

    Such a circle is tangent to the line of motion at a point p (relative to the disc's centre) and
    contains the disc of radius r, touching it. Its centre is p + rho n, with n the normal on the
    inner side of the bend; |p + rho n| = rho - r gives rho = (|p|^2 - r^2) / (2 (-p.n - r)), where
    -p.n is how far the line of motion passes the disc's centre. Points p up to the nearest one are
    tried.
    """
    speed = math.hypot(motion[0], motion[1])
    found = np.empty((6, 2))
    if speed < 1e-3:
        return found[:0]
    ux, uy = motion[0] / speed, motion[1] / speed
    nx, ny = -bend.turn * uy, bend.turn * ux
    wx, wy = line[0, 0] - bend.x, line[0, 1] - bend.y
    aside, ahead = -(wx * nx + wy * ny), -(wx * ux + wy * uy)
    if aside <= bend.radius + 1e-6:
        return found[:0]
    count = 0
    for part in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0):
        x, y = wx + part * max(0.0, ahead) * ux, wy + part * max(0.0, ahead) * uy
        rho = (x * x + y * y - bend.radius**2) / (2.0 * (aside - bend.radius))
        if rho < bend.radius:
            continue
        found[count, 0] = rho
        found[count, 1] = math.atan2(-y - rho * ny, -x - rho * nx)
        count += 1
    return found[:count]


@compiled
def fastest_circles(
    line: Array, bend: Bend, motion: tuple[float, float], pace: SpeedLimits, before: Array
) -> Array:
    """Circles for the first bend, (k, 4): time, x, y, radius; the fastest first.

    `motion` is the velocity in the map, `before` the circle of the last cycle (radius 0: none).
    Candidates are a grid of radii and apices, the circles ahead of the robot and the last one; the
    best is refined by a pattern search.
    """
    tried = np.empty((TRIES, 4))
    shape = np.empty((TRIES, 2))
    new = room_to_widen(line, bend.rest)
    count = 0
    widest = max(1.5 * pace.speed**2 / pace.acceleration, 2.0 * bend.radius) - bend.radius
    for part in (0.0, 0.08, 0.2, 0.4, 0.65, 1.0):
        for place in (0.25, 0.5, 0.75):
            shape[count, 0] = bend.radius + part * widest
            shape[count, 1] = bend.entry + bend.turn * place * bend.sweep
            count += 1
    for rho, apex in circles_ahead(line, bend, motion):
        shape[count, 0], shape[count, 1] = rho, apex
        count += 1
    off = math.hypot(before[0] - bend.x, before[1] - bend.y)
    if before[2] > 0.0 and off <= before[2] - bend.radius + 1e-6:
        shape[count, 0] = before[2]
        shape[count, 1] = math.atan2(bend.y - before[1], bend.x - before[0])
        count += 1
    best = 0
    for i in range(count):
        touch(bend, shape[i, 0], shape[i, 1], tried[i, 1:])
        tried[i, 0] = circle_time(tried[i, 1:], line, bend, motion, pace, new)
        best = i if tried[i, 0] < tried[best, 0] else best
    rho_step, apex_step = 0.2 * widest, 0.15 * bend.sweep
    for _ in range(ROUNDS):
        rho, apex = shape[best]
        for rho_move, apex_move in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            shape[count, 0] = max(bend.radius, rho + rho_move * rho_step)
            shape[count, 1] = apex + apex_move * apex_step
            touch(bend, shape[count, 0], shape[count, 1], tried[count, 1:])
            tried[count, 0] = circle_time(tried[count, 1:], line, bend, motion, pace, new)
            best = count if tried[count, 0] < tried[best, 0] else best
            count += 1
        rho_step, apex_step = 0.5 * rho_step, 0.5 * apex_step
    return tried[np.argsort(tried[:count, 0])]


@compiled
def fastest_turns(line: Array, motion: tuple[float, float], pace: SpeedLimits) -> Array:
    """Circles on which a robot with another heading turns onto a line; as `fastest_circles`.

    They are tangent to the present velocity and turn towards the line. Radii are spaced evenly in
    their logarithm from the tightest that the speed allows to the widest that the tangent to the
    end leaves: half the length over the sine of the angle between both.
    """
    speed = math.hypot(motion[0], motion[1])
    tried = np.empty((5, 4))
    dx, dy = line[1, 0] - line[0, 0], line[1, 1] - line[0, 1]
    length = math.hypot(dx, dy)
    if speed < 0.05 or length < 1e-3:
        return tried[:0]
    ux, uy = motion[0] / speed, motion[1] / speed
    aside = (ux * dy - uy * dx) / length
    if abs(aside) < 0.02:
        return tried[:0]
    turn = math.copysign(1.0, aside)
    tightest = speed**2 / (pace.bend_share * pace.acceleration)
    widest = 0.999 * 0.5 * length / abs(aside)
    for i, part in enumerate((1.0, 0.75, 0.5, 0.25, 0.0)):
        rho = widest**part * min(tightest, widest) ** (1.0 - part)
        tried[i, 1], tried[i, 2] = line[0, 0] - turn * rho * uy, line[0, 1] + turn * rho * ux
        tried[i, 3] = rho
        new = widened(line, 1, turn, tried[i, 1:])
        tried[i, 0] = math.inf if new is None else time_from(new, motion[0], motion[1], pace)
    return tried[np.argsort(tried[:, 0])]


@compiled
def circles_for(
    line: Array, vx: float, vy: float, rates: Array, before: Array
) -> tuple[int, Array, float]:
    """Circles for the next bend of a line or, without one, for the turn onto it.

    `before` is the turn (+1 ccw) and circle of the last cycle (4,).

    Returned: the index of the first point after the circle; the circles, (k, 5): turn, x, y,
    radius, time, the fastest first; and the time without any of them.
    """
    pace, motion, bend = pace_of(rates), (vx, vy), first_bend(line)
    if bend is None:
        rest, dx, dy = 1, line[1, 0] - line[0, 0], line[1, 1] - line[0, 1]
        turn = math.copysign(1.0, vx * dy - vy * dx)
        circles = fastest_turns(line, motion, pace)
    else:
        rest, turn = bend.rest, bend.turn
        circle = before[1:] if before[0] == turn else np.zeros(3)
        circles = fastest_circles(line, bend, motion, pace, circle)
    found = np.empty((len(circles), 5))
    found[:, 0], found[:, 1:4], found[:, 4] = turn, circles[:, 1:], circles[:, 0]
    return rest, found, time_from(line, vx, vy, pace)
