"""Benchmark of the arm: inverse kinematics, lines, plans and moves on seeded problems, with peers.

Inverse kinematics is measured against forward kinematics. That of a calibrated chain is iterated;
its knob is the number of steps. Durations of lines are measured against their exact timing, over
the samples along a line. Contacts along lines are measured against very fine samples, over the
step between samples; ours sweeps, without one. Plans are for 500 DEEPs 0.5 to 1.6 m high and 0.8
to 1.2 m ahead of the rover, each with a person behind it and a pillar. Peers (`arm_peers`) are
included if they are installed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

import states.arm
from behaviors.profile import load_profile
from cobodeck.bench.arm.arm_lines import contact_rows, duration_rows
from cobodeck.bench.arm.arm_peers import IK_PEERS, found, solutions
from cobodeck.bench.arm.arm_problems import ReachProblem, limits_of, parked, problems
from cobodeck.bench.harness import ROUNDS, BenchRow, TimedPoint, Work, timed, timed_each, times
from hw import compile_examples
from hw.model import inverted, load_calibration, load_robot
from hw.scene import Room
from states.arm.description import manipulator_of
from states.arm.kinematics import (
    Array,
    CollisionChecker,
    Manipulator,
    descended,
    deviation,
    forward,
    inverse,
    inverse_near,
)
from states.arm.planning import NoPlan, Plan, Planner, Query, goals_at, lines_first, plan, planner

NAME = "arm"
POSES, PROBLEMS, TIMED_PROBLEMS = 10_000, 500, 100
SINGLE_POSES, PEER_POSES = 200, 50
"""Number of poses solved one by one, and by packages that need milliseconds for each."""
STEPS = (1, 2, 3, 5, 10, 50)
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
    yield from single_rows(arm, rounds)
    asked = problems(PROBLEMS)
    yield from duration_rows(arm, asked, rounds)
    yield from contact_rows(arm, asked, rounds)
    for profile in ("tuned", "paper"):
        yield from plan_rows(arm, profile, asked, rounds)


# inverse kinematics


def ik_rows(arm: Manipulator, rounds: int = ROUNDS, poses: int = POSES) -> Iterator[BenchRow]:
    """Many poses at once: time per pose, worst position error, share without a solution."""
    points: list[TimedPoint] = []
    missing = []
    for name in SETS:
        targets = forward(arm, joint_sets(arm, name, poses))
        missed, error = ik_errors(arm, targets)
        row = BenchRow(
            NAME, f"inverse kinematics of many, {name}", "cobodeck", error=float(f"{error:.2g}"),
            error_unit="m, worst", reference="forward kinematics", goal=EXACT,
        )  # fmt: skip
        points.append((row, Work(times(partial(inverse, arm, targets)), items=poses)))
        missing.append(
            replace(
                row, name=f"{row.name}: unsolved", error=100.0 * missed, error_unit="%",
                reference="the joints asked from", goal=0.0,
            )
        )  # fmt: skip
    yield from timed(points, rounds)
    yield from missing


def single_rows(
    arm: Manipulator, rounds: int = ROUNDS, poses: int = SINGLE_POSES
) -> Iterator[BenchRow]:
    """Poses one by one, of the nominal chain beside peers, and of a calibrated one by its steps."""
    targets = forward(arm, joint_sets(arm, SETS[0], poses))
    flanges = inverted(arm.base) @ targets @ inverted(arm.tip)
    points = [_single(arm, "cobodeck", partial(inverse, arm), targets, _branches)]
    for name in found(IK_PEERS):
        few = slice(None) if name == "ur-analytic-ik" else slice(PEER_POSES)
        solve = IK_PEERS[name](arm)
        points.append(_single(arm, name, solve, flanges[few], solutions, targets[few]))
    yield from timed(points, rounds)
    measured = replace(arm, placements=load_calibration())
    targets = forward(measured, joint_sets(arm, SETS[0], poses))
    seeds = inverse_near(arm, targets).joints
    yield from timed([_iterated(measured, seeds, targets, steps) for steps in STEPS], rounds)


def _branches(answer: Any) -> Array:
    found: Array = answer.branches()
    return found


def _single(
    arm: Manipulator,
    name: str,
    solve: Callable[[Array], Any],
    asked: Array,
    joints: Callable[[Any], Array],
    wanted: Array | None = None,
) -> TimedPoint:
    """A solver of one pose at a time; its error is that of its best solution of the worst pose."""
    wanted = asked if wanted is None else wanted
    error = max(
        float(deviation(forward(arm, joints(solve(pose))), target[None])[0].min())
        for pose, target in zip(asked, wanted, strict=True)
    )
    row = BenchRow(
        NAME, "inverse kinematics", name, error=float(f"{error:.2g}"), error_unit="m, worst",
        reference="forward kinematics", default=name == "cobodeck", peer=name != "cobodeck",
    )  # fmt: skip
    return row, Work(partial(_each, solve, asked), items=len(asked))


def _each(solve: Callable[[Array], Any], poses: Array, count: int) -> None:
    for _ in range(count):
        for pose in poses:
            solve(pose)


def _iterated(measured: Manipulator, seeds: Array, targets: Array, steps: int) -> TimedPoint:
    """A calibrated chain: the branches of the nominal one, improved so many times."""
    branches = seeds.shape[1]
    wanted, first = np.repeat(targets, branches, axis=0), seeds.reshape(-1, 6)
    improve = partial(descended, measured, first, wanted, steps)
    distance, _ = deviation(forward(measured, improve()[0]), wanted)
    error = float(distance.reshape(-1, branches).min(axis=1).max())
    row = BenchRow(
        NAME, "inverse kinematics", "calibrated", "steps", steps, error=float(f"{error:.2g}"),
        error_unit="m, worst", reference="forward kinematics",
    )  # fmt: skip
    return row, Work(times(improve), items=len(targets))


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
class ArmOutcome:
    """The solution of one problem."""

    query: Query
    answer: Plan | NoPlan

    @property
    def reachable(self) -> bool:
        """True if some goal configuration is free of contact."""
        goals = self.query.goals
        return bool(len(goals) and self.query.checker.free(goals).any())


def plan_rows(
    arm: Manipulator, profile: str, asked: Sequence[ReachProblem], rounds: int = ROUNDS
) -> Iterator[BenchRow]:
    """Planning times, durations of moves, shares of plans missing, touching, not reproducible."""
    yield from _rows_of(arm, profile, asked, "cobodeck", lines_first, rounds)
    if found(["ompl"]):
        yield from _rows_of(arm, profile, asked, "ompl", planner("ompl"), rounds)


def _rows_of(
    arm: Manipulator,
    profile: str,
    asked: Sequence[ReachProblem],
    variant: str,
    solver: Planner,
    rounds: int,
) -> Iterator[BenchRow]:
    outcomes = [solved(arm, profile, problem, solver) for problem in asked]
    works = [
        Work(times(partial(solved, arm, profile, problem, solver)))
        for problem, outcome in zip(asked, outcomes, strict=True)
        if outcome.reachable
    ][:TIMED_PROBLEMS]
    row = BenchRow(NAME, f"plan {profile}", variant, peer=variant != "cobodeck")
    yield from timed_each(row, works, rounds, 0.99)
    yield from _figures(row, outcomes, solver)
    moves = durations(outcomes)
    for name, took in (
        ("mean", float(np.mean(moves))),
        *((f"{share:.0%} quantile", float(np.quantile(moves, share))) for share in (0.5, 0.95)),
    ):
        yield replace(
            row, name=f"move {profile}, {name}", error=round(took, 4), error_unit="s",
            reference="has none: how long the arm moves",
        )  # fmt: skip


def _figures(row: BenchRow, outcomes: list[ArmOutcome], solver: Planner) -> Iterator[BenchRow]:
    figures: Mapping[str, tuple[float, str, str, float]] = {
        "unsolved": (100.0 * unsolved(outcomes), "% of reachable", "goals that touch nothing", 2.0),
        "touching": (touching(outcomes), "plans", f"looked at every {STEP} rad", 0.0),
        "differing": (differing(outcomes[:100], solver), "plans of 100", "planned again", 0.0),
    }
    for name, (error, unit, reference, goal) in figures.items():
        yield replace(
            row, name=f"{row.name}: {name}", error=round(error, 3), error_unit=unit,
            reference=reference, goal=goal,
        )  # fmt: skip


def solved(
    arm: Manipulator, profile: str, problem: ReachProblem, solver: Planner = lines_first
) -> ArmOutcome:
    """Solve one problem with the limits and the parked pose of a profile."""
    limits, start = limits_of(profile), parked(arm, profile)
    checker = CollisionChecker.of(arm, problem.around)
    query = Query(checker, limits, start, goals_at(arm, problem.deep, start))
    return ArmOutcome(query, plan(query, solver))


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
