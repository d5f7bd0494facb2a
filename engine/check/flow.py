"""Data along the paths through a chart (F01–F04).

No key ever becomes undefined, so what is surely written after a node is what was written before
it, plus something that the node alone decides. One pass from the inside out finds that for every
outcome, one from the outside in finds what is written before each node; neither repeats the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from heapq import heappop, heappush

from engine.chart import DataKey, key_mark_of, mark_of
from engine.check.checked_chart import NodeInPlace, Subject


def check_flow(subject: Subject) -> None:
    """Look at all nodes; `needs`, `gives` and `final` of the leaves are known."""
    for site in reversed(subject.sites):
        if site.box:
            site.gives = _sequence(site) if site.form == "states" else _parallel(site)
            _note_writes(site)
            if site.form != "states":
                _check_writers(subject, site)
        else:
            _complete(site)
    _check_reads(subject)
    _check_results(subject)
    _check_unused(subject)


def _complete(leaf: NodeInPlace) -> None:
    """Outcomes without outputs, and those whose outputs are dropped, write nothing."""
    for outcome in (*leaf.ends, "error"):
        leaf.gives.setdefault(outcome, 0)


def _sequence(site: NodeInPlace) -> dict[str, int]:
    """Forward analysis: over all ways to a node, what has been written on each of them."""
    named = {child.node.name: child for child in site.children}
    order = _downstream(site, named)
    rank = {child: index for index, child in enumerate(order)}
    ends: dict[str, int] = {}
    order[0].entry = 0
    work = [0]  # a heap: what comes first is looked at first, so loops alone are looked at again
    while work:
        child = order[heappop(work)]
        here = child.entry or 0
        for outcome, target in _edges(child):
            after = here | child.gives.get(outcome, 0)
            sibling = named.get(target)
            if sibling is None:
                _meet(ends, target[1:], after)
            elif sibling.entry is None or sibling.entry & after != sibling.entry:
                sibling.entry = after if sibling.entry is None else sibling.entry & after
                heappush(work, rank[sibling])
    return _with_timeout(site, ends)


def _downstream(site: NodeInPlace, named: Mapping[str, NodeInPlace]) -> list[NodeInPlace]:
    """The children that can be entered, each before what follows it, but for loops."""
    first = site.children[0]
    seen = {first}
    left: list[NodeInPlace] = []
    path = [(first, iter(_edges(first)))]
    while path:
        child, edges = path[-1]
        for _, target in edges:
            sibling = named.get(target)
            if sibling is not None and sibling not in seen:
                seen.add(sibling)
                path.append((sibling, iter(_edges(sibling))))
                break
        else:
            left.append(child)
            path.pop()
    return left[::-1]


def _edges(child: NodeInPlace) -> list[tuple[str, str]]:
    """Where the outcomes of a child lead, `error` too if it can come out."""
    if "error" not in child.gives:
        return [route for route in child.routes if route[0] != "error"]
    if "error" in child.node.next:
        return child.routes
    return [*child.routes, ("error", ".error")]


def _meet(ends: dict[str, int], outcome: str, written: int) -> None:
    ends[outcome] = ends[outcome] & written if outcome in ends else written


def _with_timeout(site: NodeInPlace, ends: dict[str, int]) -> dict[str, int]:
    if site.node.timeout is not None:
        ends["timeout"] = 0
    return ends


def _parallel(site: NodeInPlace) -> dict[str, int]:
    """The winner's outputs; where outcomes are kept, those of the children that a rule names."""
    ends: dict[str, int] = {}
    keeps = site.node.keeps
    for child in site.children:
        child.entry = 0
        for outcome, target in _edges(child):
            if not keeps or outcome == "error" or outcome in child.node.next:
                _meet(ends, target[1:], child.gives.get(outcome, 0))
    named = {child.node.name: child for child in site.children}
    for rule in site.rules if keeps else ():
        written = 0
        for name, outcome in rule.conditions.items():
            written |= named[name].gives.get(outcome, 0)
        if not rule.conditions:
            for child in site.children:
                written |= _always(child)
        _meet(ends, rule.outcome, written)
    return _with_timeout(site, ends)


def _always(child: NodeInPlace) -> int:
    """What is written whichever of its outcomes is kept."""
    kept = child.kept()
    written = -1 if kept else 0
    for outcome in kept:
        written &= child.gives.get(outcome, 0)
    return written


def _note_writes(site: NodeInPlace) -> None:
    """What is written while a box runs, and what only when it ends."""
    for child in site.children:
        site.inner |= child.inner
        leads_on = site.form == "states" and any(t[0] != "." for _, t in child.routes)
        if leads_on:
            site.inner |= child.final
        site.final |= child.final


def _check_writers(subject: Subject, site: NodeInPlace) -> None:
    """F03: in `any` outputs at the end are the winner's alone, all others may meet."""
    owners: dict[str, NodeInPlace] = {}
    for child in site.children:
        writes = child.inner | child.final if site.node.keeps else child.inner
        for key in subject.data.within(writes):
            owner = owners.setdefault(key.name, child)
            if owner is not child:
                message = f"{owner.node.name!r} and {child.node.name!r} both write {key.name!r}"
                first = (owner.node.at, "this one runs beside it")
                hint = "give each a key of its own"
                subject.error("F03", message, child.node.at, hint, first)


def _check_reads(subject: Subject) -> None:
    """F01: what a node reads has been written on every way to it."""
    data = subject.data
    before: dict[NodeInPlace, int] = {subject.root: data.start}
    for site in subject.sites:
        if site.parent is not None:
            around = before.get(site.parent)
            if around is None or site.entry is None:
                continue  # never entered
            before[site] = around | site.entry
        missing = site.needs & ~before[site] & ~data.nullable
        if missing:
            for name, key in _reading(subject, site, missing):
                _report_read(subject, site, name, key, before)
        for name, key in _reading(subject, site, site.needs & data.nullable):
            at = mark_of(site.node.raw, "in", name)
            message = (
                f"{key.name!r} may hold nothing; input {name!r} of {site.node.target} wants it"
            )
            hint = "an output that may be nothing is written to it"
            subject.error("F02", message, at, hint, (key.at, "declared here"))


def _reading(subject: Subject, site: NodeInPlace, mask: int) -> list[tuple[str, DataKey]]:
    if not mask:
        return []
    keys = {key.name: key for key in subject.data.within(mask)}
    bound = ((name, site.names.get(key)) for name, key in site.node.inputs.items())
    return [(name, keys[real]) for name, real in bound if real in keys]


def _report_read(
    subject: Subject, site: NodeInPlace, name: str, key: DataKey, before: dict[NodeInPlace, int]
) -> None:
    way = _way(subject, site, subject.data.bits[key.name], before)
    what = "may still be none" if key.optional else "may be read before it is written"
    message = f"{key.name!r} {what}{way}"
    hint = "write it on every path to here" + ("" if key.optional else ", or give it `initial:`")
    at = mark_of(site.node.raw, "in", name)
    subject.error("F01", message, at, hint, (key.at, "declared here"))


def _way(subject: Subject, site: NodeInPlace, bit: int, before: dict[NodeInPlace, int]) -> str:
    """A way to `site`, or to what encloses it, on which the key of `bit` is not written."""
    while site.parent is not None:
        parent, around = site.parent, before[site.parent]
        subject.effort -= len(parent.children)
        if subject.effort < 0:
            return ""
        if parent.form == "states" and site is not parent.children[0]:
            for child in parent.reached:
                for outcome, target in _edges(child):
                    written = around | (child.entry or 0) | child.gives.get(outcome, 0)
                    if target == site.node.name and not written & bit:
                        return f", coming from {child.node.name!r} by {outcome!r}"
        site = parent
    return ", at the start"


def _check_results(subject: Subject) -> None:
    """F01: an output of the chart has been written on every way to its outcome."""
    chart, data = subject.chart, subject.data
    for outcome, named in chart.outputs.items():
        written = subject.root.gives.get(outcome)
        for name in named if written is not None else ():
            bit = data.bits[name]
            at = key_mark_of(chart.root.raw["outputs"], outcome, name)
            if not (data.start | (written or 0)) & bit:
                message = f"the chart can end with {outcome!r} before {name!r} is written"
                subject.error("F01", message, at, "write it on every way there")
            elif data.nullable & bit:
                message = f"{name!r} may hold nothing"
                subject.error("F02", message, at, "an output that may be nothing is written to it")


def _check_unused(subject: Subject) -> None:
    """F04: what is declared is used."""
    chart, data = subject.chart, subject.data
    results = {name for named in chart.outputs.values() for name in named}
    for key in chart.keys.values():
        bit = data.bits[key.name]
        if key.name in results or data.read & bit:
            continue
        what = "written but never read" if data.written & bit else "never used"
        subject.warning("F04", f"{key.name!r} is {what}", key.at, "leave it out")
    for name, parameter in chart.parameters.items():
        if name not in subject.parameters_used:
            subject.warning("F04", f"${name} is never used", parameter.at, "leave it out")
