"""Which chart uses which (S05, S12), and circles in graphs."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import TypeVar

from engine.chart import mark_of
from engine.check.callee import Facts
from engine.check.checked_chart import NodeInPlace, Subject

MOST_VERTICES = 10_000  # of a machine with all used charts put in
MOST_LEVELS = 100

_LEAF = Facts()
_T = TypeVar("_T", bound=Hashable)


def uses(subject: Subject) -> list[str]:
    """The charts that a chart names, each once."""
    targets = [site.node.target for site in subject.sites if site.form == "use"]
    return list(dict.fromkeys(target for target in targets if target in subject.world.library))


def components(graph: Mapping[_T, Iterable[_T]]) -> list[list[_T]]:
    """Strongly connected components, those that others lead to first (Tarjan 1972).

    Two nodes are in one component iff each leads to the other. No recursion: graphs may be deep.
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


def circle(graph: Mapping[_T, Iterable[_T]], component: Sequence[_T]) -> list[_T] | None:
    """A shortest way from the first node of a component back to it; `None` if there is none."""
    first, inside = component[0], set(component)
    before: dict[_T, _T] = {}
    queue = [first]
    for node in queue:
        for target in graph[node]:
            if target == first:
                way = [first]
                while node != first:
                    way.append(node)
                    node = before[node]
                return [*way, first][::-1]
            if target in inside and target not in before:
                before[target] = node
                queue.append(target)
    return None


def check_recursion(subjects: Mapping[str, Subject], graph: Mapping[str, list[str]]) -> set[str]:
    """S05: no chart uses itself, on whatever way; the charts that do."""
    recursive: set[str] = set()
    order = {name: index for index, name in enumerate(subjects)}
    for component in components(graph):
        component.sort(key=order.__getitem__)
        way = circle(graph, component)
        if way is None:
            continue
        recursive.update(component)
        subject = subjects[way[0]]
        node = next(s.node for s in subject.sites if s.form == "use" and s.node.target == way[1])
        shown = " -> ".join(way if len(way) < 10 else [*way[:8], "…", way[-1]])
        message = f"recursion: {shown}"
        subject.error("S05", message, mark_of(node.raw, "use"), "a chart may not use itself")
    return recursive


def measure(subject: Subject) -> tuple[int, int]:
    """Vertices and levels of a machine of this chart; S12 where they are too many.

    Used charts are not measured again, so this takes time as the file is long, not the machine.
    """
    vertices, levels, told = 0, 0, False
    depth: dict[NodeInPlace, int] = {}
    for site in subject.sites:
        above = 0 if site.parent is None else depth[site.parent]
        depth[site] = above + 1
        facts = _LEAF if site.callee is None else site.callee.facts
        vertices += facts.vertices
        levels = max(levels, above + facts.depth)
        told = told or facts.vertices > MOST_VERTICES or facts.depth > MOST_LEVELS
    at, hint = mark_of(subject.chart.root.raw, "chart"), "split it, or use charts less often"
    what = "with all that it uses the chart has"
    if not told and vertices > MOST_VERTICES:
        hint = f"at most {MOST_VERTICES}; {hint}"
        subject.error("S12", f"{what} {vertices} nodes", at, hint)
    elif not told and levels > MOST_LEVELS:
        subject.error("S12", f"{what} {levels} levels", at, f"at most {MOST_LEVELS}; {hint}")
    return min(vertices, MOST_VERTICES + 1), min(levels, MOST_LEVELS + 1)
