"""What a picture of a chart shows, before anything is laid out.

A container becomes a box with its children inside and a pin for each outcome on its lower border;
an edge leads from a child to a pin, and from the pin on to wherever the container's `next` says.
`use` is a plain node, or a box when it is expanded.
"""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from engine.chart import Chart, Node, Reference, Rule

ALARMS = ("error", "timeout")


@dataclass(frozen=True, slots=True)
class LeafShape:
    """A node drawn as one shape: `kind` is `do`, `watch` or `use`."""

    path: str
    name: str
    kind: str
    notes: tuple[str, ...]
    about: str

    @property
    def id(self) -> str:
        """Where edges from and to this shape end."""
        return self.path

    @property
    def entry(self) -> str:
        """The shape at which the node begins."""
        return self.path


@dataclass(frozen=True, slots=True)
class Pin:
    """An outcome on the border of a box: `notes` say when it comes about, if no edge does."""

    path: str
    outcome: str
    alarm: bool
    notes: tuple[str, ...] = ()

    @property
    def id(self) -> str:
        """Where edges from and to this pin end."""
        return f"{self.path}:{self.outcome}"


@dataclass(frozen=True, slots=True)
class BoxShape:
    """A container. The root's pins are the outcomes of the chart."""

    path: str
    name: str
    mode: str
    notes: tuple[str, ...]
    about: str
    members: tuple[LeafShape | BoxShape, ...]
    pins: tuple[Pin, ...]

    @property
    def start(self) -> str:
        """The mark from which a sequence begins; nothing where all members begin at once."""
        return f"{self.path}:" if self.mode == "states" and self.members else ""

    @property
    def entry(self) -> str:
        """A shape inside at which the box begins."""
        leaves = [member for member in self.members if isinstance(member, LeafShape)]
        return self.start or next((m.entry for m in (*leaves, *self.members)), "")

    @property
    def exit(self) -> str:
        """A shape on the lower border, where there is one."""
        return self.pins[len(self.pins) // 2].id if self.pins else self.entry

    def boxes(self) -> Iterator[BoxShape]:
        """This box and all inside it, outer first."""
        yield self
        for member in self.members:
            if isinstance(member, BoxShape):
                yield from member.boxes()


class EdgeLabel(NamedTuple):
    """A word at an edge."""

    text: str
    alarm: bool


@dataclass(frozen=True, slots=True)
class Edge:
    """From a shape to a shape: `tail` ends in a node's path or a pin's id, `head` likewise.

    `outcomes` are those of the node at `path`; `labels` what to write about them. An edge that
    ends at a pin of a box inside the picture is only half of the way and has no arrow. `back`
    edges lead to a node no farther from the start, and need not point down.
    """

    path: str
    outcomes: tuple[str, ...]
    tail: str
    head: str
    labels: tuple[EdgeLabel, ...] = ()
    alarm: bool = False
    arrow: bool = True
    back: bool = False


@dataclass(frozen=True, slots=True)
class Picture:
    """A chart as shapes and edges."""

    root: BoxShape
    edges: tuple[Edge, ...]

    def way(self, path: str, outcome: str) -> Iterator[Edge]:
        """The edges that the node at `path` takes with `outcome`, on through pins to the end."""
        tails = {edge.tail: edge for edge in self.edges}
        edge = next((e for e in self.edges if e.path == path and outcome in e.outcomes), None)
        while edge is not None:
            yield edge
            edge = tails.get(edge.head) if ":" in edge.head else None


def picture(chart: Chart, library: Mapping[str, Chart], depth: int | None = 0) -> Picture:
    """What to draw of `chart`.

    Args:
        chart: the chart.
        library: the charts it uses, by name.
        depth: how many levels of `use` are expanded; all with `None`.
    """
    painter = _Painter(library)
    root = painter.root(chart, depth)
    return Picture(root, tuple(_merged(painter.edges)))


class _Painter:
    """Goes through a chart, children first."""

    def __init__(self, library: Mapping[str, Chart]) -> None:
        self.library = library
        self.edges: list[Edge] = []

    def root(self, chart: Chart, depth: int | None) -> BoxShape:
        box = self.box(chart.root, "", depth, (chart.name,))
        known = {pin.outcome: pin for pin in box.pins}
        unused = (Pin("", outcome, False) for outcome in chart.outcomes if outcome not in known)
        return replace(box, name=chart.name, about=chart.about, pins=(*box.pins, *unused))

    def member(self, node: Node, path: str, depth: int | None, inside: tuple[str, ...]) -> Any:
        if node.form in ("states", "any", "all"):
            return self.box(node, path, depth, inside)
        used = self.library.get(node.target) if node.form == "use" else None
        if used is None or depth == 0 or used.name in inside:
            return LeafShape(path, node.name, node.form, tuple(_notes(node)), node.about)
        deeper = None if depth is None else depth - 1
        box = self.box(used.root, path, deeper, (*inside, used.name))
        return replace(
            box, name=node.name, notes=tuple(_notes(node)), about=node.about or used.about
        )

    def box(self, node: Node, path: str, depth: int | None, inside: tuple[str, ...]) -> BoxShape:
        first = len(self.edges)
        members = []
        levels = _levels(node)
        for child in node.children:
            below = f"{path}/{child.name}" if path else child.name
            member = self.member(child, below, depth, inside)
            members.append(self.leave(node, path, child, member, levels))
        pins = _pins(node, path, self.edges[first:])
        mode = f"{node.form}, when" if node.when else node.form
        return BoxShape(path, node.name, mode, (), node.about, tuple(members), tuple(pins))

    def leave(
        self,
        parent: Node,
        path: str,
        node: Node,
        member: LeafShape | BoxShape,
        levels: Mapping[str, int],
    ) -> LeafShape | BoxShape:
        """Draw the ways out of `node`; a box gets the pins that only its `next` knows."""
        guard = node.form == "watch" and parent.form != "states"
        if isinstance(member, BoxShape):
            known = {pin.outcome for pin in member.pins}
            more = [o for o in node.next if o not in known]
            added = (Pin(member.path, o, o in ALARMS, _limit(node, o)) for o in more)
            member = replace(member, pins=(*member.pins, *added))
            ways = [(pin.outcome, pin.id, pin.alarm or guard) for pin in member.pins]
        else:
            ways = [(outcome, member.id, outcome in ALARMS or guard) for outcome in node.next]
        names = {child.name for child in parent.children}
        for outcome, tail, alarm in ways:
            target = node.next.get(outcome, "" if parent.keeps else f".{outcome}")
            if target.startswith("."):
                head, arrow = f"{path}:{target[1:]}", not path
            elif target in names:
                head, arrow = f"{path}/{target}" if path else target, True
            else:
                continue
            label = EdgeLabel(_worded(node, outcome), alarm)
            back = levels.get(target, 1 << 30) <= levels[node.name]
            edge = Edge(member.path, (outcome,), tail, head, (label,), alarm, arrow, back)
            self.edges.append(edge)
        return member


def _levels(parent: Node) -> dict[str, int]:
    """How many hops each child of a sequence is away from the first."""
    ways = {child.name: child.next.values() for child in parent.children}
    levels: dict[str, int] = {}
    for start in ways:
        queue = [] if start in levels else [start]
        levels.setdefault(start, 0)
        for name in queue:
            for target in ways[name]:
                if target in ways and target not in levels:
                    levels[target] = levels[name] + 1
                    queue.append(target)
    return levels


def _limit(node: Node, outcome: str) -> tuple[str, ...]:
    given = outcome == "timeout" and node.timeout is not None
    return (f"after {_value(node.timeout)}",) if given else ()


def _pins(node: Node, path: str, edges: list[Edge]) -> Iterator[Pin]:
    """The pins of the box made of `node`: those that edges reach, then those of its rules."""
    alarms: dict[str, bool] = {}
    prefix = f"{path}:"
    for edge in edges:
        if edge.head.startswith(prefix):
            outcome = edge.head.removeprefix(prefix)
            alarms[outcome] = alarms.get(outcome, True) and edge.alarm
    notes: dict[str, tuple[str, ...]] = {}
    for rule in node.rules if node.keeps else ():
        notes[rule.outcome] = (*notes.get(rule.outcome, ()), _condition(rule))
    for outcome in dict.fromkeys((*alarms, *notes)):
        alarm = outcome in ALARMS or (alarms.get(outcome, False) and outcome not in notes)
        yield Pin(path, outcome, alarm, notes.get(outcome, ()))


def _condition(rule: Rule) -> str:
    shown = [f"{child} {outcome}" for child, outcome in rule.conditions.items()]
    return f"if {' and '.join(shown)}" if shown else "all have ended"


def _merged(edges: list[Edge]) -> Iterator[Edge]:
    """Edges between the same two shapes become one."""
    bundles: dict[tuple[str, str], list[Edge]] = {}
    for edge in edges:
        bundles.setdefault((edge.tail, edge.head), []).append(edge)
    for bundle in bundles.values():
        outcomes = tuple(outcome for edge in bundle for outcome in edge.outcomes)
        labels = tuple(label for edge in bundle for label in edge.labels)
        first = bundle[0]
        same = len(labels) == 1 and first.head.endswith(f":{labels[0].text}")
        yield replace(
            first,
            outcomes=outcomes,
            labels=() if same or first.tail != first.path else labels,
            alarm=all(edge.alarm for edge in bundle),
        )


def _worded(node: Node, outcome: str) -> str:
    shown = outcome
    if outcome == "timeout" and node.timeout is not None:
        shown = f"timeout {_value(node.timeout)}"
    level = node.autonomy.get(outcome)
    return f"{shown} ({level} autonomy)" if level else shown


def _notes(node: Node) -> Iterator[str]:
    """The small lines under a node's name."""
    yield f"chart {node.target}" if node.form == "use" else node.target
    for name, value in node.parameters.items():
        yield textwrap.shorten(f"{name}: {_value(value)}", 44, placeholder=" …")
    if node.retry is not None:
        wait = f" after {_value(node.retry.wait)}" if node.retry.wait else ""
        yield f"retry: {node.retry.times} on {', '.join(node.retry.on)}{wait}"
    if node.priority:
        yield f"priority: {node.priority}"


def _value(value: Any) -> str:
    """A value as the chart says it."""
    if isinstance(value, Reference):
        return f"${value.name}"
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    return json.dumps(value) if value is None or isinstance(value, bool) else str(value)
