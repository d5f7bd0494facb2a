"""Whole runs are the same whether the loop leaps over what repeats, visits it, or skips nothing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from typing import Any

import pytest

from cobodeck.loop import Loop, Ticked
from cobodeck.run import simulate
from cobodeck.setup import Options, open_setup
from tests.repeats import long_form

COUNTS = {"wall_s", "realtime_factor", "cpu_us_per_tick", "signals", "overruns", "left_out"}
"""Figures of the computation, not of the run."""


class Tapped:
    """A tap of the loop, which needs all repeats."""

    def failed(self, part: str, error: BaseException) -> None:
        pass

    def tick(self, ticked: Ticked) -> None:
        pass


@contextmanager
def visiting_all(loop: Loop) -> Iterator[None]:
    loop.taps = [*loop.taps, Tapped()]
    yield


def played(options: Options, chart: str, scene: str, profile: str, leaps: bool) -> dict[str, Any]:
    setup = open_setup(chart, scene, profile=profile)
    result = simulate(setup, options, around=nullcontext if leaps else visiting_all)
    kept = {name: value for name, value in result.figures.items() if name not in COUNTS}
    return {**kept, "trace": list(result.wired.run.trace.lines()), "leapt": result.loop.leapt}


def same(options: Options, chart: str, scene: str, profile: str = "tuned") -> int:
    """The ticks leapt over; fails unless all three runs are the same."""
    given = chart, scene, profile
    leapt = played(options, *given, leaps=True)
    ticks: int = leapt.pop("leapt")
    for other in (
        played(options, *given, leaps=False),
        played(replace(options, eager=True), *given, leaps=True),
    ):
        assert other.pop("leapt") == 0
        assert other == leapt
    return ticks


RUNS = {
    "study": ("cobodeck", "study", "tuned", Options(requests=1, seed=5)),
    "paper": ("cobodeck", "study", "paper", Options(requests=1, seed=6)),
    "random": ("cobodeck", "lab_a", "tuned", Options(user="random", requests=1, seed=7)),
    "chase": ("chase", "lab_b", "tuned", Options(user="random", duration_s=20.0, seed=8)),
    "full": ("cobodeck", "study", "tuned", Options(duration_s=15.0, seed=9, tier=2)),
    "logic": ("cobodeck", "study", "tuned", Options(duration_s=60.0, seed=9, tier=0)),
}


@pytest.mark.parametrize("run", RUNS)
def test_a_run_is_the_same_leapt_over_or_not(run: str) -> None:
    chart, scene, profile, options = RUNS[run]

    ticks = same(options, chart, scene, profile)

    assert (ticks > 0) == (run in ("study", "paper", "random"))


@long_form
@pytest.mark.slow
@pytest.mark.parametrize("profile", ["tuned", "paper"])
@pytest.mark.parametrize("scene", ["study", "lab_a", "lab_b", "hall"])
@pytest.mark.parametrize("seed", range(4))
def test_all_scenes_and_profiles_are_the_same(scene: str, profile: str, seed: int) -> None:
    same(Options(user="random", requests=1, seed=100 + seed), "cobodeck", scene, profile)
