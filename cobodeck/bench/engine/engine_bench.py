"""Overhead of the engine over the bare work of its states, compared with other engines.

The lower limit is a loop that only calls the states' own steps one after another; see
`engine_works`. There is no error to weigh against time: tests count each step and each transition.
So curves are over sizes.
"""

from __future__ import annotations

import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import yaml

from cobodeck.bench import harness
from cobodeck.bench.engine import engine_works as works
from cobodeck.bench.engine.engine_works import started, ticking
from cobodeck.bench.harness import BenchRow, Work, timed, times
from engine.chart import load_text
from engine.machine import Machine

NAME = "engine"
PARALLEL = (10, 30, 100)
FRESH = (1, 5, 20)
BOXES = (1, 3, 10)
"""Guarded sequences of the chart to load, of 100 leaves each."""
NUMBERS = (100, 1000, 10_000)
EXACT = "exact: steps and transitions are counted"


@dataclass(frozen=True, slots=True)
class BenchCase:
    """Engines that do the same work; their times are divided by that of `limit`."""

    name: str
    limit: Work
    limit_name: str
    variants: Mapping[str, Work]
    knob: str | None = None
    value: float | None = None
    goal: float | None = None


def rows(rounds: int = harness.ROUNDS) -> Iterator[BenchRow]:
    """Measure everything, row by row."""
    from cobodeck.bench import peers

    for case in cases(peers.found()):
        yield from timed(
            [(_row(case, variant), work) for variant, work in case.variants.items()],
            rounds, limit=case.limit, limit_name=case.limit_name,
        )  # fmt: skip
    yield from costs(peers.found())


def _row(case: BenchCase, variant: str) -> BenchRow:
    ours = variant == "cobodeck"
    return BenchRow(
        NAME, case.name, variant, case.knob, case.value,
        reference=EXACT, goal=case.goal if ours else None, peer=not ours,
    )  # fmt: skip


def cases(others: dict[str, Any]) -> Iterator[BenchCase]:
    """The timed comparisons; `others` are the installed peers."""

    def beside(kind: str, own: Work, *size: int) -> dict[str, Work]:
        made = {name: getattr(peer, kind, None) for name, peer in others.items()}
        return {"cobodeck": own} | {name: make(*size) for name, make in made.items() if make}

    yield from _ticks(beside)
    yield from _edges(beside)
    for boxes in BOXES:
        yield _loading(beside, boxes)
    small = started(works.READING.replace("SIZE", "1"))
    for size in NUMBERS:
        large = started(works.READING.replace("SIZE", str(size)))
        own = {"cobodeck": ticking(large)}
        yield BenchCase(
            "read numbers", ticking(small), "reading a float", own, "numbers", size, 1.1
        )


Beside = Callable[..., dict[str, Work]]


def _ticks(beside: Beside) -> Iterator[BenchCase]:
    """Ticks in which nothing ends."""
    run = started(works.PAIR)
    bare, name = works.loop(works.steps_of(run)), "for step in steps: step()"
    own = beside("pair", ticking(run))
    yield BenchCase("no new sample", bare, name, own, "signals", works.SIGNALS, 3.5)
    recorded = {"cobodeck": works.recording(run)}
    yield BenchCase("every tick recorded", bare, name, recorded, "signals", works.SIGNALS, 6)
    run = started(works.PAIR)
    bare = works.loop(works.steps_of(run))
    long = {"cobodeck": works.recording(run, long=True)}
    yield BenchCase("every tick recorded, long run", bare, name, long, "signals", works.SIGNALS)
    for fresh in FRESH:
        run = started(works.PAIR)
        bare = works.loop(works.steps_of(run))
        sampled = {"cobodeck": works.sampling(run, fresh)}
        goal = 20 if fresh == 5 else None
        yield BenchCase("fresh samples", bare, name, sampled, "samples", fresh, goal)
    for count in PARALLEL:
        run = started(works.parallel(count))
        bare = works.loop(works.steps_of(run))
        own, goal = beside("parallel", ticking(run), count), 3 if count == 100 else None
        yield BenchCase("in parallel", bare, name, own, "nodes", count, goal)


def _edges(beside: Beside) -> Iterator[BenchCase]:
    """Ticks in which one transition is taken."""
    bare, name = Work(works.bare_edge), "the same states made and stepped"
    run = started(works.STEPS)
    yield BenchCase("edge without timeout", bare, name, beside("steps", ticking(run)), goal=8)
    run = started(works.TIMED)
    yield BenchCase("edge with timeout", bare, name, {"cobodeck": ticking(run)}, goal=8)
    run = started(works.STEPS, lock="guard")
    yield BenchCase("a lock set", bare, name, {"cobodeck": ticking(run)}, goal=8)
    name = "the same states made, stepped, closed"
    bare, run = Work(works.bare_guard), started(works.GUARDED)
    own = beside("guarded", ticking(run))
    yield BenchCase("guard out of a two-leaf any", bare, name, own, goal=9)
    bare, run = Work(works.bare_chase), started(works.CHASING, works.CHASE)
    own = {"cobodeck": ticking(run)}
    yield BenchCase("guard out of a chart as in chase", bare, name, own, "states", 6, 9)


def _loading(beside: Beside, boxes: int) -> BenchCase:
    from engine.check import check

    text, leaves = works.large_chart(boxes), 100 * boxes

    def ours() -> None:
        library = load_text(text)
        found = list(library.findings) + list(check(library, works.INTERFACES))
        assert not found, found[0]

    bare = Work(times(partial(yaml.load, text, yaml.CSafeLoader)))
    variants = beside("loading", Work(times(ours)), leaves)
    parse = "C-YAML parse of the file"
    return BenchCase("load and check", bare, parse, variants, "leaves", leaves, 1.5)


def costs(others: dict[str, Any]) -> Iterator[BenchRow]:
    """Import time and memory of the engine and of the peers, each import in its own process."""
    modules = {"cobodeck": "engine.run.chart_run, engine.chart.load, engine.check"}
    modules |= {name: peer.MODULES for name, peer in others.items()}
    for variant, names in modules.items():
        seconds, megabytes = _import_cost(names)
        yield BenchRow(
            NAME, "import", variant, "MB", megabytes, seconds * 1e6, peer=variant != "cobodeck"
        )  # fmt: skip
    loads = {"cobodeck": lambda: Machine(*_large_machine())}
    loads |= {name: peer.load for name, peer in others.items() if hasattr(peer, "load")}
    for variant, load in loads.items():
        yield BenchRow(
            NAME, "machine of 1000 leaves", variant, "MB", _kept_megabytes(load),
            peer=variant != "cobodeck",
        )  # fmt: skip


def _large_machine() -> tuple[Any, ...]:
    library = load_text(works.large_chart())
    return library["large"], library, works.INTERFACES


def _kept_megabytes(make: Callable[[], Any]) -> float:
    tracemalloc.start()
    kept = make()
    used, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    del kept
    return used / 1e6


_IMPORT = """
import pathlib, time
status = pathlib.Path("/proc/self/statm")
def used(): return int(status.read_text().split()[1]) * 4096 / 1e6 if status.exists() else 0.0
before, begin = used(), time.perf_counter()
import MODULES
print(time.perf_counter() - begin, used() - before)
"""


def _import_cost(names: str, tries: int = 5) -> tuple[float, float]:
    """Time, s, and memory, MB, of an import in a fresh interpreter; the fastest of some tries."""
    program = _IMPORT.replace("MODULES", names)
    found = []
    for _ in range(tries):
        command = [sys.executable, "-c", program]
        result = subprocess.run(command, capture_output=True, text=True, check=True)
        seconds, megabytes = map(float, result.stdout.split())
        found.append((seconds, megabytes))
    return min(found)
