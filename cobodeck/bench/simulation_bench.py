"""Benchmark of whole runs by measures that hold on any machine.

CPU is that of 33 ms in the loop, beside other simulators in the same process, and the unit is that
of MuJoCo. Which parts of a tick take it is sampled. Tier 0 is told relative to real time.

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
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from operator import itemgetter
from pathlib import Path
from types import FrameType

from cobodeck.bench import peers, simulation_curves
from cobodeck.bench.compare import MORE_CALLS
from cobodeck.bench.harness import ROUNDS, BenchRow
from cobodeck.bench.simulation_cpu import HZ, least_cpu, run_cpu, shares
from cobodeck.loop import Loop
from cobodeck.record.format import versions
from cobodeck.run import simulate
from cobodeck.setup import FULL, Options, Setup, open_setup
from engine.chart import load_text
from hw import needs

NAME = "simulation"
SCENE = "study"
REQUESTS, DURATION_S = 3, 600.0
TIER_0_GOAL = 1 / 10_000
UNIT = "MuJoCo"
KNOWN_CALLS = Path(__file__).with_name("calls.json")
"""Calls per tick by case, and the versions with which they were counted."""
GROWTH = MORE_CALLS
"""Known calls per tick may grow by this factor."""
WAITING = """
chart: waiting
outcomes: [over]
any:
  fault: {watch: WaitFor, with: {signal: stop.engaged}, next: {there: .over}}
  tracking: {watch: UserLost, next: {lost: .over}}
"""


@dataclass(frozen=True, slots=True)
class RunCase:
    """A run that is measured; `text` is a chart in place of the shipped one."""

    scene: str
    options: Options
    text: str | None = None

    def setup(self) -> Setup:
        """The setup of the run."""
        if self.text is None:
            return open_setup(scene=self.scene)
        library = load_text(self.text)
        return open_setup(next(iter(library)), self.scene, charts=library)


CALLS = {
    "waiting": RunCase(SCENE, Options(user="brief", duration_s=60.0, seed=3), WAITING),
    "study": RunCase(SCENE, Options(requests=2, seed=3)),
    "hall": RunCase("hall", Options(user="demo", requests=1, seed=3)),
    "lab_a": RunCase("lab_a", Options(user="random", requests=2, seed=3)),
    "study_tier_2": RunCase(SCENE, Options(requests=1, seed=3, tier=FULL)),
}
CPU = {
    "study": RunCase(SCENE, Options(requests=20, seed=3)),
    "lab_a": RunCase("lab_a", Options(user="random", requests=10, seed=3)),
    "study_tier_2": RunCase(SCENE, Options(requests=3, seed=3, tier=FULL)),
}
CPU_GOALS = {"study": 1.1, "lab_a": 1.9, "study_tier_2": 5.5}
"""CPU over that of MuJoCo."""


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:
    """Curves; tier 0; CPU, beside simulators, and by part; then calls per tick."""
    yield from simulation_curves.rows(rounds)
    rounds = min(rounds, 5)
    yield tier_0_row(rounds)
    yield from cpu_rows(CPU, rounds)
    for name, case in CPU.items():
        yield from part_rows(name, case)
    for name in CALLS:
        yield calls_row(name)


def tier_0_row(rounds: int) -> BenchRow:
    """Tier 0: CPU per 33 ms, and relative to real time."""
    setup = open_setup(scene=SCENE)
    options = Options(tier=0, requests=REQUESTS, duration_s=DURATION_S)
    run_cpu(setup, options)
    taken = statistics.median(run_cpu(setup, options) for _ in range(rounds))
    return BenchRow(
        NAME, "tier_0", "cobodeck", "requests", REQUESTS, time_us=taken,
        ratio=taken * HZ / 1e6, ratio_to="real time", goal=TIER_0_GOAL,
    )  # fmt: skip


def cpu_rows(cases: Mapping[str, RunCase], rounds: int) -> Iterator[BenchRow]:
    """CPU per 33 ms of other simulators and of runs; simulators that are missing are told."""
    others = peers.simulators()
    own = {name: partial(run_cpu, case.setup(), case.options) for name, case in cases.items()}
    found = least_cpu({**others, **own}, UNIT, rounds)
    unit = found.get(UNIT)
    for name, (module, _) in peers.SIMULATORS.items():
        if name not in others:
            yield BenchRow(NAME, "cpu", name, ratio_to=needs(module), peer=True)
            continue
        yield replace(_cpu_row("cpu", name, found[name], unit), peer=True)
    for name, case in cases.items():
        requests, cpu_us = case.options.requests, found[name]
        row = _cpu_row(f"cpu_{name}", "cobodeck", cpu_us, unit)
        goal = None if unit is None else CPU_GOALS.get(name)
        yield replace(row, knob="requests", value=requests, goal=goal)
        speed = 1e6 / HZ / cpu_us
        yield BenchRow(NAME, f"cpu_{name}", "speed", ratio=speed, ratio_to="real time",
                       more_is_better=True)  # fmt: skip


def _cpu_row(name: str, variant: str, cpu_us: float, unit: float | None) -> BenchRow:
    if unit is None:
        return BenchRow(NAME, name, variant, time_us=cpu_us)
    return BenchRow(NAME, name, variant, time_us=cpu_us, ratio=cpu_us / unit, ratio_to=UNIT)


def part_rows(name: str, case: RunCase) -> Iterator[BenchRow]:
    """How much of the CPU each part of a tick takes."""
    found = shares(case.setup(), case.options)
    for part, share in sorted(found.items(), key=itemgetter(1), reverse=True):
        yield BenchRow(NAME, f"part_{name}", part, ratio=share, ratio_to="all parts")


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


def calls_per_tick(case: RunCase) -> float:
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
    python = f"{platform.python_implementation()} {sys.version_info.major}.{sys.version_info.minor}"
    if not known["versions"].items() <= {**versions(), "python": python}.items():
        return None
    return GROWTH * float(known["calls_per_tick"][name])
