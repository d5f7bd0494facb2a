"""Scripted stand-ins for states, with which any chart can be run without its robot.

`LeafScript.end(path, outcome)` makes the leaf at `path` end at its next step; otherwise leaves stay
busy. Everything else, including the order of stepping, is done by the engine itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from engine.machine.machine import Machine
from engine.machine.node import Substitute
from engine.machine.vertices import Leaf
from engine.state import Context, Outcome, Run, State
from engine.types import Type


class LeafScript:
    """A script of what the leaves of one machine do, and a log of what they did.

    Attributes:
        log: what happened: ("start" | "step" | "stop", path).
        inputs: the inputs with which a path was last entered.
        stand_ins: one for each leaf, by path, to be passed to the run.
    """

    def __init__(self, machine: Machine) -> None:
        self.log: list[tuple[str, str]] = []
        self.inputs: dict[str, dict[str, Any]] = {}
        self.stand_ins = {
            leaf.path: Substitute(partial(_Scripted, leaf, self), perhaps(leaf.interface.outputs))
            for leaf in machine.leaves
        }
        self._ends: dict[str, list[Any]] = {}
        self._leaves = {leaf.path: leaf for leaf in machine.leaves}

    def end(self, path: str, outcome: str | Exception, **outputs: Any) -> None:
        """Have the leaf at `path` return `outcome`, or raise it; outputs not given are `None`.

        Several calls for one path are consumed in order, one per entry of the leaf.
        """
        leaf = self._leaves[path]
        if isinstance(outcome, Exception):
            self._ends.setdefault(path, []).append(outcome)
            return
        declared = leaf.interface.outputs.get(outcome, {})
        given: dict[str, Any] = dict.fromkeys(declared) | outputs
        self._ends.setdefault(path, []).append((outcome, given) if given else outcome)

    def play(self, script: Mapping[str, list[str]]) -> None:
        """Queue outcomes for several paths at once."""
        for path, outcomes in script.items():
            for outcome in outcomes:
                self.end(path, outcome)

    def next_end(self, path: str) -> Any:
        """Take the next scripted end of the leaf at `path`; None: it stays busy."""
        ends = self._ends.get(path)
        return ends.pop(0) if ends else None


def perhaps(outputs: Mapping[str, Mapping[str, Type]]) -> dict[str, dict[str, Type]]:
    """The same outputs with all types optional, since a stand-in may leave some `None`."""
    return {
        outcome: {name: replace(kind, optional=True) for name, kind in produced.items()}
        for outcome, produced in outputs.items()
    }


class _Scripted(State):
    """Stands in for a leaf's state."""

    def __init__(self, leaf: Leaf, script: LeafScript, **_parameters: Any) -> None:
        self.path = leaf.path
        self.script = script

    def run(self, ctx: Context, **inputs: Any) -> Run:  # noqa: ARG002
        script, path = self.script, self.path
        script.inputs[path] = inputs
        script.log.append(("start", path))
        try:
            while True:
                script.log.append(("step", path))
                end = script.next_end(path)
                if isinstance(end, Exception):
                    raise end
                if end is not None:
                    outcome: Outcome = end
                    return outcome
                yield None
        finally:
            script.log.append(("stop", path))
