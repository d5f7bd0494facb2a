"""Rollouts of straight drives to candidate places beside a user who keeps walking.

The robot drives straight without turning, at the limits of its speed and acceleration, starting
with its current velocity; the user follows each predicted trajectory. m, s, rad, in the map.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from behaviors.situation import Situation
from hw import USER_RADIUS, Outline, compiled, compiled_like_numpy, example
from hw.scene import Point
from states.navigation import GlobalPlanner
from states.navigation.exact import distance_to_nearest, lines_cross
from states.signals import PREDICTORS, chord

Array = NDArray[np.float64]

HORIZON_S, STEP_S = 3.0, 0.1
"""Length and step of a rollout, s."""
STEPS = round(HORIZON_S / STEP_S)
CLOSEST = 0.12
"""A predicted gap to the user below this, m, counts as a touch; see `_closest`."""
WITH_USER = USER_RADIUS + 0.2
"""With the user's centre nearer than this to the outline of rover and arm, m, the arm is taken to
be at the user's hand."""
STOPPED_S = 1.3
"""An attentive user stands this long after the sign appears, s: 0.8 s to react, 0.5 s to stop."""
SLACK = 0.01
"""How much nearer to a wall a robot may come that starts too near to it, m."""
BREAK_OFF = (0, 2, 4)
"""Steps after which the drive is assumed to be aborted, so that the robot brakes."""


@dataclass(frozen=True, slots=True, eq=False)
class Rollouts:
    """Simulated drives: positions of the robot after each step, (n, steps, 2), in the map."""

    trajectories: Array
    acceleration: float

    def keeps_off(self, index: int, planner: GlobalPlanner) -> bool:
        """True if a trajectory stays clear of walls, even if it is soon aborted by braking.

        A robot that starts too near to a wall may take some steps to leave it, but not come nearer.
        """
        trajectory = self.trajectories[index, ::2].copy()
        free = planner.are_free(trajectory)
        if free.all():
            return bool(
                planner.are_free(_rest_places(self.trajectories[index], self.acceleration)).all()
            )
        if not free[-1] or (free[:-1] > free[1:]).any():
            return False
        least = planner.clearance(trajectory[0]) - SLACK
        return all(planner.clearance(place) >= least for place in trajectory[1 : free.argmax()])


@dataclass(frozen=True, slots=True, eq=False)
class RolloutEvaluation:
    """Evaluation of n drives against all trajectories of the user.

    `safe_after` (n,): time until both Escape zones stay clear, s, on the worst of the user's
    trajectories (infinite: never). `gap` (n,): smallest gap between robot and user on any of them,
    m, negative in contact; `gap_soon` (n,): … until a user who is shown the sign now has stopped.
    `touch_after` (n,): time until the gap is below CLOSEST, s, on the best of them (infinite:
    never).
    """

    safe_after: Array
    gap: Array
    gap_soon: Array
    touch_after: Array


def roll_out(now: Situation, places: Sequence[Point] | Array, max_speed: float) -> Rollouts:
    """Simulate the drives from the current pose to each place (n, 2), at up to `max_speed`, m/s."""
    pose, motion = now.pose, now.twist.rotated(now.pose.yaw)
    acceleration = now.environment.limits.base_acceleration
    goals = np.array(places, dtype=np.float64).reshape(-1, 2)
    state = (pose.x, pose.y, motion.vx, motion.vy)
    return Rollouts(_roll_out(state, max_speed, acceleration, goals), acceleration)


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
    found = _predictions(numbers, state, robot, now.environment.walls)
    found[:, :, 2] += looking - body.yaw
    return found


def evaluate(
    now: Situation, rollouts: Rollouts, predictions: Array, outline: Outline | None = None
) -> RolloutEvaluation:
    """Evaluate drives against the user's predicted trajectories.

    `outline` is that of rover and arm; None: of the rover alone. An arm at the user's hand, as
    after a touch, is ignored: any drive has to take it away from there.
    """
    pose, escape, outline = now.pose, now.settings.escape, _around_robot(now, outline)
    zones = (escape.ahead + escape.hysteresis, escape.around + escape.hysteresis, escape.half_view)
    found = _evaluate(rollouts.trajectories, predictions, pose.yaw, zones, outline, _closest(now))
    return RolloutEvaluation(*found)


def pursued(now: Situation, rollouts: Rollouts, outline: Outline | None = None) -> Array:
    """Time until a user who always walks towards the robot touches it, on each drive, (n,), s.

    They keep their present speed and turn without delay; infinite: not within the horizon.
    """
    outline = _around_robot(now, outline)
    body = now.user.body
    state = (body.x, body.y, now.velocity.speed)
    return _pursued(rollouts.trajectories, state, now.pose.yaw, outline, _closest(now))


def _closest(now: Situation) -> float:
    """The gap that counts as a touch, by how uncertain the user's pose is, m."""
    return CLOSEST + now.environment.user_margin


def _around_robot(now: Situation, outline: Outline | None) -> Outline:
    """The outline of rover and arm, or of the rover alone if the arm is at the user's hand."""
    user = now.pose.inverse().transform(now.user.body.x, now.user.body.y)
    if outline is None or outline.distance(*user) < WITH_USER:
        return now.environment.outline()
    return outline


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


@compiled
def _evaluate(
    trajectories: Array,
    predictions: Array,
    yaw: float,
    zones: tuple[float, float, float],
    outline: Outline,
    closest: float,
) -> tuple[Array, Array, Array, Array]:
    """See `RolloutEvaluation`; `zones` are radius ahead, radius around, and half the view angle."""
    count = len(trajectories)
    safe_after, touch_after = np.zeros(count), np.zeros(count)
    gap, gap_soon = np.full(count, math.inf), np.full(count, math.inf)
    c, s, cos_view = math.cos(yaw), math.sin(yaw), math.cos(zones[2])
    for i in range(count):
        for j in range(len(predictions)):
            user, safe, touch = predictions[j], 0.0, math.inf
            for step in range(trajectories.shape[1]):
                dx = trajectories[i, step, 0] - user[step, 0]
                dy = trajectories[i, step, 1] - user[step, 1]
                distance = math.hypot(dx, dy)
                # the user in the base frame, and the distance from the rectangle `outline`
                x, y = -c * dx - s * dy, s * dx - c * dy
                along = max(0.0, x - outline.front, -outline.back - x)
                across = max(0.0, y - outline.left, -outline.right - y)
                room = math.hypot(along, across) - USER_RADIUS
                gap[i] = min(gap[i], room)
                if STEP_S * step < STOPPED_S:
                    gap_soon[i] = min(gap_soon[i], room)
                if room < closest:
                    touch = min(touch, STEP_S * (step + 1))
                inside = distance < zones[1]
                if not inside and distance < zones[0]:
                    bearing = math.atan2(dy, dx) - user[step, 2]
                    inside = math.cos(bearing) >= cos_view
                if inside:
                    safe = math.inf
                elif safe == math.inf:
                    safe = STEP_S * (step + 1)
            safe_after[i] = max(safe_after[i], safe)
            touch_after[i] = max(touch_after[i], touch)
    return safe_after, gap, gap_soon, touch_after


@compiled
def _pursued(
    trajectories: Array,
    user: tuple[float, float, float],
    yaw: float,
    outline: Outline,
    closest: float,
) -> Array:
    """See `pursued`; `user` is x, y and speed."""
    found = np.full(len(trajectories), math.inf)
    c, s = math.cos(yaw), math.sin(yaw)
    for i in range(len(trajectories)):
        ux, uy = user[0], user[1]
        for step in range(trajectories.shape[1]):
            dx, dy = trajectories[i, step, 0] - ux, trajectories[i, step, 1] - uy
            distance = math.hypot(dx, dy)
            share = min(1.0, user[2] * STEP_S / max(distance, 1e-9))
            ux, uy = ux + share * dx, uy + share * dy
            dx, dy = (1.0 - share) * dx, (1.0 - share) * dy
            x, y = -c * dx - s * dy, s * dx - c * dy
            along = max(0.0, x - outline.front, -outline.back - x)
            across = max(0.0, y - outline.left, -outline.right - y)
            if math.hypot(along, across) - USER_RADIUS < closest:
                found[i] = STEP_S * (step + 1)
                break
    return found


@compiled_like_numpy
def _roll_out(
    state: tuple[float, float, float, float], max_speed: float, acceleration: float, goals: Array
) -> Array:
    """Positions after each step, (n, STEPS, 2), from x, y, vx, vy.

    In each step the wanted velocity points to the goal with the speed that can still be braked,
    sqrt(2 a left), within the limit and not past the goal; the change towards it is limited to
    a STEP_S.
    """
    count = len(goals)
    x, y, vx, vy = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    x[:], y[:], vx[:], vy[:] = state
    goal_x, goal_y = goals[:, 0].copy(), goals[:, 1].copy()
    xs, ys = np.empty((STEPS, count)), np.empty((STEPS, count))
    most = acceleration * STEP_S
    for step in range(STEPS):
        for i in range(count):  # without a branch, so that several are computed at once
            dx, dy = goal_x[i] - x[i], goal_y[i] - y[i]
            left = math.sqrt(dx * dx + dy * dy)
            braking, soon = math.sqrt(2.0 * acceleration * left), left / STEP_S
            speed = braking if braking < max_speed else max_speed
            speed = soon if soon < speed else speed
            pace = speed / left if left > 1e-9 else 0.0
            ax, ay = pace * dx - vx[i], pace * dy - vy[i]
            change = math.sqrt(ax * ax + ay * ay)
            share = most / change if change > most else 1.0
            ax *= share
            ay *= share
            x[i] += STEP_S * (vx[i] + 0.5 * ax)
            y[i] += STEP_S * (vy[i] + 0.5 * ay)
            vx[i] += ax
            vy[i] += ay
            xs[step, i], ys[step, i] = x[i], y[i]
    trajectories = np.empty((count, STEPS, 2))
    for i in range(count):
        for step in range(STEPS):
            trajectories[i, step, 0], trajectories[i, step, 1] = xs[step, i], ys[step, i]
    return trajectories


@compiled
def _rest_places(trajectory: Array, acceleration: float) -> Array:
    """Where the robot would come to rest if it braked after the steps BREAK_OFF."""
    places = np.empty((len(BREAK_OFF), 2))
    for i, step in enumerate(BREAK_OFF):
        vx = (trajectory[step + 1, 0] - trajectory[step, 0]) / STEP_S
        vy = (trajectory[step + 1, 1] - trajectory[step, 1]) / STEP_S
        stretch = math.hypot(vx, vy) / (2.0 * acceleration)
        places[i, 0] = trajectory[step, 0] + stretch * vx
        places[i, 1] = trajectory[step, 1] + stretch * vy
    return places


@example
def _example() -> None:
    predictions = _predictions(np.ones((2, 6)), np.zeros(6), np.ones(2), np.ones((1, 4)))
    trajectories = _roll_out((0.0, 0.0, 0.0, 0.0), 1.0, 1.0, np.ones((1, 2)))
    _evaluate(trajectories, predictions, 0.0, (1.0, 1.0, 1.0), Outline(0.5, 0.5, 0.4, 0.4), 0.1)
    _rest_places(trajectories[0], 1.0)
    _pursued(trajectories, (1.0, 1.0, 1.0), 0.0, Outline(0.5, 0.5, 0.4, 0.4), 0.1)
