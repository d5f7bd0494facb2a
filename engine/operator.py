"""What the operator may do to a run (rule 11): the engine's own commands, never asked of a child.

A command takes effect at the start of the next tick. Those that can be refused return the reason,
or `None` when they are accepted.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from engine.chart import AUTONOMY
from engine.decide import GRANTED, REFUSED, Writes
from engine.files.finding import did_you_mean
from engine.lifecycle import end_with
from engine.machine import CHOSEN, ENDED, IDLE, WAITING, Box, Leaf, Machine, Vertex
from engine.replace import obstacles, take_over
from engine.run import Run
from engine.types import freeze


class Operator:
    """Commands for one run."""

    def __init__(self, run: Run) -> None:
        self._run = run

    def stop(self) -> None:
        """End the run with outcome `stopped`, whatever it is doing."""
        self._run.command(partial(self._end, "stopped"))

    def preempt(self) -> None:
        """End the run with outcome `preempted`, because something else goes first."""
        self._run.command(partial(self._end, "preempted"))

    def pause(self) -> None:
        """Hold the parts and step nothing; chart time stands still."""
        self._run.command(self._pause)

    def resume(self) -> None:
        """Go on after a pause."""
        self._run.command(self._resume)

    def force(
        self, path: str, outcome: str, outputs: Mapping[str, Any] | None = None
    ) -> str | None:
        """End the active node at `path` with `outcome`."""
        refusal = self._cannot_force(path, outcome, outputs or {})
        if refusal is None:
            self._run.command(partial(self._force, path, outcome, outputs or {}))
        return refusal

    def lock(self, path: str) -> str | None:
        """Let every outcome inside `path` wait for consent."""
        if path not in self._run.machine.vertices:
            return f"no node {path!r}; {did_you_mean(path, self._run.machine.vertices)}"
        self._run.command(partial(self._set_lock, path, True))
        return None

    def unlock(self, path: str) -> str | None:
        """Take a lock away; what waited only because of it goes on."""
        if path not in self._run.judge.locks:
            return f"{path!r} is not locked; {did_you_mean(path, self._run.judge.locks)}"
        self._run.command(partial(self._set_lock, path, False))
        return None

    def set_level(self, level: str | None) -> str | None:
        """Set the autonomy level: off, low, high or full; `None`: nobody is asked."""
        if level is not None and AUTONOMY.get(level, -1) < 0:
            return f"no level {level!r}; {did_you_mean(level, ('off', 'low', 'high', 'full'))}"
        self._run.command(partial(self._set_level, None if level is None else AUTONOMY[level]))
        return None

    def waiting(self) -> dict[str, str]:
        """The nodes that wait for consent, and the outcome each wants to end with."""
        vertices = self._run.machine.vertices.values()
        return {v.path: v.waiting[0] for v in vertices if v.status == WAITING}

    def consent(self, path: str) -> str | None:
        """Let the node at `path` end as it wants to."""
        return self._answer(path, granted=True)

    def refuse(self, path: str) -> str | None:
        """Make the node at `path` try again."""
        return self._answer(path, granted=False)

    def replace(self, machine: Machine) -> list[str]:
        """Go on with another chart; the reasons why not, if there are any."""
        found = obstacles(self._run, machine)
        if not found:
            self._run.command(partial(self._replace, machine))
        return found

    # -- carried out in a tick -------------------------------------------------------------------

    def _end(self, reason: str) -> None:
        self._run.abort(self._run.machine.root, reason, reason)
        self._run.finish(reason)

    def _pause(self) -> None:
        run = self._run
        if not run.paused:
            run.paused = True
            run.pauses.append((run.board.now, run.board.now))
            run.hold()

    def _resume(self) -> None:
        run = self._run
        if run.paused:
            run.paused = False
            run.turns.notice(run.turns.monitors + run.turns.actions)

    def _cannot_force(self, path: str, outcome: str, outputs: Mapping[str, Any]) -> str | None:
        vertex = self._run.machine.vertices.get(path)
        if vertex is None:
            return f"no node {path!r}; {did_you_mean(path, self._run.machine.vertices)}"
        if vertex.parent is None:
            return "the whole chart is not forced; stop or preempt it"
        if vertex.status in (IDLE, ENDED, CHOSEN):
            return f"{path!r} is not active"
        possible = outcomes_of(vertex)
        if outcome not in possible:
            return f"{path!r} has no outcome {outcome!r}; {did_you_mean(outcome, possible)}"
        wanted = output_names(vertex, outcome)
        if set(outputs) != wanted:
            return f"{outcome!r} comes with {sorted(wanted)}, given: {sorted(outputs)}"
        try:
            for value in outputs.values():
                freeze(value, self._run.judge.freezers)
        except TypeError as error:
            return str(error)
        return None

    def _force(self, path: str, outcome: str, outputs: Mapping[str, Any]) -> None:
        run = self._run
        vertex = run.machine.vertices.get(path)
        if vertex is None or self._cannot_force(path, outcome, outputs) is not None:
            return
        ended = run.abort(vertex, "forced", outcome)
        writes: Writes = ()
        if ended == outcome:
            frozen = {name: freeze(value, run.judge.freezers) for name, value in outputs.items()}
            writes = tuple(
                (cell, frozen[name.key if isinstance(vertex, Box) else name])
                for name, cell in vertex.outputs.get(outcome, ())
            )
        run.force(vertex, ended, writes)

    def _set_lock(self, path: str, locked: bool) -> None:
        run = self._run
        if locked:
            run.judge.locks.add(path)
        else:
            run.judge.locks.discard(path)
        run.forget_routes()
        self._release_waiting()

    def _set_level(self, level: int | None) -> None:
        self._run.judge.level = level
        self._run.forget_routes()
        self._release_waiting()

    def _release_waiting(self) -> None:
        for vertex in self._run.machine.vertices.values():
            if vertex.status == WAITING and not self._run.judge.must_ask(vertex, vertex.waiting[0]):
                vertex.step = partial(end_with, GRANTED)

    def _answer(self, path: str, *, granted: bool) -> str | None:
        vertex = self._run.machine.vertices.get(path)
        if vertex is None or vertex.status != WAITING:
            return f"{path!r} waits for nothing; {did_you_mean(path, self.waiting())}"
        self._run.command(partial(self._set_answer, vertex, GRANTED if granted else REFUSED))
        return None

    def _set_answer(self, vertex: Vertex, answer: Any) -> None:
        if vertex.status == WAITING:
            vertex.step = partial(end_with, answer)

    def _replace(self, machine: Machine) -> None:
        found = obstacles(self._run, machine)
        if found:
            for reason in found:
                self._run.note(self._run.machine.root, f"not replaced: {reason}")
            return
        take_over(self._run, machine)


def outcomes_of(vertex: Vertex) -> set[str]:
    """The outcomes that a node can end with, `error` aside."""
    if isinstance(vertex, Leaf):
        return set(vertex.interface.outcomes)
    assert isinstance(vertex, Box)
    found = {outcome for outcome, _ in vertex.rules} if vertex.keeps else set()
    for child in vertex.children:
        found |= set(child.leave.values())
        if not vertex.keeps:
            found |= outcomes_of(child) - set(child.go) - set(child.leave)
    return found - {"error"}


def output_names(vertex: Vertex, outcome: str) -> set[str]:
    """The outputs that come with an outcome of a node."""
    if isinstance(vertex, Leaf):
        return set(vertex.interface.outputs.get(outcome, ()))
    return {inner.key for inner, _ in vertex.outputs.get(outcome, ())}
