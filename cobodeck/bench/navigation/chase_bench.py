"""Benchmark of the Chase pose: run time against error over the size of the cells.

The error is by how much the chosen place falls short of the best one on cells of 2.5 cm, in per
cent of its worth, the paper's weight or one over our cost: the mean of the situations in which a
place was found. Another row tells in how many none was, though there is one. `tuned` counts costs
within `tie` as equal and looks at some cells; beside it stands the same without ties, and with all
cells.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from behaviors.chase import cells_with_risk, chase_cell, chase_place, free_cells
from behaviors.person import band, drives, lines, margin, touch, waiting
from behaviors.profile import Settings, load_profile
from behaviors.situation import Array, ChaseRing, Situation, timed_cells, weighted_cells
from cobodeck.bench.harness import ROUNDS, BenchRow, TimedPoint, Work, timed, times
from cobodeck.bench.navigation.decisions import SCENE, situations
from hw import compile_examples
from hw.model import load_robot
from hw.scene import Point, load_scene
from states.environment import Environment
from states.navigation.exact import visibility

NAME = "chase"
CELLS_M, FINEST_M = (0.4, 0.2, 0.1, 0.05), 0.025
SITUATIONS = 20
REFERENCE = "best of all cells of 2.5 cm with a way there"
UNTIED = 0.0
ALL = 100_000


@dataclass(frozen=True, slots=True)
class _Choice:
    """One way of choosing among cells of a size."""

    name: str
    environment: Environment
    settings: Settings

    def at(self, cell: float) -> _Choice:
        chosen = replace(self.settings.chase, cell=cell)
        return replace(self, settings=replace(self.settings, chase=chosen))

    def cells(self) -> Array:
        chase = self.settings.chase
        ring = ChaseRing.of(chase)
        if self.settings.policy == "paper":
            return weighted_cells.__wrapped__(ring, chase.best_angle, chase.best_radius)
        return timed_cells.__wrapped__(self.environment, self.settings, ring)

    def best(self, now: Situation) -> Point | None:
        chase, seen = self.settings.chase, replace(now, settings=self.settings)
        ring = ChaseRing.of(chase)
        if self.settings.policy == "paper":
            return chase_cell(seen, ring, chase.best_angle, chase.best_radius)
        return chase_place(seen, ring)

    def worth(self, now: Situation) -> Array:
        """The free cells with their worth, (n, 3), best first."""
        cells = free_cells(now, self.cells())
        if self.settings.policy != "paper":
            costed = cells_with_risk(replace(now, settings=self.settings), cells)
            cells = np.column_stack((costed[:, :2], 1.0 / costed[:, 2]))
        return cells[np.argsort(-cells[:, 2], kind="stable")]


def rows(
    rounds: int = ROUNDS, sizes: Iterable[float] = CELLS_M, count: int = SITUATIONS
) -> Iterator[BenchRow]:
    """The decision by size of the cells; then the making of these cells, once per room."""
    compile_examples((band, drives, lines, margin, touch, waiting, visibility))
    points: list[TimedPoint] = []
    missing: list[BenchRow] = []
    building: list[TimedPoint] = []
    for choices in _choices():
        first = choices[0]
        met = situations(first.environment, first.settings, count)
        best = [_best_worth(first.at(FINEST_M), now) for now in met]
        for size in sizes:
            own = size == first.settings.chase.cell
            for choice in choices:
                point, missed = _point(choice.at(size), met, best, own)
                points.append(point)
                missing.append(missed)
            making = BenchRow(
                NAME, "making cells", first.name, "cell", size, default=own and _ours(first),
                reference="has no error: each cell has its own worth",
            )  # fmt: skip
            building.append((making, Work(times(first.at(size).cells))))
    yield from timed(points, rounds)
    yield from missing
    yield from timed(building, rounds)


def _choices() -> Iterator[tuple[_Choice, ...]]:
    room, robot = load_scene(SCENE).room, load_robot("rbkairos_ur10")
    for name in ("tuned", "paper"):
        profile = load_profile(name)
        environment, settings = profile.environment(room, robot), profile.settings
        usual = _Choice(name, environment, settings)
        if profile.policy == "paper":
            yield (usual,)
            continue
        without = replace(settings, chase=replace(settings.chase, tie=UNTIED))
        every = replace(without, chase=replace(without.chase, cells=ALL))
        untied = replace(usual, name=f"{name}, no ties", settings=without)
        yield usual, untied, replace(untied, name=f"{name}, no ties, all cells", settings=every)


def _ours(choice: _Choice) -> bool:
    return choice.name == "tuned"


def _point(
    choice: _Choice, met: Sequence[Situation], best: Sequence[float], own: bool
) -> tuple[TimedPoint, BenchRow]:
    short = [_shortfall(choice, now, most) for now, most in zip(met, best, strict=True)]
    found = [lost for lost in short if lost is not None]
    row = BenchRow(
        NAME, "choice of the pose", choice.name, "cell", choice.settings.chase.cell,
        error=round(statistics.fmean(found), 4), error_unit="% of worth lost, mean",
        reference=REFERENCE, default=own and _ours(choice),
    )  # fmt: skip
    missed = replace(
        row, name="no pose found", error=100.0 * (1.0 - len(found) / len(met)),
        error_unit="% of situations", default=False,
    )  # fmt: skip
    return (row, Work(partial(_choose, choice, met), items=len(met))), missed


def _choose(choice: _Choice, met: Sequence[Situation], count: int) -> None:
    for _ in range(count):
        for now in met:
            choice.best(now)


def _shortfall(choice: _Choice, now: Situation, most: float) -> float | None:
    """What the chosen place lacks to the greatest worth, %; None if none was found.

    It is a little below 0 for a place between the finest cells that is worth more than these.
    """
    found = choice.best(now)
    if found is None:
        return None
    cells = choice.worth(now)
    own = cells[(cells[:, 0] == found[0]) & (cells[:, 1] == found[1])]
    return 100.0 * (1.0 - float(own[0, 2]) / most)


def _best_worth(choice: _Choice, now: Situation) -> float:
    """The greatest worth of a cell to which there is a way."""
    planner, here = now.planners["chase"], (now.pose.x, now.pose.y)
    for x, y, worth in choice.worth(now).tolist():
        if planner.plan(here, (x, y), now.user_disc("chase", (x, y))) is not None:
            return float(worth)
    return 0.0
