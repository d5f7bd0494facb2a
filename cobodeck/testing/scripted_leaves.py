"""What a test's script has the leaves of a run do."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from engine.files import did_you_mean
from engine.machine import Box, Leaf, LeafScript
from engine.run import ChartRun

__tracebackhide__ = True  # a failing test shows its own line

ScriptedOutcome = str | tuple[str, Mapping[str, Any]] | Exception
Outcomes = ScriptedOutcome | Sequence[ScriptedOutcome]


class ScriptedLeaves:
    """Stand-ins for leaves of a run that has not begun.

    Leaves are named by path, end of path, or class.
    """

    def __init__(self, run: ChartRun) -> None:
        self._leaves = run.machine.leaves
        self._run = run
        self._script = LeafScript(run.machine)

    def play(
        self, script: Mapping[str, Outcomes], real: Iterable[str], *, everything: bool
    ) -> None:
        """Put the stand-ins in: for the leaves of the script, or for `everything` but `real`."""
        played = {
            leaf: [outcomes] if isinstance(outcomes, str | tuple | Exception) else outcomes
            for name, outcomes in script.items()
            for leaf in self.named(name)
        }
        kept = {leaf for name in real for leaf in self.named(name)}
        for leaf in self._leaves:
            if leaf not in kept and (everything or leaf in played):
                self._run.put_in(leaf.path, self._script.stand_ins[leaf.path])
        for leaf, outcomes in played.items():
            for outcome in outcomes:
                self._end(leaf, outcome)

    def end(self, name: str, outcome: ScriptedOutcome) -> None:
        """Let leaves end with an outcome at their next step."""
        for leaf in self.named(name):
            self._end(leaf, outcome)

    def named(self, name: str) -> list[Leaf]:
        """The leaves of this name; there is one at least."""
        found = [v for v in self._leaves if is_named(v.path, name) or v.interface.name == name]
        if not found:
            raise AssertionError(f"no leaf {name!r} in the chart; {self._meant(name)}")
        return found

    def _meant(self, name: str) -> str:
        """What to script instead: the leaves in a box of this name, or a leaf of a similar one."""
        for box in self._run.machine.vertices.values():
            if isinstance(box, Box) and box.path and is_named(box.path, name):
                what = f"uses chart {box.chart}" if box.chart else "is a container"
                inside = [v.path for v in self._leaves if v.path.startswith(f"{box.path}/")]
                leaves = ", ".join(repr(name + path.removeprefix(box.path)) for path in inside)
                return f"{name!r} {what}; script its leaves: {leaves}"
        known = {v.path for v in self._leaves} | {v.interface.name for v in self._leaves}
        return did_you_mean(name, known)

    def _end(self, leaf: Leaf, outcome: ScriptedOutcome) -> None:
        if isinstance(outcome, Exception):
            self._script.end(leaf.path, outcome)
            return
        name, outputs = (outcome, {}) if isinstance(outcome, str) else outcome
        known = leaf.interface.outcomes
        if name not in known:
            hint = did_you_mean(name, known)
            raise AssertionError(f"{leaf.path} has no outcome {name!r}; {hint}")
        self._script.end(leaf.path, name, **outputs)


def is_named(path: str, name: str) -> bool:
    """Whether a node is meant by its path or the end of it."""
    return path == name or path.endswith("/" + name)
