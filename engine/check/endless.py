"""What goes on for ever: busy loops (S03) and dead ends (S04)."""

from __future__ import annotations

from engine.check.checked_chart import NodeInPlace, Subject
from engine.check.rules import TooLarge, uncovered
from engine.check.uses import circle, components

MOST_BESIDE = 100


def check_endless(subject: Subject) -> None:
    """Look at all boxes, the inner ones first.

    Whether something outside ends a dead end is known only when all charts have been looked at,
    so they are noted in the subject.
    """
    for site in reversed(subject.sites):
        site.instant = _instant(site)
        if site.form == "states":
            _check_busy(subject, site)
            _note_dead_end(subject, site)


def _instant(site: NodeInPlace) -> frozenset[str]:
    """The outcomes a site can end with in the tick in which it was entered."""
    if site.callee is not None:
        return frozenset() if site.node.retry else site.callee.facts.instant
    if site.node.keeps:
        return frozenset()
    found = set()
    for child in _entered_at_once(site):
        for outcome, target in child.routes:
            if outcome in child.instant and target[0] == ".":
                found.add(target[1:])
    return frozenset(found)


def _entered_at_once(site: NodeInPlace) -> list[NodeInPlace]:
    if site.form != "states":
        return site.children
    edges = _instant_edges(site)
    found = dict.fromkeys(site.children[:1])
    queue = list(found)
    for child in queue:
        for sibling in edges.get(child, ()):
            if sibling not in found:
                found[sibling] = None
                queue.append(sibling)
    return queue


def _instant_edges(site: NodeInPlace) -> dict[NodeInPlace, list[NodeInPlace]]:
    quick = [child for child in site.reached if child.instant]
    if not quick:
        return {}
    named = {child.node.name: child for child in site.children}
    edges: dict[NodeInPlace, list[NodeInPlace]] = {child: [] for child in site.children}
    for child in quick:
        for outcome, target in child.routes:
            if outcome in child.instant and target in named:
                edges[child].append(named[target])
    return edges


def _check_busy(subject: Subject, site: NodeInPlace) -> None:
    """S03: nothing in a circle of instant states ever waits."""
    edges = _instant_edges(site)
    order = {child: index for index, child in enumerate(site.children)}
    for component in components(edges):
        component.sort(key=order.__getitem__)
        way = circle(edges, component)
        if way is not None:
            names = [child.node.name for child in way]
            shown = " -> ".join(names if len(names) < 10 else [*names[:8], "…", names[-1]])
            message = f"busy loop: {shown} never waits"
            hint = "put a state between them that waits, or a monitor that watches"
            subject.warning("S03", message, way[0].node.at, hint)


def _note_dead_end(subject: Subject, site: NodeInPlace) -> None:
    """S04: no outcome leads out of some children of a sequence."""
    named = {child.node.name: child for child in site.children}
    sources: dict[NodeInPlace, list[NodeInPlace]] = {child: [] for child in site.children}
    leaving: dict[NodeInPlace, None] = {}
    for child in site.reached:
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
    dead = [child for child in site.children if child in site.reached and child not in leaving]
    if dead and not any(child.form == "states" and not child.produced for child in dead):
        subject.dead_ends.append(dead[0])


def report_dead_ends(subjects: list[Subject]) -> None:
    """S04, for charts in an order in which those that are used come first."""
    ended: dict[str, list[bool]] = {}  # chart -> for each use, whether something there ends it
    for subject in reversed(subjects):
        around = ended.get(subject.chart.name, [])
        outside = bool(around) and all(around)
        enders = _Enders()
        for site in subject.sites:
            if site.form == "use":
                ends = outside or enders.end(site)
                ended.setdefault(site.node.target, []).append(ends)
        if outside or not subject.chart.outcomes:
            continue
        for site in subject.dead_ends:
            if site.parent is not None and not enders.end(site.parent):
                message = f"from {site.node.name!r} on this can never end"
                hint = "lead an outcome out, or set a guard beside it, or a timeout around it"
                subject.warning("S04", message, site.node.at, hint)


class _Enders:
    """Finds out what is ended by something beside it."""

    def __init__(self) -> None:
        self.found: dict[NodeInPlace, list[NodeInPlace]] = {}

    def end(self, site: NodeInPlace) -> bool:
        """Whether its timeout or one around it ends `site`, or a sibling of it or of those."""
        while site.parent is not None:
            parent = site.parent
            if site.node.timeout is not None:
                return True
            if parent.form != "states" and any(e is not site for e in self._enders(parent)):
                return True
            if parent.node.keeps and _ends_without(parent, site):
                return True
            site = parent
        return False

    def _enders(self, box: NodeInPlace) -> list[NodeInPlace]:
        """Up to two children of `box` that can end it."""
        if box not in self.found:
            able = (child for child in box.children if _can_end(child, box))
            self.found[box] = [child for child, _ in zip(able, range(2), strict=False)]
        return self.found[box]


def _can_end(child: NodeInPlace, box: NodeInPlace) -> bool:
    """Whether some outcome of `child` is sure to end `box`, if it comes."""
    ending = [outcome in child.node.next for outcome in child.produced]
    return bool(ending) and (not box.node.keeps or all(ending))


def _ends_without(box: NodeInPlace, site: NodeInPlace) -> bool:
    """Whether `box` ends whatever is kept of its children, if nothing is of `site`.

    Taken for granted in boxes with very many children, where it takes long to find out.
    """
    if len(box.children) > MOST_BESIDE:
        return True
    domains = {child.node.name: child.kept() for child in box.children if child is not site}
    domains = {name: kept for name, kept in domains.items() if kept}
    rules = [rule.conditions for rule in box.rules if rule.conditions.keys() <= domains.keys()]
    try:
        return bool(domains) and all(rules) and uncovered(domains, rules) is None
    except TooLarge:
        return True
