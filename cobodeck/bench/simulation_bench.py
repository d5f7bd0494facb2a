"""Benchmark of whole runs: computing time relative to simulated time by tier, and calls per tick.

Calls per tick are Python and C calls inside the loop, over simulated seconds times the tick rate,
so that ticks left out count as well. They are exact: every machine with the same versions of
Python and of the libraries counts the same. Those in `calls.json` may grow by 2 %.
"""

from __future__ import annotations

import gc
import json
import platform
import statistics
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from types import FrameType

from cobodeck.bench.harness import ROUNDS, WORSE, BenchRow
from cobodeck.loop import Loop
from cobodeck.run import simulate
from cobodeck.setup import CHART, FULL, Options, Setup, open_setup
from engine.chart import load_text

NAME = "simulation"
SCENE = "study"
REQUESTS, DURATION_S = 3, 600.0
GOALS = {0: 1 / 10_000, 1: 1 / 300}
KNOWN_CALLS = Path(__file__).with_name("calls.json")
"""Calls per tick by case, and the versions with which they were counted."""
LIBRARIES = ("numpy", "scipy", "shapely", "networkx", "numba")
GROWTH = WORSE["calls_per_tick"]
"""Known calls per tick may grow by this factor."""
WAITING = """
chart: waiting
outcomes: [over]
any:
  fault: {watch: FaultRaised, next: {raised: .over}}
  tracking: {watch: UserLost, next: {lost: .over}}
"""


@dataclass(frozen=True, slots=True)
class CallsCase:
    """A run whose calls are counted; `text` is a chart in place of the shipped one."""

    scene: str
    options: Options
    text: str | None = None

    def setup(self) -> Setup:
        """The setup of the run."""
        if self.text is None:
            return open_setup(CHART, self.scene)
        library = load_text(self.text)
        return open_setup(next(iter(library)), self.scene, charts=library)


CALLS = {
    "waiting": CallsCase(SCENE, Options(user="brief", duration_s=60.0, seed=3), WAITING),
    "study": CallsCase(SCENE, Options(requests=2, seed=3)),
    "hall": CallsCase("hall", Options(user="demo", requests=1, seed=3)),
    "lab_a": CallsCase("lab_a", Options(user="random", requests=2, seed=3)),
    "study_tier_2": CallsCase(SCENE, Options(requests=1, seed=3, tier=FULL)),
}


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """One row per tier: µs per tick, and wall time over simulated time; then calls per tick."""
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
    for name in CALLS:
        yield calls_row(name)


def calls_row(name: str) -> BenchRow:
    """The calls per tick of a case."""
    case = CALLS[name]
    requests = case.options.requests
    return BenchRow(
        NAME,
        f"calls_{name}",
        "cobodeck",
        None if requests is None else "requests",
        requests,
        goal=calls_limit(name),
        calls_per_tick=calls_per_tick(case),
    )


def calls_per_tick(case: CallsCase) -> float:
    """Python and C calls per tick of the second of two equal runs; the first fills all caches."""
    setup = case.setup()
    simulate(setup, case.options)
    counter = _Counter()
    figures = simulate(setup, case.options, around=counter.counting).figures
    return counter.calls / float(figures["sim_s"] * setup.tick_hz)


@dataclass(slots=True)
class _Counter:
    calls: int = 0

    @contextmanager
    def counting(self, _loop: Loop) -> Iterator[None]:
        """Count while the loop runs; without the collector, whose callbacks are calls as well."""
        before, collects = sys.getprofile(), gc.isenabled()
        gc.disable()
        sys.setprofile(self._count)
        try:
            yield
        finally:
            sys.setprofile(before)
            if collects:
                gc.enable()

    def _count(self, _frame: FrameType, event: str, _argument: object) -> None:
        if event in ("call", "c_call"):
            self.calls += 1


def calls_limit(name: str) -> float | None:
    """The most calls per tick that a case may have; None with versions not counted with."""
    known = json.loads(KNOWN_CALLS.read_text())
    if known["versions"] != versions():
        return None
    return GROWTH * float(known["calls_per_tick"][name])


def versions() -> dict[str, str]:
    """What calls depend on besides our own code."""
    python = f"{platform.python_implementation()} {sys.version_info.major}.{sys.version_info.minor}"
    return {"python": python, **{name: version(name) for name in LIBRARIES}}
