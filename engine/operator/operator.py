"""What the operator may do to a run (rule 11): carried out by the engine, never left to a state.

A command takes effect at the start of the next tick. Those that can be refused return the reason,
or `None` when they are accepted.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from engine.chart import AUTONOMY
from engine.files import did_you_mean
from engine.machine import WAITING, Machine
from engine.operator.commands import (
    Answer,
    End,
    ForceOutcome,
    Pause,
    Replace,
    Resume,
    SetLevel,
    SetLock,
)
from engine.operator.replace import obstacles
from engine.run import ChartRun


class Operator:
    """Commands for one run."""

    def __init__(self, run: ChartRun) -> None:
        self._run = run

    def stop(self) -> None:
        """End the run with outcome `stopped`, whatever it is doing."""
        self._run.command(End("stopped"))

    def preempt(self) -> None:
        """End the run with outcome `preempted`, because something else takes precedence."""
        self._run.command(End("preempted"))

    def pause(self) -> None:
        """Hold the parts and step nothing; chart time stands still."""
        self._run.command(Pause())

    def resume(self) -> None:
        """Go on after a pause."""
        self._run.command(Resume())

    def force(
        self, path: str, outcome: str, outputs: Mapping[str, Any] | None = None
    ) -> str | None:
        """End the active node at `path` with `outcome`."""
        command = ForceOutcome(path, outcome, dict(outputs or {}))
        refusal = command.refusal(self._run)
        if refusal is None:
            self._run.command(command)
        return refusal

    def lock(self, path: str) -> str | None:
        """Let every outcome inside `path` wait for consent."""
        if path not in self._run.nodes:
            return f"no node {path!r}; {did_you_mean(path, self._run.nodes)}"
        self._run.command(SetLock(path))
        return None

    def unlock(self, path: str) -> str | None:
        """Remove a lock; nodes that waited only because of it continue."""
        if path not in self._run.judge.locks:
            return f"{path!r} is not locked; {did_you_mean(path, self._run.judge.locks)}"
        self._run.command(SetLock(path, locked=False))
        return None

    def set_level(self, level: str | None) -> str | None:
        """Set the autonomy level: off, low, high or full; `None`: only locks ask."""
        if level is not None and AUTONOMY.get(level, -1) < 0:
            return f"no level {level!r}; {did_you_mean(level, ('off', 'low', 'high', 'full'))}"
        self._run.command(SetLevel(None if level is None else AUTONOMY[level]))
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
            self._run.command(Replace(machine))
        return found

    def _answer(self, path: str, *, granted: bool) -> str | None:
        node = self._run.nodes.get(path)
        if node is None or node.status != WAITING:
            return f"{path!r} waits for nothing; {did_you_mean(path, self.waiting())}"
        self._run.command(Answer(path, granted))
        return None
