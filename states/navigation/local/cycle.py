"""What every local planner computes in each cycle, compiled: where all are, and how to brake.

Velocities are in the map unless said otherwise. `rates` are the limits of the drive, (4,): speed,
acceleration, turn rate and its acceleration. m, s, rad.
"""

from __future__ import annotations

import math

from hw import compiled, wrapped
from hw.scene import Point
from states.navigation.exact import Array, Circle, Triple
from states.navigation.local.reckoning import (
    lose_track,
    reckon_place,
    reckon_pose,
)

LOST_TRACK = 0.3
"""If measured and sent velocity differ by more, m/s, planning starts from the measured one."""
EDGE_OF_DISC = 1e-6
"""Rounding of a disc that ends at the goal, m."""
ASIDE = 0.35
"""The user is seen from the robot's nearest side in a direction that differs by this from that seen
from its centre, rad."""
SHARES = (1.0, 0.75, 0.5, 0.25)
"""Shares of the wanted change of velocity that are tried."""
NONE, IN_MAP, IN_BASE = 0, 1, 2
"""Whether it is known what velocity the base was given, and in which frame it is."""


@compiled
def rotated(vx: float, vy: float, yaw: float) -> Point:
    """A velocity turned by yaw."""
    c, s = math.cos(yaw), math.sin(yaw)
    return c * vx - s * vy, s * vx + c * vy


@compiled
def perceive(
    track: Array, place: Array, seen: Array, given: int, aim: Array, dt: float, arrived: bool
) -> tuple[Triple, Triple, Circle, bool]:
    """Robot and user at the instant from which the velocity sent now acts, by all seen so far.

    Args:
        track: of the robot, see `reckoning`; updated.
        place: of the user, likewise.
        seen: measured pose, map_from_base; measured velocity and, if `given`, the one that the base
            was given; the user's disc (radius below 0: none) and velocity (14,).
        given: one of NONE, IN_MAP, IN_BASE; the measured velocity is in the base frame.
        aim: goal, and tolerances of position, yaw and speed (6,).
        dt: time since the last cycle.
        arrived: whether the robot had arrived at the goal; if so, tolerances count twice.

    Returns:
        Pose, velocity, the user's disc, and whether the robot has arrived.
    """
    pose = seen[0], seen[1], wrapped(seen[2])
    vx, vy = rotated(seen[3], seen[4], pose[2])
    measured = now = vx, vy, seen[5]
    if given != NONE:
        gx, gy = seen[6], seen[7]
        if given == IN_BASE:
            gx, gy = rotated(gx, gy, pose[2])
        now = gx, gy, seen[8]
    dx, dy, dw = now[0] - measured[0], now[1] - measured[1], now[2] - measured[2]
    if dx * dx + dy * dy + dw * dw > LOST_TRACK * LOST_TRACK:
        now = measured
        lose_track(track)
    pose = reckon_pose(track, pose, measured, now, dt)
    goal = aim[0], aim[1]
    user = reckoned_disc(place, (seen[9], seen[10], seen[11]), (seen[12], seen[13]), goal, dt)
    return pose, now, user, has_arrived(pose, now, aim, arrived)


@compiled
def reckoned_disc(place: Array, disc: Circle, velocity: Point, goal: Point, dt: float) -> Circle:
    """The disc at the user's reckoned place; a goal outside of it as measured stays outside."""
    x, y, radius = disc
    if radius < 0.0:
        place[:] = 0.0
        return disc
    px, py = reckon_place(place, (x, y), velocity, dt)
    if math.hypot(x - goal[0], y - goal[1]) >= radius - EDGE_OF_DISC:
        radius = min(radius, math.hypot(px - goal[0], py - goal[1]))
    return px, py, radius


@compiled
def has_arrived(pose: Triple, now: Triple, aim: Array, before: bool) -> bool:
    """True within all tolerances, or, after an arrival, within twice those of the pose."""
    away = math.hypot(aim[0] - pose[0], aim[1] - pose[1])
    turned = abs(wrapped(aim[2] - pose[2]))
    if before and away <= 2.0 * aim[3] and turned <= 2.0 * aim[4]:
        return True
    is_slow = math.hypot(now[0], now[1]) <= aim[5] and abs(now[2]) <= aim[5]
    return bool(away <= aim[3] and turned <= aim[4] and is_slow)


@compiled
def braked(now: Triple, rates: Array, dt: float) -> Triple:
    """The velocity after one period of braking."""
    vx, vy, wz = now
    speed, slower = math.hypot(vx, vy), rates[3] * dt
    scale = max(0.0, 1.0 - rates[1] * dt / speed) if speed else 0.0
    return scale * vx, scale * vy, wz - max(-slower, min(slower, wz))


@compiled
def turn_rate(error: float, turning: float, rates: Array, dt: float) -> float:
    """The turn rate for the end of this period that still ends the turn by `error`, rad/s.

    The largest rate w that can still be braked: w^2 / (2 a) is covered while braking and half
    of w dt in this period, so w = sqrt((a dt / 2)^2 + 2 a rest) - a dt / 2.
    """
    half = 0.5 * rates[3] * dt
    rest = max(0.0, abs(error) - 0.5 * math.copysign(1.0, error) * turning * dt)
    rate = math.sqrt(half * half + 2.0 * rates[3] * rest) - half
    wanted = math.copysign(min(rates[2], rate), error)
    return float(max(turning - 2.0 * half, min(turning + 2.0 * half, wanted)))


@compiled
def ways_to_stop(  # noqa: PLR0913 - what a cycle knows
    place: Point,
    now: Triple,
    wanted: Triple,
    user: Circle,
    rates: Array,
    dt: float,
    turns: bool,
    tight: bool,
    velocities: Array,
    ways: Array,
) -> None:
    """Write the velocities that may be sent, the best first, and where braking from each ends.

    The former, (6, 3), are the shares of the wanted change of velocity, then braking with the
    wanted turn rate (if the base `turns` as it likes), then braking the turn, too. Where it is
    `tight` the turn is always braked: a corner of the robot could swing towards a wall.

    A way, of each but the last, (5, 10), has x, y after the period, where the robot stands after
    braking then, and where if the safety chain takes out the part of the velocity that closes the
    gap to the user, whom it may see on either side of the direction from the robot's centre.
    """
    bx, by, bw = braked(now, rates, dt)
    turn = bw if tight else wanted[2]
    for i in range(6):
        part = SHARES[i] if i < 4 else 0.0
        vx, vy = bx, by
        if i < 4:
            vx, vy = bx + part * (wanted[0] - bx), by + part * (wanted[1] - by)
        velocities[i, 0], velocities[i, 1], velocities[i, 2] = vx, vy, turn
        if i == 5 or (i == 4 and not turns):
            velocities[i, 2] = bw
        if i == 5:
            break
        x, y = place[0] + 0.5 * (now[0] + vx) * dt, place[1] + 0.5 * (now[1] + vy) * dt
        ways[i, 0], ways[i, 1] = x, y
        ways[i, 2], ways[i, 3] = standstill(x, y, vx, vy, rates)
        held_back(ways[i], vx, vy, user, rates)


@compiled
def standstill(x: float, y: float, vx: float, vy: float, rates: Array) -> Point:
    """Where braking ends: it covers v^2 / 2a, the velocity times v / 2a."""
    time = 0.5 * math.hypot(vx, vy) / rates[1]
    return x + vx * time, y + vy * time


@compiled
def held_back(way: Array, vx: float, vy: float, user: Circle, rates: Array) -> None:
    """Write where the robot ends that is held off the user, after the first period of a way."""
    x, y = way[0], way[1]
    at = math.atan2(user[1] - y, user[0] - x)
    for i, off in enumerate((0.0, ASIDE, -ASIDE)):
        nx, ny = math.cos(at + off), math.sin(at + off)
        toward = max(0.0, vx * nx + vy * ny)
        way[4 + 2 * i], way[5 + 2 * i] = standstill(x, y, vx - toward * nx, vy - toward * ny, rates)
