"""What would come of driving to one place or another while the user goes on walking.

The robot drives straight, its yaw kept, at the limits of its speed and acceleration and with the
momentum it has; the user goes along each predicted track. m, s, rad, in the map.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from behaviors.situation import Situation
from hw.geometry import STILL, Outline, Twist2
from hw.people.person import RADIUS
from hw.room import Point
from states.environment import SubsystemName
from states.navigation.local_planner import GlobalPlanner
from states.signals.prediction import PREDICTORS, chord

Array = NDArray[np.float64]

HORIZON_S = 3.0
STEP_S = 0.1
STEPS = round(HORIZON_S / STEP_S)
CLOSEST = 0.12
"""A way that is predicted to come nearer to the user than this, m, is none."""
WITH_USER = RADIUS + 0.2
"""An arm nearer than this to the middle of the user is with them, m."""
SLACK = 0.01
BREAK_OFF = (0, 2, 4)
"""Steps after which a drive may be broken off."""


@dataclass(frozen=True, slots=True, eq=False)
class Drives:
    """Straight drives to `places` (n, 2); `ways` (n, steps, 2) is where the robot is meanwhile."""

    places: Array
    ways: Array
    acceleration: float

    def keeps_off(self, index: int, planner: GlobalPlanner) -> bool:
        """Does the robot keep off the walls on its way to a place, momentum included?

        Nor if the drive is broken off soon, and it brakes. A robot that begins too near to a wall
        may take a while to get away, but come no nearer.
        """
        way = self.ways[index, ::2].copy()
        free = planner.are_free(way)
        if free.all():
            return bool(planner.are_free(_rests(self.ways[index], self.acceleration)).all())
        if not free[-1] or (free[:-1] > free[1:]).any():
            return False
        least = planner.clearance(way[0]) - SLACK
        return all(planner.clearance(place) >= least for place in way[1 : free.argmax()])


@dataclass(frozen=True, slots=True, eq=False)
class Forecasts:
    """What comes of each of n drives; the worst of all tracks counts.

    `safe_after` (n,): when both Escape zones are clear for good, s (infinite: never). `gap` (n,):
    the least room between robot and user, m, below 0 in contact. `touch_after` (n,): when they
    come nearer than CLOSEST even on the best of all tracks, s (infinite: never).
    """

    safe_after: Array
    gap: Array
    touch_after: Array


def drives(now: Situation, places: Sequence[Point] | Array, max_speed: float) -> Drives:
    """The drives from here to each place."""
    pose, motion = now.pose, now.twist.rotated(now.pose.yaw)
    acceleration = now.environment.limits.base_acceleration
    goals = np.array(places, dtype=np.float64).reshape(-1, 2)
    state = (pose.x, pose.y, motion.vx, motion.vy)
    return Drives(goals, _drives(state, max_speed, acceleration, goals), acceleration)


def tracks(now: Situation, predictors: Sequence[str]) -> Array:
    """Where each predictor sees the user, (predictors, steps, 3): x, y, direction of view."""
    body, velocity = now.user.body, now.velocity
    looking = now.user.head_yaw if now.settings.escape.view == "head" else body.yaw
    chosen = (PREDICTORS[name] for name in predictors)
    numbers = np.array(
        [(p.speed, p.keeps, p.turn, p.fades, p.comes, p.least) for p in chosen], dtype=np.float64
    )
    state = np.array((body.x, body.y, body.yaw, velocity.vx, velocity.vy, velocity.wz))
    found = _tracks(numbers, state, np.array((now.pose.x, now.pose.y)))
    found[:, :, 2] += looking - body.yaw
    return found


def forecasts(
    now: Situation, found: Drives, user_tracks: Array, outline: Outline | None = None
) -> Forecasts:
    """What comes of the drives while the user goes along the tracks.

    `outline` is that of rover and arm; None: of the rover alone. An arm that is with the user, as
    after a touch, does not count: it has to get away from there.
    """
    pose, escape, user = now.pose, now.settings.escape, now.user.body
    zones = (escape.ahead + escape.hysteresis, escape.around + escape.hysteresis, escape.half_view)
    if outline is None or outline.distance(*pose.inverse().transform(user.x, user.y)) < WITH_USER:
        outline = now.environment.outline()
    return Forecasts(*_judge(found.ways, user_tracks, pose.yaw, zones, outline))


def towards(now: Situation, goal: Point, name: SubsystemName) -> Twist2:
    """The command (base frame) with which a forecast drives, with the speed of a subsystem.

    Standstill instead, if the robot, braking straight on in the next tick, came too near to a wall:
    whatever ends a drive stops it so.
    """
    environment, pose, twist = now.environment, now.pose, now.twist
    acceleration = environment.limits.base_acceleration
    dx, dy = goal[0] - pose.x, goal[1] - pose.y
    left = math.hypot(dx, dy)
    if left < 1e-6:
        return STILL
    speed = min(environment.navigation.named(name).max_speed, math.sqrt(2.0 * acceleration * left))
    pace = min(speed / left, 1.0 / STEP_S)
    wanted_x, wanted_y = pace * dx, pace * dy
    motion = twist.rotated(pose.yaw)
    ax, ay = wanted_x - motion.vx, wanted_y - motion.vy
    share = min(1.0, 2.0 * acceleration * environment.period / max(1e-9, math.hypot(ax, ay)))
    vx, vy = motion.vx + share * ax, motion.vy + share * ay
    braking = math.hypot(vx, vy) / (2.0 * acceleration)
    rest = (pose.x + braking * vx, pose.y + braking * vy)
    if not now.planners[name].allows((pose.x, pose.y), rest):
        return STILL
    return Twist2(wanted_x, wanted_y).rotated(-pose.yaw)


@njit(cache=True)
def crowding(
    ways: Array, user_tracks: Array, room: float, far: float, touch: float, dread: float
) -> Array:
    """How badly robots on their ways keep between `room` and `far` of the user, (n,).

    Squares of what is missing, m2, in the mean of all tracks; below `touch` times `dread`.
    """
    found = np.zeros(len(ways))
    for i in range(len(ways)):
        for j in range(len(user_tracks)):
            for step in range(ways.shape[1]):
                dx = ways[i, step, 0] - user_tracks[j, step, 0]
                dy = ways[i, step, 1] - user_tracks[j, step, 1]
                square = dx * dx + dy * dy
                if room * room <= square <= far * far:
                    continue
                distance = math.sqrt(square)
                near, beyond, close = room - distance, distance - far, touch - distance
                found[i] += max(0.0, near) ** 2 + max(0.0, beyond) ** 2
                found[i] += dread * max(0.0, close) ** 2
        found[i] /= len(user_tracks)
    return found


_chord = njit(cache=True)(chord)


@njit(cache=True)
def _tracks(predictors: Array, state: Array, robot: Array) -> Array:
    """`Predictor.at` for each predictor, a row with its numbers, and each step."""
    found = np.empty((len(predictors), STEPS, 3))
    heading = math.atan2(state[4], state[3])
    dx, dy = robot[0] - state[0], robot[1] - state[1]
    for i in range(len(predictors)):
        speed, keeps, turn, fades, comes, least = predictors[i]
        pace = max(least, math.hypot(state[3], state[4]))
        rate = keeps * state[5] + turn
        for step in range(STEPS):
            ahead = STEP_S * (step + 1)
            length, off, turned = _chord(speed * pace, rate, fades, ahead)
            direction, yaw = heading + off, state[2] + turned
            if comes:
                length, direction = min(pace * ahead, math.hypot(dx, dy)), math.atan2(dy, dx)
                yaw = direction
            found[i, step, 0] = state[0] + length * math.cos(direction)
            found[i, step, 1] = state[1] + length * math.sin(direction)
            found[i, step, 2] = yaw
    return found


@njit(cache=True)
def _judge(
    ways: Array,
    user_tracks: Array,
    yaw: float,
    zones: tuple[float, float, float],
    outline: Outline,
) -> tuple[Array, Array, Array]:
    count = len(ways)
    safe_after, gap, touch_after = np.zeros(count), np.full(count, math.inf), np.zeros(count)
    c, s, cos_view = math.cos(yaw), math.sin(yaw), math.cos(zones[2])
    for i in range(count):
        for j in range(len(user_tracks)):
            track, safe, touch = user_tracks[j], 0.0, math.inf
            for step in range(ways.shape[1]):
                dx, dy = ways[i, step, 0] - track[step, 0], ways[i, step, 1] - track[step, 1]
                distance = math.hypot(dx, dy)
                x, y = -c * dx - s * dy, s * dx - c * dy
                along = max(0.0, x - outline.front, -outline.back - x)
                across = max(0.0, y - outline.left, -outline.right - y)
                room = math.hypot(along, across) - RADIUS
                gap[i] = min(gap[i], room)
                if room < CLOSEST:
                    touch = min(touch, STEP_S * (step + 1))
                inside = distance < zones[1]
                if not inside and distance < zones[0]:
                    bearing = math.atan2(dy, dx) - track[step, 2]
                    inside = math.cos(bearing) >= cos_view
                if inside:
                    safe = math.inf
                elif safe == math.inf:
                    safe = STEP_S * (step + 1)
            safe_after[i] = max(safe_after[i], safe)
            touch_after[i] = max(touch_after[i], touch)
    return safe_after, gap, touch_after


@njit(cache=True, error_model="numpy")
def _drives(
    state: tuple[float, float, float, float], max_speed: float, acceleration: float, goals: Array
) -> Array:
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
    ways = np.empty((count, STEPS, 2))
    for i in range(count):
        for step in range(STEPS):
            ways[i, step, 0], ways[i, step, 1] = xs[step, i], ys[step, i]
    return ways


@njit(cache=True)
def _rests(way: Array, acceleration: float) -> Array:
    """Where the robot would come to rest if it braked after some of the first steps."""
    places = np.empty((len(BREAK_OFF), 2))
    for i, step in enumerate(BREAK_OFF):
        vx = (way[step + 1, 0] - way[step, 0]) / STEP_S
        vy = (way[step + 1, 1] - way[step, 1]) / STEP_S
        stretch = math.hypot(vx, vy) / (2.0 * acceleration)
        places[i, 0] = way[step, 0] + stretch * vx
        places[i, 1] = way[step, 1] + stretch * vy
    return places


def warm_up() -> None:
    """Compile, or load from the cache."""
    user_tracks = _tracks(np.ones((2, 6)), np.zeros(6), np.ones(2))
    ways = _drives((0.0, 0.0, 0.0, 0.0), 1.0, 1.0, np.ones((1, 2)))
    _judge(ways, user_tracks, 0.0, (1.0, 1.0, 1.0), Outline(0.5, 0.5, 0.4, 0.4))
    _rests(ways[0], 1.0)
    crowding(ways, user_tracks, 3.0, 4.0, 1.0, 1.0)
