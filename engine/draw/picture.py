"""Turns a chart into shapes and edges."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

from engine.chart import CONTAINERS, Chart, Node
from engine.draw.chart_shapes import (
    BoxShape,
    Edge,
    Ending,
    LeafShape,
    OutcomeLabel,
    Picture,
    Pin,
    Shape,
    TableShape,
    common,
)
from engine.draw.style import Cause
from engine.draw.wording import (
    NONE,
    Values,
    cause_of,
    condition_text,
    declared_by,
    from_outside,
    notes_of,
    outcome_label,
    target_of,
    values_of,
)
from engine.literals import Constant

MOST_NODES = 10_000
"""More nodes than these are not drawn."""
LEVELS = 64
"""Levels of used charts that are counted."""
Outcomes = dict[str, Cause]
EdgeCounts = Mapping[tuple[str, str], int]
"""How often the outcomes of nodes were taken, by path and outcome."""


def picture(
    chart: Chart,
    library: Mapping[str, Chart],
    depth: int | None = 0,
    constants: Mapping[str, Constant] = NONE,
    unfolded: Collection[str] = (),
    counts: EdgeCounts | None = None,
) -> Picture:
    """The shapes and edges of `chart`.

    Args:
        chart: the chart.
        library: the charts it uses, by name.
        depth: how many levels of `use` are expanded; `None`: all.
        constants: what `$name.name` stands for; the others are shown by their names.
        unfolded: paths of further `use` nodes that are expanded.
        counts: if given, they stand behind the outcomes that they have.
    """
    painter = _Painter(library, constants, unfolded, counts or {})
    root = painter.root(chart, depth)
    declared = tuple(declared_by(chart, constants))
    return Picture(root, declared, tuple(painter.edges), painter.passed_on, counts is not None)


@dataclass(frozen=True, slots=True)
class _Scope:
    """Values of a chart's parameters, levels of `use` left to expand, names of enclosing charts."""

    values: Values
    depth: int | None
    inside: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Member:
    """A child, its shape, the labels of its outcomes, and where each outcome leads.

    A target is the name of a sibling, or `.outcome` of the parent, or "" if the parent keeps it.
    """

    node: Node
    shape: Shape
    labels: Mapping[str, OutcomeLabel]
    targets: Mapping[str, str]


class _Painter:
    """Builds shapes and edges from a chart, children first."""

    def __init__(
        self,
        library: Mapping[str, Chart],
        constants: Mapping[str, Constant],
        unfolded: Collection[str],
        counts: EdgeCounts,
    ) -> None:
        self.library, self.constants = library, constants
        self.unfolded, self.counts = unfolded, counts
        self.edges: list[Edge] = []
        self.passed_on: dict[tuple[str, str], tuple[str, str]] = {}

    def root(self, chart: Chart, depth: int | None) -> BoxShape:
        scope = _Scope(values_of(chart, {}, self.constants), depth, (chart.name,))
        members = self.members(chart.root, "", scope)
        labels = _own_outcomes(chart.root, chart.root, members, scope.values)
        for outcome in chart.outcomes:
            labels.setdefault(outcome, OutcomeLabel(outcome, cause_of(outcome)))
        box = self.box(chart.root, "", members, _pins(chart.root, "", labels, {}))
        return replace(box, name=chart.name, about=chart.about)

    def members(self, body: Node, path: str, scope: _Scope) -> list[_Member]:
        """The children of the container `body` with their shapes."""
        found = []
        before: set[str] = set()
        for child in body.children:
            below = f"{path}/{child.name}" if path else child.name
            before.add(child.name)
            member = self.member(child, below, body, scope)
            pins = (
                replace(p, back=member.targets.get(p.outcomes[0]) in before)
                for p in member.shape.pins
            )
            found.append(replace(member, shape=replace(member.shape, pins=tuple(pins))))
        return found

    def member(self, node: Node, path: str, parent: Node, scope: _Scope) -> _Member:
        used = self.library.get(node.target) if node.form == "use" else None
        notes = notes_of(node, scope.values)
        if node.form in CONTAINERS:
            body, inner = node, scope
        elif used is None or used.name in scope.inside or self.folded(path, scope):
            labels = {o: _leaf_label(node, o, parent, scope.values) for o in node.next}
            labels = self.counted(path, labels)
            leaf = LeafShape(path, node.name, node.form, target_of(node), notes, node.about)
            pins = _pins(node, path, labels, node.next)
            return _Member(node, replace(leaf, pins=pins), labels, node.next)
        else:
            notes = (target_of(node), *notes, *from_outside(used, node.parameters))
            body = used.root
            depth = None if scope.depth is None else max(0, scope.depth - 1)
            values = values_of(used, node.parameters, scope.values)
            inner = _Scope(values, depth, (*scope.inside, used.name))
        members = self.members(body, path, inner)
        labels = self.counted(path, _own_outcomes(node, body, members, scope.values))
        targets = {o: node.next.get(o, "" if parent.keeps else f".{o}") for o in labels}
        about = node.about or (used.about if used else "")
        pins = _pins(body, path, labels, targets)
        shape: Shape
        if (body.form == "states" and members) or any(
            isinstance(m.shape, BoxShape) for m in members
        ):
            shape = self.box(body, path, members, pins)
        else:
            shape = self.table(body, path, members, pins)
        shape = replace(shape, name=node.name, notes=notes, about=about)
        return _Member(node, shape, labels, targets)

    def folded(self, path: str, scope: _Scope) -> bool:
        return scope.depth == 0 and path not in self.unfolded

    def counted(self, path: str, labels: Mapping[str, OutcomeLabel]) -> dict[str, OutcomeLabel]:
        """The labels of the outcomes of the node at `path`, with how often each was taken."""
        return {o: label._replace(taken=self.counts.get((path, o))) for o, label in labels.items()}

    def table(
        self, body: Node, path: str, members: list[_Member], pins: tuple[Pin, ...]
    ) -> TableShape:
        rules = [f"{rule.outcome} {condition_text(rule)}" for rule in body.rules if body.keeps]
        rows = tuple(self.row(member, path) for member in members)
        return TableShape(path, body.name, _mode(body), (), "", rows, tuple(rules), pins=pins)

    def row(self, member: _Member, path: str) -> LeafShape | TableShape:
        """A member's shape with the outcomes of the container at `path` that it brings about."""
        assert not isinstance(member.shape, BoxShape), "boxes have edges"
        bundles: dict[str, list[OutcomeLabel]] = {}
        for outcome, target in member.targets.items():
            if target.startswith("."):
                bundles.setdefault(target[1:], []).append(member.labels[outcome])
                self.passed_on[member.shape.path, outcome] = (path, target[1:])
        endings = (Ending(tuple(labels), ends) for ends, labels in bundles.items())
        return replace(member.shape, endings=tuple(endings), pins=())

    def box(self, body: Node, path: str, members: list[_Member], pins: tuple[Pin, ...]) -> BoxShape:
        drawn: list[_Member] = []
        rows: list[LeafShape | TableShape] = []
        for member in members:
            if body.form == "states" or isinstance(member.shape, BoxShape):
                drawn.append(member)
            else:
                rows.append(self.row(member, path))
        self.edges += _edges(path, drawn, pins)
        mode, inside = _mode(body), tuple(member.shape for member in drawn)
        return BoxShape(path, body.name, mode, (), body.about, tuple(rows), inside, pins)


def _mode(body: Node) -> str:
    return f"{body.form}, when" if body.when else body.form


def _leaf_label(node: Node, outcome: str, parent: Node, values: Values) -> OutcomeLabel:
    guard = node.form == "watch" and parent.form != "states"
    return outcome_label(node, outcome, values, "guard" if guard else "")


def _own_outcomes(
    node: Node, body: Node, members: list[_Member], values: Values
) -> dict[str, OutcomeLabel]:
    """The outcomes of a container: `node` has the `next` and `timeout`, `body` the children."""
    causes: dict[str, list[Cause]] = {}
    for member in members:
        for outcome, target in member.targets.items():
            if target.startswith("."):
                causes.setdefault(target[1:], []).append(member.labels[outcome].cause)
    for rule in body.rules if body.keeps else ():
        causes.setdefault(rule.outcome, []).append("")
    for outcome in node.next:
        causes.setdefault(outcome, [])
    return {o: outcome_label(node, o, values, common(found)) for o, found in causes.items()}


def _pins(
    body: Node, path: str, labels: Mapping[str, OutcomeLabel], targets: Mapping[str, str]
) -> tuple[Pin, ...]:
    """One pin for each target of outcomes; each outcome of a rule has a pin of its own."""
    notes: dict[str, tuple[str, ...]] = {}
    for rule in body.rules if body.keeps else ():
        notes[rule.outcome] = (*notes.get(rule.outcome, ()), condition_text(rule))
    groups: dict[str, list[str]] = {}
    for outcome in labels:
        shared = targets.get(outcome) if outcome not in notes else ""
        groups.setdefault(shared or f":{outcome}", []).append(outcome)
    return tuple(
        Pin(path, tuple(group), tuple(labels[o] for o in group), notes.get(group[0], ()))
        for group in groups.values()
    )


def _edges(path: str, members: list[_Member], pins: tuple[Pin, ...]) -> Iterator[Edge]:
    """Edges from the members of a box to each other and to its pins."""
    names = {member.node.name for member in members}
    ends = {outcome: pin.id for pin in pins for outcome in pin.outcomes}
    for member in members:
        for pin in member.shape.pins:
            target = member.targets[pin.outcomes[0]]
            if target.startswith(".") and target[1:] in ends:
                yield Edge(pin, ends[target[1:]], path, arrow=not path)
            elif target in names:
                yield Edge(pin, f"{path}/{target}" if path else target, path, arrow=True)


def nodes_shown(name: str, library: Mapping[str, Chart], depth: int | None) -> int:
    """Number of nodes in a picture of a chart that shows used charts to this `depth`, or all."""
    return _count(name, library, LEVELS if depth is None else depth, {})


def _count(
    name: str, library: Mapping[str, Chart], depth: int, known: dict[tuple[str, int], int]
) -> int:
    if (name, depth) not in known:
        known[name, depth] = 0  # a chart nested in itself is not drawn again
        for node in library[name].root.walk():
            known[name, depth] += 1
            if node.form == "use" and depth > 0 and node.target in library:
                known[name, depth] += _count(node.target, library, depth - 1, known)
    return known[name, depth]
