"""Dead ends of charts, found by exploration: told step by step, and as tests that play them.

A step of a script is what ends at the same time. Tries that `retry` allows are played as well.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from cobodeck.validation.fitting_values import fitting_value
from engine import description_of
from engine.files import visible
from engine.machine import (
    Event,
    Exploration,
    Leaf,
    Machine,
    Step,
    Vertex,
    after_steps,
    never_taken,
)

SHOWN = 5
"""Dead ends of one chart that are told, the shortest ones."""
TICKS = 3
"""Ticks after each step: what is put off begins with the next one."""
STILL_S = 30.0
"""For so long, s, a test looks whether anything ends."""
OPEN = "..."
"""Stands in a test for the value of an input that the reader has to give."""


class Explored(NamedTuple):
    """A chart, made ready to run, and what its exploration has found."""

    machine: Machine
    found: Exploration


@dataclass(frozen=True, slots=True)
class Played:
    """What ends at the same time; `wait_s`: until the further try that follows begins."""

    events: Step
    wait_s: float | None = None


def explanation(walk: Explored) -> Iterator[str]:
    """What an exploration has found, in lines: dead ends with their steps, what never happens."""
    machine, found = walk
    name = machine.chart.name
    yield f"{name}: {found.summary()}"
    for number, script in enumerate(found.stuck[:SHOWN], 1):
        yield f"{name}: dead end {number}: nothing ends any more, except by an error, after"
        for count, step in enumerate(script, 1):
            yield f"  {count}. {' and '.join(_told(event) for event in step)}"
        *_, last = after_steps(machine, script)
        yield f"  {'then' if script else 'the start:'} {_running(last.active)}"
    if len(found.stuck) > SHOWN:
        yield f"{name}: and {len(found.stuck) - SHOWN} more dead ends, with as many steps or more"
    for path, outcome in never_taken(machine, found):
        yield f"{name}: never taken: {path}: {outcome}"
    if found.complete:
        for outcome in machine.chart.outcomes:
            if outcome not in found.outcomes:
                yield f"{name}: never ends with {outcome}"


def _told(event: Event) -> str:
    path, outcome = event
    return f"{path} times out" if outcome == "timeout" else f"{path} ends with {outcome}"


def _running(leaves: Iterable[Leaf]) -> str:
    told = ", ".join(f"{leaf.path} ({leaf.interface.name})" for leaf in leaves)
    return f"{told} run on" if told else "nothing runs"


def dead_end_tests(walks: Iterable[Explored], folder: Path) -> str:
    """A pytest file for this folder that plays the dead ends of charts with the fixture `sim`."""
    found = ['"""Dead ends of charts, as `cobodeck validate --explain` has found them."""']
    for machine, exploration in walks:
        file = Path(os.path.relpath(Path(machine.chart.file).resolve(), folder.resolve()))
        for number, script in enumerate(exploration.stuck[:SHOWN], 1):
            name = re.sub(r"\W", "_", machine.chart.name)
            lines = [f"def test_dead_end_{number}_of_{name}(sim):", *_start(machine, file)]
            lines += [f"sim.tick({TICKS})", *_lines(machine, script)]
            lines += [f"sim.wait({STILL_S})  # nothing ends any more", "assert sim.outcome is None"]
            lines += [_assertion(list(after_steps(machine, script))[-1].active)]
            found.append("\n\n" + "\n    ".join(lines))
    return "\n".join(found) + "\n"


def _start(machine: Machine, file: Path) -> Iterator[str]:
    """The line that starts a chart; its inputs have values of their types, or `...`."""
    if not machine.missing:
        yield f"sim.start({str(file)!r})"
        return
    yield f"sim.start({str(file)!r}, inputs={{  # the script decides: any values do"
    for name in machine.missing:
        kind = machine.types[machine.chart.inputs[name].type]
        value = fitting_value(kind)
        told = visible(description_of(kind))
        yield f"    {name!r}: {OPEN if value is None else repr(value)},  # {told}"
    yield "})"


def _lines(machine: Machine, script: Iterable[Step]) -> Iterator[str]:
    for plays, leaves in _plays(machine, script):
        for played in plays:
            for path, outcome in played.events:
                yield _line(path, outcome)
            if played.wait_s is not None:
                yield f"sim.wait({played.wait_s})  # for the further try"
            yield f"sim.tick({TICKS})"
        yield _assertion(leaves)


def _line(path: str, outcome: str) -> str:
    if outcome == "timeout":
        return f"sim.time_out({path!r})"
    if outcome == "error":
        return f"sim.end({path!r}, RuntimeError('as played'))"
    return f"sim.end({path!r}, {outcome!r})"


def _assertion(leaves: Iterable[Leaf]) -> str:
    return f"assert sorted(sim.active) == {sorted(leaf.path for leaf in leaves)!r}"


def _plays(
    machine: Machine, script: Iterable[Step]
) -> Iterator[tuple[list[Played], tuple[Leaf, ...]]]:
    """What is to be played for each step, and the leaves that run then.

    An outcome that is tried again is reached only by what led to it, once for each try.
    """
    past: list[Played] = []
    since: dict[Vertex, int] = {}  # where in `past` a node was entered
    first, *later = after_steps(machine, script)
    _note_entries(first.active, since, 0)
    for step, moment in zip(script, later, strict=True):
        begun = len(past)
        past.append(Played(step))
        for path, outcome in moment.edges:
            vertex = machine.vertices[path]
            if vertex.retry is not None and outcome in vertex.retry[1]:
                times, _, wait = vertex.retry
                tries = list(_inside(path, past[since.pop(vertex, begun) :]))
                again = Played(tries[-1].events, wait / 1e9)
                past[-1] = Played(past[-1].events, wait / 1e9)
                past += ([*tries[:-1], again] * times)[:-1] + tries[-1:]
        for vertex in [v for v in since if not any(_holds(v, leaf) for leaf in moment.active)]:
            del since[vertex]
        for path, _ in moment.edges:
            since.pop(machine.vertices[path], None)
        _note_entries(moment.active, since, len(past))
        yield past[begun:], moment.active


def _inside(path: str, plays: Iterable[Played]) -> Iterator[Played]:
    """The part of these plays that is at a node or below it."""
    for played in plays:
        events = tuple(e for e in played.events if e[0] == path or e[0].startswith(f"{path}/"))
        if events:
            yield Played(events, played.wait_s)


def _note_entries(leaves: Iterable[Leaf], since: dict[Vertex, int], at: int) -> None:
    for leaf in leaves:
        vertex: Vertex | None = leaf
        while vertex is not None:
            since.setdefault(vertex, at)
            vertex = vertex.parent


def _holds(vertex: Vertex, leaf: Leaf) -> bool:
    return vertex.order <= leaf.order <= vertex.last
