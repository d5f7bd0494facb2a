"""Collision-free motion of the arm to any of several joint goals, deterministic (R43).

`lines_first` tries the straight joint lines to all goals, quickest first; nine in ten moves between
the parked pose and a DEEP need no more. The rest goes to `rrt_connect`; `ompl` does the same with
another library's trees. Planners are generators: they yield after every slice of work, so that a
control loop keeps its period, and return a `Plan`, or a `NoPlan` that says why. Work is counted in
joint sets checked for collision, never in time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass, replace
from importlib.util import find_spec

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hw import needs
from hw.model import MotionLimits
from states.arm.kinematics import (
    EXACT,
    Array,
    CollisionChecker,
    Integers,
    Manipulator,
    followed,
    inverse,
    inverse_near,
    nearest_copies,
)
from states.arm.motion import (
    JointPath,
    SlowZone,
    Trajectory,
    first_contact,
    line_durations,
    rounded,
    time_path,
)
from states.arm.planning.approach import WayIn
from states.arm.planning.rrt import connect, shortened

BUDGET = 100_000
"""Joint sets checked before a planner gives up; about a tenth of a second of work."""

SLICE = 2_000
"""Joint sets checked between two yields; about two milliseconds of work."""


def _moved_first(count: int) -> NDArray[np.bool_]:
    """Joints that a point on the way has moved already, as masks (6, j).

    The arm turns by its first joint, folds by those up to its wrist, of three.
    """
    turn = [i == 0 for i in range(count)]
    fold = [0 < i < count - 3 for i in range(count)]
    wrist = [i >= count - 3 for i in range(count)]
    both = np.array([turn, fold, wrist])
    return np.concatenate([both, both[[0, 1, 0]] | both[[2, 2, 1]]])


@dataclass(frozen=True, slots=True, eq=False)
class Query:
    """A planning problem: from `start` (j,) to any of `goals` (k, j), rad, within limits.

    A motion may begin and end with a line of the tool, see `approach`: `lead` leads to `start`, and
    ways_in[i], if there are any, from goals[i] to the DEEP. The lines are checked by `beside`,
    which lets the prop come nearer to the person than `checker` does. In `slow` the tool keeps its
    speed limit, on lines it does so everywhere. The same query gives the same answer, bit for bit.
    """

    checker: CollisionChecker
    limits: MotionLimits
    start: Array
    goals: Array
    seed: int = 0
    budget: int = BUDGET
    slice: int = SLICE
    slow: SlowZone | None = None
    lead: JointPath | None = None
    ways_in: tuple[WayIn, ...] = ()
    beside: CollisionChecker | None = None

    def lets_in(self, goal: int) -> bool:
        """True if the line from this goal to the DEEP is free."""
        if not self.ways_in:
            return True
        return first_contact(self.beside or self.checker, self.ways_in[goal].path()) is None

    def extra(self) -> Array:
        """How long the line from each goal takes, (k,), s; an estimate, 0 without lines."""
        if not self.ways_in:
            return np.zeros(len(self.goals))
        return np.array([way.duration(self.checker.arm, self.limits) for way in self.ways_in])

    def timed(self, path: JointPath, goal: int, checks: int) -> Plan:
        """The plan along a free path from `start` to this goal, with its lines."""
        first = time_path(self.checker.arm, path, self.limits, self.slow)
        leads, lands = 0.0, first.path.length
        everywhere = None if self.slow is None else replace(self.slow, radius=math.inf)
        if self.lead is not None:
            first = time_path(self.checker.arm, self.lead, self.limits, everywhere).then(first)
            leads, lands = self.lead.length, lands + self.lead.length
        if self.ways_in:
            way = self.ways_in[goal].path()
            first = first.then(time_path(self.checker.arm, way, self.limits, everywhere))
        return Plan(first, goal, checks, leads, lands)


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A free trajectory to goals[goal]; `checks` joint sets were checked for it.

    Its path begins with a line of the tool up to `leads` and ends with one from `lands` on, both in
    its own parameter; without them they are its start and its end.
    """

    trajectory: Trajectory
    goal: int
    checks: int
    leads: float
    lands: float

    @property
    def line(self) -> float:
        """Length of the line to the DEEP, m; 0 without one."""
        return self.trajectory.path.length - self.lands


@dataclass(frozen=True, slots=True)
class NoPlan:
    """No plan was found; `reason` says why, as text."""

    reason: str
    checks: int = 0


Planning = Generator[None, None, Plan | NoPlan]
Planner = Callable[[Query], Planning]
Connecting = Callable[
    [CollisionChecker, Array, Array, np.random.Generator, int, int],
    Generator[None, None, tuple[Array | None, int]],
]


def lines_first(query: Query) -> Planning:
    """Straight joint lines, quickest first, then two of them; RRT-Connect where none are free."""
    checked = _checked(query)
    if isinstance(checked, NoPlan):
        return checked
    query, order, checks = checked
    found, checks = yield from _straight(query, order, checks)
    if found is not None:
        return found
    if checks >= query.budget:
        return _given_up(query, checks)
    return (yield from _grown(query, order, checks))


def lines_only(query: Query) -> Planning:
    """Straight joint lines, quickest first, then two of them."""
    checked = _checked(query)
    if isinstance(checked, NoPlan):
        return checked
    query, order, checks = checked
    found, checks = yield from _straight(query, order, checks)
    return found or NoPlan(f"no line of {len(order)} is free", checks)


def rrt_connect(query: Query) -> Planning:
    """RRT-Connect (Kuffner and LaValle, ICRA 2000) to all goals at once, shortened and rounded."""
    checked = _checked(query)
    if isinstance(checked, NoPlan):
        return checked
    query, order, checks = checked
    return (yield from _grown(query, order, checks))


def ompl(query: Query) -> Planning:
    """Like `rrt_connect`, with the trees of OMPL (extra `ompl`), for comparison."""
    from states.arm.planning.ompl_connect import connect as ompl_connect

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
        raise ValueError(f"arm planner 'ompl' {needs('ompl')}")
    return PLANNERS[name]


def in_turn(queries: Iterable[Query], solver: Planner = lines_first) -> Planning:
    """The first of several queries that has a plan; without any, the answer to the last.

    `lines_first` tries the lines of all but the last before it grows trees for one: the last is
    what is left if nothing else will do.
    """
    answer: Plan | NoPlan = NoPlan("out of reach: no joint angles lead there")
    before: list[Query] = []
    quick = lines_only if solver is lines_first else solver
    remaining = iter(queries)
    query = next(remaining, None)
    while query is not None:
        following = next(remaining, None)
        if following is not None:
            answer = yield from quick(query)
            before.append(query)
        else:
            for again in before if solver is lines_first else ():
                answer = yield from rrt_connect(again)
                if isinstance(answer, Plan):
                    return answer
            answer = yield from solver(query)
        if isinstance(answer, Plan):
            return answer
        query = following
    return answer


def plan(query: Query, solver: Planner = lines_first) -> Plan | NoPlan:
    """Run a planner to its end."""
    return ended(solver(query))


def ended(work: Planning) -> Plan | NoPlan:
    """Run the work of a planner to its end."""
    while True:
        try:
            next(work)
        except StopIteration as done:
            answer: Plan | NoPlan = done.value
            return answer


def goals_at(
    arm: Manipulator,
    target: ArrayLike,
    near: ArrayLike,
    tolerance: tuple[float, float] = (0.0, 0.0),
) -> Array:
    """Joint goals (k, 6) with the prop at rover_from_tcp (4, 4), in the turns nearest to `near`.

    Exact ones where they exist, else the nearest within the tolerance, m and rad (R44).
    """
    found = inverse(arm, target).branches()
    if arm.is_numeric:  # the way there from where it is, before all others
        start = np.asarray(near, dtype=np.float64)[None]
        nearest, worth = followed(arm, start, np.asarray(target)[None])
        found = np.concatenate([nearest[worth <= EXACT**2], found])
    if not len(found) and tolerance[0] > 0.0:
        found = inverse_near(arm, target).within(*tolerance).branches()
    return nearest_copies(arm, found, near)


def _checked(query: Query) -> tuple[Query, Integers, int] | NoPlan:
    """The query (with a smaller margin for a close start), free goals by time, checks so far."""
    goals = query.goals.reshape(-1, len(query.start))
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
    times = line_durations(query.checker.arm, query.start, goals[free], query.limits, query.slow)
    times = times + query.extra()[free]
    return query, free[np.argsort(times, kind="stable")], 1 + len(goals)


def _contact(query: Query, goals: Array) -> str:
    _, first, second = max(query.checker.tightest(goal) for goal in goals)
    return f"{first} with {second}"


def _straight(
    query: Query, order: Integers, checks: int
) -> Generator[None, None, tuple[Plan | None, int]]:
    """The first free line to a goal, else the first free pair of lines, and the checks so far."""
    open_goals = []
    for goal in order:
        yield
        free, used = _line_free(query, query.start, query.goals[goal], query.budget - checks)
        checks += used
        if free and query.lets_in(goal):
            path = JointPath.through([query.start, query.goals[goal]])
            return query.timed(path, int(goal), checks), checks
        if not free:
            open_goals.append(int(goal))
        if checks >= query.budget:
            return None, checks
    for goal, via in _vias(query, open_goals):
        free, used = _pair_free(query, via, query.goals[goal])
        checks += used
        if free and query.lets_in(goal):
            path, used = _rounded(query, np.array([query.start, via, query.goals[goal]]))
            return query.timed(path, goal, checks + used), checks + used
        if checks >= query.budget:
            return None, checks
        if used > 1:
            yield
    return None, checks


def _line_free(query: Query, start: Array, goal: Array, budget: int) -> tuple[bool, int]:
    free, used = query.checker.sweep_line(start, goal - start, budget)
    return free >= 1.0, used


def _pair_free(query: Query, via: Array, goal: Array) -> tuple[bool, int]:
    if not query.checker.free(via)[0]:
        return False, 1
    checks = 1
    for start, end in ((query.start, via), (via, goal)):
        free, used = _line_free(query, start, end, query.budget)
        checks += used
        if not free:
            return False, checks
    return True, checks


def _vias(query: Query, goals: list[int]) -> list[tuple[int, Array]]:
    """Goals with points on the way to them, quickest first.

    At each point some joints are at their goal already and the others still at the start: the arm
    turns first and stretches afterwards, or the other way round.
    """
    if not goals:
        return []
    first = _moved_first(len(query.start))
    ends = np.repeat(query.goals[goals], len(first), axis=0)
    moved = np.tile(first, (len(goals), 1))
    points = np.where(moved, ends, query.start)
    times = line_durations(query.checker.arm, query.start, points, query.limits, query.slow)
    times = times + line_durations(query.checker.arm, points, ends, query.limits, query.slow)
    times = times + np.repeat(query.extra()[goals], len(first))
    order = np.argsort(times, kind="stable")
    return [(goals[i // len(first)], points[i]) for i in order.tolist()]


def _rounded(query: Query, corners: Array) -> tuple[JointPath, int]:
    """The path through these corners, sharp under a jerk limit, which bends do not keep."""
    if math.isfinite(query.limits.arm_jerk):
        return JointPath.through(corners), 0
    return rounded(query.checker, corners)


def _grown(
    query: Query, order: Integers, checks: int, connecting: Connecting = connect
) -> Planning:
    order = np.array([goal for goal in order if query.lets_in(goal)], dtype=np.int64)
    if not len(order):
        return NoPlan("in contact: the line to the DEEP is obstructed", checks)
    rng = np.random.default_rng(query.seed)
    found, used = yield from connecting(
        query.checker, query.start, query.goals[order], rng, query.budget - checks,
        query.slice,
    )  # fmt: skip
    checks += used
    if found is None:
        return _given_up(query, checks)
    corners, used = yield from shortened(query.checker, found, rng, query.slice)
    checks += used
    path, used = _rounded(query, corners)
    goal = np.abs(query.goals - corners[-1]).max(axis=1).argmin()
    return query.timed(path, int(goal), checks + used)


def _given_up(query: Query, checks: int) -> NoPlan:
    return NoPlan(f"no free path found in {query.budget} checks", checks)
