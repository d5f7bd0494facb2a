"""Benchmark of what can be escaped: the least distances from which a person can be avoided at all.

The errors are distances of centres, m, at the start of a person's walk at the standing robot, and
for a person who turns first the largest gap that can be kept. They hold for every behaviour.
"""

from __future__ import annotations

import itertools
import math
import statistics
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from cobodeck.avoidable import (
    CENTRES,
    GAP,
    STANDING,
    ZONES,
    Oncoming,
    Question,
    asked,
    best_motion,
    gap_beside_turning,
    least_distance,
)
from cobodeck.bench.harness import ROUNDS, BenchRow, Work, seconds_of

NAME = "envelope"
AIMS = {"no touch": GAP, "1.27 m apart": CENTRES, "no Escape": ZONES}
ACCELERATIONS = (0.5, 1.0, 1.5, 3.0)
SPEEDS, DELAYS_S = (0.5, 1.0, 2.0), (0.0, 0.4)
"""Varied one at a time; else 1.5 m/s and 0.2 s, at 1 m/s2."""
REACTIONS_S = (0.3, 0.5, 0.8)
SLOWEST_S = 0.8
"""The slowest reaction of attentive people, s."""
TURNS_DEG = (90, 180)
SEARCH_S = 0.2
"""Goal for one search, s."""


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """The time of one search, then the distances, then the gaps beside who turns first."""
    yield search_row(rounds)
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
            yield _row(what, "largest gap", "turn_deg", degrees, gap)


def search_row(rounds: int) -> BenchRow:
    """The time of one search over 3 s, beside a wall and a person who comes from 2.5 m."""
    question = replace(asked(Oncoming(wall=True), 2.5), horizon_s=3.0, one_side=False)
    motion = best_motion(question)
    assert motion is not None
    work = Work(partial(_repeat, question))
    taken = statistics.median(seconds_of(work, 1) for _ in range(min(rounds, 5)))
    return BenchRow(
        NAME, "search", "cobodeck", "motions", motion.tried, time_us=taken * 1e6,
        ratio=taken / SEARCH_S, ratio_to=f"{1e3 * SEARCH_S:g} ms", goal=1.0,
    )  # fmt: skip


def _repeat(question: Question, count: int) -> None:
    for _ in range(count):
        best_motion(question)


def _distances(what: str, approach: Oncoming, knob: str, value: float) -> Iterator[BenchRow]:
    for aim, number in AIMS.items():
        yield _row(what, aim, knob, value, least_distance(approach, number))


def _row(what: str, aim: str, knob: str, value: float, found: float | None) -> BenchRow:
    error = None if found is None else round(found, 3)
    return BenchRow(NAME, what, aim, knob, value, error=error, error_unit="m")
