"""What the engine costs over the bare work of its states, beside other engines.

The limit is the loop that nobody can undercut: the states' own steps called one after another.
"""

from __future__ import annotations

import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterator
from typing import Any

import yaml

from cobodeck.bench import harness
from cobodeck.bench.harness import BenchCase, BenchRow, Work
from cobodeck.bench.states import STATES, Once, Trip, Watch, Working
from engine.board import Board
from engine.clock import TickGrid
from engine.load import load_text
from engine.machine import Machine
from engine.run import ChartRun
from engine.signals import Measured, declare
from engine.state import interface

GRID = TickGrid(30)
SIGNALS = 20
NAME = "engine"


INTERFACES = {cls.__name__: interface(cls) for cls in STATES}  # type: ignore[arg-type]
NOWS = [GRID.instant(n) for n in range(1 << 17)]

PAIR = """
chart: pair
outcomes: [done]
any:
  guard: {watch: Watch, next: {seen: .done}}
  work: {do: Working, next: {done: .done}}
"""
HUNDRED = "chart: hundred\noutcomes: [done]\nany:\n" + "".join(
    f"  a{n}: {{do: Working, next: {{done: .done}}}}\n" for n in range(100)
)
STEPS = """
chart: steps
outcomes: [done]
any:
  guard: {watch: Watch, next: {seen: .done}}
  work:
    states:
      a: {do: Once, next: {done: b}}
      b: {do: Once, next: {done: a}}
"""
GUARDED = """
chart: guarded
outcomes: [done]
states:
  normal:
    any:
      guard: {watch: Trip, next: {seen: .tripped}}
      work: {do: Working, next: {done: .tripped}}
    next: {tripped: escape}
  escape:
    any:
      guard: {watch: Trip, next: {seen: .tripped}}
      work: {do: Working, next: {done: .tripped}}
    next: {tripped: normal}
"""
READING = """
chart: reading
outcomes: [done]
data: {value: {type: any}}
states:
  give: {do: Give, with: {size: SIZE}, out: {value: value}, next: {given: a}}
  a: {do: Take, in: {value: value}, next: {done: b}}
  b: {do: Take, in: {value: value}, next: {done: a}}
"""


def rows(rounds: int = harness.ROUNDS) -> Iterator[BenchRow]:
    """Measure everything, row by row."""
    from cobodeck.bench import peers

    for case in cases(peers.found()):
        yield from harness.measure(NAME, case, rounds)
    yield from costs(peers.found())


def cases(others: dict[str, Any]) -> Iterator[BenchCase]:
    """The timed comparisons; `others` are the peers that are installed."""
    run, steps = started(PAIR)

    def beside(kind: str, own: Work) -> dict[str, Work]:
        works = {name: getattr(peer, kind, None) for name, peer in others.items()}
        return {"cobodeck": own} | {name: make() for name, make in works.items() if make}

    bare = loop(steps)
    name = "for step in steps: step()"
    yield BenchCase("tick_pair", bare, name, beside("pair", ticking(run)), "signals", SIGNALS, 3.5)
    traced = {"cobodeck": ticking(run, traced=True)}
    yield BenchCase("tick_pair_traced", bare, name, traced, "signals", SIGNALS, 6)
    run, steps = started(HUNDRED)
    yield BenchCase(
        "parallel_100", loop(steps), name, beside("hundred", ticking(run)), "nodes", 100, 3
    )
    run, _ = started(STEPS)
    name = "the same steps, cls() and run()"
    yield BenchCase("transition", Work(_bare_steps), name, beside("steps", ticking(run)), goal=4)
    run, _ = started(GUARDED)
    yield BenchCase(
        "guard_exit", Work(_bare_guarded), name, beside("guarded", ticking(run)), goal=8
    )
    yield _loading(beside)
    small, _ = started(READING.replace("SIZE", "1"))
    large, _ = started(READING.replace("SIZE", "10000"))
    own = {"cobodeck": ticking(large)}
    yield BenchCase("read_10000", ticking(small), "reading a float", own, "numbers", 10_000, 1.1)


def _loading(beside: Callable[[str, Work], dict[str, Work]]) -> BenchCase:
    from engine.check import check

    text = large_chart()

    def ours() -> None:
        library = load_text(text)
        found = list(library.findings) + list(check(library, INTERFACES))
        assert not found, found[0]

    bare = Work(times(lambda: yaml.load(text, yaml.CSafeLoader)))
    own = Work(times(ours))
    variants = beside("loading", own)
    return BenchCase("load_1000", bare, "C-YAML parse of the file", variants, "leaves", 1000, 3)


def started(text: str) -> tuple[ChartRun, list[Callable[[], Any]]]:
    """A run of a chart after some ticks, with signals that nobody delivers; its leaves' steps."""
    library = load_text(text)
    assert not library.findings, library.findings
    machine = Machine(next(iter(library.values())), library, INTERFACES)
    signals = declare(Measured(f"signal_{n}") for n in range(SIGNALS))
    run = ChartRun(machine, Board(signals))
    for now in NOWS[:4]:
        run.tick(now)
    return run, [node.step for node in run.running if node.step is not None]


def ticking(run: ChartRun, *, traced: bool = False) -> Work:
    """Ticks of a run; `traced`: each writes a record."""
    add, root = run.trace.add, run.machine.root

    def plain(count: int) -> None:
        tick = run.tick
        for now in NOWS[:count]:
            tick(now)

    def recorded(count: int) -> None:
        tick = run.tick
        for now in NOWS[:count]:
            add(("tick", now, root))
            tick(now)

    return Work(recorded if traced else plain, run.trace.raw.clear)


def loop(steps: list[Callable[[], Any]]) -> Work:
    """The steps alone."""

    def run(count: int) -> None:
        for _ in range(count):
            for step in steps:
                step()

    return Work(run)


def times(function: Callable[[], Any]) -> Callable[[int], None]:
    """Do it n times."""

    def run(count: int) -> None:
        for _ in range(count):
            function()

    return run


class _NoContext:
    """What the states of the limits get, who never look at it."""


_NO_CONTEXT: Any = _NoContext()


def _bare_steps(count: int) -> None:
    watch = Watch().run(_NO_CONTEXT).__next__
    step = Once().run(_NO_CONTEXT).__next__
    step()
    for _ in range(count):
        watch()
        try:
            step()
        except StopIteration:
            step = Once().run(_NO_CONTEXT).__next__
            step()


def _bare_guarded(count: int) -> None:
    guard, work = Trip().run(_NO_CONTEXT).__next__, Working().run(_NO_CONTEXT)
    guard()
    next(work)
    for _ in range(count):
        try:
            guard()
        except StopIteration:
            work.close()
            guard, work = Trip().run(_NO_CONTEXT).__next__, Working().run(_NO_CONTEXT)
            guard()
            next(work)


def large_chart(boxes: int = 10, steps: int = 99) -> str:
    """A chart of 1000 leaves: ten guarded sequences, one after the other."""
    lines = ["chart: large", "outcomes: [done, failed]", "states:"]
    for box in range(boxes):
        following = f"box_{box + 1}" if box + 1 < boxes else ".done"
        lines += [
            f"  box_{box}:",
            "    any:",
            "      guard: {watch: Watch, next: {seen: .failed}}",
            "      work:",
            "        states:",
        ]
        for step in range(steps):
            target = f"step_{step + 1}" if step + 1 < steps else ".done"
            lines.append(
                f"          step_{step}: {{do: Go, with: {{distance: {step + 1} cm}}, timeout: 5 s,"
                f" next: {{arrived: {target}, blocked: .failed, timeout: .failed}}}}"
            )
        lines.append("        next: {done: .done, failed: .failed}")
        lines.append(f"    next: {{done: {following}, failed: .failed}}")
    return "\n".join(lines) + "\n"


def costs(others: dict[str, Any]) -> Iterator[BenchRow]:
    """Import time and memory of the engine and of the peers, each import in its own process."""
    modules = {"cobodeck": "engine.run, engine.load, engine.check"}
    modules |= {name: peer.MODULES for name, peer in others.items()}
    for variant, names in modules.items():
        seconds, megabytes = _import_cost(names)
        yield BenchRow(NAME, "import", variant, "MB", megabytes, seconds * 1e6)
    loads = {"cobodeck": lambda: Machine(*_large_machine())}
    loads |= {name: peer.load for name, peer in others.items() if hasattr(peer, "load")}
    for variant, load in loads.items():
        yield BenchRow(NAME, "memory_1000", variant, "MB", _kept_megabytes(load))


def _large_machine() -> tuple[Any, ...]:
    library = load_text(large_chart())
    return library["large"], library, INTERFACES


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
    """Seconds and MB that an import takes in a fresh interpreter; the best of some tries."""
    program = _IMPORT.replace("MODULES", names)
    found = []
    for _ in range(tries):
        command = [sys.executable, "-c", program]
        result = subprocess.run(command, capture_output=True, text=True, check=True)
        seconds, megabytes = map(float, result.stdout.split())
        found.append((seconds, megabytes))
    return min(found)
