"""Recursion and size of charts that use others (S05, S12), and cycles in graphs."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import TypeVar

from engine.chart import mark_of
from engine.check.callee import Facts
from engine.check.checked_chart import CheckedChart, PlacedNode

MOST_VERTICES = 10_000  # of a machine, with all used charts expanded
MOST_LEVELS = 100  # likewise

_LEAF = Facts()
_T = TypeVar("_T", bound=Hashable)


def uses(checked: CheckedChart) -> list[str]:
    """The names of the charts that a chart uses, each once."""
    targets = [placed.node.target for placed in checked.nodes if placed.form == "use"]
    return list(dict.fromkeys(target for target in targets if target in checked.scope.library))


def components(graph: Mapping[_T, Iterable[_T]]) -> list[list[_T]]:
    """Strongly connected components in reverse topological order (Tarjan 1972).

    Two nodes are in one component iff each leads to the other. Not recursive: graphs may be deep.
    """
    index: dict[_T, int] = {}
    low: dict[_T, int] = {}
    waiting: dict[_T, None] = {}  # not yet in a component, in the order of their index
    found: list[list[_T]] = []
    for start in graph:
        if start in index:
            continue
        index[start] = low[start] = len(index)
        waiting[start] = None
        path = [(start, iter(graph[start]))]
        while path:
            node, targets = path[-1]
            for target in targets:
                if target not in index:
                    index[target] = low[target] = len(index)
                    waiting[target] = None
                    path.append((target, iter(graph[target])))
                    break
                if target in waiting:
                    low[node] = min(low[node], index[target])
            else:
                path.pop()
                if path:
                    low[path[-1][0]] = min(low[path[-1][0]], low[node])
                if low[node] == index[node]:
                    found.append(_split_off(waiting, node))
    return found


def _split_off(waiting: dict[_T, None], first: _T) -> list[_T]:
    component = []
    while True:
        node, _ = waiting.popitem()
        component.append(node)
        if node == first:
            return component[::-1]


def cycle_in(graph: Mapping[_T, Iterable[_T]], component: Sequence[_T]) -> list[_T] | None:
    """A shortest cycle through the first node of a component; `None` if there is none."""
    first, inside = component[0], set(component)
    before: dict[_T, _T] = {}
    queue = [first]
    for node in queue:
        for target in graph[node]:
            if target == first:
                cycle = [first]
                while node != first:
                    cycle.append(node)
                    node = before[node]
                return [*cycle, first][::-1]
            if target in inside and target not in before:
                before[target] = node
                queue.append(target)
    return None


def check_recursion(charts: Mapping[str, CheckedChart], graph: Mapping[str, list[str]]) -> set[str]:
    """S05: no chart uses itself, directly or through others; returns the charts that do."""
    recursive: set[str] = set()
    order = {name: index for index, name in enumerate(charts)}
    for component in components(graph):
        component.sort(key=order.__getitem__)
        cycle = cycle_in(graph, component)
        if cycle is None:
            continue
        recursive.update(component)
        checked = charts[cycle[0]]
        node = next(s.node for s in checked.nodes if s.form == "use" and s.node.target == cycle[1])
        shown = " -> ".join(cycle if len(cycle) < 10 else [*cycle[:8], "…", cycle[-1]])
        message = f"recursion: {shown}"
        checked.error("S05", message, mark_of(node.raw, "use"), "a chart may not use itself")
    return recursive


def measure(checked: CheckedChart) -> tuple[int, int]:
    """Vertices and levels of a machine of this chart; S12 if there are too many.

    Used charts are not measured again, so the time grows with the file, not with the machine.
    """
    vertices, levels, reported = 0, 0, False
    depth: dict[PlacedNode, int] = {}
    for placed in checked.nodes:
        above = 0 if placed.parent is None else depth[placed.parent]
        depth[placed] = above + 1
        facts = _LEAF if placed.callee is None else placed.callee.facts
        vertices += facts.vertices
        levels = max(levels, above + facts.depth)
        reported = reported or facts.vertices > MOST_VERTICES or facts.depth > MOST_LEVELS
    at, hint = mark_of(checked.chart.root.raw, "chart"), "split it, or use charts less often"
    what = "with all that it uses the chart has"
    if not reported and vertices > MOST_VERTICES:
        hint = f"at most {MOST_VERTICES}; {hint}"
        checked.error("S12", f"{what} {vertices} nodes", at, hint)
    elif not reported and levels > MOST_LEVELS:
        checked.error("S12", f"{what} {levels} levels", at, f"at most {MOST_LEVELS}; {hint}")
    return min(vertices, MOST_VERTICES + 1), min(levels, MOST_LEVELS + 1)
