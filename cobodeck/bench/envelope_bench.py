"""Benchmark of what can be escaped: the search for the best motion, and what it finds.

The search is measured over its grid: the error is that of the gap which the best motion keeps,
against a finer grid. Then come the least distances from which a person can be avoided at all: of
centres, m, at the start of a person's walk at the standing robot, and for a person who turns first
the largest gap that can be kept. They stand as errors, have no time, and hold for every behaviour.
"""

from __future__ import annotations

import itertools
import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from cobodeck.avoidable import (
    CENTRES,
    GAP,
    STANDING,
    ZONES,
    Oncoming,
    Question,
    SearchGrid,
    asked,
    best_motion,
    gap_beside_turning,
    least_distance,
)
from cobodeck.bench.harness import ROUNDS, BenchRow, TimedPoint, Work, timed, times

NAME = "envelope"
AIMS = {"no touch": GAP, "1.27 m apart": CENTRES, "no Escape": ZONES}
ACCELERATIONS = (0.5, 1.0, 1.5, 3.0)
SPEEDS, DELAYS_S = (0.5, 1.0, 2.0), (0.0, 0.4)
"""Varied one at a time; else 1.5 m/s and 0.2 s, at 1 m/s2."""
REACTIONS_S = (0.3, 0.5, 0.8)
SLOWEST_S = 0.8
"""The slowest reaction of attentive people, s."""
TURNS_DEG = (90, 180)
USUAL = SearchGrid()
KNOBS: dict[str, tuple[float, ...]] = {
    "directions": (6, 12, 24, 48),
    "step": (0.2, 0.1, 0.05, 0.025),
    "durations": (1, 2, 5),
}
FINE = {"directions": 96, "step": 0.0125, "durations": 11}
DURATIONS_S: dict[float, tuple[float, ...]] = {
    1: (0.7,),
    2: (0.4, 1.1),
    5: USUAL.holds_s,
    11: (0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9, 1.1, 1.3, 1.6, 2.0),
}
"""By their number: for how long a phase may last, s."""
MOST_ROUNDS = 3


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """The search over its grid, then the distances, then the gaps beside who turns first."""
    yield from search_rows(questions(), rounds)
    for acceleration in ACCELERATIONS:
        approach = Oncoming(acceleration=acceleration)
        yield from _distances("walks on", approach, "acceleration", acceleration)
    for speed in SPEEDS:
        yield from _distances("walks on", Oncoming(speed), "speed", speed)
    for delay in DELAYS_S:
        yield from _distances("walks on", Oncoming(delay_s=delay), "delay", delay)
    for what, acceleration in (("sign, robot stands", STANDING), ("sign", 1.0)):
        for reaction in REACTIONS_S:
            approach = Oncoming(acceleration=acceleration, reaction_s=reaction)
            yield from _distances(what, approach, "reaction", reaction)
    yield from _distances("wall behind", Oncoming(wall=True), "acceleration", 1.0)
    for reaction in REACTIONS_S:
        approach = Oncoming(reaction_s=reaction, wall=True)
        yield from _distances("wall behind, sign", approach, "reaction", reaction)
    for degrees in TURNS_DEG:
        for seen, slowest in itertools.product(("turn", "walk"), (None, SLOWEST_S)):
            approach = Oncoming(reaction_s=slowest)
            gap = gap_beside_turning(math.radians(degrees), seen=seen, approach=approach)
            heeds = "" if slowest is None else f", sign, {slowest:g} s"
            what = f"turns first, {seen} seen{heeds}"
            row = _row(what, "largest gap", "turn_deg", degrees, gap)
            yield replace(row, more_is_better=True)


def questions() -> tuple[Question, ...]:
    """Three searches over 3 s: beside a wall, and from two sides of a robot that stands turned."""
    found = (
        asked(Oncoming(wall=True), 2.5),
        asked(Oncoming(), 2.2, 0.5),
        asked(Oncoming(1.0, 1.5), 1.8, 0.8),
    )
    return tuple(replace(question, horizon_s=3.0, one_side=False) for question in found)


def search_rows(
    asked_for: Sequence[Question], rounds: int, knobs: Sequence[str] = tuple(KNOBS)
) -> Iterator[BenchRow]:
    """Time and error of the search, one knob of its grid varied at a time."""
    points: list[TimedPoint] = []
    for knob in knobs:
        exact = _gaps(asked_for, _grid(knob, FINE[knob]))
        for value in KNOBS[knob]:
            grid = _grid(knob, value)
            search = partial(_gaps, asked_for, grid)
            off = statistics.fmean(abs(a - b) for a, b in zip(search(), exact, strict=True))
            row = BenchRow(
                NAME, "search", "cobodeck", knob, value, error=round(100.0 * off, 3),
                error_unit="cm of the gap, mean", reference=f"{knob} {FINE[knob]:g}",
                default=grid == USUAL,
            )  # fmt: skip
            points.append((row, Work(times(search), items=len(asked_for))))
    yield from timed(points, min(rounds, MOST_ROUNDS))


def _grid(knob: str, value: float) -> SearchGrid:
    if knob == "directions":
        return replace(USUAL, directions=round(value))
    if knob == "step":
        return replace(USUAL, step_s=value)
    return replace(USUAL, holds_s=DURATIONS_S[value])


def _gaps(asked_for: Sequence[Question], grid: SearchGrid) -> list[float]:
    found = [best_motion(replace(question, grid=grid)) for question in asked_for]
    assert None not in found
    return [motion.gap for motion in found if motion is not None]


def _distances(what: str, approach: Oncoming, knob: str, value: float) -> Iterator[BenchRow]:
    for aim, number in AIMS.items():
        yield _row(what, aim, knob, value, least_distance(approach, number))


def _row(what: str, aim: str, knob: str, value: float, found: float | None) -> BenchRow:
    error = None if found is None else round(found, 3)
    return BenchRow(NAME, what, aim, knob, value, error=error, error_unit="m")
