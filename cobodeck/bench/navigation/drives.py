"""Benchmark of drives: run time against error of both local planners.

Times are of one control cycle. Drives of an ideal base are compared with the least time that the
limits allow: over its period; over the profile, where the least time has a closed form; and over
the tolerance, where the error is what is left to the goal. Drives by estimated poses, and beside
walking users, have no knob.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from behaviors.profile import load_profile, profile_names
from cobodeck.bench.harness import ROUNDS, BenchRow, TimedPoint, Work, timed, times
from cobodeck.bench.navigation.disturbed import (
    CASES,
    WALKERS,
    WALKS,
    DisturbedCase,
    DisturbedResult,
    drive_disturbed,
)
from cobodeck.bench.navigation.drive_trials import (
    OPEN_ROOM,
    TRIALS,
    DriveOutcome,
    Trial,
    drive,
    slow_enough,
)
from hw import Pose2, compile_examples
from hw.model import load_robot
from hw.scene import Room
from states.navigation import LOCAL_PLANNERS, Limits, Tolerance
from states.navigation.exact import ExactPlanner, visibility
from states.navigation.local import LocalPlanner, profile_planner, teb_planner

NAME = "drives"
PERIODS = (0.2, 0.1, 0.05, 1.0 / 30.0, 0.02, 0.01)
PERIOD, TICK = 0.05, 1.0 / 30.0
"""The period for which goals are set, and that of the robots, s."""
LIMITS, TOLERANCE = Limits(), Tolerance()
TOLERANCES = (0.2, 0.1, 0.05, 0.02, 0.01)
OVER_GOALS = {"profile": 7.0, "teb": 5.0}
"""Largest excess over the least time, %."""
STRAIGHT_M = 3.0
LEAST_TIME = "direct transcription, 120 intervals"
HZ = 30.0
"""Rate of the control cycles in drives by estimated poses, Hz."""
SEEDS = range(20, 24)
NOISY = CASES[3]
WINDOW = 0.3
"""Time over which the velocity of a walking user is estimated, s."""


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """Everything, row by row."""
    compile_examples((visibility, profile_planner, teb_planner))
    yield from period_rows(rounds)
    yield from profile_rows(rounds)
    yield from tolerance_rows(rounds)
    for case in (*CASES, *WALKERS):
        yield from disturbed_rows(case)


@dataclass(frozen=True, slots=True)
class _Setting:
    """A local planner by name, with what it is given."""

    name: str
    limits: Limits = LIMITS
    tolerance: Tolerance = TOLERANCE
    period: float = TICK

    def drive(self, trial: Trial) -> DriveOutcome:
        return drive(_driver(self.name, self.limits, self.tolerance), trial, self.period)

    def work(self, trials: Iterable[Trial], found: Iterable[DriveOutcome]) -> Work:
        """Driving all trials again; the items are their cycles."""
        return Work(partial(_repeat, self, tuple(trials)), items=sum(o.cycles for o in found))


def _repeat(setting: _Setting, trials: Iterable[Trial], count: int) -> None:
    for _ in range(count):
        for trial in trials:
            setting.drive(trial)


def period_rows(
    rounds: int = ROUNDS, periods: Iterable[float] = PERIODS, trials: Sequence[Trial] = TRIALS
) -> Iterator[BenchRow]:
    """The four trials over the period; then the deepest intrusion into the user's disc, if any."""
    points, deep = [], []
    for name in LOCAL_PLANNERS:
        for period in periods:
            setting = _Setting(name, period=period)
            found = [setting.drive(trial) for trial in trials]
            over = [_over(o, trial.least_time) for o, trial in zip(found, trials, strict=True)]
            row = BenchRow(
                NAME, "four trials", name, "period", period,
                error=round(statistics.fmean(over), 3), error_unit="% over the least time, mean",
                reference=LEAST_TIME, goal=OVER_GOALS[name] if period == PERIOD else None,
                default=name == "profile" and period == TICK,
            )  # fmt: skip
            points.append((row, setting.work(trials, found)))
            deepest = 100.0 * max(0.0, *(outcome.intrusion for outcome in found))
            limit = 0.0 if name == "profile" else 3.0
            deep.append(
                replace(
                    row, name="four trials: intrusion", error=round(deepest, 3), error_unit="cm",
                    reference="the user's disc", goal=limit if period == PERIOD else None,
                    default=False,
                )
            )  # fmt: skip
    yield from timed(points, rounds)
    yield from deep


def _over(outcome: DriveOutcome, least_time: float) -> float:
    """Excess over the least time, %; infinite without an arrival."""
    return 100.0 * (outcome.time / least_time - 1.0) if outcome.arrived else math.inf


def profile_rows(rounds: int = ROUNDS, periods: Iterable[float] = PERIODS) -> Iterator[BenchRow]:
    """A straight drive with the limits and the tolerance of each profile, over the period."""
    robot, points = load_robot("rbkairos_ur10"), []
    for profile in map(load_profile, profile_names()):
        environment = profile.environment(Room(OPEN_ROOM), robot)
        subsystem, own = environment.navigation.haptic, environment.limits
        limits = Limits(
            subsystem.max_speed, own.base_acceleration, own.base_yaw_rate, own.base_yaw_acceleration
        )
        tolerance = Tolerance(subsystem.tolerance, subsystem.yaw_tolerance)
        least = slow_enough(STRAIGHT_M - tolerance.position, limits.speed, limits.acceleration)
        trial = Trial(profile.name, Pose2(0.0, 5.0), Pose2(STRAIGHT_M, 5.0), None, least)
        for period in periods:
            setting = _Setting("profile", limits, tolerance, period)
            outcome = setting.drive(trial)
            row = BenchRow(
                NAME, "straight on by profile", profile.name, "period", period,
                error=round(_over(outcome, least), 3), error_unit="% over the least time",
                reference="trapezoid, closed form",
                default=profile.name == "tuned" and period == TICK,
            )  # fmt: skip
            points.append((row, setting.work([trial], [outcome])))
    yield from timed(points, rounds)


def tolerance_rows(
    rounds: int = ROUNDS, tolerances: Iterable[float] = TOLERANCES
) -> Iterator[BenchRow]:
    """What is left to the goal on arrival over the tolerance, by exact and by estimated poses."""
    points: list[TimedPoint] = []
    for name in LOCAL_PLANNERS:
        for case in (None, NOISY):
            for tolerance in tolerances:
                drives = _Arrivals(name, Tolerance(tolerance), case)
                row = BenchRow(
                    NAME, "arrival", name if case is None else f"{name}, {case.name}",
                    "tolerance", tolerance, error=round(100.0 * statistics.fmean(drives.left()), 4),
                    error_unit="cm left to the goal, mean", reference="the goal",
                    default=name == "profile" and tolerance == TOLERANCE.position,
                )  # fmt: skip
                points.append((row, Work(times(drives.left), items=len(TRIALS))))
    yield from timed(points, rounds)


def _distance(outcome: DriveOutcome, trial: Trial) -> float:
    return math.dist(outcome.places[-1], (trial.goal.x, trial.goal.y))


@dataclass(frozen=True, slots=True)
class _Arrivals:
    """The four trials with a tolerance, as they are or disturbed."""

    name: str
    tolerance: Tolerance
    case: DisturbedCase | None

    def left(self) -> list[float]:
        """Distance to the goal on arrival, m, by trial; infinite without an arrival."""
        return [self._left(trial) for trial in TRIALS]

    def _left(self, trial: Trial) -> float:
        driver = _driver(self.name, tolerance=self.tolerance)
        if self.case is None:
            outcome = drive(driver, trial, TICK)
            away, arrived = _distance(outcome, trial), outcome.arrived
        else:
            result = drive_disturbed(driver, trial, self.case.disturbance, SEEDS[0], HZ)
            away, arrived = result.away, result.arrived
        return away if arrived else math.inf


def disturbed_rows(case: DisturbedCase, seeds: Iterable[int] = SEEDS) -> Iterator[BenchRow]:
    """For both local planners, by estimated poses: excess over the least time, intrusion."""
    own = "error of the pose" if case.within_error else "the user's disc"
    for name in LOCAL_PLANNERS:
        found = [(least, result) for seed in seeds for least, result in _driven(case, name, seed)]
        if math.isfinite(case.over):
            over = [100.0 * (result.time / least - 1.0) for least, result in found]
            yield BenchRow(
                NAME, f"drives, {case.name}", name,
                error=round(statistics.fmean(over), 3), error_unit="% over the least time, mean",
                reference="direct transcription, 120 intervals", goal=case.over,
            )  # fmt: skip
        deepest = max(case.depth(result) for _, result in found)
        yield BenchRow(
            NAME, f"drives, {case.name}: intrusion", name,
            error=round(100.0 * max(0.0, deepest), 3), error_unit="cm", reference=own, goal=0.0,
        )  # fmt: skip


def _driven(case: DisturbedCase, name: str, seed: int) -> Iterator[tuple[float, DisturbedResult]]:
    """Least time and result of each drive; one that did not arrive has infinite time."""
    if case in WALKERS:
        for walk in WALKS:
            yield math.inf, drive_disturbed(
                _driver(name), walk.trial, case.disturbance, seed, HZ,
                walking=walk.walking, window=WINDOW,
            )  # fmt: skip
        return
    for trial in TRIALS:
        result = drive_disturbed(_driver(name), trial, case.disturbance, seed, HZ)
        yield trial.least_time, result if result.arrived else replace(result, time=math.inf)


def _driver(name: str, limits: Limits = LIMITS, tolerance: Tolerance = TOLERANCE) -> LocalPlanner:
    floor = ExactPlanner(OPEN_ROOM, inflation_radius=0.5)
    return LOCAL_PLANNERS[name](floor, limits, tolerance)
