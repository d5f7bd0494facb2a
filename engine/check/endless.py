"""Charts that never end: busy loops (S03) and dead ends (S04)."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from engine.check.checked_chart import CheckedChart, PlacedNode
from engine.check.uses import components, cycle_in
from engine.check.when import TooLarge, uncovered
from engine.state_code import outcomes_at_once

MOST_BESIDE = 100
Edges = dict[PlacedNode, list[PlacedNode]]


def check_endless(checked: CheckedChart) -> None:
    """Check all containers, the inner ones first.

    Dead ends are only noted here: whether something outside ends them is known only once all
    charts have been checked.
    """
    for placed in reversed(checked.nodes):
        placed.instant = _instant(placed)
        if placed.form == "states":
            _check_busy(checked, placed)
            _note_dead_end(checked, placed)


def _instant(placed: PlacedNode) -> frozenset[str]:
    """The outcomes that a node can end with in the tick of its entry."""
    if placed.callee is not None:
        return frozenset() if placed.node.retry else placed.callee.facts.instant
    if placed.node.keeps:
        return frozenset()
    found = set()
    for child in _entered_at_once(placed):
        for outcome, target in child.routes:
            if outcome in child.instant and target[0] == ".":
                found.add(target[1:])
    return frozenset(found)


def _entered_at_once(placed: PlacedNode) -> list[PlacedNode]:
    if placed.form != "states":
        return placed.children
    edges = _instant_edges(placed)
    found = dict.fromkeys(placed.children[:1])
    queue = list(found)
    for child in queue:
        for sibling in edges.get(child, ()):
            if sibling not in found:
                found[sibling] = None
                queue.append(sibling)
    return queue


def _instant_edges(placed: PlacedNode) -> Edges:
    return _edges(placed, {child: child.instant for child in placed.reached})


def _edges(placed: PlacedNode, quick: Mapping[PlacedNode, Collection[str]]) -> Edges:
    """What follows each child by these outcomes; empty if none has any."""
    if not any(quick.values()):
        return {}
    named = {child.node.name: child for child in placed.children}
    edges: Edges = {child: [] for child in placed.children}
    for child, outcomes in quick.items():
        for outcome, target in child.routes:
            if outcome in outcomes and target in named:
                edges[child].append(named[target])
    return edges


def _check_busy(checked: CheckedChart, placed: PlacedNode) -> None:
    """S03: a cycle of states in which nothing ever waits, or nothing has to."""
    never = _cycles(placed, _instant_edges(placed))
    for cycle in never:
        message = f"busy loop: {_shown(cycle)} never waits"
        hint = "put a state between them that waits, or a monitor that watches"
        checked.warning("S03", message, cycle[0].node.at, hint)
    told = {child for cycle in never for child in cycle}
    for cycle in _hasty_cycles(checked, placed):
        if told.isdisjoint(cycle):
            message = f"busy loop: {_shown(cycle)} in every tick, as long as they end at once"
            hint = "try again after a `wait`, or put a state between them that waits"
            checked.warning("S03", message, cycle[0].node.at, hint)


def _hasty_cycles(checked: CheckedChart, placed: PlacedNode) -> list[list[PlacedNode]]:
    """Cycles in which nothing has to wait, and an action ends otherwise than it is meant to.

    Those of instant states, and of actions whose code can return before its first `yield`. What an
    action is for is the first of its outcomes: two drives after one another will not both be at
    their goals already.
    """
    acting = {child: _acting(child) for child in placed.reached}
    if not _cycles(placed, _edges(placed, {c: c.instant | acting[c] for c in acting})):
        return []
    known, quick = checked.scope.interfaces, {}
    for child, outcomes in acting.items():
        at_once = outcomes_at_once(known[child.node.target]) if outcomes else frozenset()
        quick[child] = child.instant | (outcomes & at_once)
    edges = _edges(placed, quick)
    failing = _edges(placed, {c: quick[c] - {*[*c.ends][:1]} for c in acting if acting[c]})
    found = []
    for component in components(edges):
        inside = {child: [t for t in edges[child] if t in component] for child in component}
        pairs = ((c, t) for c in component for t in failing.get(c, ()) if t in inside)
        first = next(pairs, None)
        if first is not None:
            found.append(_through(inside, *first))
    return found


def _through(edges: Edges, child: PlacedNode, target: PlacedNode) -> list[PlacedNode]:
    """The shortest cycle through an edge of a strongly connected graph, from its target on."""
    cut = {**edges, child: [target]}
    cycle = cycle_in(cut, [target, *(c for c in edges if c is not target)])
    assert cycle is not None
    return cycle


def _acting(child: PlacedNode) -> frozenset[str]:
    """The outcomes of an action that is not tried again first."""
    acts = child.form == "do" and child.callee is not None and child.node.retry is None
    return frozenset(child.ends) - {"timeout"} if acts else frozenset()


def _cycles(placed: PlacedNode, edges: Edges) -> list[list[PlacedNode]]:
    order = {child: index for index, child in enumerate(placed.children)}
    found = []
    for component in components(edges):
        component.sort(key=order.__getitem__)
        cycle = cycle_in(edges, component)
        if cycle is not None:
            found.append(cycle)
    return found


def _shown(cycle: list[PlacedNode]) -> str:
    names = [child.node.name for child in cycle]
    return " -> ".join(names if len(names) < 10 else [*names[:8], "…", names[-1]])


def _note_dead_end(checked: CheckedChart, placed: PlacedNode) -> None:
    """S04: note the first child of a sequence from which no path leads out of it."""
    named = {child.node.name: child for child in placed.children}
    sources: dict[PlacedNode, list[PlacedNode]] = {child: [] for child in placed.children}
    leaving: dict[PlacedNode, None] = {}
    for child in placed.reached:
        for outcome, target in child.routes:
            if outcome == "error":
                continue
            if target[0] == ".":
                leaving[child] = None
            else:
                sources[named[target]].append(child)
    queue = list(leaving)
    for child in queue:
        for source in sources[child]:
            if source not in leaving:
                leaving[source] = None
                queue.append(source)
    dead = [child for child in placed.children if child in placed.reached and child not in leaving]
    if dead and not any(child.form == "states" and not child.produced for child in dead):
        checked.dead_ends.append(dead[0])


def report_dead_ends(charts: list[CheckedChart]) -> None:
    """Report S04 for all charts; `charts` has used ones before those that use them."""
    ended: dict[str, list[bool]] = {}  # by chart, for each use: whether something there ends it
    for checked in reversed(charts):
        around = ended.get(checked.chart.name, [])
        outside = bool(around) and all(around)
        enders = _Enders()
        for placed in checked.nodes:
            if placed.form == "use":
                ends = outside or enders.end(placed)
                ended.setdefault(placed.node.target, []).append(ends)
        if outside or not checked.chart.outcomes:
            continue
        for placed in checked.dead_ends:
            if placed.parent is not None and not enders.end(placed.parent):
                message = f"from {placed.node.name!r} on, nothing ends this sequence"
                hint = "lead an outcome out, or set a guard beside it, or a timeout around it"
                checked.warning("S04", message, placed.node.at, hint)


class _Enders:
    """Finds nodes that something beside or around them can end."""

    def __init__(self) -> None:
        self.found: dict[PlacedNode, list[PlacedNode]] = {}

    def end(self, placed: PlacedNode) -> bool:
        """True if `placed`, or a node around it, has a timeout or a sibling that can end it."""
        while placed.parent is not None:
            parent = placed.parent
            if placed.node.timeout is not None:
                return True
            if parent.form != "states" and any(e is not placed for e in self._enders(parent)):
                return True
            if parent.node.keeps and _ends_without(parent, placed):
                return True
            placed = parent
        return False

    def _enders(self, container: PlacedNode) -> list[PlacedNode]:
        """Children of a container that can end it; the search stops at two."""
        if container not in self.found:
            able = (child for child in container.children if _can_end(child, container))
            self.found[container] = [child for child, _ in zip(able, range(2), strict=False)]
        return self.found[container]


def _can_end(child: PlacedNode, container: PlacedNode) -> bool:
    """True if an outcome of `child` ends the container; where outcomes are kept, if each does."""
    ending = [outcome in child.node.next for outcome in child.produced]
    return bool(ending) and (not container.node.keeps or all(ending))


def _ends_without(container: PlacedNode, placed: PlacedNode) -> bool:
    """True if the container ends with every combination of outcomes of the other children.

    Assumed to hold with more than `MOST_BESIDE` children, where deciding it would take too long.
    """
    if len(container.children) > MOST_BESIDE:
        return True
    others = (child for child in container.children if child is not placed)
    domains = {child.node.name: child.kept() for child in others}
    domains = {name: kept for name, kept in domains.items() if kept}
    rules = [
        rule.conditions for rule in container.rules if rule.conditions.keys() <= domains.keys()
    ]
    try:
        return bool(domains) and all(rules) and uncovered(domains, rules) is None
    except TooLarge:
        return True
