"""RRT-Connect of OMPL in place of our own; needs the extra `ompl`.

OMPL draws samples and grows trees; every joint set and every line is judged by our own checker, so
that its paths are as free as ours. Its random numbers start from the query's seed each time.
"""

from __future__ import annotations

from collections.abc import Generator
from importlib import import_module
from typing import Any

import numpy as np

from states.arm.kinematics import Array, CollisionChecker
from states.arm.planning.rrt import STEP, drawing_box


def connect(
    checker: CollisionChecker,
    start: Array,
    goals: Array,
    rng: np.random.Generator,
    budget: int,
    portion: int,
) -> Generator[None, None, tuple[Array | None, int]]:
    """As `states.arm.planning.rrt.connect`, by OMPL.

    Raises:
        ModuleNotFoundError: ompl is not installed.
    """
    base, util = import_module("ompl.base"), import_module("ompl.util")
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(int(rng.integers(1, 2**31)))
    counter = _Counter(checker)
    problem, planner = _problem(base, counter, drawing_box(checker.arm, start, goals), start, goals)
    while not problem.hasExactSolution():
        if counter.checks >= budget:
            return None, counter.checks
        counter.due = min(budget, counter.checks + portion)
        planner.solve(base.PlannerTerminationCondition(counter.is_due))
        yield
    states = problem.getSolutionPath().getStates()
    return np.array([_joints(state, len(start)) for state in states]), counter.checks


class _Counter:
    """Our checker, with the number of joint sets checked."""

    def __init__(self, checker: CollisionChecker) -> None:
        self.checker = checker
        self.checks = self.due = 0

    def is_due(self) -> bool:
        return self.checks >= self.due

    def is_free(self, state: Any) -> bool:
        self.checks += 1
        return bool(self.checker.free(_joints(state, self.checker.arm.count))[0])

    def is_line_free(self, begin: Any, end: Any) -> bool:
        count = self.checker.arm.count
        a, b = _joints(begin, count), _joints(end, count)
        share, used = self.checker.sweep_line(a, b - a)
        self.checks += used
        return share >= 1.0


def _problem(
    base: Any, counter: _Counter, box: tuple[Array, Array], start: Array, goals: Array
) -> tuple[Any, Any]:
    """The problem definition of OMPL, and a planner set up for it."""
    count = len(start)
    space = base.RealVectorStateSpace(count)
    bounds = base.RealVectorBounds(count)
    for i, (low, high) in enumerate(zip(*box, strict=True)):
        bounds.setLow(i, float(low))
        bounds.setHigh(i, float(high))
    space.setBounds(bounds)
    about = base.SpaceInformation(space)
    about.setStateValidityChecker(counter.is_free)
    about.setMotionValidator(_motion_validator(base, about, counter))
    about.setup()
    problem, ends = base.ProblemDefinition(about), base.GoalStates(about)
    problem.addStartState(_state(space, start))
    for goal in goals:
        ends.addState(_state(space, goal))
    problem.setGoal(ends)
    planner = import_module("ompl.geometric").RRTConnect(about)
    planner.setRange(STEP)
    planner.setProblemDefinition(problem)
    planner.setup()
    return problem, planner


def _motion_validator(base: Any, about: Any, counter: _Counter) -> Any:
    class Lines(base.MotionValidator):  # type: ignore[misc]
        def checkMotion(self, begin: Any, end: Any) -> bool:
            return counter.is_line_free(begin, end)

    return Lines(about)


def _state(space: Any, joints: Array) -> Any:
    state = space.allocState()
    for i, value in enumerate(joints):
        state[i] = float(value)
    return state


def _joints(state: Any, count: int) -> Array:
    return np.array([state[i] for i in range(count)])
