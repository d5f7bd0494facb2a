"""Which edges of charts the runs of tests have taken.

An edge is an outcome of a node in the file of a chart, and what it leads to. The nodes of a used
chart count for its own file, whichever chart uses it, and however often. An `error` is an edge only
where a `next` maps it. An outcome that is tried again, lost to another, or still waits for consent
has taken no edge.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from engine.chart import Chart, Node, key_mark_of
from engine.machine import Box, Leaf, Machine, Vertex
from engine.run import ChartRun, TraceRecord

Event = tuple[str, str]
"""A node's path and its outcome."""
KEPT, TRIED = "(kept)", "(tried again)"
"""What an outcome may lead to beside the outcome of its box."""


class ChartEdge(NamedTuple):
    """An edge of a chart file: path of the node in it, outcome, where it leads, line in the file.

    `target` is as the chart has it; empty where the container keeps the outcome.
    """

    node: str
    outcome: str
    target: str
    line: int

    def __str__(self) -> str:
        return f"{self.node}: {self.outcome}" + (f" -> {self.target}" if self.target else "")


class EdgeCoverage:
    """The edges of all charts that have been run, and how often each was taken, by file."""

    def __init__(self) -> None:
        self.files: dict[str, dict[ChartEdge, int]] = {}

    def add(self, run: ChartRun) -> None:
        """Count the edges that a run has taken so far, of its chart and of those it uses."""
        edges = dict(edges_of(run.machine))
        for file, edge in edges.values():
            self._count(file, edge, 0)
        for event in taken(run.machine, run.trace):
            if event in edges:
                self._count(*edges[event], 1)

    def merge(self, rows: Iterable[tuple[str, str, str, str, int, int]]) -> None:
        """Add the counts of another session; see `rows`."""
        for file, node, outcome, target, line, count in rows:
            self._count(file, ChartEdge(node, outcome, target, line), count)

    def rows(self) -> list[tuple[str, str, str, str, int, int]]:
        """File, the fields of the edge, and its count: to be sent elsewhere."""
        return [(file, *edge, n) for file, edges in self.files.items() for edge, n in edges.items()]

    def share(self, folder: Path) -> float:
        """The share of the edges of the charts in `folder` that were taken; 1 without any."""
        counts = [count for edges in self.within(folder).values() for count in edges.values()]
        return sum(count > 0 for count in counts) / len(counts) if counts else 1.0

    def within(self, folder: Path) -> dict[str, dict[ChartEdge, int]]:
        """The edges of the charts in `folder`, by relative path, without those of installed ones.

        A chart that a test has as text is in no folder.
        """
        inside = {
            file: Path(file).resolve().relative_to(folder.resolve())
            for file in self.files
            if Path(file).is_file() and Path(file).resolve().is_relative_to(folder.resolve())
        }
        own = {file: path for file, path in inside.items() if "site-packages" not in path.parts}
        return {path.as_posix(): self.files[file] for file, path in sorted(own.items())}

    def report(self, folder: Path) -> Iterator[str]:
        """A line for each chart in `folder`, followed by its edges that were never taken."""
        for file, edges in self.within(folder).items():
            reached = sum(count > 0 for count in edges.values())
            yield f"{file} {reached}/{len(edges)} edges ({percent(reached, len(edges))} %)"
            for edge in sorted(edges, key=lambda edge: edge.line):
                if not edges[edge]:
                    yield f"  {file}:{edge.line}  {edge}"

    def _count(self, file: str, edge: ChartEdge, count: int) -> None:
        edges = self.files.setdefault(file, {})
        edges[edge] = edges.get(edge, 0) + count


def percent(part: int, whole: int) -> int:
    """How many of a hundred, rounded down, so that 100 means all."""
    return 100 * part // whole if whole else 100


def edges_of(machine: Machine) -> Iterator[tuple[Event, tuple[str, ChartEdge]]]:
    """Every edge of a machine as path and outcome, and the file and edge that it is."""
    for event, chart, node, path in _mapped(machine.root, machine.chart, machine.library):
        target = node.next.get(event[1], "")
        at = key_mark_of(node.raw, "next", event[1]) if target else node.at
        yield event, (chart.file, ChartEdge(path, event[1], target, at[0]))


def _mapped(
    box: Box, chart: Chart, library: Mapping[str, Chart], below: str = ""
) -> Iterator[tuple[Event, Chart, Node, str]]:
    """The edges inside a box, of which `chart` is the chart, at its path `below`."""
    nodes = {child.name: child for child in _at(chart.root, below).children}
    for child in box.children:
        path = f"{below}/{child.name}" if below else child.name
        for outcome in _edges(child):
            yield (child.path, outcome), chart, nodes[child.name], path
        if isinstance(child, Box):
            used = library[child.chart] if child.chart else None
            yield from _mapped(child, used or chart, library, "" if used else path)


def _at(root: Node, path: str) -> Node:
    for name in path.split("/") if path else ():
        root = next(child for child in root.children if child.name == name)
    return root


def _edges(vertex: Vertex) -> list[str]:
    """The outcomes of a vertex that lead somewhere, or that its box keeps."""
    return list(dict.fromkeys([*vertex.go, *vertex.leave, *_outcomes(vertex)]))


def _outcomes(vertex: Vertex) -> list[str]:
    """What a vertex can end with, but for errors."""
    timeout = [] if vertex.timeout_ns is None else ["timeout"]
    if isinstance(vertex, Leaf):
        return [*vertex.interface.outcomes, *timeout]
    assert isinstance(vertex, Box)
    if vertex.keeps:
        return [*(outcome for outcome, _ in vertex.rules), *timeout]
    left = [up for child in vertex.children for up in child.leave.values()]
    passed = [o for c in vertex.children for o in _outcomes(c) if o not in {*c.go, *c.leave}]
    return [*(outcome for outcome in [*left, *passed] if outcome != "error"), *timeout]


def taken(machine: Machine, records: Iterable[TraceRecord]) -> Counter[Event]:
    """How often each edge, by path and outcome, was taken according to the trace of a run."""
    reading = _Reading(machine)
    for record in records:
        if record.subject in machine.vertices:  # else it is of a chart that was replaced
            reading.take(record)
    reading.keep(reading.open)
    return reading.found


class _Reading:
    """Reads a trace, one record after the other.

    Attributes:
        found: the edges taken so far, and how often.
        open: the outcomes of which it is not known yet what they lead to, by path.
        entries: how often each node was entered since its box was.
    """

    def __init__(self, machine: Machine) -> None:
        self.found: Counter[Event] = Counter()
        self.open: dict[str, str] = {}
        self.entries: Counter[str] = Counter()
        self._vertices = machine.vertices

    def take(self, record: TraceRecord) -> None:
        path, kind, detail = record.subject, record.kind, record.detail
        vertex = self._vertices[path]
        if kind == "enter":
            self._enter(vertex)
        elif kind == "move":
            inner = f"{path}/{detail[0]}" if path else detail[0]
            self.found[inner, detail[1]] += 1
            self.open.pop(inner, None)
        elif kind == "outcome":
            self._close(vertex, detail[0])
            self.open.pop(path, None)
            self.open[path] = detail[0]  # the newest is the last
        elif kind == "exit":
            self._close(vertex, "")
            if detail == ("lost",):
                self.open.pop(path, None)

    def _enter(self, vertex: Vertex) -> None:
        self.open.pop(vertex.path, None)  # that was not the last try
        self.entries[vertex.path] += 1
        for child in vertex.children if isinstance(vertex, Box) else ():
            self.entries[child.path] = 0

    def _close(self, vertex: Vertex, outcome: str) -> None:
        """A box ends: with what it kept, and by the newest outcome that leads to its own."""
        children = vertex.children if isinstance(vertex, Box) else ()
        ended = {child.path for child in children}
        inside = [path for path in self.open if path in ended]
        self.keep(inside)
        up = [path for path in inside if self._leads(path) == outcome]
        self.found.update((path, self.open[path]) for path in up[-1:])
        for path in inside:
            del self.open[path]

    def keep(self, paths: Iterable[str]) -> None:
        """Those of the outcomes of these nodes that their boxes keep are taken."""
        self.found.update((path, self.open[path]) for path in paths if self._leads(path) == KEPT)

    def _leads(self, path: str) -> str:
        """What a node's outcome ends its box with, or `KEPT`, or `TRIED` if it is tried again."""
        vertex, outcome = self._vertices[path], self.open[path]
        times, on, _ = vertex.retry or (0, (), 0)
        if outcome in on and self.entries[path] <= times:
            return TRIED
        keeps = vertex.parent is not None and vertex.parent.keeps
        return vertex.leave.get(outcome, KEPT if keeps else outcome)
