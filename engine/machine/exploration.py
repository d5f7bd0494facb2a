"""Walks all that a chart can do (rule 16).

Leaves have finitely many outcomes and any timeout may fire, so a chart has finitely many
configurations. In one step one leaf ends, or a timeout fires, or several children of one box that
keeps outcomes end together. A leaf may also end with `error` where a `next` of it or around it maps
that; everywhere else it would end the run. No code of the runner is used: the two are tested
against each other.

A configuration is nested tuples: a leaf is `None`; a sequence is (index of the child, its
configuration); a parallel box is a tuple with one entry per child, the outcome as text where the
child has ended.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import product
from operator import attrgetter
from typing import Any, NamedTuple

from engine.machine import Box, Leaf, Machine, Vertex

Configuration = Any
Event = tuple[str, str]  # path, outcome
Step = tuple[Event, ...]  # what ends at the same time
LIMIT = 100_000
TOGETHER = 6  # children of a box that may end in one step; in larger boxes they end one by one


@dataclass(frozen=True, slots=True)
class Ended:
    """The chart, or part of it, has ended."""

    outcome: str


@dataclass(slots=True)
class Exploration:
    """The result of an exploration. A script is a sequence of steps from the start.

    Attributes:
        configurations: how many were visited.
        complete: whether these are all, with every combination of children that end together.
        moves: the shortest script to each edge (path, outcome) that is taken.
        outcomes: the shortest script to each outcome of the chart.
        entered: the leaves that can become active.
        stuck: scripts to configurations in which nothing can end any more, except by an error.
    """

    configurations: int = 0
    complete: bool = True
    moves: dict[Event, tuple[Step, ...]] = field(default_factory=dict)
    outcomes: dict[str, tuple[Step, ...]] = field(default_factory=dict)
    entered: set[str] = field(default_factory=set)
    stuck: list[tuple[Step, ...]] = field(default_factory=list)

    def summary(self) -> str:
        """One line for people."""
        what = f"{self.configurations} configurations, {len(self.moves)} edges"
        return f"{what}, complete" if self.complete else f"{what}, not complete"


def explore(machine: Machine, limit: int = LIMIT) -> Exploration:
    """Walk all configurations, breadth first, at most `limit` of them."""
    boxes = [v for v in machine.vertices.values() if isinstance(v, Box) and v.keeps]
    found = Exploration(complete=all(len(box.children) <= TOGETHER for box in boxes))
    first = initial(machine.root)
    came: dict[Configuration, tuple[Configuration, Step] | None] = {first: None}
    queue = deque([first])
    while queue:
        here = queue.popleft()
        found.configurations += 1
        found.entered.update(leaf.path for leaf in active(machine.root, here))
        going = False
        for step in steps(machine.root, here):
            going = going or step[0][1] != "error"
            edges: list[Event] = []
            there = after(machine.root, here, step, edges)
            fresh = [edge for edge in edges if edge not in found.moves]
            ending = isinstance(there, Ended)
            if fresh or (ending and there.outcome not in found.outcomes):
                script = (*_script(came, here), step)
                found.moves.update((edge, script) for edge in fresh)
                if ending:
                    found.outcomes.setdefault(there.outcome, script)
            if not ending and there not in came:
                if len(came) >= limit:
                    found.complete = False
                    continue
                came[there] = (here, step)
                queue.append(there)
        if not going:
            found.stuck.append(_script(came, here))
    return found


class Moment(NamedTuple):
    """Where a chart is after some steps: the edges that the last one took, the leaves that run."""

    edges: tuple[Event, ...]
    active: tuple[Leaf, ...]


def moments(machine: Machine, script: Iterable[Step]) -> Iterator[Moment]:
    """The start of a chart, and what follows each step of a script; the end has no leaves."""
    here = initial(machine.root)
    yield Moment((), tuple(active(machine.root, here)))
    for step in script:
        edges: list[Event] = []
        here = after(machine.root, here, step, edges)
        left = () if isinstance(here, Ended) else active(machine.root, here)
        yield Moment(tuple(edges), tuple(left))


def never_taken(machine: Machine, found: Exploration) -> list[Event]:
    """The edges of a chart that no script takes; empty if not all was walked."""
    if not found.complete:
        return []
    edges = [(v.path, o) for v in machine.vertices.values() for o in (*v.go, *v.leave)]
    return [edge for edge in edges if edge not in found.moves]


def _script(came: dict[Configuration, Any], here: Configuration) -> tuple[Step, ...]:
    steps_back = []
    while came[here] is not None:
        here, step = came[here]
        steps_back.append(step)
    return tuple(reversed(steps_back))


def initial(vertex: Vertex) -> Configuration:
    """The configuration of a vertex at its entry."""
    if not isinstance(vertex, Box):
        return None
    if vertex.form == "states":
        return (0, initial(vertex.children[0]))
    return tuple(initial(child) for child in vertex.children)


def active(vertex: Vertex, here: Configuration) -> Iterator[Leaf]:
    """The leaves that are running."""
    if isinstance(vertex, Leaf):
        yield vertex
    elif isinstance(vertex, Box):
        for _, child, below in _running(vertex, here):
            yield from active(child, below)


def _running(box: Box, here: Configuration) -> Iterator[tuple[int, Vertex, Configuration]]:
    if box.form == "states":
        yield here[0], box.children[here[0]], here[1]
        return
    for index, (child, below) in enumerate(zip(box.children, here, strict=True)):
        if not isinstance(below, str):
            yield index, child, below


def steps(vertex: Vertex, here: Configuration) -> Iterator[Step]:
    """All steps that are possible next."""
    if vertex.timeout_ns is not None:
        yield ((vertex.path, "timeout"),)
    if isinstance(vertex, Leaf):
        for outcome in vertex.interface.outcomes:
            yield ((vertex.path, outcome),)
        if _caught(vertex):
            yield ((vertex.path, "error"),)
        return
    assert isinstance(vertex, Box)
    running = list(_running(vertex, here))
    for _, child, below in running:
        yield from steps(child, below)
    if vertex.keeps and 1 < len(running) <= TOGETHER:
        for monitors in (True, False):
            yield from _together(running, monitors)


def _caught(vertex: Vertex) -> bool:
    """Whether a `next` of this vertex, or of one around it, maps its error."""
    around: Vertex | None = vertex
    while around is not None:
        if "error" in around.go or "error" in around.leave:
            return True
        around = around.parent
    return False


def _together(running: list[tuple[int, Vertex, Configuration]], monitors: bool) -> Iterator[Step]:
    """Steps in which several children of a box end in one pass: of the monitors, or of the rest."""
    choices: list[list[Event | None]] = []
    for _, child, below in running:
        watching = {leaf.path for leaf in active(child, below) if leaf.monitor}
        kept: dict[str, Event | None] = {"": None}
        for step in steps(child, below):
            path, outcome = step[0]
            if len(step) > 1 or (path in watching and outcome != "timeout") != monitors:
                continue
            if outcome == "error":
                continue  # it takes precedence over whatever ends with it
            there = after(child, below, step, [])
            if isinstance(there, Ended) and there.outcome not in child.leave:
                kept.setdefault(there.outcome, step[0])
        choices.append(list(kept.values()))
    for chosen in product(*choices):
        events = tuple(event for event in chosen if event is not None)
        if len(events) > 1:
            yield events


def after(
    vertex: Vertex, here: Configuration, step: Step, edges: list[Event]
) -> Configuration | Ended:
    """The configuration after `step`; the edges taken are added to `edges`."""
    own = [outcome for path, outcome in step if path == vertex.path]
    if own:
        return Ended(own[0])
    assert isinstance(vertex, Box)
    for index, child, below in _running(vertex, here):
        inside = tuple(e for e in step if e[0] == child.path or e[0].startswith(child.path + "/"))
        if not inside:
            continue
        there = after(child, below, inside, edges)
        if not isinstance(there, Ended):
            here = _with(vertex, here, index, there)
            continue
        ended = _child_ended(vertex, here, index, there.outcome, edges)
        if isinstance(ended, Ended):
            return ended
        here = ended
    if vertex.keeps:
        outcomes = zip(vertex.children, here, strict=True)
        matched = vertex.match({c.name: kept for c, kept in outcomes if isinstance(kept, str)})
        if matched is not None:
            return Ended(matched)
    return here


def _child_ended(
    box: Box, here: Configuration, index: int, outcome: str, edges: list[Event]
) -> Configuration | Ended:
    child = box.children[index]
    edges.append((child.path, outcome))
    target = child.go.get(outcome)
    if target is not None:
        index = bisect_left(box.children, target.order, key=attrgetter("order"))
        return (index, initial(target))
    up = child.leave.get(outcome)
    if up is None and box.keeps:
        return _with(box, here, index, outcome)
    return Ended(up or outcome)


def _with(box: Box, here: Configuration, index: int, there: Configuration) -> Configuration:
    if box.form == "states":
        return (index, there)
    return (*here[:index], there, *here[index + 1 :])
