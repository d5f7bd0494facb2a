"""Where the user may walk: their lines of walk, sampled, up to walls. m, s, rad, in the map."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from behaviors.person.drives import STEP_S, Array, steps_of
from behaviors.situation import Situation
from hw import compiled, example
from states.navigation.exact import distance_to_nearest, lines_cross
from states.signals import PREDICTORS, chord


def lines_of_walk(now: Situation) -> Array:
    """The lines that the user is likely to walk, (n, steps, 3).

    Who walks goes on straight or in their bend, which is likely to become tighter; who turns on the
    spot may set off at any angle of the turn.
    """
    if now.velocity.speed >= now.settings.escape.moving:
        rate = now.velocity.wz
        tighter: tuple[str, ...] = ()
        if abs(rate) >= now.settings.user.walks.bends:
            tighter = ("turns_left",) if rate > 0.0 else ("turns_right",)
        return predict_user(now, (*now.settings.user.likely, *tighter))
    turned = np.array(now.settings.user.walks.sets_off) * now.velocity.wz
    return setting_off(now, now.user.body.yaw + turned)


def predict_user(now: Situation, predictors: Sequence[str]) -> Array:
    """The user's trajectory by each predictor, (predictors, steps, 3): x, y, direction of view.

    Nobody walks through a wall: a trajectory that meets one ends there.
    """
    body, velocity = now.user.body, now.velocity
    looking = now.user.head_yaw
    chosen = (PREDICTORS[name] for name in predictors)
    numbers = np.array(
        [(p.speed, p.keeps, p.turn, p.fades, p.comes, p.least) for p in chosen], dtype=np.float64
    )
    state = np.array((body.x, body.y, body.yaw, velocity.vx, velocity.vy, velocity.wz))
    robot = np.array((now.pose.x, now.pose.y))
    found = _predictions(numbers, state, robot, now.environment.walls, steps_of(now))
    found[:, :, 2] += looking - body.yaw
    return found


_chord = compiled(chord)


@compiled
def _predictions(predictors: Array, state: Array, robot: Array, walls: Array, steps: int) -> Array:
    """`Predictor.at` for each predictor (a row with its parameters) and each step, up to a wall."""
    found = np.empty((len(predictors), steps, 3))
    clear = distance_to_nearest(state[0], state[1], walls)
    heading = math.atan2(state[4], state[3])
    dx, dy = robot[0] - state[0], robot[1] - state[1]
    for i in range(len(predictors)):
        speed, keeps, turn, fades, comes, least = predictors[i]
        pace = max(least, math.hypot(state[3], state[4]))
        rate = keeps * state[5] + turn
        before_x, before_y = state[0], state[1]
        for step in range(steps):
            ahead = STEP_S * (step + 1)
            length, off, turned = _chord(speed * pace, rate, fades, ahead)
            direction, yaw = heading + off, state[2] + turned
            if comes:
                length, direction = min(pace * ahead, math.hypot(dx, dy)), math.atan2(dy, dx)
                yaw = direction
            x = state[0] + length * math.cos(direction)
            y = state[1] + length * math.sin(direction)
            if length > clear and _is_walled_off(before_x, before_y, x, y, walls):
                found[i, step:] = np.array((before_x, before_y, yaw))
                break
            found[i, step, 0], found[i, step, 1], found[i, step, 2] = x, y, yaw
            before_x, before_y = x, y
    return found


@compiled
def _is_walled_off(px: float, py: float, qx: float, qy: float, walls: Array) -> bool:
    """True if the straight line from p to q crosses a wall."""
    for i in range(len(walls)):  # noqa: SIM110  compiled generators are slow
        if lines_cross(px, py, qx, qy, walls[i]):
            return True
    return False


def setting_off(now: Situation, angles: Array) -> Array:
    """Straight lines of a user who sets off at these angles, (n, steps, 3).

    They walk at their pace, up to a wall.
    """
    body, walks = now.user.body, now.settings.user.walks
    lengths = free_lengths(body.x, body.y, angles, now.environment.walls, walks.farthest)
    times = STEP_S * np.arange(1, steps_of(now) + 1)
    ways = np.minimum(lengths[:, None], walks.pace * times)
    x, y = body.x + ways * np.cos(angles)[:, None], body.y + ways * np.sin(angles)[:, None]
    return np.stack((x, y, np.broadcast_to(angles[:, None], x.shape)), axis=2)


@compiled
def free_lengths(x: float, y: float, angles: Array, walls: Array, farthest: float) -> Array:
    """Length of the free ray from x, y in each direction, m, at most `farthest`."""
    found = np.empty(len(angles))
    for i in range(len(angles)):
        c, s, length = math.cos(angles[i]), math.sin(angles[i]), farthest
        for j in range(len(walls)):
            ax, ay = walls[j, 0] - x, walls[j, 1] - y
            dx, dy = walls[j, 2] - walls[j, 0], walls[j, 3] - walls[j, 1]
            cross = c * dy - s * dx
            if cross == 0.0:
                continue
            along, share = (ax * dy - ay * dx) / cross, (ax * s - ay * c) / cross
            if 0.0 <= share <= 1.0 and 0.0 <= along < length:
                length = along
        found[i] = length
    return found


@example
def _example() -> None:
    free_lengths(0.0, 0.0, np.zeros(1), np.ones((1, 4)), 8.0)
    _predictions(np.ones((2, 6)), np.zeros(6), np.ones(2), np.ones((1, 4)), 3)
