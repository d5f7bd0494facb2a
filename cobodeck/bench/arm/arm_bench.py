"""Benchmark of the arm: inverse kinematics, plans and moves on seeded problems, with peers.

Times of inverse kinematics are relative to forward kinematics of as many poses. Plans are for 500
DEEPs 0.5 to 1.6 m high and 0.8 to 1.2 m ahead of the rover, each with a person behind it and a
pillar. Peers (`arm_peers`) are included if they are installed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from time import perf_counter

import numpy as np

import states.arm
from behaviors.profile import load_profile
from cobodeck.bench.arm.arm_peers import IK_PEERS, found
from cobodeck.bench.harness import ROUNDS, BenchCase, BenchRow, Work, measure, seconds_of
from hw import compile_examples
from hw.model import MotionLimits, load_robot
from hw.scene import Room
from states.arm.description import manipulator_of
from states.arm.kinematics import (
    Array,
    CollisionChecker,
    Manipulator,
    Surroundings,
    deviation,
    forward,
    inverse,
    inverted,
)
from states.arm.planning import (
    ANGLES,
    NoPlan,
    Plan,
    Planner,
    Query,
    goals_at,
    lines_first,
    plan,
    planner,
)

NAME = "arm"
POSES, PROBLEMS = 10_000, 500
PEER_POSES = 50
"""Number of poses for packages that need milliseconds per pose."""
SEED = 42
SETS = ("anywhere", "wrist", "elbow", "shoulder")
EXACT = 1e-9
STEP = 0.01
"""Step at which plans are checked for contact once more, rad."""


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """Everything, row by row."""
    robot = load_robot("rbkairos_ur10")
    arm, environment = manipulator_of(robot), load_profile("tuned").environment(Room(()), robot)
    compile_examples((states.arm,), workspace=environment.workspace)
    yield from ik_rows(arm, rounds)
    asked = problems(PROBLEMS)
    for profile in ("tuned", "paper"):
        yield from plan_rows(arm, profile, asked)


# inverse kinematics


def ik_rows(arm: Manipulator, rounds: int = ROUNDS, poses: int = POSES) -> Iterator[BenchRow]:
    """Batch and single times, worst position error, and share of poses without a solution."""
    sets = {name: joint_sets(arm, name, poses) for name in SETS}
    for name, joints in sets.items():
        targets = forward(arm, joints)
        missed, error = ik_errors(arm, targets)
        case = BenchCase(
            f"ik {name}",
            Work(times(partial(forward, arm, joints))),
            "forward kinematics",
            {"cobodeck": Work(times(partial(inverse, arm, targets)))},
        )
        (timed,) = measure(NAME, case, rounds)
        assert timed.time_us is not None
        yield BenchRow(
            NAME, case.name, "cobodeck", "poses", poses,
            time_us=timed.time_us / poses, ratio=timed.ratio, ratio_to=timed.ratio_to,
            error=float(f"{error:.2g}"), error_unit="m, worst", reference="forward kinematics",
            goal=EXACT,
        )  # fmt: skip
        yield BenchRow(
            NAME, f"ik {name} unsolved", "cobodeck", "poses", poses,
            error=100.0 * missed, error_unit="%", reference="the joints asked from", goal=0.0,
        )  # fmt: skip
    yield from _single_rows(arm, sets["anywhere"], rounds)


def _single_rows(arm: Manipulator, joints: Array, rounds: int) -> Iterator[BenchRow]:
    targets = forward(arm, joints)
    flanges = inverted(arm.base) @ targets @ inverted(arm.tip)
    solvers = {"cobodeck": (lambda pose: inverse(arm, pose), targets)}
    for name in found(IK_PEERS):
        solvers[name] = (IK_PEERS[name](arm), flanges)
    for name, (solve, poses) in solvers.items():
        taken = sorted(
            min(seconds_of(Work(times(partial(solve, pose))), 1) for _ in range(min(rounds, 3)))
            for pose in poses[: 1000 if name in ("cobodeck", "ur-analytic-ik") else PEER_POSES]
        )
        for quantile in (0.5, 0.99):
            took = float(np.quantile(taken, quantile)) * 1e6
            yield BenchRow(NAME, "ik single", name, "quantile", quantile, time_us=took)


def ik_errors(arm: Manipulator, targets: Array) -> tuple[float, float]:
    """Share of poses without a solution, and largest position error of any solution, m."""
    solved = inverse(arm, targets)
    reached = forward(arm, solved.joints[solved.valid])
    asked = np.broadcast_to(targets[:, None], (*solved.valid.shape, 4, 4))[solved.valid]
    distance, _ = deviation(reached, asked)
    return float((~solved.valid.any(axis=1)).mean()), float(distance.max())


def joint_sets(arm: Manipulator, kind: str, count: int) -> Array:
    """Joint angles (count, 6), rad: anywhere, or near a singularity of wrist, elbow or shoulder.

    One in ten of those near a singularity is exactly there.
    """
    rng = np.random.default_rng(SETS.index(kind))
    q = rng.uniform(-np.pi, np.pi, (count, 6))
    off = 10.0 ** rng.uniform(-12, -2, count) * rng.choice([-1.0, 1.0], count)
    off[: count // 10] = 0.0
    if kind == "wrist":
        q[:, 4] = rng.choice([0.0, np.pi], count) + off
    elif kind == "elbow":
        q[:, 2] = np.clip(rng.choice([0.0, -np.pi, np.pi], count) + off, -np.pi, np.pi)
    elif kind == "shoulder":  # the wrist centre on the shoulder's axis, at horizontal distance
        # a2 cos q2 + a3 cos(q2 + q3) + d5 sin(q2 + q3 + q4) = along cos q2 + across sin q2 = 0
        _, a2, a3, _, d5, _ = arm.dh
        along = a2 + a3 * np.cos(q[:, 2]) + d5 * np.sin(q[:, 2] + q[:, 3])
        across = -a3 * np.sin(q[:, 2]) + d5 * np.cos(q[:, 2] + q[:, 3])
        q[:, 1] = np.arctan2(-along, across) + rng.choice([0.0, np.pi], count) + off
    return q


# plans


@dataclass(frozen=True, slots=True, eq=False)
class ReachProblem:
    """A planning problem: rover_from_deep (4, 4) and the obstacles."""

    deep: Array
    around: Surroundings


def problems(count: int) -> list[ReachProblem]:
    """Seeded DEEPs ahead of the rover, from the paper's seven directions."""
    rng = np.random.default_rng(SEED)
    return [_problem(rng) for _ in range(count)]


def _problem(rng: np.random.Generator) -> ReachProblem:
    height, distance = rng.uniform(0.5, 1.6), rng.uniform(0.8, 1.2)
    yaw, pitch = np.pi - rng.choice(ANGLES), rng.uniform(-np.radians(20), np.radians(20))
    (cy, sy), (cp, sp) = (np.cos(yaw), np.sin(yaw)), (np.cos(pitch), np.sin(pitch))
    deep = np.eye(4)
    deep[:3, :3] = [[cy * cp, -sy, cy * sp], [sy * cp, cy, sy * sp], [-sp, 0.0, cp]]
    deep[:3, 3] = distance, 0.0, height
    person = deep[:2, 3] - 0.85 * np.array([cy, sy])
    while True:
        radius, angle, away = rng.uniform(0.05, 0.15), rng.uniform(-1.7, 1.7), rng.uniform(0.7, 1.2)
        pillar = away * np.array([np.cos(angle), np.sin(angle)])
        outside = np.maximum(np.abs(pillar) - [0.565, 0.455], 0.0)
        if np.hypot(*outside) > radius + 0.02 and np.hypot(*(pillar - deep[:2, 3])) > radius + 0.2:
            break
    cylinders = np.array([[*person, 0.5, 0.0, 1.8], [*pillar, radius, 0.0, 2.5]])
    return ReachProblem(deep, Surroundings(np.zeros((0, 6)), cylinders))


@dataclass(frozen=True, slots=True, eq=False)
class ArmOutcome:
    """The solution of one problem, and the times of inverse kinematics and planning, s."""

    query: Query
    answer: Plan | NoPlan
    seconds: float

    @property
    def reachable(self) -> bool:
        """True if some goal configuration is free of contact."""
        goals = self.query.goals
        return bool(len(goals) and self.query.checker.free(goals).any())


def plan_rows(arm: Manipulator, profile: str, asked: list[ReachProblem]) -> Iterator[BenchRow]:
    """Planning and moving times; shares of plans missing, in contact, and not reproducible."""
    yield from _rows_of(arm, profile, asked, "cobodeck", lines_first)
    if found(["ompl"]):
        yield from _rows_of(arm, profile, asked, "ompl", planner("ompl"))


def _rows_of(
    arm: Manipulator, profile: str, asked: list[ReachProblem], variant: str, solver: Planner
) -> Iterator[BenchRow]:
    outcomes = [solved(arm, profile, problem, solver) for problem in asked]
    taken = [outcome.seconds for outcome in outcomes if outcome.reachable]
    for quantile in (0.5, 0.99):
        took = float(np.quantile(taken, quantile)) * 1e6
        yield BenchRow(NAME, f"plan {profile}", variant, "quantile", quantile, time_us=took)
    yield from _figures(profile, outcomes, variant, solver)
    moves = durations(outcomes)
    yield BenchRow(NAME, f"move {profile} mean", variant, time_us=float(np.mean(moves)) * 1e6)
    for quantile in (0.5, 0.95):
        took = float(np.quantile(moves, quantile)) * 1e6
        yield BenchRow(NAME, f"move {profile}", variant, "quantile", quantile, time_us=took)


def _figures(
    profile: str, outcomes: list[ArmOutcome], variant: str, solver: Planner
) -> Iterator[BenchRow]:
    figures: Mapping[str, tuple[float, str, str, float]] = {
        "unsolved": (100.0 * unsolved(outcomes), "% of reachable", "goals that touch nothing", 2.0),
        "touching": (touching(outcomes), "plans", f"looked at every {STEP} rad", 0.0),
        "differing": (differing(outcomes[:100], solver), "plans of 100", "planned again", 0.0),
    }
    for name, (error, unit, reference, goal) in figures.items():
        yield BenchRow(
            NAME, f"plan {profile} {name}", variant, "problems", len(outcomes),
            error=round(error, 3), error_unit=unit, reference=reference, goal=goal,
        )  # fmt: skip


def solved(
    arm: Manipulator, profile: str, problem: ReachProblem, solver: Planner = lines_first
) -> ArmOutcome:
    """Solve one problem with the limits and the parked pose of a profile."""
    limits, start = _limits(profile), _parked(arm, profile)
    checker = CollisionChecker.of(arm, problem.around)
    begin = perf_counter()
    query = Query(checker, limits, start, goals_at(arm, problem.deep, start))
    answer = plan(query, solver)
    return ArmOutcome(query, answer, perf_counter() - begin)


def _limits(profile: str) -> MotionLimits:
    robot = load_profile(profile).robot
    tool = np.inf if robot.tool_speed is None else robot.tool_speed
    return MotionLimits(arm_acceleration=robot.arm_acceleration, tool_speed=tool)


def _parked(arm: Manipulator, profile: str) -> Array:
    own = load_profile(profile).robot.parked(arm.name)
    return np.array(arm.tool.parked if own is None else own)


def durations(outcomes: list[ArmOutcome]) -> list[float]:
    """Durations of the moves, s."""
    return [o.answer.trajectory.duration for o in outcomes if isinstance(o.answer, Plan)]


def unsolved(outcomes: list[ArmOutcome]) -> float:
    """Share of reachable problems without a plan."""
    reachable = [outcome for outcome in outcomes if outcome.reachable]
    return sum(isinstance(o.answer, NoPlan) for o in reachable) / len(reachable)


def touching(outcomes: list[ArmOutcome]) -> int:
    """Number of plans with a contact at one of the checks along them."""
    count = 0
    for outcome in outcomes:
        if isinstance(outcome.answer, Plan):
            path = outcome.answer.trajectory.path
            joints, _, _ = path.at(np.append(np.arange(0.0, path.length, STEP), path.length))
            count += bool(outcome.query.checker.clearance(joints).min() <= 0.0)
    return count


def differing(outcomes: list[ArmOutcome], solver: Planner = lines_first) -> int:
    """Number of plans that differ, by even one bit, when computed again."""
    count = 0
    for outcome in outcomes:
        again, before = plan(outcome.query, solver), outcome.answer
        if isinstance(again, Plan) and isinstance(before, Plan):
            one, other = again.trajectory, before.trajectory
            same = np.array_equal(one.path.pieces, other.path.pieces)
            count += not (same and np.array_equal(one.times, other.times))
        else:
            count += again != before
    return count
