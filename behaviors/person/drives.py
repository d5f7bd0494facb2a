"""Simulated straight drives of the robot to candidate places, and the time of closing in.

The robot drives straight without turning, at the limits of its speed and acceleration, starting
with its current velocity. m, s, rad, in the map.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from behaviors.situation import Situation
from hw import USER_RADIUS, Pose2, compiled, compiled_like_numpy, example
from hw.safety import SafetyLimits, allowed_speed, nearness
from hw.scene import Point
from states.navigation import GlobalPlanner
from states.navigation.local import straight_planner

Array = NDArray[np.float64]

STEP_S = straight_planner.STEP_S
"""Step of simulated drives and lines of walk, s: that of the drive which they stand for."""


@dataclass(frozen=True, slots=True, eq=False)
class Rollouts:
    """Simulated drives: positions of the robot after each step, (n, steps, 2), in the map.

    They may be aborted, by braking, after the steps `breaks`; `slack`, m, is how much nearer to a
    wall the robot may come that starts too near to it.
    """

    trajectories: Array
    acceleration: float
    breaks: tuple[int, ...]
    slack: float

    def keeps_off(self, index: int, planner: GlobalPlanner) -> bool:
        """True if a trajectory stays clear of walls, even if it is soon aborted by braking.

        A robot that starts too near to a wall may take some steps to leave it, but not come nearer.
        """
        trajectory = self.trajectories[index, ::2].copy()
        free = planner.are_free(trajectory)
        if free.all():
            ends = _rest_places(self.trajectories[index], self.acceleration, self.breaks)
            return bool(planner.are_free(ends).all())
        if not free[-1] or (free[:-1] > free[1:]).any():
            return False
        least = planner.clearance(trajectory[0]) - self.slack
        return all(planner.clearance(place) >= least for place in trajectory[1 : free.argmax()])


def steps_of(now: Situation) -> int:
    """Number of steps of drives and lines of walk."""
    return round(now.settings.user.walks.lookahead / STEP_S)


def roll_out(now: Situation, places: Sequence[Point] | Array, max_speed: float) -> Rollouts:
    """Simulate the drives from the current pose to each place (n, 2), at up to `max_speed`, m/s."""
    pose, motion = now.pose, now.twist.rotated(now.pose.yaw)
    acceleration = now.environment.limits.base_acceleration
    goals = np.array(places, dtype=np.float64).reshape(-1, 2)
    state = (pose.x, pose.y, motion.vx, motion.vy)
    trajectories = _roll_out(state, max_speed, acceleration, goals, steps_of(now))
    beside = now.settings.user.beside
    breaks = tuple(round(after / STEP_S) for after in beside.breaks_off)
    return Rollouts(trajectories, acceleration, breaks, beside.wall_slack)


@compiled_like_numpy
def _roll_out(
    state: tuple[float, float, float, float],
    max_speed: float,
    acceleration: float,
    goals: Array,
    steps: int,
) -> Array:
    """Positions after each step, (n, steps, 2), from x, y, vx, vy.

    In each step the wanted velocity points to the goal with the speed that can still be braked,
    sqrt(2 a left), within the limit and not past the goal; the change towards it is limited to
    a STEP_S.
    """
    count = len(goals)
    x, y, vx, vy = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    x[:], y[:], vx[:], vy[:] = state
    goal_x, goal_y = goals[:, 0].copy(), goals[:, 1].copy()
    xs, ys = np.empty((steps, count)), np.empty((steps, count))
    most = acceleration * STEP_S
    for step in range(steps):
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
    trajectories = np.empty((count, steps, 2))
    for i in range(count):
        for step in range(steps):
            trajectories[i, step, 0], trajectories[i, step, 1] = xs[step, i], ys[step, i]
    return trajectories


@compiled
def _rest_places(trajectory: Array, acceleration: float, breaks: tuple[int, ...]) -> Array:
    """Where the robot would come to rest if it braked after these steps, (n, 2)."""
    places = np.empty((len(breaks), 2))
    for i, step in enumerate(breaks):
        vx = (trajectory[step + 1, 0] - trajectory[step, 0]) / STEP_S
        vy = (trajectory[step + 1, 1] - trajectory[step, 1]) / STEP_S
        stretch = math.hypot(vx, vy) / (2.0 * acceleration)
        places[i, 0] = trajectory[step, 0] + stretch * vx
        places[i, 1] = trajectory[step, 1] + stretch * vy
    return places


def closing_time(now: Situation, goal: Pose2, closing: float) -> float:
    """Time to come nearer to the user by so much, m, on the last of the way to a goal, s.

    The safety chain admits a closing speed by the gap, or that of a granted touch; the mean of its
    inverse at both ends counts.
    """
    if closing <= 0.0:
        return 0.0
    environment, user = now.environment, now.user.body
    limits = SafetyLimits.of(environment.robot, environment.limits)
    shape, stopping = limits.footprint, limits.stopping
    braking = (stopping.deceleration, stopping.reaction, stopping.clearance)
    place = goal.inverse().transform(user.x, user.y)
    gap = nearness(shape.half_length, shape.half_width, *place, USER_RADIUS).gap
    fastest = environment.navigation.haptic.max_speed
    slowness = []
    for left in (gap, gap + closing):
        admitted = allowed_speed(left, limits.uncertainty, 0.0, braking)
        slowness.append(1.0 / min(fastest, max(limits.touch_speed, admitted)))
    return 0.5 * closing * sum(slowness)


@example
def _example() -> None:
    trajectories = _roll_out((0.0, 0.0, 0.0, 0.0), 1.0, 1.0, np.ones((1, 2)), 6)
    _rest_places(trajectories[0], 1.0, (0, 2, 4))
    allowed_speed(nearness(0.5, 0.4, 1.0, 0.0, USER_RADIUS).gap, 0.0, 0.0, (3.0, 0.1, 0.35))
