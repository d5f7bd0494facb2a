"""The search: all motions of three phases, each tried step by step, as compiled code.

A phase is one of the task's actions, held for one of its durations: an acceleration of full size in
one direction, braking, or coasting; the last phase lasts to the horizon, where the robot must
still be able to brake before a wall. A motion is given up as
soon as it is no better than the best one known, so that the result is that of trying all of them.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cobodeck.avoidable.shapes import Array, meets_walls, way_distance
from hw import compiled

PHASES = 3
TINY = 1e-9
"""Values that differ by less are equal, m: the motion with fewer phases is kept."""
COAST, BRAKE, ACCELERATE = 0.0, 1.0, 2.0
COASTS, BRAKES = 0, 1
"""The places of coasting and of braking among a task's actions."""
GAP, CENTRES, ZONES = 0, 1, 2
"""What is to be large: the gap between outlines, between centres beyond `clear`, or to the zones.
The zones are tried at the ends of steps, the others are swept."""


class Task(NamedTuple):
    """What the search is given; lengths in m, times in steps, in the map.

    Attributes:
        start: x, y, vx, vy of the robot.
        headings: cos and sin of its yaw before each step and at the end, (steps + 1, 2).
        person: x, y, direction of view, rad, likewise, (steps + 1, 3).
        walls: edges of closed rings, (n, 4).
        actions: kind and direction (unit vector), (n, 3); first to coast, then to brake.
        holds: whether a phase may end after so many steps, (steps + 1,).
        limits: acceleration, deceleration when braking, m/s2, largest speed, m/s, step, s.
        outline: half length and half width for the person, the same for walls, the disc's radius.
        aim: one of GAP, CENTRES, ZONES.
        clear: the distance of centres that counts as none.
        zones: reach ahead, half angle, rad, reach elsewhere.
        delay: number of steps in which the robot coasts before it begins.
        blind: whether the robot brakes in a step whatever the action, (steps,).
        enough: a motion that is this good ends the search.
    """

    start: Array
    headings: Array
    person: Array
    walls: Array
    actions: Array
    holds: NDArray[np.bool_]
    limits: tuple[float, float, float, float]
    outline: tuple[float, float, float, float, float]
    aim: int
    clear: float
    zones: tuple[float, float, float]
    delay: int
    blind: NDArray[np.bool_]
    enough: float


@compiled
def moved(task: Task, state: Any, action: Any) -> Any:
    """x, y, vx, vy after one step; exact but for the step in which the largest speed is reached."""
    x, y, vx, vy = state
    push, brakes, fastest, h = task.limits
    speed = math.hypot(vx, vy)
    wx, wy = vx, vy
    if action[0] == ACCELERATE:
        wx, wy = vx + push * h * action[1], vy + push * h * action[2]
        scale = max(fastest, speed) / max(math.hypot(wx, wy), 1e-9)
        if scale < 1.0:  # the nearest velocity that is allowed: within the acceleration, too
            wx, wy = scale * wx, scale * wy
    elif action[0] == BRAKE:
        if speed <= brakes * h:
            span = 0.5 * speed / brakes
            return x + span * vx, y + span * vy, 0.0, 0.0
        wx, wy = vx - brakes * h * vx / speed, vy - brakes * h * vy / speed
    return x + 0.5 * h * (vx + wx), y + 0.5 * h * (vy + wy), wx, wy


@compiled
def value(task: Task, n: int, before: Any, after: Any) -> float:
    """How good step n is, m, by the task's aim; minus infinity if a wall is touched."""
    c0, s0 = task.headings[n]
    c1, s1 = task.headings[n + 1]
    a, b, wall_a, wall_b, radius = task.outline
    poses = (before[0], before[1], c0, s0), (after[0], after[1], c1, s1)
    if len(task.walls) and meets_walls(wall_a, wall_b, poses[0], poses[1], task.walls):
        return -math.inf
    px, py = task.person[n, 0] - before[0], task.person[n, 1] - before[1]
    qx, qy = task.person[n + 1, 0] - after[0], task.person[n + 1, 1] - after[1]
    if task.aim == CENTRES:
        return way_distance(0.0, 0.0, px, py, qx, qy) - task.clear
    if task.aim == ZONES:
        return beyond_zones(task.zones, qx, qy, task.person[n + 1, 2])
    return (
        way_distance(
            a, b, c0 * px + s0 * py, c0 * py - s0 * px, c1 * qx + s1 * qy, c1 * qy - s1 * qx
        )
        - radius
    )


@compiled
def beyond_zones(zones: Any, qx: float, qy: float, view: float) -> float:
    """Distance of the robot beyond the reach of the zone in its direction, m; negative inside.

    (qx, qy) leads from the robot to the person, who looks along `view`, rad.
    """
    ahead = -qx * math.cos(view) - qy * math.sin(view)
    away = math.hypot(qx, qy)
    seen = ahead >= away * math.cos(zones[1])
    reach: float = zones[0] if seen else zones[2]
    return away - reach


@compiled
def stops_free(task: Task, state: Any) -> bool:
    """True if braking at the horizon ends before a wall."""
    x, y, vx, vy = state
    span = 0.5 * math.hypot(vx, vy) / task.limits[1]
    c, s = task.headings[-1]
    before, after = (x, y, c, s), (x + span * vx, y + span * vy, c, s)
    return not meets_walls(task.outline[2], task.outline[3], before, after, task.walls)


@compiled
def explore(task: Task, left: int, state: Any, known: Array, best: Array) -> None:
    """Try all motions that go on from `state` with exactly `left` more phases.

    `known` is the worst value so far, and for each phase its action and its last step; -1 for
    phases to come. `best` takes the best motion in the same order, if it is better by TINY.
    """
    here = 1 + 2 * int((known[1::2] >= 0.0).sum())
    begin, last = task.delay if here == 1 else int(known[here - 1]), len(task.person) - 1
    begun = known.copy()
    for action in range(len(task.actions)):
        if here > 1 and known[here - 2] == action:
            continue
        now, worst, k = state, known[0], begin
        begun[here] = action
        while k < last:
            after = moved(task, now, task.actions[BRAKES if task.blind[k] else action])
            worst = min(worst, value(task, k, now, after))
            if worst <= best[0] + TINY:
                break
            now, k = after, k + 1
            begun[0], begun[here + 1] = worst, k
            if left > 1 and k < last and task.holds[k - begin]:
                explore(task, left - 1, now, begun, best)
        else:
            if left == 1 and stops_free(task, now):
                best[:] = begun
        if best[0] > task.enough:
            return
