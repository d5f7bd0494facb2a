"""What the monitors of any signal mean, said by looking at every tick; and runs of one of them."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from hypothesis import strategies as st

from engine.chart.load import Library
from engine.clock import TickGrid
from engine.files.source import read
from engine.interfaces import interface
from engine.machine.machine import Machine
from engine.run.chart_run import ChartRun
from engine.signals.board import Board
from engine.signals.signal_kinds import Derived, Measured, Signal, declare
from engine.state import Context, Key, Monitor, Run, Stamped
from states.watching.states import Above, Below, Changed, Silent, WaitFor, Within

HZ = 10
GRID = TickGrid(HZ)
READY = (Above, Below, Within, Changed, WaitFor, Silent)
Given = Mapping[str, Any]
"""The parameters of a monitor, as in a chart."""


class Seen(NamedTuple):
    """What a monitor can see in one tick: the newest sample, and its value unless it is too old."""

    now: int
    sample: Stamped | None
    value: Any


class Polled(Monitor):
    """Looks at a signal in every tick, and never ends."""

    outcomes = ("never",)
    reads = {"$signal": "$older"}

    def __init__(self, signal: Key[Any], seen: Any, older: float | None = None) -> None:
        self.signal, self.seen = signal, seen

    def run(self, ctx: Context) -> Run:
        while ctx.now >= 0:
            self.seen.append(Seen(ctx.now, ctx.sample(self.signal), ctx.value(self.signal)))
            yield
        return "never"


@dataclass(frozen=True)
class Watch:
    """A monitor with its parameters, and the outcome that it ends with."""

    name: str
    given: Given

    @property
    def outcome(self) -> str:
        """The one outcome of its class."""
        return next(cls for cls in READY if cls.__name__ == self.name).outcomes[0]

    @property
    def older(self) -> float | None:
        """The greatest age of a value, s."""
        found: float | None = self.given["time" if self.name == "Silent" else "older"]
        return found

    def chart(self) -> str:
        """A chart of this monitor alone, whose value, if it has one, is written to `v`."""
        given = ", ".join(f"{k}: {v}" for k, v in self.given.items() if v is not None)
        out = "" if self.name == "Silent" else "out: {value: v}, "
        node = f"{{watch: {self.name}, with: {{{given}}}, {out}next: {{{self.outcome}: .x}}}}"
        data = "data: {v: {type: any, initial: none}}\n"
        return f"chart: c\noutcomes: [x]\n{data}states:\n  a: {node}\n"

    def end(self, seen: Sequence[Seen]) -> tuple[int, Any] | None:
        """By what is seen in each tick: when it ends, ns, and the value then; None: it does not."""
        look = _MEANINGS.get(self.name, _threshold)
        for n, now in enumerate(seen):
            if look(self, seen[: n + 1]):
                return now.now, None if self.name == "Silent" else now.value
        return None


def _threshold(watch: Watch, seen: Sequence[Seen]) -> bool:
    """Whether each value has counted for as long as it has to, up to the last one."""
    counted: list[bool] = []
    for now in seen:
        before = bool(counted) and counted[-1]
        known = now.value is not None and not math.isnan(now.value)
        counted.append(known and _counts(watch, now.value, before))
    lasts = round(watch.given["for"] * 1e9)
    return any(
        all(counted[n:]) and seen[-1].now - first.now >= lasts for n, first in enumerate(seen)
    )


def _counts(watch: Watch, value: float, before: bool) -> bool:
    given = watch.given
    if watch.name == "WaitFor":
        return given["value"] is None or value == given["value"]
    slack = given["hysteresis"]
    if watch.name == "Above":
        return value > given["limit"] or (before and value >= given["limit"] - slack)
    if watch.name == "Below":
        return value < given["limit"] or (before and value <= given["limit"] + slack)
    inside: bool = given["low"] <= value <= given["high"]
    return inside or (before and given["low"] - slack <= value <= given["high"] + slack)


def _changed(_watch: Watch, seen: Sequence[Seen]) -> bool:
    first = next((now.sample for now in seen if now.sample is not None), None)
    value = seen[-1].value
    if first is None or value is None or math.isnan(value):
        return False
    return bool(value != first.value)


def _silent(watch: Watch, seen: Sequence[Seen]) -> bool:
    begin, last = seen[0], seen[-1]
    waited = last.now - begin.now >= round(watch.given["time"] * 1e9)
    return last.value is None and (waited or begin.sample is not None)


_MEANINGS: dict[str, Callable[[Watch, Sequence[Seen]], bool]] = {
    "Changed": _changed,
    "Silent": _silent,
}


@st.composite
def watches(draw: st.DrawFn, signals: Sequence[str], names: Sequence[str]) -> Watch:
    """A monitor of one of these classes, of one of these signals of numbers from 0 to 2."""
    name = draw(st.sampled_from(names))
    given: dict[str, Any] = {"signal": draw(st.sampled_from(signals))}
    if name == "Silent":
        return Watch(name, given | {"time": draw(st.sampled_from((0.0, 0.1, 0.35, 1.0, 3.0)))})
    given["older"] = draw(st.sampled_from((None, 0.0, 0.1, 0.35, 1.0)))
    if name == "Changed":
        return Watch(name, given)
    given["for"] = draw(st.sampled_from((0.0, 0.1, 0.25, 0.3, 1.0, 4.0)))
    if name == "WaitFor":
        return Watch(name, given | {"value": draw(st.sampled_from((None, 0.5, 1.0)))})
    given["hysteresis"] = draw(st.sampled_from((0.0, 0.25, 0.5)))
    if name == "Within":
        return Watch(name, given | {"low": 0.75, "high": draw(st.sampled_from((0.75, 1.25)))})
    return Watch(name, given | {"limit": draw(st.sampled_from((0.5, 0.75, 1.0)))})


def run_of(watch: Watch, signals: Mapping[str, Signal]) -> ChartRun:
    """A run of its chart."""
    return ChartRun(_machine(watch.chart()), Board(signals))


def polling(watch: Watch, signals: Mapping[str, Signal]) -> tuple[ChartRun, list[Seen]]:
    """A run that looks at its signal in every tick, and what it sees."""
    seen: list[Seen] = []
    older = "" if watch.older is None else f", older: {watch.older}"
    node = f"{{watch: Polled, with: {{signal: {watch.given['signal']}{older}}}, next: "
    machine = _machine(f"chart: c\noutcomes: [x]\nstates:\n  a: {node}{{never: .x}}}}\n")
    machine.leaves[0].parameters["seen"] = seen
    return ChartRun(machine, Board(signals)), seen


def _machine(text: str) -> Machine:
    library = Library()
    library.add(read(text.encode(), "<text>"))
    assert not library.findings, library.findings
    return Machine(library["c"], library, {c.__name__: interface(c) for c in (*READY, Polled)})


def ended(run: ChartRun) -> tuple[int, Any] | None:
    """When the monitor of a run has ended, ns, and its value."""
    if run.outcome is None:
        return None
    assert run.outcome == "x", run.errors
    records = list(run.trace)
    value = next((r.detail[1] for r in records if r.kind == "data"), None)
    return next(r.time for r in records if r.kind == "outcome"), value


SIGNALS = declare([
    Measured("a", float),
    Measured("b", float),
    Derived("mean", ("a", "b"), lambda a, b: (a + b) / 2, float),
])  # fmt: skip

Delivery = tuple[str, float | None, int]
"""A signal, a value, and its stamp, ns."""


@dataclass
class Feed:
    """Samples that come by chance, late by up to `lag`, ns; most of them repeat.

    One in `every` ticks, by chance.
    """

    chance: random.Random
    lag: int
    every: int = 1
    held: dict[str, float | None] = field(default_factory=dict)
    heard: dict[str, bool] = field(default_factory=dict)

    def samples(self, now: int) -> list[Delivery]:
        """What arrives before the tick at this instant."""
        found = []
        for name in ("a", "b"):
            if self.chance.random() < 0.1:
                self.heard[name] = not self.heard.get(name, False)
            if self.chance.random() < 0.15:
                self.held[name] = self.chance.choice((None, math.nan, 0.0, 0.5, 0.75, 1.0, 2.0))
            comes = self.heard.get(name) and not self.chance.randrange(self.every)
            if comes and name in self.held:
                late = self.chance.randrange(self.lag + 1)
                found.append((name, self.held[name], max(0, now - late)))
        return found
