"""How fast a line may be driven: forward and backward pass under norm limits.

Speed and acceleration are limited as vectors (never per axis, which would let a holonomic base go
1.4 times as fast along the diagonal). In a bend of radius r the turning takes v^2 / r of the
acceleration; what is left, sqrt(a^2 - v^4 / r^2), speeds up or brakes (the friction circle).

A line is (n, 3): x, y and the radius of the bend to the next point, infinite on a straight. A
corner between straights is rounded within `corner_error`. m, s, rad.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from states.navigation.clearance import Array
from states.navigation.path import Path


def as_line(path: Path) -> Array:
    """A path as a line for the functions below."""
    line = np.full((len(path.points), 3), math.inf)
    line[:, :2] = path.points
    line[:-1, 2] = path.radii
    return line


TOO_FAST = 4.0
"""What it costs to begin faster than one can brake: time lost per time to slow down."""


class SpeedLimits(NamedTuple):
    """Largest speed (m/s) and acceleration (m/s2), both as norms.

    Bends are planned with the share `bend_share` of the acceleration, so that some is left for
    corrections; corners may be missed by `corner_error`, m.
    """

    speed: float
    acceleration: float
    bend_share: float
    corner_error: float


@njit(cache=True)
def bend_speed(radius: float, pace: SpeedLimits) -> float:
    """Largest speed in a bend, m/s."""
    if radius == math.inf:
        return pace.speed
    return min(pace.speed, math.sqrt(pace.bend_share * pace.acceleration * radius))


@njit(cache=True)
def corner_speed(before: Array, corner: Array, after: Array, pace: SpeedLimits) -> float:
    """Largest speed at a corner that is rounded by an arc within the allowed deviation, m/s."""
    ax, ay = corner[0] - before[0], corner[1] - before[1]
    bx, by = after[0] - corner[0], after[1] - corner[1]
    lengths = math.hypot(ax, ay) * math.hypot(bx, by)
    if lengths == 0.0:
        return pace.speed
    half = math.sqrt(max(0.0, 0.5 * (1.0 + (ax * bx + ay * by) / lengths)))
    if half > 0.999999:
        return pace.speed
    return bend_speed(pace.corner_error * half / (1.0 - half), pace)


@njit(cache=True)
def reachable_speed(speed: float, step: float, radius: float, pace: SpeedLimits) -> float:
    """The speed from which `speed` can be braked to (or reached from it) within a stretch, m/s.

    On a straight v^2 grows by 2 a s. On the friction circle of a bend dv^2/ds =
    2 sqrt(a^2 - v^4 / r^2), so v^2 = a r sin(2 s / r + c).
    """
    if radius == math.inf:
        return math.sqrt(speed * speed + 2.0 * pace.acceleration * step)
    top = pace.bend_share * pace.acceleration * radius
    phase = math.asin(min(1.0, speed * speed / top)) + 2.0 * step / radius
    return math.sqrt(top * math.sin(min(0.5 * math.pi, phase)))


@njit(cache=True)
def step_length(line: Array, i: int) -> float:
    """Distance from point i to the next, m."""
    return math.hypot(line[i + 1, 0] - line[i, 0], line[i + 1, 1] - line[i, 1])


@njit(cache=True)
def point_speed(line: Array, i: int, pace: SpeedLimits) -> float:
    """Largest speed at point i for the bends on both its sides, m/s."""
    if i == 0:
        return bend_speed(line[0, 2], pace)
    radius = min(line[i - 1, 2], line[i, 2])
    if radius == math.inf:
        return corner_speed(line[i - 1], line[i], line[i + 1], pace)
    return bend_speed(radius, pace)


@njit(cache=True)
def braking_speeds(line: Array, pace: SpeedLimits, end_speed: float) -> Array:
    """The largest speed at each point from which bends and the end can still be met, m/s."""
    count = len(line)
    speeds = np.empty(count)
    speeds[-1] = end_speed
    for i in range(count - 2, -1, -1):
        radius, step = line[i, 2], step_length(line, i)
        speeds[i] = min(
            point_speed(line, i, pace), reachable_speed(speeds[i + 1], step, radius, pace)
        )
    return speeds


@njit(cache=True)
def stretch_time(step: float, start: float, end: float, radius: float, pace: SpeedLimits) -> float:
    """Time for one stretch between two speeds that can follow each other, s."""
    if step == 0.0:
        return 0.0
    if radius < math.inf:
        return 2.0 * step / max(1e-6, start + end)
    a = pace.acceleration
    peak = math.sqrt(max(0.0, 0.5 * (start * start + end * end) + a * step))
    if peak <= pace.speed:
        return (2.0 * peak - start - end) / a
    top = pace.speed
    cruise = step - (2.0 * top * top - start * start - end * end) / (2.0 * a)
    return (2.0 * top - start - end) / a + cruise / top


@njit(cache=True)
def travel_time(line: Array, speed: float, pace: SpeedLimits) -> float:
    """Time from the first point to rest at the last, starting at `speed` along the line, s."""
    speeds = braking_speeds(line, pace, 0.0)
    total = TOO_FAST * max(0.0, speed - speeds[0]) / pace.acceleration
    now = min(speed, float(speeds[0]))
    for i in range(len(line) - 1):
        radius, step = line[i, 2], step_length(line, i)
        following = min(speeds[i + 1], reachable_speed(now, step, radius, pace))
        total += stretch_time(step, now, following, radius, pace)
        now = following
    return float(total)


@njit(cache=True)
def speed_before(rest: float, end: float, radius: float, period: float, pace: SpeedLimits) -> float:
    """The speed from which `end` can be met in the distance `rest`, less half a period's way."""
    half = 0.5 * pace.acceleration * period
    if radius == math.inf:
        return math.sqrt(half * half + end * end + 2.0 * pace.acceleration * rest) - half
    speed = reachable_speed(end, rest, radius, pace)
    for _ in range(2):
        left = max(0.0, rest - 0.5 * speed * period)
        speed = reachable_speed(end, left, radius, pace)
    return speed


@njit(cache=True)
def next_speed(line: Array, speed: float, pace: SpeedLimits, period: float) -> float:
    """The speed to have at the end of this period, so that all bends and the end are still met.

    The base is taken to change its speed evenly within the period.
    """
    speeds = braking_speeds(line, pace, 0.0)
    passed = 0.0
    for i in range(len(line) - 1):
        step = step_length(line, i)
        if passed + step <= speed * period and i < len(line) - 2:
            passed += step
            continue
        rest = max(0.0, passed + step - 0.5 * speed * period)
        return min(
            bend_speed(line[i, 2], pace),
            speed_before(rest, speeds[i + 1], line[i, 2], period, pace),
        )
    return 0.0


@njit(cache=True)
def stretch_heading(line: Array, i: int) -> float:
    """Direction from point i to the next, rad."""
    return math.atan2(line[i + 1, 1] - line[i, 1], line[i + 1, 0] - line[i, 0])


@njit(cache=True)
def bend_heading(line: Array, i: int) -> float:
    """Direction of the way at point i, on or beside the bend that is drawn there, rad."""
    if i == 0 or step_length(line, i - 1) < 1e-9:
        return stretch_heading(line, i)
    if i == len(line) - 1 or step_length(line, i) < 1e-9:
        return stretch_heading(line, i - 1)
    before, after = stretch_heading(line, i - 1), stretch_heading(line, i)
    return before + 0.5 * turned(before, after)


@njit(cache=True)
def turned(before: float, after: float) -> float:
    """Angle from one direction to another, in [-pi, pi), rad."""
    return (after - before + math.pi) % (2.0 * math.pi) - math.pi


@njit(cache=True)
def heading_after(line: Array, distance: float) -> float:
    """Direction of the way at a distance from its start, rad."""
    heading = 0.0
    for i in range(len(line) - 1):
        step = step_length(line, i)
        if step < 1e-9:
            continue
        heading = stretch_heading(line, i)
        if distance <= step:
            if line[i, 2] < math.inf:
                first, last = bend_heading(line, i), bend_heading(line, i + 1)
                heading = first + turned(first, last) * distance / step
            return heading
        distance -= step
    return heading
