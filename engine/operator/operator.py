"""What the operator may do to a run (rule 11): carried out by the engine, never left to a state.

A command takes effect at the start of the next tick. Those that can be refused return the reason,
or `None` when they are accepted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from engine.chart import AUTONOMY
from engine.files import did_you_mean
from engine.machine import WAITING, Machine
from engine.operator.commands import (
    Answer,
    End,
    ForceOutcome,
    Pause,
    Remark,
    Replace,
    Resume,
    SetBreak,
    SetLevel,
    SetLock,
    Step,
    breaks_of,
    renew_breaks,
)
from engine.operator.replace import obstacles
from engine.run import ChartRun, Command


class Operator:
    """Commands for one run; `by` is who issues them, as records say it."""

    def __init__(self, run: ChartRun, by: str = "") -> None:
        self._run, self._by = run, by

    def _issue(self, command: Command) -> None:
        self._run.command(replace(command, by=self._by))

    def attend(self, attended: bool = True) -> None:
        """Attend the run, so that breakpoints pause it, or leave it alone again.

        To be called between ticks. Without an operator, breakpoints do nothing at all.
        """
        self._run.attended = attended
        renew_breaks(self._run)

    def stop(self) -> None:
        """End the run with outcome `stopped`, whatever it is doing."""
        self._issue(End("stopped"))

    def preempt(self) -> None:
        """End the run with outcome `preempted`, because something else takes precedence."""
        self._issue(End("preempted"))

    def pause(self) -> None:
        """Hold the parts and step nothing; chart time stands still."""
        self._issue(Pause())

    def resume(self) -> None:
        """Go on after a pause."""
        self._issue(Resume())

    def step(self) -> str | None:
        """In a pause, run one tick, and pause again; chart time goes on by one period."""
        run = self._run
        if run.over:
            return "the run has ended"
        if not run.paused:
            return "the run is not paused; pause it first"
        self._issue(Step())
        return None

    def breaks(self) -> list[str]:
        """The paths with a breakpoint, in document order."""
        return breaks_of(self._run)

    def break_at(self, path: str) -> str | None:
        """Let each entry of the node at `path` pause the run, further tries included.

        It pauses with the next tick of the grid, so the node has been stepped once.
        """
        if path not in self._run.nodes:
            return f"no node {path!r}; {did_you_mean(path, self._run.nodes)}"
        if not self._run.attended:
            return "no operator attends the run, so breakpoints do nothing; attend it first"
        self._issue(SetBreak(path))
        return None

    def unbreak(self, path: str) -> str | None:
        """Remove a breakpoint, one that the chart has, too."""
        if path not in (breaks := breaks_of(self._run)):
            return f"{path!r} has no breakpoint; {did_you_mean(path, breaks)}"
        self._issue(SetBreak(path, breaks=False))
        return None

    def remark(self, text: str) -> None:
        """Put on record what was done beside the chart, as `stop` for a pull of the stop line."""
        self._issue(Remark(text))

    def force(
        self, path: str, outcome: str, outputs: Mapping[str, Any] | None = None
    ) -> str | None:
        """End the active node at `path` with `outcome`."""
        command = ForceOutcome(path, outcome, dict(outputs or {}))
        refusal = command.refusal(self._run)
        if refusal is None:
            self._issue(command)
        return refusal

    def lock(self, path: str) -> str | None:
        """Let every outcome inside `path` wait for consent."""
        if path not in self._run.nodes:
            return f"no node {path!r}; {did_you_mean(path, self._run.nodes)}"
        self._issue(SetLock(path))
        return None

    def unlock(self, path: str) -> str | None:
        """Remove a lock; nodes that waited only because of it continue."""
        if path not in self._run.judge.locks:
            return f"{path!r} is not locked; {did_you_mean(path, self._run.judge.locks)}"
        self._issue(SetLock(path, locked=False))
        return None

    def set_level(self, level: str | None) -> str | None:
        """Set the autonomy level: off, low, high or full; `None`: only locks ask."""
        if level is not None and AUTONOMY.get(level, -1) < 0:
            return f"no level {level!r}; {did_you_mean(level, ('off', 'low', 'high', 'full'))}"
        self._issue(SetLevel(None if level is None else AUTONOMY[level]))
        return None

    def waiting(self) -> dict[str, str]:
        """The nodes that wait for consent, and the outcome each wants to end with."""
        nodes = self._run.nodes.values()
        return {node.path: node.waiting[0] for node in nodes if node.status == WAITING}

    def consent(self, path: str) -> str | None:
        """Let the node at `path` end as it wants to."""
        return self._answer(path, granted=True)

    def refuse(self, path: str) -> str | None:
        """Make the node at `path` try again."""
        return self._answer(path, granted=False)

    def replace(self, machine: Machine) -> list[str]:
        """Continue with another chart; returns the reasons if that is impossible, else [].

        `Machine.changed` makes one that is given all that the present one was given.
        """
        found = obstacles(self._run, machine)
        if not found:
            self._issue(Replace(machine))
        return found

    def _answer(self, path: str, *, granted: bool) -> str | None:
        node = self._run.nodes.get(path)
        if node is None or node.status != WAITING:
            return f"{path!r} waits for nothing; {did_you_mean(path, self.waiting())}"
        self._issue(Answer(path, granted))
        return None
