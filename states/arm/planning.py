"""Collision-free motion of the arm to any of several joint goals, deterministic (R43).

`lines_first` tries the straight joint lines to all goals, quickest first; nine in ten moves between
the parked pose and a DEEP need no more. The rest goes to `rrt_connect`; `ompl` does the same with
another library's trees. Planners are generators: they yield after every slice of work, so that a
control loop keeps its period, and return a `Plan`, or a `NoPlan` that says why. Work is counted in
joint sets checked for collision, never in time.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, replace
from importlib.util import find_spec

import numpy as np
from numpy.typing import ArrayLike

from states.arm.collision import CollisionChecker, CollisionModel, Surroundings
from states.arm.collision import warm_up as collision_warm_up
from states.arm.inverse import inverse, inverse_near, nearest_copies
from states.arm.inverse import warm_up as inverse_warm_up
from states.arm.kernels import Array, Integers
from states.arm.kinematics import KinematicChain
from states.arm.model import Manipulator
from states.arm.path import JointPath, rounded
from states.arm.rrt import connect, shortened
from states.arm.timing import line_durations, time_path
from states.arm.timing import warm_up as timing_warm_up
from states.arm.trajectory import ArmLimits, Trajectory

BUDGET = 100_000
"""Joint sets checked before a planner gives up; about a tenth of a second of work."""

SLICE = 2_000
"""Joint sets checked between two yields; about two milliseconds of work."""


@dataclass(frozen=True, slots=True, eq=False)
class Query:
    """A planning problem: from `start` (6,) to any of `goals` (k, 6), rad, within limits.

    The same query gives the same answer, bit for bit.
    """

    chain: KinematicChain
    checker: CollisionChecker
    limits: ArmLimits
    start: Array
    goals: Array
    seed: int = 0
    budget: int = BUDGET
    slice: int = SLICE


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A free trajectory to goals[goal]; `checks` joint sets were checked for it."""

    trajectory: Trajectory
    goal: int
    checks: int


@dataclass(frozen=True, slots=True)
class NoPlan:
    """No plan was found; `reason` says why, as text."""

    reason: str
    checks: int = 0


Planning = Generator[None, None, Plan | NoPlan]
Planner = Callable[[Query], Planning]
Connecting = Callable[
    [CollisionChecker, KinematicChain, Array, Array, np.random.Generator, int, int],
    Generator[None, None, tuple[Array | None, int]],
]


def lines_first(query: Query) -> Planning:
    """Straight joint lines, quickest first; RRT-Connect where none of them is free."""
    checked = _checked(query)
    if isinstance(checked, NoPlan):
        return checked
    query, order, checks = checked
    for goal in order:
        yield
        step = query.goals[goal] - query.start
        piece = np.array([query.start, step, np.zeros(6)])
        free, used = query.checker.sweep(piece, 1.0, query.budget - checks)
        checks += used
        if free >= 1.0:
            path = JointPath.through([query.start, query.goals[goal]])
            return Plan(time_path(query.chain, path, query.limits), int(goal), checks)
        if checks >= query.budget:
            return _given_up(query, checks)
    return (yield from _grown(query, order, checks))


def rrt_connect(query: Query) -> Planning:
    """RRT-Connect (Kuffner and LaValle, ICRA 2000) to all goals at once, shortened and rounded."""
    checked = _checked(query)
    if isinstance(checked, NoPlan):
        return checked
    query, order, checks = checked
    return (yield from _grown(query, order, checks))


def ompl(query: Query) -> Planning:
    """Like `rrt_connect`, with the trees of OMPL (extra `ompl`), for comparison."""
    from states.arm.ompl_connect import connect as ompl_connect

    checked = _checked(query)
    if isinstance(checked, NoPlan):
        return checked
    query, order, checks = checked
    return (yield from _grown(query, order, checks, ompl_connect))


PLANNERS: Mapping[str, Planner] = {
    "lines_first": lines_first,
    "rrt_connect": rrt_connect,
    "ompl": ompl,
}


def planner(name: str) -> Planner:
    """A planner by name.

    Raises:
        ValueError: unknown name, or a package is missing; says which.
    """
    if name not in PLANNERS:
        raise ValueError(f"no arm planner '{name}'; known: {', '.join(PLANNERS)}")
    if name == "ompl" and find_spec("ompl") is None:
        raise ValueError("arm planner 'ompl' needs the package ompl: pip install 'cobodeck[ompl]'")
    return PLANNERS[name]


def plan(query: Query, solver: Planner = lines_first) -> Plan | NoPlan:
    """Run a planner to its end."""
    work = solver(query)
    while True:
        try:
            next(work)
        except StopIteration as done:
            answer: Plan | NoPlan = done.value
            return answer


def goals_at(
    chain: KinematicChain,
    target: ArrayLike,
    near: ArrayLike,
    tolerance: tuple[float, float] = (0.0, 0.0),
) -> Array:
    """Joint goals (k, 6) with the prop at rover_from_tcp (4, 4), in the turns nearest to `near`.

    Exact ones where they exist, else the nearest within the tolerance, m and rad (R44).
    """
    found = inverse(chain, target).of()
    if not len(found) and tolerance[0] > 0.0:
        found = inverse_near(chain, target).within(*tolerance).of()
    return nearest_copies(chain, found, near)


def _checked(query: Query) -> tuple[Query, Integers, int] | NoPlan:
    """The query (with a smaller margin for a close start), free goals by time, checks so far."""
    goals = query.goals.reshape(-1, 6)
    if not len(goals):
        return NoPlan("out of reach: no joint angles lead there")
    gap, first, second = query.checker.tightest(query.start)
    if gap <= 0.0:
        return NoPlan(f"the arm starts in contact: {first} with {second}, {-gap:.3f} m deep", 1)
    if gap < query.checker.margin:  # an arm that starts close to something may still leave
        query = replace(query, checker=replace(query.checker, margin=0.9 * gap))
    free = np.flatnonzero(query.checker.free(goals))
    if not len(free):
        return NoPlan(f"in contact: {_contact(query, goals)} at the goal", 1 + len(goals))
    times = line_durations(query.chain, query.start, goals[free], query.limits)
    return query, free[np.argsort(times, kind="stable")], 1 + len(goals)


def _contact(query: Query, goals: Array) -> str:
    _, first, second = max(query.checker.tightest(goal) for goal in goals)
    return f"{first} with {second}"


def _grown(
    query: Query, order: Integers, checks: int, connecting: Connecting = connect
) -> Planning:
    rng = np.random.default_rng(query.seed)
    found, used = yield from connecting(
        query.checker, query.chain, query.start, query.goals[order], rng, query.budget - checks,
        query.slice,
    )  # fmt: skip
    checks += used
    if found is None:
        return _given_up(query, checks)
    corners, used = yield from shortened(query.checker, found, rng, query.slice)
    checks += used
    path, used = rounded(query.checker, corners)
    goal = np.abs(query.goals - corners[-1]).max(axis=1).argmin()
    trajectory = time_path(query.chain, path, query.limits)
    return Plan(trajectory, int(goal), checks + used)


def _given_up(query: Query, checks: int) -> NoPlan:
    return NoPlan(f"no free path found in {query.budget} checks", checks)


def warm_up(model: Manipulator) -> None:
    """Compile what planning needs, so that no control tick does."""
    chain, solid = KinematicChain.of(model), CollisionModel.of(model)
    inverse_warm_up(chain)
    collision_warm_up(solid)
    timing_warm_up()
    checker = CollisionChecker.of(solid, Surroundings.empty())
    limits = ArmLimits.even(model.max_speed, 1.0, tool_speed=1.0)
    start = np.array(model.tool.parked)
    plan(Query(chain, checker, limits, start, start[None] + 0.01))
