"""What would come of driving to one place or another while the user goes on walking.

The robot drives straight, its yaw kept, at the limits of its speed and acceleration and with the
momentum it has; the user goes along each predicted track. m, s, rad, in the map.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from behaviors.situation import Situation
from hw.geometry import STILL, Pose2, Twist2
from hw.person import RADIUS
from hw.room import Point
from states.navigation.visibility import ExactPlanner
from states.signals.prediction import PREDICTORS
from states.site import SubsystemName

Array = NDArray[np.float64]

HORIZON_S = 3.0
STEP_S = 0.1
STEPS = round(HORIZON_S / STEP_S)
CLOSEST = 0.05
"""A way that is predicted to come nearer to the user than this, m, is none."""
SLACK = 0.01
BREAK_OFF = (0, 2, 4)
"""Steps after which a drive may be broken off."""


@dataclass(frozen=True, slots=True, eq=False)
class Forecasts:
    """What is predicted for each of n places to drive to; the worst of all tracks counts.

    `safe_after` (n,): when both Escape zones are clear for good, s (infinite: never). `gap` (n,):
    the least room between robot and user, m, below 0 in contact. `touch_after` (n,): when they
    come nearer than CLOSEST even on the best of all tracks, s (infinite: never). `apart`
    (n, tracks, steps): distance of the centres. `ways` (n, steps, 2): where the robot is.
    """

    places: tuple[Point, ...]
    safe_after: Array
    gap: Array
    touch_after: Array
    apart: Array
    ways: Array
    acceleration: float

    def keeps_off(self, index: int, planner: ExactPlanner) -> bool:
        """Does the robot keep off the walls on its way to a place, momentum included?

        Nor if the drive is broken off soon, and it brakes. A robot that begins too near to a wall
        may take a while to get away, but come no nearer.
        """
        way = [(x, y) for x, y in self.ways[index, ::2].tolist()]
        free = [planner.is_free(place) for place in way]
        if all(free):
            return all(planner.is_free(place) for place in self._rests(index))
        if not free[-1] or free != sorted(free):
            return False
        least = planner.clearance(way[0]) - SLACK
        return all(planner.clearance(place) >= least for place in way[1 : free.index(True)])

    def _rests(self, index: int) -> Iterator[Point]:
        """Where the robot would come to rest if it braked after some of the first steps."""
        way = self.ways[index]
        for step in BREAK_OFF:
            vx, vy = (way[step + 1] - way[step]) / STEP_S
            stretch = math.hypot(vx, vy) / (2.0 * self.acceleration)
            yield float(way[step, 0] + stretch * vx), float(way[step, 1] + stretch * vy)


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
    now: Situation, places: Sequence[Point], user_tracks: Array, max_speed: float
) -> Forecasts:
    """Drive to each place in turn."""
    pose, motion, escape = now.pose, now.twist.rotated(now.pose.yaw), now.settings.escape
    outline = now.site.robot.footprint
    zones = np.array(
        (
            escape.ahead + escape.hysteresis,
            escape.around + escape.hysteresis,
            escape.half_view,
            outline.half_length,
            outline.half_width,
        )
    )
    state = np.array((pose.x, pose.y, pose.yaw, motion.vx, motion.vy))
    limits = np.array((max_speed, now.site.limits.base_acceleration))
    goals = np.array(places, dtype=np.float64).reshape(-1, 2)
    found = _judge(state, limits, goals, user_tracks, zones)
    return Forecasts(tuple(places), *found, now.site.limits.base_acceleration)


def towards(now: Situation, goal: Point, name: SubsystemName) -> Twist2:
    """The command (base frame) with which a forecast drives, with the speed of a subsystem.

    Standstill instead, if the robot, braking straight on in the next tick, came too near to a wall:
    whatever ends a drive stops it so.
    """
    site, pose = now.site, now.pose
    acceleration = site.limits.base_acceleration
    dx, dy = goal[0] - pose.x, goal[1] - pose.y
    left = math.hypot(dx, dy)
    if left < 1e-6:
        return STILL
    speed = min(site.navigation.named(name).max_speed, math.sqrt(2.0 * acceleration * left))
    speed = min(speed, left / STEP_S)
    wanted = Twist2(speed * dx / left, speed * dy / left)
    motion = now.twist.rotated(pose.yaw)
    ax, ay = wanted.vx - motion.vx, wanted.vy - motion.vy
    share = min(1.0, 2.0 * acceleration * site.period / max(1e-9, math.hypot(ax, ay)))
    soon = Twist2(motion.vx + share * ax, motion.vy + share * ay)
    rest = site.standstill(Pose2(pose.x, pose.y), soon)
    if not site.planner(name).allows((pose.x, pose.y), (rest.x, rest.y)):
        return STILL
    return wanted.rotated(-pose.yaw)


@njit(cache=True)
def crowding(apart: Array, room: float, far: float, touch: float, dread: float) -> Array:
    """How badly distances (n, tracks, steps) keep between `room` and `far`, (n,).

    Squares of what is missing, in the mean of all tracks; below `touch` times `dread`.
    """
    found = np.zeros(len(apart))
    for i in range(len(apart)):
        for distance in apart[i].ravel():
            near, beyond, close = room - distance, distance - far, touch - distance
            found[i] += max(0.0, near) ** 2 + max(0.0, beyond) ** 2 + dread * max(0.0, close) ** 2
        found[i] /= apart.shape[1]
    return found


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
            turned = rate * fades * (1.0 - math.exp(-ahead / fades))
            shorter = math.sin(0.5 * turned) / (0.5 * turned) if turned != 0.0 else 1.0
            way = speed * pace * ahead * shorter
            direction, yaw = heading + fades * (rate - turned / ahead), state[2] + turned
            if comes:
                way, direction = min(pace * ahead, math.hypot(dx, dy)), math.atan2(dy, dx)
                yaw = direction
            found[i, step, 0] = state[0] + way * math.cos(direction)
            found[i, step, 1] = state[1] + way * math.sin(direction)
            found[i, step, 2] = yaw
    return found


@njit(cache=True)
def _judge(
    state: Array, limits: Array, goals: Array, user_tracks: Array, zones: Array
) -> tuple[Array, Array, Array, Array, Array]:
    count, track_count, steps = len(goals), user_tracks.shape[0], user_tracks.shape[1]
    safe_after, gap = np.zeros(count), np.full(count, math.inf)
    touch_after = np.zeros(count)
    apart, ways = np.empty((count, track_count, steps)), np.empty((count, steps, 2))
    c, s, cos_view = math.cos(state[2]), math.sin(state[2]), math.cos(zones[2])
    for i in range(count):
        ways[i] = _drive(state, limits, goals[i], steps)
        for j in range(track_count):
            track, safe, touch = user_tracks[j], 0.0, math.inf
            for step in range(steps):
                dx, dy = ways[i, step, 0] - track[step, 0], ways[i, step, 1] - track[step, 1]
                distance = math.hypot(dx, dy)
                apart[i, j, step] = distance
                along, across = abs(c * dx + s * dy) - zones[3], abs(c * dy - s * dx) - zones[4]
                room = math.hypot(max(0.0, along), max(0.0, across)) - RADIUS
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
    return safe_after, gap, touch_after, apart, ways


@njit(cache=True)
def _drive(state: Array, limits: Array, goal: Array, steps: int) -> Array:
    places = np.empty((steps, 2))
    x, y, _, vx, vy = state
    max_speed, acceleration = limits
    for step in range(steps):
        dx, dy = goal[0] - x, goal[1] - y
        left = math.hypot(dx, dy)
        speed = min(max_speed, math.sqrt(2.0 * acceleration * left), left / STEP_S)
        wx, wy = (speed * dx / left, speed * dy / left) if left > 1e-9 else (0.0, 0.0)
        change = math.hypot(wx - vx, wy - vy)
        share = min(1.0, acceleration * STEP_S / change) if change > 0.0 else 0.0
        ax, ay = share * (wx - vx), share * (wy - vy)
        x, y = x + STEP_S * (vx + 0.5 * ax), y + STEP_S * (vy + 0.5 * ay)
        vx, vy = vx + ax, vy + ay
        places[step, 0], places[step, 1] = x, y
    return places


def warm_up() -> None:
    """Compile, or load from the cache."""
    user_tracks = _tracks(np.ones((2, 6)), np.zeros(6), np.ones(2))
    *_, apart, _ = _judge(np.zeros(5), np.ones(2), np.ones((1, 2)), user_tracks, np.ones(5))
    crowding(apart, 3.0, 4.0, 1.0, 1.0)
