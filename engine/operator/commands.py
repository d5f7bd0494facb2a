"""The operator's commands as values (rule 11): a run carries them out at the start of a tick.

Those carried out are kept with their times in `ChartRun.carried_out`, so that they can be recorded
and replayed at the same instants. `Operator` issues them, or returns why one is refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from engine.files import did_you_mean
from engine.machine import (
    CHOSEN,
    ENDED,
    GRANTED,
    IDLE,
    PUT_OFF,
    REFUSED,
    WAITING,
    Box,
    Leaf,
    Machine,
    Vertex,
    Writes,
    checked,
)
from engine.operator.replace import obstacles, take_over
from engine.run import ChartRun, Command, text_of
from engine.types import ANY, Type


@dataclass(frozen=True, slots=True)
class End(Command):
    """End the run with this outcome: `stopped` or `preempted`."""

    outcome: str

    def carry_out(self, run: ChartRun) -> None:
        """Close everything."""
        run.life.abort(run.life.root, self.outcome, self.outcome)
        run.finish(self.outcome)


@dataclass(frozen=True, slots=True)
class Pause(Command):
    """Hold the parts and step nothing; chart time stands still."""

    def carry_out(self, run: ChartRun) -> None:
        """Begin the pause."""
        run.pause()


@dataclass(frozen=True, slots=True)
class Resume(Command):
    """Go on after a pause."""

    def carry_out(self, run: ChartRun) -> None:
        """End the pause."""
        run.resume()


@dataclass(frozen=True, slots=True)
class StepOnce(Command):
    """In a pause, run this tick; the pause goes on with the next one. Two in a tick are one."""

    def carry_out(self, run: ChartRun) -> None:
        """Let this tick take place."""
        run.step_once()


@dataclass(frozen=True, slots=True)
class Break(Command):
    """Pause, because a node with a breakpoint was entered; the run wants it by itself."""

    path: str

    def carry_out(self, run: ChartRun) -> None:
        """Begin the pause, with a note at the node."""
        run.note(run.nodes.get(self.path, run.life.root), "breakpoint")
        run.pause()


@dataclass(frozen=True, slots=True)
class SetBreak(Command):
    """Set a breakpoint at `path`, or remove it, whatever the chart says."""

    path: str
    breaks: bool = True

    def carry_out(self, run: ChartRun) -> None:
        """Set or remove it; it counts from the next entry of the node on."""
        run.breakpoints[self.path] = self.breaks
        renew_breaks(run)


@dataclass(frozen=True, slots=True)
class Remark(Command):
    """Put on record what the operator did beside the chart, as a pull of the stop line."""

    text: str
    is_late: ClassVar[bool] = True

    def carry_out(self, run: ChartRun) -> None:
        """Note it; nothing else happens."""
        run.note(run.life.root, f"{self.by or 'operator'}: {self.text}")


@dataclass(frozen=True, slots=True)
class ForceOutcome(Command):
    """End the active node at `path` with an outcome and its outputs."""

    path: str
    outcome: str
    outputs: Mapping[str, Any] = field(default_factory=dict)

    def carry_out(self, run: ChartRun) -> None:
        """Close the node and follow its outcome."""
        node = run.nodes.get(self.path)
        if node is None or self.refusal(run) is not None:
            return
        vertex = node.vertex
        ended = run.life.abort(node, "forced", self.outcome)
        writes: Writes = ()
        if ended == self.outcome:
            types = output_types(run.machine, vertex, self.outcome)
            frozen = checked(self.outputs, types, run.judge.freezers)
            writes = tuple(
                (cell, frozen[name.key if isinstance(vertex, Box) else name])
                for name, cell in vertex.outputs.get(self.outcome, ())
            )
        run.follow(node, ended, writes)

    def refusal(self, run: ChartRun) -> str | None:
        """Why it cannot be done; None if it can."""
        node = run.nodes.get(self.path)
        if node is None:
            return f"no node {self.path!r}; {did_you_mean(self.path, run.nodes)}"
        vertex = node.vertex
        if vertex.parent is None:
            return "the whole chart is not forced; stop or preempt it"
        if node.status in (IDLE, ENDED, CHOSEN, PUT_OFF):
            return f"{self.path!r} is not active"
        possible = outcomes_of(vertex)
        if self.outcome not in possible:
            hint = did_you_mean(self.outcome, possible)
            return f"{self.path!r} has no outcome {self.outcome!r}; {hint}"
        types = output_types(run.machine, vertex, self.outcome)
        if set(self.outputs) != set(types):
            given = sorted(self.outputs)
            return f"{self.outcome!r} comes with {sorted(types)}, given: {given}"
        try:
            checked(self.outputs, types, run.judge.freezers)
        except Exception as error:  # noqa: BLE001  freezers may raise anything
            return text_of(error)
        return None


@dataclass(frozen=True, slots=True)
class SetLock(Command):
    """Lock `path`, so that every outcome inside it waits for consent, or unlock it."""

    path: str
    locked: bool = True

    def carry_out(self, run: ChartRun) -> None:
        """Set or remove the lock; nodes that waited only because of it continue."""
        if self.locked:
            run.judge.locks.add(self.path)
        else:
            run.judge.locks.discard(self.path)
        run.forget_routes()
        _release_waiting(run)


@dataclass(frozen=True, slots=True)
class SetLevel(Command):
    """Set the autonomy level, a number of `engine.chart.chart.AUTONOMY`; None: only locks ask."""

    level: int | None

    def carry_out(self, run: ChartRun) -> None:
        """Set it; nodes that waited only because of the old level continue."""
        run.judge.level = self.level
        run.forget_routes()
        _release_waiting(run)


@dataclass(frozen=True, slots=True)
class Answer(Command):
    """Let the node at `path` end as it wants to, or make it try again."""

    path: str
    granted: bool

    def carry_out(self, run: ChartRun) -> None:
        """Record the answer; the node acts on it when it is next stepped."""
        node = run.nodes.get(self.path)
        if node is not None and node.status == WAITING:
            node.answer = GRANTED if self.granted else REFUSED


@dataclass(frozen=True, slots=True)
class Replace(Command):
    """Go on with another chart."""

    machine: Machine

    def carry_out(self, run: ChartRun) -> None:
        """Replace the chart, unless obstacles have arisen meanwhile; these are noted."""
        found = obstacles(run, self.machine)
        if found:
            for reason in found:
                run.note(run.life.root, f"not replaced: {reason}")
            return
        take_over(run, self.machine)
        renew_breaks(run)


def breaks_of(run: ChartRun) -> list[str]:
    """The paths with a breakpoint, in document order; the operator's word comes first."""
    said, vertices = run.breakpoints, run.machine.vertices
    return [path for path, vertex in vertices.items() if said.get(path, vertex.breaks)]


def renew_breaks(run: ChartRun) -> None:
    """Let entries of nodes with a breakpoint pause the run, if an operator attends it."""
    paths = breaks_of(run) if run.attended else ()
    run.life.breaks = {path: Break(path, by="breakpoint") for path in paths}


def _release_waiting(run: ChartRun) -> None:
    for node in run.nodes.values():
        if node.status == WAITING and not run.judge.must_ask(node, node.waiting[0]):
            node.answer = GRANTED


def outcomes_of(vertex: Vertex) -> set[str]:
    """The outcomes that a node can end with, except `error`."""
    if isinstance(vertex, Leaf):
        return set(vertex.interface.outcomes)
    assert isinstance(vertex, Box)
    found = {outcome for outcome, _ in vertex.rules} if vertex.keeps else set()
    for child in vertex.children:
        found |= set(child.leave.values())
        if not vertex.keeps:
            found |= outcomes_of(child) - set(child.go) - set(child.leave)
    return found - {"error"}


def output_types(machine: Machine, vertex: Vertex, outcome: str) -> Mapping[str, Type]:
    """The outputs that come with an outcome of a node, and their types."""
    if isinstance(vertex, Leaf):
        return vertex.interface.outputs.get(outcome, {})
    assert isinstance(vertex, Box)
    names = [inner.key for inner, _ in vertex.outputs.get(outcome, ())]
    declared = machine.library[vertex.chart].outputs[outcome] if names else {}
    return {name: machine.types.get(declared[name], ANY) for name in names}
