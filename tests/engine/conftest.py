"""A chart, its run and a script for its leaves, driven tick by tick."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pytest

from engine.chart.load import Library
from engine.files.source import read
from engine.interfaces import Interface, interface
from engine.machine.machine import Machine
from engine.machine.scripted_states import LeafScript
from engine.operator.operator import Operator
from engine.run.chart_run import ChartRun
from engine.state import Action, Context, Monitor, Run as Steps, State

HZ = 10


class Do(Action):
    """An action with three outcomes."""

    outcomes = ("done", "failed", "other")

    def run(self, ctx: Context) -> Steps:
        yield
        return "done"


class See(Monitor):
    """A monitor with two outcomes."""

    outcomes = ("seen", "lost")

    def run(self, ctx: Context) -> Steps:
        yield
        return "seen"


class Give(Action):
    """An action with an output."""

    outcomes = ("done", "failed", "other")
    outputs = {"done": {"value": float}}

    def run(self, ctx: Context) -> Steps:
        yield
        return "done", {"value": 1.0}


class Tell(Monitor):
    """A monitor with an output."""

    outcomes = ("seen", "lost")
    outputs = {"seen": {"value": float}}

    def run(self, ctx: Context) -> Steps:
        yield
        return "seen", {"value": 1.0}


class Use(Action):
    """An action with an input."""

    outcomes = ("done", "failed", "other")

    def run(self, ctx: Context, value: float) -> Steps:
        yield
        return "done"


class Drive(Action):
    """An action that commands a part."""

    outcomes = ("done", "failed", "other")
    commands = ("base",)

    def run(self, ctx: Context) -> Steps:
        yield
        return "done"


class Part:
    """A part that counts its stops."""

    def __init__(self) -> None:
        self.stops = 0

    def stop(self) -> None:
        self.stops += 1


STATES: tuple[type[State], ...] = (Do, See, Give, Tell, Use, Drive)


class Bench:
    """One run in virtual time, with scripted leaves."""

    def __init__(
        self,
        text: str,
        states: tuple[type[State], ...] = (),
        scripted: bool = True,
        binding: Mapping[str, Any] | None = None,
        **given: Any,
    ) -> None:
        self.binding = binding or {}  # of the machine: types, inputs, what names stand for
        self.library = Library()
        for part in text.split("---\n"):
            self.library.add(read(part.encode(), "<text>"))
        assert not self.library.findings, self.library.findings
        self.interfaces: dict[str, Interface] = {c.__name__: interface(c) for c in STATES + states}
        self.chart = next(iter(self.library.values()))
        self.machine = self.bind(self.chart)
        self.script = LeafScript(self.machine) if scripted else None
        self.base = Part()
        given.setdefault("parts", {"base": self.base})
        if self.script is not None:
            given["stand_ins"] = self.script.stand_ins
        self.run = ChartRun(self.machine, **given)
        self.operator = Operator(self.run)
        self.ticks = 0

    def bind(self, chart: Any) -> Machine:
        return Machine(chart, self.library, self.interfaces, **self.binding)

    @property
    def now(self) -> int:
        return self.ticks * 10**9 // HZ

    def tick(self, times: int = 1) -> list[str]:
        """Run ticks; what was stepped in the last of them."""
        for _ in range(times):
            if self.script is not None:
                self.script.log.clear()
            self.run.tick(self.now)
            self.ticks += 1
        return self.steps

    @property
    def steps(self) -> list[str]:
        if self.script is None:
            return []
        return [path for what, path in self.script.log if what == "step"]

    def end(self, path: str, outcome: str | Exception, **outputs: Any) -> None:
        assert self.script is not None
        self.script.end(path, outcome, **outputs)

    @property
    def active(self) -> list[str]:
        return self.run.active

    def records(self, *kinds: str, since: int = -1) -> list[tuple[Any, ...]]:
        """The trace's records of these kinds, later than `since` ns, without times."""
        return [
            (r.kind, r.subject, *r.detail)
            for r in self.run.trace
            if r.time > since and (not kinds or r.kind in kinds)
        ]

    def last(self, *kinds: str) -> list[tuple[Any, ...]]:
        """The records of the last tick."""
        return self.records(*kinds, since=(self.ticks - 2) * 10**9 // HZ)


@pytest.fixture
def bench() -> Callable[..., Bench]:
    return Bench


def exits(records: list[tuple[Any, ...]]) -> Mapping[str, str]:
    return {record[1]: record[2] for record in records if record[0] == "exit"}
