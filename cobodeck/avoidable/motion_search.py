"""What a robot could have done: the best of several hundred thousand motions of three phases.

The robot keeps its yaw; rotation that it has at the start is braked. Everything is in the map, in
m, s and rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from cobodeck.avoidable.motions import (
    ACCELERATE,
    BRAKE,
    BRAKES,
    COAST,
    COASTS,
    GAP,
    PHASES,
    Task,
    beyond_zones,
    explore,
    moved,
    value,
)
from cobodeck.avoidable.shapes import Array, overlaps_walls
from hw import wrap

RADIUS = 0.5
"""Radius of a person, m."""
ZONES = (2.5, math.radians(36.0), 1.5)
"""The Escape zones: reach ahead, m, its half angle, rad, reach elsewhere, m."""
NEAR = 1.27
"""Distance of centres, m, at which robot and person may touch, whatever the robot's yaw."""
STEP_S = 0.05
INSETS = (0.0, 0.01, 0.05, 0.2)
"""The outline is smaller for walls by the first of these that lets the robot start free, m."""
_EXACT = 1e-9
NO_WALLS = np.zeros((0, 4))


@dataclass(frozen=True, slots=True)
class RobotState:
    """Pose and velocity in the map; `wz` is the yaw rate."""

    x: float
    y: float
    yaw: float
    vx: float = 0.0
    vy: float = 0.0
    wz: float = 0.0


@dataclass(frozen=True, slots=True)
class RobotLimits:
    """Limits of the base, and half length and half width of its outline with foam, m.

    `braking` is what the safety chain may brake with, straight ahead, m/s2.
    """

    acceleration: float
    braking: float
    speed: float
    half_length: float
    half_width: float
    yaw_acceleration: float = 2.0


@dataclass(frozen=True, slots=True)
class Walk:
    """Where a person will be: times (n,), rising, and x, y, direction of view (n, 3)."""

    times: Array
    places: Array

    def at(self, times: Any) -> Array:
        """x, y and direction of view at these times, (m, 3); at rest before and after."""
        views = np.unwrap(self.places[:, 2])
        columns = (self.places[:, 0], self.places[:, 1], views)
        return np.stack([np.interp(times, self.times, column) for column in columns], axis=1)


@dataclass(frozen=True, slots=True)
class SearchGrid:
    """Which motions are tried: time step, s, number of directions, durations of phases, s."""

    step_s: float = STEP_S
    directions: int = 24
    holds_s: tuple[float, ...] = (0.2, 0.4, 0.7, 1.1, 1.6)


USUAL = SearchGrid()


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked of the search.

    `walls` are edges of closed rings (n, 4). The robot coasts for `delay_s`, brakes within the
    spans `blind_s`, from and to, and is judged until `horizon_s`. `aim` and `near` are the task's
    (`motions.Task.aim`, `clear`). With `one_side` only motions to the left of the person are tried:
    enough where both sides are the same. `grid` is how finely the search looks.
    """

    robot: RobotState
    limits: RobotLimits
    walk: Walk
    start_s: float = 0.0
    horizon_s: float = 3.0
    delay_s: float = 0.0
    blind_s: tuple[tuple[float, float], ...] = ()
    walls: Array = field(default_factory=lambda: NO_WALLS)
    aim: int = GAP
    near: float = NEAR
    one_side: bool = False
    grid: SearchGrid = USUAL


@dataclass(frozen=True, slots=True)
class BestMotion:
    """The best motion found.

    Attributes:
        gap: the least value of the aim on the way, m; of outlines, at most 0 in contact.
        times: (n,), from the question's `start_s` on; `poses` (n, 3) of the robot at these.
        phases: action and duration, s, of each phase.
        clear_s: time after the start from which it is out of both zones for good; None: never.
        tried: number of motions of which it is the best.
    """

    gap: float
    times: Array
    poses: Array
    phases: tuple[tuple[str, float], ...]
    clear_s: float | None
    tried: int

    @property
    def free(self) -> bool:
        """True if nothing was touched."""
        return self.gap > 0.0


def best_motion(question: Question) -> BestMotion | None:
    """The motion with the largest least gap; None if each one touches a wall."""
    task = _task(question, math.inf)
    best = _search(task, -math.inf)
    return None if best[0] == -math.inf else _motion(question, task, best)


def is_avoidable(question: Question, margin: float = 0.0) -> bool:
    """True if some motion keeps the aim's value above `margin`, m, all the way."""
    return bool(_search(_task(question, margin), margin)[0] > margin)


def _search(task: Task, bound: float) -> Array:
    """The worst value of the best motion, and its phases; those up to `bound` are not looked for.

    While the robot coasts it has no choice, so that a wall is not held against it.
    """
    x, y, vx, vy = task.start.tolist()
    state, worst = (x, y, vx, vy), math.inf
    for n in range(task.delay):
        after = moved(task, state, task.actions[COASTS])
        worst, state = min(worst, value(task, n, state, after)), after
    known, best = np.full(2 * PHASES + 1, -1.0), np.full(2 * PHASES + 1, -1.0)
    known[0], best[0] = worst, bound
    for phases in range(1, PHASES + 1):
        explore(task, phases, state, known, best)
    return best


def _task(question: Question, enough: float) -> Task:
    robot, limits, step = question.robot, question.limits, question.grid.step_s
    steps = max(1, math.ceil(question.horizon_s / step - 1e-9))
    times = step * np.arange(steps + 1)
    person = question.walk.at(question.start_s + times)
    yaws = _braked_yaws(robot, limits.yaw_acceleration, times)
    headings = np.stack([np.cos(yaws), np.sin(yaws)], axis=1)
    holds = np.zeros(steps + 1, dtype=np.bool_)
    held = np.rint(np.array(question.grid.holds_s) / step).astype(np.int64)
    holds[held[held <= steps]] = True
    away = math.atan2(robot.y - person[0, 1], robot.x - person[0, 0])
    return Task(
        np.array([robot.x, robot.y, robot.vx, robot.vy]),
        headings,
        person,
        question.walls,
        actions(away, question.grid.directions, question.one_side),
        holds,
        (limits.acceleration, limits.braking, limits.speed, step),
        (limits.half_length, limits.half_width, *_wall_outline(question, headings[0]), RADIUS),
        question.aim,
        question.near,
        ZONES,
        min(steps, round(question.delay_s / step)),
        _blind(question, times[:-1]),
        enough,
    )


def _blind(question: Question, times: Any) -> Any:
    """Whether the robot is blind at these times since the start, (n,)."""
    found = np.zeros(len(times), dtype=np.bool_)
    for since, until in question.blind_s:
        at = question.start_s + times
        found |= (since - _EXACT <= at) & (at < until - _EXACT)
    return found


def _wall_outline(question: Question, heading: Array) -> tuple[float, float]:
    """The outline for walls: smaller for a robot that starts at one."""
    robot, limits = question.robot, question.limits
    pose = (robot.x, robot.y, float(heading[0]), float(heading[1]))
    for inset in INSETS:
        outline = limits.half_length - inset, limits.half_width - inset
        if not overlaps_walls(*outline, pose, question.walls):
            break
    return outline


def _braked_yaws(robot: RobotState, braking: float, times: Any) -> Any:
    """The yaw while the rotation is braked, rad."""
    until = np.minimum(times, abs(robot.wz) / braking)
    return robot.yaw + robot.wz * until - math.copysign(0.5 * braking, robot.wz) * until**2


def actions(away: float, directions: int, one_side: bool = False) -> Array:
    """The actions: to coast, to brake, to accelerate, first of all in the direction `away`, rad."""
    turns = [wrap(math.tau * n / directions) for n in range(directions)]
    turns = sorted((t for t in turns if t > -_EXACT or not one_side), key=lambda t: (abs(t), t))
    pushes = [(ACCELERATE, math.cos(away + turn), math.sin(away + turn)) for turn in turns]
    return np.array([(COAST, 0.0, 0.0), (BRAKE, 0.0, 0.0), *pushes])


def _motion(question: Question, task: Task, best: Array) -> BestMotion:
    step = question.grid.step_s
    ends = [(int(action), int(n)) for action, n in best[1:].reshape(-1, 2) if action >= 0.0]
    phases, chosen = [], [COASTS] * task.delay
    for action, end in ends:
        phases.append((_name(task.actions[action]), (end - len(chosen)) * step))
        chosen += [action] * (end - len(chosen))
    x, y, vx, vy = task.start.tolist()
    states = [(x, y, vx, vy)]
    for k, action in enumerate(chosen):
        brakes = k >= task.delay and task.blind[k]
        states.append(moved(task, states[-1], task.actions[BRAKES if brakes else action]))
    places = np.array(states)[:, :2]
    yaws = np.arctan2(task.headings[:, 1], task.headings[:, 0])
    times: Any = question.start_s + step * np.arange(len(places))
    return BestMotion(
        float(best[0]),
        times,
        np.column_stack([places, yaws]),
        tuple(phases),
        clear_after(places, task.person, step),
        _count(_holds(task), len(task.actions)),
    )


def _name(action: Array) -> str:
    kind, ux, uy = action
    if kind == ACCELERATE:
        return f"accelerate {math.degrees(math.atan2(uy, ux)):.0f} deg"
    return "coast" if kind == COAST else "brake"


def clear_after(places: Array, person: Array, step_s: float = STEP_S) -> float | None:
    """Time from which the robot, at `places` (n, 2) each `step_s`, is out of both zones for good.

    None if it is in one at the end.
    """
    away = person[:, :2] - places
    rows = zip(away.tolist(), person[:, 2].tolist(), strict=True)
    inside = [beyond_zones(ZONES, x, y, view) < 0.0 for (x, y), view in rows]
    last = max((n for n, is_in in enumerate(inside) if is_in), default=-1)
    return None if last == len(inside) - 1 else (last + 1) * step_s


def _holds(task: Task) -> tuple[int, ...]:
    steps = len(task.person) - 1 - task.delay
    return (steps, *(int(n) for n in np.flatnonzero(task.holds)))


@lru_cache
def _count(steps_and_holds: Sequence[int], choices: int) -> int:
    """Number of different motions: those of one, two and three phases that end at the horizon."""
    steps, *holds = steps_and_holds
    others = choices - 1
    two = sum(hold < steps for hold in holds)
    three = sum(first + second < steps for first in holds for second in holds)
    return choices * (1 + two * others + three * others * others)
