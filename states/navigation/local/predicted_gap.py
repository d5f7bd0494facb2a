"""Predicted gap between the robot on a path and a walking user: both positions at equal times.

The user is assumed to keep their velocity for HORIZON s; the robot drives its line as fast as
allowed, or brakes in its present direction. Gaps are from the robot's centre to the user's disc, m.
"""

from __future__ import annotations

import math

from hw import compiled
from hw.scene import Disc, Point
from states.navigation.exact import Array, distance_to_segment
from states.navigation.local.speed_profile import (
    SpeedLimits,
    braking_speeds,
    reachable_speed,
    step_length,
)

HORIZON = 2.5
"""How far ahead a walking user is predicted, s."""
STEP = 0.15
"""Spacing of the positions on the line that are compared, m."""

WalkerState = tuple[float, float, float, float, float, float]
"""The user's disc x, y, radius, its velocity vx, vy in the map, and the rate at which the radius
grows for the uncertainty of the velocity, m/s."""


@compiled
def seen_from_user(x: float, y: float, time: float, walker: WalkerState) -> tuple[float, float]:
    """Position in the map relative to where the user will be after `time` s."""
    return x - walker[0] - time * walker[3], y - walker[1] - time * walker[4]


@compiled
def nearest_between(first: tuple[float, float], second: tuple[float, float]) -> float:
    """Least distance to the user on a straight line between two positions relative to them, m."""
    return float(distance_to_segment(0.0, 0.0, first[0], first[1], second[0], second[1]))


@compiled
def least_gap_standing(x: float, y: float, since: float, walker: WalkerState) -> float:
    """Least distance to the user, less the growth of their disc, while standing until HORIZON."""
    least, parts = math.inf, 5
    step = max(0.0, HORIZON - since) / parts
    before = seen_from_user(x, y, since, walker)
    for k in range(1, parts + 1):
        time = since + k * step
        after = seen_from_user(x, y, time, walker)
        least = min(least, nearest_between(before, after) - time * walker[5])
        before = after
    return least


@compiled
def least_gap_on(line: Array, speed: float, walker: WalkerState, pace: SpeedLimits) -> float:
    """Least gap while driving a line, starting at `speed`, until HORIZON."""
    limits = braking_speeds(line, pace, 0.0)
    now, time = min(speed, limits[0]), 0.0
    before = seen_from_user(line[0, 0], line[0, 1], 0.0, walker)
    least = math.inf
    for i in range(len(line) - 1):
        length = step_length(line, i)
        parts = max(1, math.ceil(length / STEP))
        for k in range(parts):
            part, left = (k + 1) / parts, length * (parts - 1 - k) / parts
            limit = min(pace.speed, reachable_speed(limits[i + 1], left, line[i, 2], pace))
            following = min(limit, reachable_speed(now, length / parts, line[i, 2], pace))
            lasts = 2.0 * length / parts / max(1e-3, now + following)
            time, now = time + lasts, following
            x = line[i, 0] + part * (line[i + 1, 0] - line[i, 0])
            y = line[i, 1] + part * (line[i + 1, 1] - line[i, 1])
            after = seen_from_user(x, y, time, walker)
            if time > HORIZON:
                rest = 1.0 - (time - HORIZON) / lasts
                rx, ry = after[0] - before[0], after[1] - before[1]
                after = before[0] + rest * rx, before[1] + rest * ry
                last = nearest_between(before, after) - HORIZON * walker[5]
                return min(least, last) - walker[2]
            least = min(least, nearest_between(before, after) - time * walker[5])
            before = after
    # having arrived the robot stands there
    return min(least, least_gap_standing(line[-1, 0], line[-1, 1], time, walker)) - walker[2]


@compiled
def least_gap_braking(
    x: float, y: float, vx: float, vy: float, walker: WalkerState, pace: SpeedLimits
) -> float:
    """Least gap while braking to standstill and standing there until HORIZON."""
    stop = math.hypot(vx, vy) / pace.acceleration
    before = seen_from_user(x, y, 0.0, walker)
    least = math.inf
    for k in range(1, 11):
        time = stop * k / 10.0
        # braking evenly within `stop`: distance over initial speed
        moved = time - 0.5 * time * time / stop if stop > 0.0 else 0.0
        after = seen_from_user(x + vx * moved, y + vy * moved, time, walker)
        least = min(least, nearest_between(before, after) - time * walker[5])
        before = after
    stands = least_gap_standing(x + 0.5 * vx * stop, y + 0.5 * vy * stop, stop, walker)
    return min(least, stands) - walker[2]


def predicted_disc(user: Disc, velocity: Point, time: float, robot: Point) -> Disc:
    """The user's disc after a time, s, made smaller where it would cover the robot."""
    x, y = user.x + time * velocity[0], user.y + time * velocity[1]
    away = math.dist((x, y), robot)
    return Disc(x, y, min(user.radius, max(0.1, away - 1e-3)) if time > 0.0 else user.radius)


def steps_aside(user: Disc, velocity: Point, robot: Point, margin: float) -> list[Point]:
    """Positions beside the robot, left and right of the user's course, that they will pass."""
    speed = math.hypot(*velocity)
    nx, ny = -velocity[1] / speed, velocity[0] / speed
    offset = (robot[0] - user.x) * nx + (robot[1] - user.y) * ny
    reach = user.radius + margin
    return [
        (robot[0] + (side * reach - offset) * nx, robot[1] + (side * reach - offset) * ny)
        for side in (1.0, -1.0)
    ]
