"""The charts of the engine benchmark, and for each the same work without an engine.

A bare loop does what the states of its chart do in a tick, and nothing else: it makes, steps and
closes the same generators. It looks nothing up, keeps no lists and decides nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cobodeck.bench.engine.bench_states import STATES, Once, Trip, Watch, Working
from cobodeck.bench.harness import Work, nothing
from engine import TickGrid, interface
from engine.chart import load_text
from engine.machine import Machine
from engine.operator import Operator
from engine.run import ChartRun
from engine.signals import Board, Measured, declare

GRID = TickGrid(30)
SIGNALS = 20
INTERFACES = {cls.__name__: interface(cls) for cls in STATES}  # type: ignore[arg-type]
NOWS = [GRID.instant(n) for n in range(1 << 12)]
"""Ticks between two resets: so few that the trace never lets records go, which takes longer."""

PAIR = """
chart: pair
outcomes: [done]
any:
  guard: {watch: Watch, next: {seen: .done}}
  work: {do: Working, next: {done: .done}}
"""
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
TIMED = (
    STEPS.replace("{do: Once,", "{do: Once, timeout: 9 s,")
    .replace("next: {done: b}", "next: {done: b, timeout: b}")
    .replace("next: {done: a}", "next: {done: a, timeout: a}")
)
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
CHASING = """
chart: chasing
outcomes: [never]
states:
  chase: {use: chase, next: {tripped: again}}
  again: {use: chase, next: {tripped: chase}}
"""
CHASE = """
chart: chase
outcomes: [tripped]
any:
  danger: {watch: Trip, next: {seen: .tripped}}
  request: {watch: Watch, next: {seen: .tripped}}
  follow:
    states:
      drive:
        any:
          late: {watch: Watch, next: {seen: .tripped}}
          stand: {watch: Watch, next: {seen: .tripped}}
          crowded: {watch: Watch, next: {seen: .tripped}}
          go: {do: Working, next: {done: .tripped}}
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


def started(text: str, *used: str, lock: str | None = None) -> ChartRun:
    """A run of a chart, after some ticks; `used` are the texts of charts that it uses.

    `lock` is a path to lock, if any.
    """
    library = load_text(text)
    for other in used:
        library |= load_text(other)
    assert not library.findings, library.findings
    machine = Machine(next(iter(library.values())), library, INTERFACES)
    run = ChartRun(machine, Board(declare(Measured(f"signal_{n}") for n in range(SIGNALS))))
    if lock is not None:
        assert Operator(run).lock(lock) is None
    for now in NOWS[:4]:
        run.tick(now)
    return run


def steps_of(run: ChartRun) -> list[Callable[[], Any]]:
    """The step functions of the running leaves."""
    return [node.step for node in run.running if node.step is not None]


def ticking(run: ChartRun) -> Work:
    """Ticks of a run."""

    def work(count: int) -> None:
        tick = run.tick
        for now in NOWS[:count]:
            tick(now)

    return Work(work, run.trace.raw.clear, most=len(NOWS))


def recording(run: ChartRun, long: bool = False) -> Work:
    """Ticks of a run that each write a record; in a `long` one old records leave the memory."""
    while long and not run.trace.gone:
        run.recorded_tick(NOWS[0])

    def work(count: int) -> None:
        tick = run.recorded_tick
        for now in NOWS[:count]:
            tick(now)

    return Work(work, nothing if long else run.trace.raw.clear, most=len(NOWS))


def sampling(run: ChartRun, fresh: int) -> Work:
    """Ticks of a run, each after `fresh` signals got a new sample."""
    names = [f"signal_{n}" for n in range(fresh)]

    def work(count: int) -> None:
        tick, put = run.tick, run.board.put
        for now in NOWS[:count]:
            for name in names:
                put(name, now, now)
            tick(now)

    return Work(work, run.trace.raw.clear, most=len(NOWS))


def loop(steps: list[Callable[[], Any]]) -> Work:
    """The steps alone, `for step in steps: step()`."""

    def run(count: int) -> None:
        for _ in range(count):
            for step in steps:
                step()

    return Work(run)


class _NoContext:
    """Given as context to the states of the bare loops, which never use it."""


_NO_CONTEXT: Any = _NoContext()


def bare_edge(count: int) -> None:
    """A monitor is stepped; an action is stepped, ends, and the next one is made and stepped."""
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


def bare_guard(count: int) -> None:
    """A guard ends, the action beside it is closed; both are made anew and stepped."""
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


def bare_chase(count: int) -> None:
    """Five monitors are stepped, the first ends, all others are closed, all six are made anew.

    Written out one by one, with the first step of each, because loops over lists take twice as
    long. The sixth is the action, which is closed first.
    """
    trip, watch, work = Trip, Watch, Working
    ctx = _NO_CONTEXT
    danger, request, late = trip().run(ctx), watch().run(ctx), watch().run(ctx)
    stand, crowded, go = watch().run(ctx), watch().run(ctx), work().run(ctx)
    next(danger), next(request), next(late), next(stand), next(crowded), next(go)
    for _ in range(count):
        try:
            next(danger)
        except StopIteration:
            next(request), next(late), next(stand), next(crowded)
            go.close()
            crowded.close()
            stand.close()
            late.close()
            request.close()
            danger, request, late = trip().run(ctx), watch().run(ctx), watch().run(ctx)
            stand, crowded, go = watch().run(ctx), watch().run(ctx), work().run(ctx)
            next(danger), next(request), next(late), next(stand), next(crowded), next(go)


def parallel(count: int) -> str:
    """A chart of so many actions at once."""
    leaves = (f"  a{n}: {{do: Working, next: {{done: .done}}}}\n" for n in range(count))
    return "chart: parallel\noutcomes: [done]\nany:\n" + "".join(leaves)


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
