"""Where the user may walk: their lines of walk, sampled, up to walls. m, s, rad, in the map."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from behaviors.person.drives import STEP_S, STEPS, Array
from behaviors.situation import Situation
from hw import compiled, example
from states.navigation.exact import distance_to_nearest, lines_cross
from states.signals import PREDICTORS, chord


def predict_user(now: Situation, predictors: Sequence[str]) -> Array:
    """The user's trajectory by each predictor, (predictors, steps, 3): x, y, direction of view.

    Nobody walks through a wall: a trajectory that meets one ends there.
    """
    body, velocity = now.user.body, now.velocity
    looking = now.user.head_yaw if now.settings.escape.view == "head" else body.yaw
    chosen = (PREDICTORS[name] for name in predictors)
    numbers = np.array(
        [(p.speed, p.keeps, p.turn, p.fades, p.comes, p.least) for p in chosen], dtype=np.float64
    )
    state = np.array((body.x, body.y, body.yaw, velocity.vx, velocity.vy, velocity.wz))
    robot = np.array((now.pose.x, now.pose.y))
    found = _predictions(numbers, state, robot, now.environment.walls)
    found[:, :, 2] += looking - body.yaw
    return found


_chord = compiled(chord)


@compiled
def _predictions(predictors: Array, state: Array, robot: Array, walls: Array) -> Array:
    """`Predictor.at` for each predictor (a row with its parameters) and each step, up to a wall."""
    found = np.empty((len(predictors), STEPS, 3))
    clear = distance_to_nearest(state[0], state[1], walls)
    heading = math.atan2(state[4], state[3])
    dx, dy = robot[0] - state[0], robot[1] - state[1]
    for i in range(len(predictors)):
        speed, keeps, turn, fades, comes, least = predictors[i]
        pace = max(least, math.hypot(state[3], state[4]))
        rate = keeps * state[5] + turn
        before_x, before_y = state[0], state[1]
        for step in range(STEPS):
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


@example
def _example() -> None:
    _predictions(np.ones((2, 6)), np.zeros(6), np.ones(2), np.ones((1, 4)))
