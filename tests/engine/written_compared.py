"""The engine and the second reading on random charts with values, signals and named parts."""

from __future__ import annotations

import json
import random
from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

from engine.chart.load import Library
from engine.check.all_checks import check
from engine.files.finding import Finding
from engine.files.source import read
from engine.machine.machine import Machine
from engine.machine.node import Substitute
from engine.machine.vertices import Leaf
from engine.run.chart_run import ChartRun
from engine.signals.board import Board
from engine.state import NEVER_NS, Context, Run, State, Until
from tests.engine.compared import KINDS, TICKS, Script, difference, ends_of
from tests.engine.conftest import HZ
from tests.engine.reading import RAISES, Entry
from tests.engine.written_charts import EYES, RENAMED, WrittenCase, written_of
from tests.engine.written_reading import WrittenReading
from tests.engine.written_states import AROUND, INTERFACES, SIGNALS, TYPES, Heading, Leg, Spot

Samples = list[dict[str, float]]


class Played(NamedTuple):
    """What a run made of a case, of plain values."""

    entries: list[Entry]
    entered: list[tuple[Any, ...]]
    written: list[tuple[Any, ...]]
    outcome: str | None
    results: Mapping[str, Any]


class Play(NamedTuple):
    """A chart, what happens, and what the rules make of it."""

    case: WrittenCase
    script: Script
    samples: Samples
    expected: Played


def play_of(seed: int) -> Play:
    """A random chart with a script and samples that let things happen."""
    case, chance = written_of(seed), random.Random(f"played {seed}")
    reading = WrittenReading(case.charts["c"], case.charts, case.inputs)
    leaves = [i for i in reading.root.walk() if i.leaf]
    script: Script = []
    samples: Samples = []
    for number in range(TICKS):
        drawn = {name: _sample(kind, chance) for name, kind in EYES.items()}
        samples.append({name: v for name, v in drawn.items() if chance.random() < 0.2})
        now = number * 10**9 // HZ
        reading.samples |= {name: (value, now) for name, value in samples[-1].items()}
        ends = ends_of(reading, leaves, chance)
        script.append({path: _called(reading, path, o) for path, o in ends.items()})
        script[-1] = {p: o for p, o in script[-1].items() if _cls(reading, p) != "Over"}
        reading.tick(script[-1])
        if reading.outcome is not None:
            break
    return Play(case, script, samples, _played(reading))


def played_by(cls: type[WrittenReading], play: Play) -> Played:
    """What another reading makes of it."""
    reading = cls(play.case.charts["c"], play.case.charts, play.case.inputs)
    for number, (ends, samples) in enumerate(zip(play.script, play.samples, strict=True)):
        now = number * 10**9 // HZ
        reading.samples |= {name: (value, now) for name, value in samples.items()}
        reading.tick(ends)
    return _played(reading)


def _played(reading: WrittenReading) -> Played:
    return Played(
        reading.entries, reading.entered, reading.written, reading.outcome, reading.results
    )


def _sample(kind: str, chance: random.Random) -> float:
    if kind == "integer":
        return chance.choice((-1, 0, 0, 1, 1, 2, 3, 4))
    return round(chance.uniform(-0.1, 2.2), 2)


def _cls(reading: WrittenReading, path: str) -> str:
    node = reading.nodes[path]
    return str(node.get("do") or node.get("watch"))


def _called(reading: WrittenReading, path: str, outcome: str) -> str:
    return RENAMED.get(outcome, outcome) if _cls(reading, path) == "Pick" else outcome


# -- the engine ------------------------------------------------------------------------------------


class Part:
    """A part that counts its stops."""

    def __init__(self) -> None:
        self.stops = 0

    def stop(self) -> None:
        """Stop."""
        self.stops += 1


class Stage:
    """What the stand-ins of a run's leaves are to do, and what they were given."""

    def __init__(self, machine: Machine) -> None:
        self.parts = {name: Part() for leaf in machine.leaves for name in leaf.interface.commands}
        self.ends: dict[str, list[tuple[int, str]]] = {}  # ticks, and outcomes from then on
        self.times: dict[str, int] = {}
        self.entered: list[tuple[Any, ...]] = []
        self.stand_ins = {
            leaf.path: Substitute(partial(_Playing, leaf, self), leaf.interface.outputs)
            for leaf in machine.leaves
            if leaf.interface.name != "Over"
        }


class _Playing(State):
    """Stands in for the state of a leaf."""

    def __init__(self, leaf: Leaf, stage: Stage, **parameters: Any) -> None:
        self.leaf, self.stage, self.parameters = leaf, stage, parameters

    def run(self, ctx: Context, **inputs: Any) -> Run:
        stage, path, of = self.stage, self.leaf.path, self.leaf.interface
        stage.times[path] = stage.times.get(path, 0) + 1
        given = _plain(self.parameters), _plain(inputs)
        stage.entered.append((_tick(ctx.now), path, *given, of.commands))
        assert all(stage.parts[name].stops for name in of.commands)
        while True:
            ends = stage.ends.get(path)
            at = ends[0][0] * 10**9 // HZ if ends else NEVER_NS
            if ends and at <= ctx.now:
                _, outcome = ends.pop(0)
                if outcome == RAISES:
                    raise RuntimeError("scripted")
                held = {"where": Spot(float(stage.times[path]), float(_tick(ctx.now)))}
                held |= {"chosen": outcome, "item": inputs.get("value")}
                return outcome, {name: held[name] for name in of.outputs.get(outcome, ())}
            yield Until(at)


def _tick(now: int) -> int:
    """The number of the tick at this instant."""
    return -(-now * HZ // 10**9)


def library_of(case: WrittenCase) -> Library:
    library = Library()
    for name, chart in case.charts.items():
        library.add(read(json.dumps(chart).encode(), f"{name}.yaml"))
    assert not library.findings, library.findings
    return library


def machine_of(case: WrittenCase) -> Machine:
    library = library_of(case)
    given = {name: read(json.dumps(v).encode(), "in").value for name, v in case.inputs.items()}
    return Machine(library["c"], library, INTERFACES, types=TYPES, inputs=given, around=AROUND)


def played_by_engine(play: Play, *, leave_out: bool = False) -> Played:
    """What the engine makes of it; `leave_out`: without the ticks in which nothing is due."""
    machine = machine_of(play.case)
    stage, board = Stage(machine), Board(SIGNALS)
    run = ChartRun(machine, board, stage.parts, stand_ins=stage.stand_ins)
    for number, ends in enumerate(play.script):
        for path, outcome in ends.items():
            stage.ends.setdefault(path, []).append((number, outcome))
    for number, samples in enumerate(play.samples):
        now = number * 10**9 // HZ
        for name, value in samples.items():
            board.put(name, value, now)
        if not (leave_out and run.schedule.leave_out(now)):
            run.tick(now)
    records = [(_tick(r.time), (r.kind, r.subject, *r.detail)) for r in run.trace]
    entries = [Entry(tick, record, 0) for tick, record in records if record[0] in KINDS]
    written = [(t, r[1], r[2], _plain(r[3])) for t, r in records if r[0] == "data"]
    return Played(entries, stage.entered, written, run.outcome, _plain(run.results))


def _plain(value: Any) -> Any:
    """A value as the second reading has it."""
    if isinstance(value, dict):
        return {name.rstrip("_"): _plain(item) for name, item in value.items()}
    if isinstance(value, Spot):
        return "Spot", _plain(value.x), _plain(value.y)
    if isinstance(value, Leg):
        return "Leg", _plain(value.spot), _plain(value.pace), value.level.name
    if isinstance(value, Heading):
        return "Heading", _plain(value.cos), _plain(value.sin)
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    return round(value, 9) if isinstance(value, float) else value


# -- comparison ------------------------------------------------------------------------------------


def unlike(expected: Played, found: Played) -> str:
    """What is not alike, in words; empty if everything is."""
    if (entries := difference(expected.entries, found.entries)) is not None:
        return f"rule {entries.rule}, tick {entries.tick}: {entries.found}, not {entries.expected}"
    for what in ("entered", "written"):
        pairs = zip(getattr(expected, what), getattr(found, what), strict=False)
        for told, came in pairs:
            if told != came:
                return f"{what}: {came}, not {told}"
        if len(getattr(expected, what)) != len(getattr(found, what)):
            return f"{what}: {getattr(found, what)}, not {getattr(expected, what)}"
    if (expected.outcome, expected.results) != (found.outcome, found.results):
        return f"ended with {found.outcome} {found.results}, not {expected[3:]}"
    return ""


def errors_of(case: WrittenCase) -> list[Finding]:
    """The errors that the checks find in its charts."""
    library, parts = library_of(case), [f"p{number}" for number in range(1000)]
    found = check(library, INTERFACES, types=TYPES, signals=SIGNALS, parts=parts, around=AROUND)
    return [finding for finding in found if finding.severity == "error"]
