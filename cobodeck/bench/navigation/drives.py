"""Benchmark of drives by ideal and estimated poses: run time, excess over least time, intrusion."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Iterator
from dataclasses import replace
from time import perf_counter_ns

from cobodeck.bench.harness import ROUNDS, BenchRow
from cobodeck.bench.navigation.disturbed import (
    CASES,
    WALKERS,
    WALKS,
    DisturbedCase,
    DisturbedResult,
    drive_disturbed,
)
from cobodeck.bench.navigation.drive_trials import OPEN_ROOM, TRIALS, Trial, drive
from states.navigation import LOCAL_PLANNERS, Limits, Tolerance
from states.navigation.exact import ExactPlanner
from states.navigation.local import LocalPlanner

NAME = "navigation"

PERIOD = 0.05
DRIVE_GOALS = {"profile": 7.0, "teb": 5.0}
"""Largest excess over the least time, %."""


HZ = 30.0
"""Rate of the control cycles in drives by estimated poses, Hz."""
SEEDS = range(20, 24)
WINDOW = 0.3
"""Time over which the velocity of a walking user is estimated, s."""


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """Everything, row by row."""
    for trial in TRIALS:
        yield from drive_rows(trial, rounds)
    for case in (*CASES, *WALKERS):
        yield from disturbed_rows(case)


def drive_rows(trial: Trial, rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """For both local planners: median cycle time, excess over the least time, intrusion."""
    for name in LOCAL_PLANNERS:
        drives = [
            drive(_driver(name), trial, PERIOD, clock=perf_counter_ns)
            for _ in range(min(rounds, 3))
        ]
        cycles = [min(same) / 1e9 for same in zip(*(d.cycles_ns for d in drives), strict=True)]
        time = drives[0].time if drives[0].arrived else math.inf
        yield BenchRow(
            NAME, f"drive {trial.name}", name, "period", PERIOD,
            time_us=statistics.median(cycles) * 1e6,
            ratio=statistics.median(cycles) / PERIOD,
            ratio_to="period",
            error=round(100.0 * (time / trial.least_time - 1.0), 3),
            error_unit="% over the least time",
            reference="direct transcription, 120 intervals",
            goal=DRIVE_GOALS[name],
        )  # fmt: skip
        if trial.user is not None:
            deepest = max(0.0, drives[0].intrusion)
            yield BenchRow(
                NAME, f"drive {trial.name} intrusion", name, "period", PERIOD,
                error=round(100.0 * deepest, 3), error_unit="cm",
                reference="the user's disc", goal=0.0 if name == "profile" else 3.0,
            )  # fmt: skip


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


def _driver(name: str) -> LocalPlanner:
    return LOCAL_PLANNERS[name](
        ExactPlanner(OPEN_ROOM, inflation_radius=0.5), Limits(), Tolerance()
    )
