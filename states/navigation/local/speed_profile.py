"""Speed profiles along a polyline: forward and backward pass under norm limits.

Speed and acceleration are limited as vectors (per axis, a holonomic base would go 1.4 times as fast
along the diagonal). In a bend of radius r, turning takes v^2 / r of the acceleration a; what is
left, sqrt(a^2 - v^4 / r^2), speeds up or brakes (the friction circle).

A line is (n, 3): x, y and the radius of the bend to the next point, infinite on a straight. A
corner between straights is rounded within `corner_error`. m, s, rad.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hw import compiled
from states.navigation.exact import Array, turn_between

BEND_SHARE = 0.9
"""Share of the acceleration that bends are planned with; the rest is for corrections."""
CORNER_ERROR = 0.03
"""Deviation within which corners of paths found on grids are rounded, m."""
TOO_FAST = 4.0
"""Penalty factor for starting too fast to brake in time: times the time that slowing down takes."""


class SpeedLimits(NamedTuple):
    """Largest speed (m/s) and acceleration (m/s2), both as norms.

    Bends are planned with the share `bend_share` of the acceleration, which leaves the rest for
    corrections; corners are rounded within `corner_error`, m.
    """

    speed: float
    acceleration: float
    bend_share: float
    corner_error: float


@compiled
def pace_of(rates: Array) -> SpeedLimits:
    """That of a drive with these limits: speed, acceleration, … (4,)."""
    return SpeedLimits(rates[0], rates[1], BEND_SHARE, CORNER_ERROR)


@compiled
def bend_speed(radius: float, pace: SpeedLimits) -> float:
    """Largest speed in a bend, m/s."""
    if radius == math.inf:
        return pace.speed
    return min(pace.speed, math.sqrt(pace.bend_share * pace.acceleration * radius))


@compiled
def corner_speed(before: Array, corner: Array, after: Array, pace: SpeedLimits) -> float:
    """Largest speed at a corner that is rounded by an arc within the allowed deviation, m/s.

    An arc of radius r that rounds a corner of deflection b passes it at r (1 / cos(b / 2) - 1), so
    r = error cos(b / 2) / (1 - cos(b / 2)), with cos(b / 2)^2 = (1 + cos(b)) / 2.
    """
    ax, ay = corner[0] - before[0], corner[1] - before[1]
    bx, by = after[0] - corner[0], after[1] - corner[1]
    lengths = math.hypot(ax, ay) * math.hypot(bx, by)
    if lengths == 0.0:
        return pace.speed
    half = math.sqrt(max(0.0, 0.5 * (1.0 + (ax * bx + ay * by) / lengths)))
    if half > 0.999999:
        return pace.speed
    return bend_speed(pace.corner_error * half / (1.0 - half), pace)


@compiled
def reachable_speed(speed: float, step: float, radius: float, pace: SpeedLimits) -> float:
    """The speed from which `speed` can be reached by braking over `step` (or vice versa), m/s.

    On a straight v^2 grows by 2 a s. On the friction circle of a bend dv^2/ds =
    2 sqrt(a^2 - v^4 / r^2), so v^2 = a r sin(2 s / r + c), up to the top of the sine. With
    acos(u)^2 <= pi^2 / 2 (1 - u) < 5 (1 - u) most bends are known to get there without its arc.
    """
    if radius == math.inf:
        return math.sqrt(speed * speed + 2.0 * pace.acceleration * step)
    top = pace.bend_share * pace.acceleration * radius
    share, turned = min(1.0, speed * speed / top), 2.0 * step / radius
    if turned * turned > 5.0 * (1.0 - share):
        return math.sqrt(top)
    phase = math.asin(share) + turned
    return math.sqrt(top * math.sin(min(0.5 * math.pi, phase)))


@compiled
def step_length(line: Array, i: int) -> float:
    """Distance from point i to the next, m."""
    return math.hypot(line[i + 1, 0] - line[i, 0], line[i + 1, 1] - line[i, 1])


@compiled
def point_speed(line: Array, i: int, pace: SpeedLimits) -> float:
    """Largest speed at point i, by the bends before and after it, m/s."""
    if i == 0:
        return bend_speed(line[0, 2], pace)
    radius = min(line[i - 1, 2], line[i, 2])
    if radius == math.inf:
        return corner_speed(line[i - 1], line[i], line[i + 1], pace)
    return bend_speed(radius, pace)


@compiled
def braking_speeds(line: Array, pace: SpeedLimits, end_speed: float) -> Array:
    """Backward pass: largest speed at each point that bends and the end ahead allow, m/s."""
    speeds: Array = braking_passes(line, pace, end_speed)[0]
    return speeds


@compiled
def braking_passes(line: Array, pace: SpeedLimits, end_speed: float) -> Array:
    """`braking_speeds`, and the lengths of the steps from each point but the last, (2, n)."""
    count = len(line)
    passes = np.empty((2, count))
    passes[0, -1] = end_speed
    for i in range(count - 2, -1, -1):
        radius, step = line[i, 2], step_length(line, i)
        passes[0, i] = min(
            point_speed(line, i, pace), reachable_speed(passes[0, i + 1], step, radius, pace)
        )
        passes[1, i] = step
    return passes


@compiled
def stretch_time(step: float, start: float, end: float, radius: float, pace: SpeedLimits) -> float:
    """Time for one stretch between two speeds that are reachable from each other, s.

    On a straight: speed up to the peak with peak^2 = (start^2 + end^2) / 2 + a step, then brake; if
    the peak is beyond the limit, cruise at the limit over what is left. In bends: the mean speed.
    """
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


@compiled
def travel_time(line: Array, speed: float, pace: SpeedLimits) -> float:
    """Time from the first point to a stop at the last, starting at `speed` along the line, s."""
    speeds, steps = braking_passes(line, pace, 0.0)
    total = TOO_FAST * max(0.0, speed - speeds[0]) / pace.acceleration
    now = min(speed, float(speeds[0]))
    for i in range(len(line) - 1):
        radius, step = line[i, 2], steps[i]
        following = min(speeds[i + 1], reachable_speed(now, step, radius, pace))
        total += stretch_time(step, now, following, radius, pace)
        now = following
    return float(total)


def rest_to_rest(length: Array | float, speed: float, acceleration: float) -> Array:
    """Time to go this far, m or rad, from standstill to standstill under both limits, s.

    Short of speed^2 / acceleration the limit is not reached: half of the length is a t^2 / 2 with
    half of the time. Beyond, speeding up and braking take speed / acceleration each and cover half
    of what cruising would.
    """
    short = 2.0 * np.sqrt(length / acceleration)
    found: Array = np.where(
        length < speed * speed / acceleration, short, length / speed + speed / acceleration
    )
    return found


@compiled
def speed_before(rest: float, end: float, radius: float, period: float, pace: SpeedLimits) -> float:
    """The speed for the end of this period from which `end` can be met in the distance `rest`.

    During half a period v period / 2 of the rest is covered at that speed: on a straight
    v^2 = end^2 + 2 a (rest - v period / 2), solved for v; in bends iterated twice.
    """
    half = 0.5 * pace.acceleration * period
    if radius == math.inf:
        return math.sqrt(half * half + end * end + 2.0 * pace.acceleration * rest) - half
    speed = reachable_speed(end, rest, radius, pace)
    for _ in range(2):
        left = max(0.0, rest - 0.5 * speed * period)
        speed = reachable_speed(end, left, radius, pace)
    return speed


@compiled
def next_speed(line: Array, speed: float, pace: SpeedLimits, period: float) -> float:
    """The speed to send for the end of this period, so that all bends and the end are still met.

    The base is assumed to change its speed evenly within the period.
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


@compiled
def stretch_heading(line: Array, i: int) -> float:
    """Direction from point i to the next, rad."""
    return math.atan2(line[i + 1, 1] - line[i, 1], line[i + 1, 0] - line[i, 0])


@compiled
def bend_heading(line: Array, i: int) -> float:
    """Tangent direction at point i of a bend drawn as a polyline, rad."""
    if i == 0 or step_length(line, i - 1) < 1e-9:
        return stretch_heading(line, i)
    if i == len(line) - 1 or step_length(line, i) < 1e-9:
        return stretch_heading(line, i - 1)
    before, after = stretch_heading(line, i - 1), stretch_heading(line, i)
    return before + 0.5 * turn_between(before, after)


@compiled
def heading_after(line: Array, distance: float) -> float:
    """Direction of the line at a distance from its start, rad."""
    heading = 0.0
    for i in range(len(line) - 1):
        step = step_length(line, i)
        if step < 1e-9:
            continue
        heading = stretch_heading(line, i)
        if distance <= step:
            if line[i, 2] < math.inf:
                first, last = bend_heading(line, i), bend_heading(line, i + 1)
                heading = first + turn_between(first, last) * distance / step
            return heading
        distance -= step
    return heading
