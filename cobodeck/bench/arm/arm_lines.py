"""Straight lines of the joints: their durations and their contacts, over the step along a line."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from cobodeck.bench.arm.arm_problems import ReachProblem, limits_of, parked
from cobodeck.bench.harness import ROUNDS, BenchRow, TimedPoint, Work, timed, times
from states.arm.kinematics import Array, CollisionChecker, Manipulator
from states.arm.motion import LINE_SAMPLES, JointPath, line_durations, time_path
from states.arm.planning import goals_at

NAME = "arm"
PROFILE = "tuned"
SAMPLES = (3, 5, 9, 17, 33, 65)
"""More are finer than the grid of the reference."""
STEPS_RAD, FINEST_RAD = (0.4, 0.2, 0.1, 0.05, 0.02, 0.01), 0.001
LINES = 300
REACH_RAD = 1.5
"""How far the joints of a line move from the parked pose at most, rad."""
SEED = 7


def duration_rows(
    arm: Manipulator,
    asked: Sequence[ReachProblem],
    rounds: int = ROUNDS,
    samples: Iterable[int] = SAMPLES,
) -> Iterator[BenchRow]:
    """The duration of lines from the parked pose to all goals of the problems."""
    start, limits = parked(arm, PROFILE), limits_of(PROFILE)
    goals = np.concatenate([goals_at(arm, problem.deep, start) for problem in asked])[:LINES]
    exact = np.array(
        [
            time_path(arm, JointPath.through([start, goal]), limits).duration
            for goal in goals
        ]
    )  # fmt: skip
    points: list[TimedPoint] = []
    for number in samples:
        measure = partial(line_durations, arm, start, goals, limits, samples=number)
        error = 100.0 * float(np.mean(np.abs(measure() / exact - 1.0)))
        row = BenchRow(
            NAME, "duration of a line", "cobodeck", "samples", number, error=round(error, 4),
            error_unit="%, mean", reference="timed as a path", default=number == LINE_SAMPLES,
        )  # fmt: skip
        points.append((row, Work(times(measure), items=len(goals))))
    yield from timed(points, rounds)


def contact_rows(
    arm: Manipulator,
    asked: Sequence[ReachProblem],
    rounds: int = ROUNDS,
    steps: Iterable[float] = STEPS_RAD,
    count: int = LINES,
) -> Iterator[BenchRow]:
    """Where lines first touch something: by samples along them, and by sweeping.

    Samples have no margin. The sweep has one, and is sure of what is between its samples; so it
    stops earlier. Then the share of contacts that are overlooked.
    """
    lines = _lines(arm, asked, count)
    ends = np.array([_length(*line) for line in lines])
    exact = np.array([_sampled(*line, FINEST_RAD) for line in lines])
    judges: list[tuple[float | None, _Judge]] = [(s, partial(_sampled, step=s)) for s in steps]
    points, missing = [], []
    for step, judge in (*judges, (None, _swept)):
        told = np.array([judge(*line) for line in lines])
        touching = exact < ends
        name, knob = ("cobodeck", None) if step is None else ("sampled", "step")
        row = BenchRow(
            NAME, "contact along a line", name, knob, step,
            error=round(float(np.mean(np.abs(told - exact)[touching])), 5),
            error_unit="rad off, mean", reference=f"samples every {FINEST_RAD} rad",
            default=step is None,
        )  # fmt: skip
        points.append((row, Work(partial(_judge_all, judge, lines), items=len(lines))))
        missed = 100.0 * float(np.mean(told[touching] >= ends[touching]))
        missing.append(
            replace(
                row, name=f"{row.name}: missed", error=round(missed, 3), default=False,
                error_unit="% of contacts", goal=0.0 if step is None else None,
            )
        )  # fmt: skip
    yield from timed(points, rounds)
    yield from missing


_Line = tuple[CollisionChecker, Array, Array]
_Judge = Callable[[CollisionChecker, Array, Array], float]


def _lines(arm: Manipulator, asked: Sequence[ReachProblem], count: int) -> list[_Line]:
    rng, start = np.random.default_rng(SEED), parked(arm, PROFILE)
    return [
        (
            CollisionChecker.of(arm, asked[n % len(asked)].around),
            start,
            start + rng.uniform(-REACH_RAD, REACH_RAD, 6),
        )
        for n in range(count)
    ]


def _length(_checker: CollisionChecker, start: Array, goal: Array) -> float:
    return float(np.linalg.norm(goal - start))


def _sampled(checker: CollisionChecker, start: Array, goal: Array, step: float) -> float:
    """How far along a line the first sample is that touches something, rad; its length if none."""
    length = _length(checker, start, goal)
    shares = np.linspace(0.0, 1.0, max(1, math.ceil(length / step)) + 1)
    touches = checker.clearance(start + shares[:, None] * (goal - start)) < 0.0
    return length * float(shares[np.argmax(touches)]) if touches.any() else length


def _swept(checker: CollisionChecker, start: Array, goal: Array) -> float:
    return _length(checker, start, goal) * checker.sweep_line(start, goal - start)[0]


def _judge_all(judge: _Judge, lines: Sequence[_Line], count: int) -> None:
    for _ in range(count):
        for line in lines:
            judge(*line)
