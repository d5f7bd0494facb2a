"""The engine and the second reading of its rules on one chart and one script, side by side."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from tests.engine.conftest import HZ, Bench
from tests.engine.reading import RAISES, Entry, Item, Reading
from tests.engine.seeded_charts import OUTCOMES, made_of, smaller

TICKS = 25
Charts = dict[str, dict[str, Any]]
Script = list[dict[str, str]]
"""For each tick, how leaves end at their next step."""
Runner = Callable[[Charts, Script], list[Entry]]
RULE_OF: Mapping[str, int] = {
    "enter": 6, "outcome": 4, "exit": 7, "move": 6, "error": 8, "note": 6
}  # fmt: skip
"""The rule of a record that there should not be, behind all that there should."""
KINDS = ("enter", "outcome", "exit", "move", "error", "note")


class Difference(NamedTuple):
    """The first tick in which two runs are not alike."""

    tick: int
    rule: int
    expected: list[tuple[str, ...]]
    found: list[tuple[str, ...]]


class Case(NamedTuple):
    """A chart, a script, and what the rules make of them."""

    charts: Charts
    script: Script
    reading: Reading


def played(charts: Charts, script: Script, cls: type[Reading] = Reading) -> Reading:
    reading = cls(charts["c"], charts)
    for ends in script:
        reading.tick(ends)
    return reading


def read_by(cls: type[Reading]) -> Runner:
    """A reading in place of the engine."""
    return lambda charts, script: played(charts, script, cls).entries


def run_by_engine(charts: Charts, script: Script) -> list[Entry]:
    """What the engine makes of it; it gives no rules."""
    bench = Bench("---\n".join(json.dumps(chart) + "\n" for chart in charts.values()))
    for ends in script:
        for path, outcome in ends.items():
            bench.end(path, RuntimeError("scripted") if outcome == RAISES else outcome)
        bench.tick()
    ticks = {number * 10**9 // HZ: number for number in range(len(script))}
    return [
        Entry(ticks[r.time], (r.kind, r.subject, *r.detail), 0)
        for r in bench.run.trace
        if r.kind in KINDS
    ]


def case(seed: int) -> Case:
    """A random chart with a script that lets things happen, many of them at once."""
    charts = made_of(seed)
    chance = random.Random(seed)
    reading = Reading(charts["c"], charts)
    leaves = [item for item in reading.root.walk() if item.leaf]
    script: Script = []
    for _ in range(TICKS):
        script.append(ends_of(reading, leaves, chance))
        reading.tick(script[-1])
        if reading.outcome is not None:
            break
    return Case(charts, script, reading)


def ends_of(reading: Reading, leaves: list[Item], chance: random.Random) -> dict[str, str]:
    """How leaves end in the next tick: all guards of a container, some leaves, or one to come."""
    active = reading.active
    chosen = [leaf for leaf in active if chance.random() < 0.12]
    guarded = [leaf.parent.path for leaf in active if leaf.guard and leaf.parent]
    if guarded and chance.random() < 0.5:
        box = chance.choice(guarded)  # the more guards, the more often
        chosen += [
            leaf for leaf in active if leaf.guard and leaf.parent and leaf.parent.path == box
        ]
    if chance.random() < 0.15:
        chosen.append(chance.choice(leaves))
    return {
        leaf.path: RAISES if chance.random() < 0.05 else chance.choice(OUTCOMES[leaf.form])
        for leaf in chosen
    }


def difference(expected: list[Entry], found: list[Entry]) -> Difference | None:
    """The first tick that is not alike, and the rule of the first record that is not."""
    expected, found = _comparable(expected), _comparable(found)
    if [entry[:2] for entry in expected] == [entry[:2] for entry in found]:
        return None
    for number in sorted({entry.tick for entry in expected + found}):
        told = [entry for entry in expected if entry.tick == number]
        came = [entry for entry in found if entry.tick == number]
        if [e.record for e in told] != [e.record for e in came]:
            return Difference(number, _rule(told, came), _records(told), _records(came))
    raise AssertionError("ticks are not in order")


def _comparable(entries: list[Entry]) -> list[Entry]:
    """Without what no trace has; what should have followed there is rule 6."""
    made: list[Entry] = []
    put_off = False
    for entry in entries:
        if entry.record[0] == "put off":
            put_off = True
        else:
            made.append(entry._replace(rule=6) if put_off else entry)
            put_off = False
    return made


def _records(entries: list[Entry]) -> list[tuple[str, ...]]:
    return [entry.record for entry in entries]


def _rule(told: list[Entry], came: list[Entry]) -> int:
    """The rule of the first record that is not as it should be; who is lost decides the rest."""
    lost = [e.rule for e in told if _is_lost(e) and e.record not in _records(came)]
    if lost or any(_is_lost(e) and e.record not in _records(told) for e in came):
        return [*lost, 4][0]
    pairs = enumerate(zip(told, came, strict=False))
    at = next((i for i, (a, b) in pairs if a.record != b.record), min(len(told), len(came)))
    if at == len(told):
        return RULE_OF[came[at].record[0]]
    if told[at].record[0] == "enter" and sorted(_records(told)) == sorted(_records(came)):
        return 3  # the right things in another order
    return told[at].rule


def _is_lost(entry: Entry) -> bool:
    return entry.record[0] == "exit" and entry.record[-1] == "lost"


def compared(charts: Charts, script: Script, runner: Runner) -> Difference | None:
    return difference(played(charts, script).entries, runner(charts, script))


def shrunk(found: Case, runner: Runner, attempts: int = 1500) -> tuple[Charts, Script, Difference]:
    """A small chart and script that on which the runner still breaks the same rule."""
    charts, script = found.charts, found.script
    last = compared(charts, script, runner)
    assert last is not None
    progress = True
    while progress and attempts > 0:
        progress = False
        script = script[: last.tick + 1]
        for fewer in _smaller_cases(charts, script):
            attempts -= 1
            try:
                now = compared(*fewer, runner)
            except (AssertionError, LookupError):
                continue  # it is no chart any more
            if now is not None and now.rule == last.rule:
                (charts, script), last, progress = fewer, now, True
                break
            if attempts <= 0:
                break
    return charts, script, last


def _smaller_cases(charts: Charts, script: Script) -> Iterator[tuple[Charts, Script]]:
    for fewer in smaller(charts):
        yield fewer, script
    for number, ends in enumerate(script):
        if not ends and len(script) > 1:
            yield charts, script[:number] + script[number + 1 :]
        for path in ends:
            less = {p: outcome for p, outcome in ends.items() if p != path}
            yield charts, [*script[:number], less, *script[number + 1 :]]


def described(found: Case, runner: Runner) -> str:
    """A difference in words: the rule, a small chart with its script, and both traces."""
    charts, script, last = shrunk(found, runner)
    lines = [f"rule {last.rule}, tick {last.tick}: the runner does not do as the rules say"]
    lines += [json.dumps(chart) for chart in charts.values()]
    lines += [f"tick {number}: {ends}" for number, ends in enumerate(script) if ends]
    lines += ["by the rules:", *(f"  {record}" for record in last.expected)]
    lines += ["by the runner:", *(f"  {record}" for record in last.found)]
    return "\n".join(lines)


def check(seed: int, runner: Runner) -> int:
    """Fail with a small chart if the runner differs; how many ties of three guards there were."""
    found = case(seed)
    if difference(found.reading.entries, runner(found.charts, found.script)) is not None:
        raise AssertionError(described(found, runner))
    return found.reading.ties
