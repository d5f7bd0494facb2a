"""Benchmark of the Chase pose: run time against error over the size of the cells.

The error is by how much the chosen place falls short of the best one on cells of 1 cm, in per cent
of its weight, where all of these are weighed: the mean of the situations in which a place was
found. Another row tells in how many none was, though there is one. `tuned` weighs the risk of about
`chase.CELLS` cells, and counts weights within `tie` as equal; beside it stands the same without
ties, and with all cells.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from behaviors import chase, person
from behaviors.profile import Settings, load_profile
from behaviors.situation import Array, ChaseCell, ChaseSpace, Situation, grid, space
from cobodeck.bench.harness import ROUNDS, BenchRow, TimedPoint, Work, timed, times
from cobodeck.bench.navigation.decisions import SCENE, situations
from hw import compile_examples
from hw.model import load_robot
from hw.scene import Point, load_scene
from states.environment import Environment
from states.navigation.exact import visibility

NAME = "chase"
CELLS_M, FINEST_M = (0.4, 0.2, 0.1, 0.05, 0.025), 0.01
SITUATIONS = 20
REFERENCE = "best of all cells of 1 cm with a way there"
ALL = 10**9
AT_ONCE = 500
"""Cells whose risk is computed in one go when looking for the best of 1 cm."""


@dataclass(frozen=True, slots=True)
class _Choice:
    """One way of choosing among cells of a size: settings, number of cells weighed by risk."""

    name: str
    environment: Environment
    settings: Settings
    most: int = chase.CELLS

    def at(self, cell: float) -> _Choice:
        chosen = replace(self.settings.chase, cell=cell)
        return replace(self, settings=replace(self.settings, chase=chosen))

    def cells(self) -> Array:
        return grid(self.environment, self.settings)

    def space(self, now: Situation, cells: Array) -> ChaseSpace:
        return space(self.settings, lambda: cells, now.planners["chase"], now.user)

    def best(self, now: Situation, cells: Array) -> Point | None:
        seen = replace(now, settings=self.settings)
        return chase.best_cell(seen, self.space(now, cells), self.most)


def rows(
    rounds: int = ROUNDS, sizes: Iterable[float] = CELLS_M, count: int = SITUATIONS
) -> Iterator[BenchRow]:
    """The decision by size of the cells; then the making of these cells, once per room."""
    compile_examples((person, visibility))
    points: list[TimedPoint] = []
    missing: list[BenchRow] = []
    building: list[TimedPoint] = []
    for choices in _choices():
        first = choices[0]
        met = situations(first.environment, first.settings, count)
        finest = first.at(FINEST_M).cells()
        best = [_largest(first, now, finest) for now in met]
        for size in sizes:
            own = size == first.settings.chase.cell
            for choice in choices:
                point, missed = _point(choice.at(size), met, best, own)
                points.append(point)
                missing.append(missed)
            making = BenchRow(
                NAME, "making cells", first.name, "cell", size, default=own and _ours(first),
                reference="has no error: each cell has its own weight",
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
        if settings.chase.risk == 0.0:
            yield (usual,)
            continue
        without = replace(settings, chase=replace(settings.chase, tie=0.0))
        untied = replace(usual, name=f"{name}, no ties", settings=without)
        yield usual, untied, replace(untied, name=f"{name}, no ties, all cells", most=ALL)


def _ours(choice: _Choice) -> bool:
    return choice.name == "tuned"


def _point(
    choice: _Choice, met: Sequence[Situation], best: Sequence[float], own: bool
) -> tuple[TimedPoint, BenchRow]:
    cells = choice.cells()
    short = [_shortfall(choice, now, cells, most) for now, most in zip(met, best, strict=True)]
    found = [lost for lost in short if lost is not None]
    row = BenchRow(
        NAME, "choice of the pose", choice.name, "cell", choice.settings.chase.cell,
        error=round(statistics.fmean(found), 4), error_unit="% of weight lost, mean",
        reference=REFERENCE, default=own and _ours(choice),
    )  # fmt: skip
    missed = replace(
        row, name="no pose found", error=100.0 * (1.0 - len(found) / len(met)),
        error_unit="% of situations", default=False,
    )  # fmt: skip
    return (row, Work(partial(_choose, choice, met, cells), items=len(met))), missed


def _choose(choice: _Choice, met: Sequence[Situation], cells: Array, count: int) -> None:
    for _ in range(count):
        for now in met:
            choice.best(now, cells)


def _shortfall(choice: _Choice, now: Situation, cells: Array, most: float) -> float | None:
    """What the chosen place lacks to the largest weight, %; None if none was found.

    It is a little below 0 for a place between cells of 1 cm that weighs more than these.
    """
    found = choice.best(now, cells)
    if found is None:
        return None
    free = choice.space(now, cells).all_free()
    own = free[(free[:, 0] == found[0]) & (free[:, 1] == found[1])]
    seen = replace(now, settings=choice.settings)
    return 100.0 * (1.0 - _weighed(seen, own)[0][2] / most)


def _largest(choice: _Choice, now: Situation, cells: Array) -> float:
    """The largest weight of a cell to which there is a way; they come best first.

    Risk only lowers weights, so that the rest need not be looked at once all of them are lower.
    """
    seen = replace(now, settings=choice.settings)
    free, best = choice.space(now, cells).all_free(), 0.0
    for first in range(0, len(free), AT_ONCE):
        if free[first, 2] <= best:
            break
        for x, y, weight in _weighed(seen, free[first : first + AT_ONCE]):
            if weight <= best:
                break
            if _has_way(seen, (x, y)):
                best = weight
                break
    return best


def _weighed(now: Situation, cells: Array) -> list[ChaseCell]:
    """Cells with weights that include the risk, if the settings count it; best first."""
    if now.settings.chase.risk == 0.0:
        found: list[ChaseCell] = cells.tolist()
        return found
    return chase.drives_weighed(now, chase.out_of_the_way(now, cells, ALL))


def _has_way(now: Situation, place: Point) -> bool:
    here, user = (now.pose.x, now.pose.y), now.user_disc("chase", place)
    return now.planners["chase"].plan(here, place, user) is not None
