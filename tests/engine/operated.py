"""The second reading of the rules with an operator: pause, step, force, replace, close (rule 11).

As in `reading`, nothing is shared with the engine. A case is a chart, how its leaves end, and what
the operator does before each tick.
"""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from engine.chart.load import load_text
from engine.machine.machine import Machine
from engine.machine.scripted_states import LeafScript
from tests.engine.compared import KINDS, TICKS, Charts, Script, ends_of
from tests.engine.conftest import HZ, Bench
from tests.engine.reading import RAISES, Entry, Item, Reading
from tests.engine.seeded_charts import OUTCOMES, made_of


class Act(NamedTuple):
    """What the operator does.

    pause, resume, step, close, break at `path` and unbreak, force `path` to `outcome`, put in
    `charts`; the run itself: note that it was broken off at `path`.
    """

    what: str
    path: str = ""
    outcome: str = ""
    charts: Charts | None = None


Acts = list[list[Act]]
"""For each tick, what the operator does before it."""


class Operated(Reading):
    """One run by the rules, with an operator; `refused` has the ticks and acts that are refused."""

    def __init__(self, chart: Mapping[str, Any], library: Mapping[str, Mapping[str, Any]]) -> None:
        super().__init__(chart, library)
        self.paused = self.closed = self.stepped = False
        self.said: dict[str, bool] = {}  # breakpoints set and removed
        self.paused_ns = self.before = 0
        self.acts: list[Act] = []
        self.refused: list[tuple[int, str]] = []
        self.new: list[Item] = [self.root]  # put in by a replacement, or at the start

    def operate(self, act: Act) -> None:
        """Ask for something; what is refused is noted."""
        if act.what == "force" and not self.can_force(act.path, act.outcome):
            self.refused.append((self.number, "force"))
        elif act.what == "replace" and not self.can_replace(act.charts):
            self.refused.append((self.number, "replace"))
        elif act.what == "step" and (self.outcome is not None or self.closed or not self.paused):
            self.refused.append((self.number, "step"))
        elif act.what == "unbreak" and not self.breaks_at(self.find(act.path)):
            self.refused.append((self.number, "unbreak"))
        elif act.what == "close":
            self.closed = True
        else:
            self.acts.append(act)

    def begin(self, now: int) -> bool:
        """Rule 11: commands first; in a pause nothing is stepped, and chart time stands still."""
        if self.closed:
            return False
        if self.paused and not self.stepped:
            self.paused_ns += now - self.before
        self.stepped = False
        self.before = now
        self.now = now - self.paused_ns
        acts, self.acts = self.acts, []
        for act in acts:
            if self.outcome is None:
                self.carry_out(act)
        if self.outcome is None and (self.stepped or not self.paused):
            self.new = []
            return True
        return False

    def carry_out(self, act: Act) -> None:
        """Rule 11: what is impossible by now is left undone."""
        if act.what in ("pause", "resume"):
            self.stepped = self.stepped and act.what == "pause"
            self.paused = act.what == "pause"
        elif act.what == "step":
            self.stepped = self.paused
        elif act.what in ("break", "unbreak"):
            self.said[act.path] = act.what == "break"
        elif act.what == "broken":
            there = any(item.path == act.path for item in self.root.walk())
            self.record(11, "note", act.path if there else "", "breakpoint")
            self.paused = True
        elif act.what == "force" and self.can_force(act.path, act.outcome):
            item = self.find(act.path)
            for inside in reversed([s for s in self.started if item.holds(s)]):
                self.leave(inside, "forced", 11)
            self.forget(item)
            self.record(11, "outcome", item.path, act.outcome)
            self.take(self.route(item, act.outcome, ended=True))
        elif act.what == "replace":
            assert act.charts is not None
            self.replace(act.charts)

    def enter(self, item: Item) -> None:
        """Rule 11: what is entered at a breakpoint pauses the run with the next tick."""
        super().enter(item)
        if self.breaks_at(item):
            self.acts.append(Act("broken", item.path))

    def breaks_at(self, item: Item) -> bool:
        """Whether a breakpoint is at a node: the operator's word comes before the chart's."""
        return self.said.get(item.path, item.breaks)

    def find(self, path: str) -> Item:
        """The node at a path."""
        return next(item for item in self.root.walk() if item.path == path)

    # -- forcing -----------------------------------------------------------------------------------

    def can_force(self, path: str, outcome: str) -> bool:
        """It runs or waits to be tried again, and can end so."""
        item = self.find(path)
        if self.outcome is not None or item.parent is None:
            return False
        return (item.running or item.retry_at is not None) and outcome in self.endings(item)

    def endings(self, item: Item) -> set[str]:
        """What a node can end with by itself: neither an error nor its own timeout."""
        if item.leaf:
            return set(OUTCOMES[item.form])
        found = {outcome for outcome, _ in item.rules} if item.keeps else set()
        if item.form == "all" and not item.rules:
            found.add("done")
        for child in item.children:
            own = self.endings(child)
            for outcome, target in child.next.items():
                own.discard(outcome)
                if target.startswith("."):
                    found.add(target[1:])
            if not item.keeps:
                found |= own
        return found - {"error"}

    # -- replacing ---------------------------------------------------------------------------------

    def can_replace(self, charts: Charts | None) -> bool:
        """Nothing waits, and everything that runs or is kept is there in the new chart, too."""
        assert charts is not None
        new = {item.path for item in Reading(charts["c"], charts).root.walk()}
        waits = [i for i in self.root.walk() if i.retry_at is not None or (i.chosen and i.leaf)]
        put_off = [item for item in self.put_off if item not in self.new]
        if self.outcome is not None or self.closed or waits or put_off:
            return False
        return all(item.path in new for item in self.carried())

    def carried(self) -> list[Item]:
        """What runs, and what has ended in a running box that keeps outcomes."""
        kept = [i for i in self.root.walk() if i.kept is not None and i.parent in self.started]
        return self.started + kept

    def replace(self, charts: Charts) -> None:
        """Everything that runs goes on; what is new beside it starts with the next tick."""
        old, carried = {i.path: i for i in self.root.walk()}, {i.path for i in self.carried()}
        fresh = Reading(charts["c"], charts)
        self.root, self.library = fresh.root, charts
        named = {item.path: item for item in self.root.walk()}
        for path in carried:
            before, now = old[path], named[path]
            now.running, now.entered_in, now.deadline = (
                before.running, before.entered_in, before.deadline,
            )  # fmt: skip
            now.tries, now.put_off_in, now.kept = before.tries, before.put_off_in, before.kept
        self.started = [named[item.path] for item in self.started]
        for item in self.started:
            item.looks = item.keeps
        self.new = [
            child
            for box in (self.started or [self.root])
            if box.form in ("any", "all")
            for child in box.children
            if not child.running and child.kept is None
        ]
        if not self.started:
            self.new = [self.root]
        self.put_off = [*self.new]


# -- cases -----------------------------------------------------------------------------------------


class OperatedCase(NamedTuple):
    """A chart, a script, what the operator does, and what the rules make of them."""

    charts: Charts
    script: Script
    acts: Acts
    reading: Operated


def operated_case(seed: int) -> OperatedCase:
    """A random chart, script and operator; the later likes to replace twice and to force."""
    charts = made_of(seed)
    chance = random.Random(f"operated {seed}")
    reading = Operated(charts["c"], charts)
    current, number = charts, 0
    script: Script = []
    acts: Acts = []
    for _ in range(TICKS):
        leaves = [item for item in reading.root.walk() if item.leaf]
        script.append(ends_of(reading, leaves, chance))
        acts.append([])
        for what in _wishes(reading, chance):
            if what == "replace":
                number += 1
                edited = _edited(current, chance, number)
                act = Act("replace", charts=edited)
                current = edited if reading.can_replace(edited) else current
            elif what == "force":
                act = _forced(reading, chance)
            elif what in ("break", "unbreak"):
                act = Act(what, chance.choice([*reading.root.walk()]).path)
            else:
                act = Act(what)
            acts[-1].append(act)
            reading.operate(act)
        reading.tick(script[-1])
        if reading.outcome is not None:
            break
    return OperatedCase(charts, script, acts, reading)


def _wishes(reading: Operated, chance: random.Random) -> Iterator[str]:
    """Either one node is forced, or the chart is replaced once or twice."""
    if chance.random() < (0.4 if reading.paused else 0.12):
        yield "resume" if reading.paused else "pause"
    if chance.random() < (0.6 if reading.paused else 0.05):
        yield "step"
    if chance.random() < 0.1:
        yield chance.choice(("break", "break", "unbreak"))
    drawn = chance.random()
    if drawn < 0.2:
        yield "force"
    elif drawn < 0.5:
        yield from ["replace"] * chance.choice((1, 2, 2))
    elif drawn > 0.99:
        yield "close"


def _forced(reading: Operated, chance: random.Random) -> Act:
    """Mostly something that is possible; often a node that is put off."""
    items = [item for item in reading.root.walk() if item.parent is not None]
    likely = [i for i in items if i.running or i.retry_at is not None] + reading.put_off * 3
    item = chance.choice([i for i in likely if i.parent is not None] or items)
    outcomes = sorted(reading.endings(item)) * 4 + ["done", "x", "seen"]
    return Act("force", item.path, chance.choice(outcomes))


def _edited(charts: Charts, chance: random.Random, number: int) -> Charts:
    """The charts with a child more in one container, or one fewer of those put in before."""
    edited = copy.deepcopy(charts)
    boxes = [*_boxes(edited["c"])]
    form, box = chance.choice(boxes)
    added = [name for name in box if name.startswith("r")]
    if added and chance.random() < 0.3:
        del box[chance.choice(added)]
        return edited
    kind = chance.choice(("do", "watch"))
    outcomes, sibling = OUTCOMES[kind], next(iter(box.values()))
    node: dict[str, Any] = {kind: {"do": "Do", "watch": "See"}[kind]}
    ends = [target for target in sibling.get("next", {}).values() if target.startswith(".")]
    if ends:
        node["next"] = dict.fromkeys(outcomes, ends[0])
    elif form != "states":
        node["next"] = {}
    if chance.random() < 0.3:
        node["break"] = True
    if kind == "watch" and form != "states":
        node["priority"] = chance.randint(-1, 1)
    box[f"r{number}"] = node
    return edited


def _boxes(node: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for form in ("states", "any", "all"):
        if form in node:
            yield form, node[form]
            for child in node[form].values():
                yield from _boxes(child)


# -- the engine ------------------------------------------------------------------------------------


def operated_by_engine(
    charts: Charts, script: Script, acts: Acts
) -> tuple[list[Entry], list[tuple[int, str]]]:
    """What the engine makes of it, and which acts it refuses."""
    bench, refused = Bench(_text(charts)), []
    bench.operator.attend()
    assert bench.script is not None
    for number, (ends, wanted) in enumerate(zip(script, acts, strict=True)):
        for path, outcome in ends.items():
            bench.end(path, RuntimeError("scripted") if outcome == RAISES else outcome)
        refused += [(number - 1, act.what) for act in wanted if not _acted(bench, act)]
        bench.tick()
    ticks = {number * 10**9 // HZ: number for number in range(len(script))}
    entries = [
        Entry(ticks[r.time], (r.kind, r.subject, *r.detail), 0)
        for r in bench.run.trace
        if r.kind in KINDS
    ]
    return entries, refused


def _text(charts: Charts) -> str:
    return "---\n".join(json.dumps(chart) + "\n" for chart in charts.values())


def _acted(bench: Bench, act: Act) -> bool:
    operator, script = bench.operator, bench.script
    assert script is not None
    others = {
        "close": bench.run.close,
        "pause": operator.pause,
        "resume": operator.resume,
        "step": operator.step,
        "break": lambda: operator.break_at(act.path),
        "unbreak": lambda: operator.unbreak(act.path),
        "force": lambda: operator.force(act.path, act.outcome),
    }
    if act.what in others:
        return others[act.what]() is None
    assert act.charts is not None
    library = load_text(json.dumps(act.charts["c"]))
    for name, chart in act.charts.items():
        if name != "c":
            library |= load_text(json.dumps(chart))
    machine = Machine(library["c"], library, bench.interfaces)
    more = LeafScript(machine)
    more.log, more._ends = script.log, script._ends
    for path, stand_in in more.stand_ins.items():
        if path not in bench.run.stand_ins:
            bench.run.put_in(path, stand_in)
    script._leaves |= more._leaves
    return operator.replace(machine) == []
