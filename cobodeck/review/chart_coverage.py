"""How often recorded runs have taken the edges of a chart, to be drawn on it.

The chart is counted wherever a run has used it, also in a chart that was put in the place of the
running one. A chart may have changed since a run: an edge counts if it led where it leads now.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import NamedTuple

from cobodeck.project import Catalogue
from cobodeck.record.format import value
from cobodeck.record.read import Record, replaced, setup_of
from cobodeck.setup import Setup
from cobodeck.terminal import FAILED, Problem
from cobodeck.testing import edges_of, taken
from engine.chart import Chart, nodes_by_path
from engine.machine import Box, Machine
from engine.run import TraceRecord


def edge_counts(
    chart: Chart,
    library: Mapping[str, Chart],
    records: Iterable[Record],
    known: Catalogue,
    tell: Callable[[str], object],
) -> dict[tuple[str, str], int]:
    """How often the edges of `chart` were taken, by path and outcome; 0: never.

    Args:
        chart: as it is now.
        library: the charts that it uses.
        records: of the runs.
        known: what charts may name.
        tell: called with a remark on each chart that was another when it ran.

    Raises:
        Problem: a run did not use the chart, or cannot be read with the present states.
    """
    nodes = dict(nodes_by_path(chart, library))
    counts = {(path, outcome): 0 for path, node in nodes.items() for outcome in node.next}
    for record in records:
        setup = setup_of(record, known)
        ran = [one for one in _ran(record, setup) if _places(one.machine, chart.name)]
        if not ran:
            raise Problem(f"{record.path}: {setup.chart.name} ran, without {chart.name}", FAILED)
        if {one.machine.library[chart.name].source.text for one in ran} != {chart.source.text}:
            tell(f"{record.path}: {chart.name} was another; edges count that led where they lead")
        for machine, events in ran:
            for event, target, count in _taken(machine, events, chart.name):
                if event in counts and nodes[event[0]].next[event[1]] == target:
                    counts[event] += count
    return counts


class _Ran(NamedTuple):
    """A chart that ran, and what the trace tells of it."""

    machine: Machine
    events: list[TraceRecord]


def _ran(record: Record, setup: Setup) -> list[_Ran]:
    """The charts that ran, one after the other."""
    found = [_Ran(setup.machine(), [])]
    for group in record.groups():
        with record.understood(group):
            commands = group.messages("operator")
            new = [value(told["arguments"]) for told in commands if told["command"] == "Replace"]
            found += [_Ran(replaced(setup, arguments), []) for arguments in new]
            found[-1].events.extend(group.traced())
    return found


def _taken(
    machine: Machine, events: Iterable[TraceRecord], chart: str
) -> Iterator[tuple[tuple[str, str], str, int]]:
    """The edges of `chart` in a machine: path in it and outcome, target, how often it was taken."""
    found = taken(machine, events)
    places = _places(machine, chart)
    for (path, outcome), (_, edge) in edges_of(machine):
        for inner in filter(None, (_inside(path, place) for place in places)):
            yield (inner, outcome), edge.target, found[path, outcome]


def _places(machine: Machine, chart: str) -> list[str]:
    """The paths at which a machine runs this chart."""
    boxes = (v for v in machine.vertices.values() if isinstance(v, Box))
    used = [box.path for box in boxes if box.path and box.chart == chart]
    return ["", *used] if machine.chart.name == chart else used


def _inside(path: str, place: str) -> str:
    """A path as seen from the chart at `place`; "" if it is not inside."""
    if not place:
        return path
    return path.removeprefix(f"{place}/") if path.startswith(f"{place}/") else ""
