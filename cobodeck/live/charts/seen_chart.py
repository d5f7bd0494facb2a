"""A chart as a page sees it: its nodes by path, with values, outcomes and places in files.

Unlike a machine, it is there for charts with mistakes, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from typing import Any

from engine import Interface, NoOutcome, resolved
from engine.chart import LEAVES, Chart, Node
from engine.draw import resolved_value, value_text, values_of
from engine.files import Map, Place, Seq, si_unit, written_text

LARGEST = 10_000
"""Nodes that are told of; charts that use each other can have billions."""
NodeOutcomes = dict[str, dict[str, str]]
"""Outcomes by name, each with the types of its outputs by their names."""


@dataclass(frozen=True, slots=True)
class SeenNode:
    """A node at `path`, as in the trace; the root has the path "".

    `chart` is the one in whose file it stands, `used` the one that it uses, if that is known.
    `values` are those of the parameters of `chart`.
    """

    path: str
    node: Node
    chart: Chart
    used: Chart | None
    values: Mapping[str, Any]
    inside: tuple[str, ...]

    @property
    def body(self) -> Node:
        """The node that has the children."""
        return self.node if self.used is None else self.used.root

    @property
    def about(self) -> str:
        """What it is for."""
        own = self.node.about if self.path else self.chart.about
        return own or ("" if self.used is None else self.used.about)

    def children(self, charts: Mapping[str, Chart]) -> Iterator[SeenNode]:
        """The nodes directly below."""
        chart, values, inside = self.chart, self.values, self.inside
        if self.used is not None:
            chart, inside = self.used, (*inside, self.used.name)
            values = values_of(self.used, self.node.parameters, values)
        for child in self.body.children:
            below = f"{self.path}/{child.name}" if self.path else child.name
            used = charts.get(child.target) if child.form == "use" else None
            if used is not None and used.name in inside:
                used = None
            yield SeenNode(below, child, chart, used, values, inside)

    def walk(self, charts: Mapping[str, Chart]) -> Iterator[SeenNode]:
        """This node and all below it, in document order."""
        yield self
        for child in self.children(charts):
            yield from child.walk(charts)


def seen_nodes(
    chart: Chart, charts: Mapping[str, Chart], constants: Mapping[str, Any]
) -> list[SeenNode]:
    """The nodes of a chart and of those that it uses, in document order, at most `LARGEST`."""
    return list(islice(_root(chart, constants).walk(charts), LARGEST))


def _root(chart: Chart, constants: Mapping[str, Any]) -> SeenNode:
    values = values_of(chart, {}, constants)
    return SeenNode("", chart.root, chart, None, values, (chart.name,))


def shown_values(seen: SeenNode, interfaces: Mapping[str, Interface]) -> dict[str, str]:
    """What a node is given, by name; with the defaults of its class, and its keys of data."""
    node, known = seen.node, seen.values
    found = {name: value_text(value, known) for name, value in node.parameters.items()}
    found |= {name: value_text(value, known) for name, value in node.given.items()}
    found |= {name: f"← {key}" for name, key in node.reads.items()}
    state = interfaces.get(node.target) if node.form in LEAVES else None
    for name, argument in state.parameters.items() if state is not None else ():
        if name not in found and not argument.required and argument.default is not None:
            unit = si_unit(argument.type.name)
            found[name] = f"{written_text(argument.default)} {unit}".rstrip() + " (default)"
    for name, key in node.outputs.items():
        found[f"{name} →"] = key
    if node.timeout is not None:
        found["timeout"] = value_text(node.timeout, known)
    if node.retry is not None:
        wait = f" after {value_text(node.retry.wait, known)}" if node.retry.wait else ""
        times = value_text(node.retry.times, known)
        found["retry"] = f"{times} on {', '.join(node.retry.on)}{wait}"
    return found


def outcomes_at(
    seen: SeenNode, charts: Mapping[str, Chart], interfaces: Mapping[str, Interface]
) -> NodeOutcomes:
    """What a node can end with, except `error`, and the outputs that come with it.

    These are the outcomes and outputs that an operator can force.
    """
    if seen.node.form in LEAVES:
        return _of_state(seen, interfaces)
    if seen.node.form == "use" and seen.used is None:
        return {outcome: {} for outcome in seen.node.next if outcome not in ("error", "timeout")}
    declared = {} if seen.used is None else seen.used.outputs
    return {
        outcome: {
            key: kind for key, kind in declared.get(outcome, {}).items() if key in seen.node.outputs
        }
        for outcome in _of_box(seen, charts, interfaces)
    }


def _of_state(seen: SeenNode, interfaces: Mapping[str, Interface]) -> NodeOutcomes:
    node, state = seen.node, interfaces.get(seen.node.target)
    if state is None:
        return {outcome: {} for outcome in node.next if outcome not in ("error", "timeout")}
    if state.is_open:
        named = {
            name: resolved_value(node.parameters[name], seen.values)
            for name in state.named_by & node.parameters.keys()
        }
        with suppress(NoOutcome, TypeError, KeyError):  # the checks tell what is wrong
            state = resolved(state, named)
    outputs = state.outputs
    return {
        outcome: {key: str(kind) for key, kind in outputs.get(outcome, {}).items()}
        for outcome in state.outcomes
    }


def _of_box(
    seen: SeenNode, charts: Mapping[str, Chart], interfaces: Mapping[str, Interface]
) -> list[str]:
    body = seen.body
    found = [rule.outcome for rule in body.rules] if body.keeps else []
    for child in seen.children(charts):
        found += [target[1:] for target in child.node.next.values() if target.startswith(".")]
        if not body.keeps:
            own = outcomes_at(child, charts, interfaces)
            found += [outcome for outcome in own if outcome not in child.node.next]
    return [outcome for outcome in dict.fromkeys(found) if outcome != "error"]


def path_of(place: Place, nodes: list[SeenNode]) -> str | None:
    """The path of the innermost node that has a place in its lines; None: another file.

    What stands in a used chart outside of its nodes belongs to the node that uses it.
    """
    best: tuple[tuple[int, int], str] | None = None
    for seen in nodes:
        start = _start(place, seen)
        if start is not None and (best is None or start > best[0]):
            best = start, seen.path
    return None if best is None else best[1]


def _start(place: Place, seen: SeenNode) -> tuple[int, int] | None:
    """Where the lines of a node begin, if a place is in them."""
    used = seen.used
    if (used is not None and used.file == place.file) or (
        not seen.path and seen.chart.file == place.file
    ):
        return (0, 0)
    if not seen.path or seen.chart.file != place.file:
        return None
    start, at = seen.node.at[:2], (place.line, place.column)
    return start if start <= at <= _end(seen.node.raw) else None


def _end(raw: Map | Seq) -> tuple[int, int]:
    """The end of what is written, as far as its words are known: line and column."""
    marks = [*raw.keys_at.values(), *raw.values_at.values()] if isinstance(raw, Map) else []
    inside = raw.values() if isinstance(raw, Map) else raw
    marks += [raw.at, *(raw.values_at if isinstance(raw, Seq) else ())]
    ends = [(line, end) for line, _, end in marks]
    return max(*ends, *(_end(one) for one in inside if isinstance(one, Map | Seq)), (0, 0))
