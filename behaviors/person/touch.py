"""Touch: when a user who walks on would touch the outline of rover and arm on a simulated drive."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from behaviors.person.drives import STEP_S, Array, Rollouts
from behaviors.situation import Situation
from hw import USER_RADIUS, Outline, compiled, example


@dataclass(frozen=True, slots=True, eq=False)
class RolloutEvaluation:
    """Evaluation of n drives against all trajectories of the user.

    `safe_after` (n,): time until both Escape zones stay clear, s, on the worst of the user's
    trajectories (infinite: never). `gap` (n,): smallest gap between robot and user on any of them,
    m, negative in contact; `gap_soon` (n,): … until a user who is shown the sign now has stopped.
    `touch_after` (n,): time until there is a touch, s, on the best of them (infinite: never).
    """

    safe_after: Array
    gap: Array
    gap_soon: Array
    touch_after: Array


def evaluate(
    now: Situation, rollouts: Rollouts, predictions: Array, outline: Outline | None = None
) -> RolloutEvaluation:
    """Evaluate drives against the user's predicted trajectories.

    `outline` is that of rover and arm; None: of the rover alone. An arm at the user's hand, as
    after a touch, is ignored: any drive has to take it away from there.
    """
    pose, escape, outline = now.pose, now.settings.escape, _around_robot(now, outline)
    zones = (escape.ahead + escape.hysteresis, escape.around + escape.hysteresis, escape.half_view)
    stops, closest = now.settings.user.walks.stops, _closest(now)
    drives = rollouts.trajectories
    found = _evaluate(drives, predictions, pose.yaw, zones, outline, closest, stops)
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
    return now.settings.user.margins.touch + now.environment.user_margin


def _around_robot(now: Situation, outline: Outline | None) -> Outline:
    """The outline of rover and arm, or of the rover alone if the arm is at the user's hand."""
    user = now.pose.inverse().transform(now.user.body.x, now.user.body.y)
    near = USER_RADIUS + now.settings.user.margins.at_hand
    if outline is None or outline.distance(*user) < near:
        return now.environment.outline()
    return outline


@compiled
def _evaluate(
    trajectories: Array,
    predictions: Array,
    yaw: float,
    zones: tuple[float, float, float],
    outline: Outline,
    closest: float,
    stops: float,
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
                if STEP_S * step < stops:
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


@example
def _example() -> None:
    drive, walk, outline = np.zeros((1, 2, 2)), np.zeros((1, 2, 3)), Outline(0.5, 0.5, 0.4, 0.4)
    _evaluate(drive, walk, 0.0, (1.0, 1.0, 1.0), outline, 0.1, 1.0)
    _pursued(drive, (1.0, 1.0, 1.0), 0.0, outline, 0.1)
