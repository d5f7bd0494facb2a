"""Benchmark of whole runs: computing time relative to simulated time, by tier."""

from __future__ import annotations

import statistics
from collections.abc import Iterator

from cobodeck.bench.harness import ROUNDS, BenchRow
from cobodeck.options import Options
from cobodeck.setup import open_setup
from cobodeck.simulate import simulate

NAME = "simulation"
SCENE = "study"
REQUESTS, DURATION_S = 3, 600.0
GOALS = {0: 1 / 10_000, 1: 1 / 300}


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """One row per tier: µs per tick, and wall time over simulated time."""
    for tier, goal in GOALS.items():
        setup = open_setup(scene=SCENE)
        options = Options(tier=tier, requests=REQUESTS, duration_s=DURATION_S)
        simulate(setup, options)
        found = [simulate(setup, options).figures for _ in range(min(rounds, 5))]
        shares = [figures["wall_s"] / figures["sim_s"] for figures in found]
        ticks = [figures["wall_s"] / figures["ticks"] for figures in found]
        yield BenchRow(
            NAME,
            f"tier_{tier}",
            "cobodeck",
            "requests",
            REQUESTS,
            time_us=statistics.median(ticks) * 1e6,
            ratio=statistics.median(shares),
            ratio_to="real time",
            goal=goal,
        )
