"""Costs of simulated drives beside a walking user: too near, too far, too late, too fast."""

from __future__ import annotations

import math

import numpy as np

from behaviors.person.drives import STEP_S, Array
from behaviors.person.margin import time_aside
from hw import compiled, example
from hw.scene import Point
from states.navigation.exact import distance_to_nearest

FAR = 4.0
"""Weight of being too far from the user, relative to being too near."""
OPEN, CORNERED = 2.5, 6.0
"""A clearance from walls below OPEN, m, costs CORNERED times the squared deficit."""
EFFORT = 0.5
"""Cost of driving, per m."""


@compiled
def crowding(
    trajectories: Array,
    predictions: Array,
    room: float,
    far: float,
    touch: float,
    dread: float,
) -> Array:
    """Cost of distances to the user outside of `room` to `far`, m, along trajectories, (n,), m2.

    Sum over the steps of the squared deficit or excess, averaged over the user's trajectories; the
    squared deficit below `touch`, m, is added `dread` times.
    """
    found = np.zeros(len(trajectories))
    for i in range(len(trajectories)):
        for j in range(len(predictions)):
            for step in range(trajectories.shape[1]):
                dx = trajectories[i, step, 0] - predictions[j, step, 0]
                dy = trajectories[i, step, 1] - predictions[j, step, 1]
                square = dx * dx + dy * dy
                if room * room <= square <= far * far:
                    continue
                distance = math.sqrt(square)
                near, beyond, close = room - distance, distance - far, touch - distance
                found[i] += max(0.0, near) ** 2 + FAR * max(0.0, beyond) ** 2
                found[i] += dread * max(0.0, close) ** 2
        found[i] /= len(predictions)
    return found


_time_aside = compiled(time_aside)


@compiled
def lateness(
    trajectories: Array, predictions: Array, contact: float, reaction: float, acceleration: float
) -> Array:
    """How much too late the robot would be at each step to get out of the user's line, (n,), s2.

    At a step the user, walking straight on, comes within `contact`, m, after the time `available`,
    and the robot needs `reaction` and `time_aside` with the velocity that it has. The squared lack
    of time is summed over the steps; the worst of the user's trajectories counts.
    """
    found = np.zeros(len(trajectories))
    for i in range(len(trajectories)):
        for j in range(len(predictions)):
            total = 0.0
            for step in range(trajectories.shape[1] - 1):
                ux, uy = predictions[j, step, 0], predictions[j, step, 1]
                c = (predictions[j, step + 1, 0] - ux) / STEP_S
                s = (predictions[j, step + 1, 1] - uy) / STEP_S
                speed = math.hypot(c, s)
                if speed < 0.1:
                    continue
                c, s = c / speed, s / speed
                x, y = trajectories[i, step, 0], trajectories[i, step, 1]
                vx = (trajectories[i, step + 1, 0] - x) / STEP_S
                vy = (trajectories[i, step + 1, 1] - y) / STEP_S
                along, lateral = c * (x - ux) + s * (y - uy), c * (y - uy) - s * (x - ux)
                if along <= 0.0 or abs(lateral) >= contact:
                    continue
                reach = along - math.sqrt(contact * contact - lateral * lateral)
                drift = c * vy - s * vx
                aside = _time_aside(lateral, drift, contact, acceleration)
                late = reaction + aside - max(0.0, reach) / speed
                total += max(0.0, late) ** 2
            found[i] = max(found[i], total)
    return found


@compiled
def haste(trajectories: Array, user: Point, keep: float, acceleration: float) -> Array:
    """Excess of the robot's closing speed to where the user is now, (n,), m2/s2.

    A user who walks away may stop and turn. A stop from the speed v takes v^2 / 2a, which must fit
    in the distance beyond `keep`, m; the squared excess of the speed is summed over the steps.
    """
    found = np.zeros(len(trajectories))
    for i in range(len(trajectories)):
        before = math.hypot(trajectories[i, 0, 0] - user[0], trajectories[i, 0, 1] - user[1])
        for step in range(1, trajectories.shape[1]):
            dx, dy = trajectories[i, step, 0] - user[0], trajectories[i, step, 1] - user[1]
            distance = math.hypot(dx, dy)
            closing = (before - distance) / STEP_S
            admitted = math.sqrt(2.0 * acceleration * max(0.0, distance - keep))
            found[i] += max(0.0, closing - admitted) ** 2
            before = distance
    return found


@compiled
def efforts(places: Array, x: float, y: float, walls: Array) -> Array:
    """Cost of driving from x, y to each place (n, 2), and of its nearness to walls, (n,)."""
    found = np.empty(len(places))
    for i in range(len(places)):
        px, py = places[i, 0], places[i, 1]
        cornered = max(0.0, OPEN - distance_to_nearest(px, py, walls))
        found[i] = EFFORT * math.hypot(px - x, py - y) + CORNERED * cornered * cornered
    return found


@example
def _example() -> None:
    trajectories, predictions = np.zeros((1, 2, 2)), np.zeros((1, 2, 3))
    crowding(trajectories, predictions, 3.0, 4.0, 1.0, 1.0)
    lateness(trajectories, predictions, 1.0, 0.1, 1.0)
    haste(trajectories, (0.0, 0.0), 1.0, 1.0)
    efforts(np.ones((1, 2)), 0.0, 0.0, np.ones((1, 4)))
