"""Data flow along the paths through a chart (F01–F04).

A key that is written stays written. So the keys certainly written after a node are those written
before it plus a set that depends on the node alone. One pass from the inside out computes that set
for every outcome; a second one, from the outside in, the keys written before each node.
"""

from __future__ import annotations

from collections.abc import Mapping
from heapq import heappop, heappush

from engine.chart import DataKey, key_mark_of, mark_of
from engine.check.checked_chart import CheckedChart, PlacedNode


def check_flow(checked: CheckedChart) -> None:
    """Check all nodes; `needs`, `gives` and `final` of the leaves are known already."""
    for placed in reversed(checked.nodes):
        if placed.is_container:
            placed.gives = _sequence(placed) if placed.form == "states" else _parallel(placed)
            _note_writes(placed)
            if placed.form != "states":
                _check_writers(checked, placed)
        else:
            _complete(placed)
    _check_reads(checked)
    _check_results(checked)
    _check_unused(checked)


def _complete(leaf: PlacedNode) -> None:
    """Let outcomes without outputs, or whose outputs are not bound, give no keys."""
    for outcome in (*leaf.ends, "error"):
        leaf.gives.setdefault(outcome, 0)


def _sequence(placed: PlacedNode) -> dict[str, int]:
    """Forward must-analysis: the keys written on every path to a node and to each outcome."""
    named = {child.node.name: child for child in placed.children}
    order = _downstream(placed, named)
    rank = {child: index for index, child in enumerate(order)}
    ends: dict[str, int] = {}
    order[0].entry = 0
    work = [0]  # a heap, in topological order: only nodes in loops are visited twice
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
    return _with_timeout(placed, ends)


def _downstream(placed: PlacedNode, named: Mapping[str, PlacedNode]) -> list[PlacedNode]:
    """The children that can be entered, in topological order, except for loops."""
    first = placed.children[0]
    seen = {first}
    left: list[PlacedNode] = []
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


def _edges(child: PlacedNode) -> list[tuple[str, str]]:
    """The outcomes of a child with their targets, `error` included if it can occur."""
    if "error" not in child.gives:
        return [route for route in child.routes if route[0] != "error"]
    if "error" in child.node.next:
        return child.routes
    return [*child.routes, ("error", ".error")]


def _meet(ends: dict[str, int], outcome: str, written: int) -> None:
    ends[outcome] = ends[outcome] & written if outcome in ends else written


def _with_timeout(placed: PlacedNode, ends: dict[str, int]) -> dict[str, int]:
    if placed.node.timeout is not None:
        ends["timeout"] = 0
    return ends


def _parallel(placed: PlacedNode) -> dict[str, int]:
    """Keys written at each outcome: by the winner, or by the children that a rule names."""
    ends: dict[str, int] = {}
    keeps = placed.node.keeps
    for child in placed.children:
        child.entry = 0
        for outcome, target in _edges(child):
            if not keeps or outcome == "error" or outcome in child.node.next:
                _meet(ends, target[1:], child.gives.get(outcome, 0))
    named = {child.node.name: child for child in placed.children}
    for rule in placed.rules if keeps else ():
        written = 0
        for name, outcome in rule.conditions.items():
            written |= named[name].gives.get(outcome, 0)
        if not rule.conditions:
            for child in placed.children:
                written |= _always(child)
        _meet(ends, rule.outcome, written)
    return _with_timeout(placed, ends)


def _always(child: PlacedNode) -> int:
    """The keys written whichever of its outcomes is kept."""
    kept = child.kept()
    written = -1 if kept else 0
    for outcome in kept:
        written &= child.gives.get(outcome, 0)
    return written


def _note_writes(placed: PlacedNode) -> None:
    """Note the keys that are written while a container runs (`inner`) and at its end (`final`)."""
    for child in placed.children:
        placed.inner |= child.inner
        leads_on = placed.form == "states" and any(t[0] != "." for _, t in child.routes)
        if leads_on:
            placed.inner |= child.final
        placed.final |= child.final


def _check_writers(checked: CheckedChart, placed: PlacedNode) -> None:
    """F03: concurrent writers of a key; in `any` only the winner's final outputs are kept."""
    owners: dict[str, PlacedNode] = {}
    for child in placed.children:
        writes = child.inner | child.final if placed.node.keeps else child.inner
        for key in checked.data.within(writes):
            owner = owners.setdefault(key.name, child)
            if owner is not child:
                message = f"{owner.node.name!r} and {child.node.name!r} both write {key.name!r}"
                first = (owner.node.at, "this one runs beside it")
                hint = "give each a key of its own"
                checked.error("F03", message, child.node.at, hint, first)


def _check_reads(checked: CheckedChart) -> None:
    """F01: a key that a node reads is written on every path to it."""
    data = checked.data
    before: dict[PlacedNode, int] = {checked.root: data.start}
    for placed in checked.nodes:
        if placed.parent is not None:
            around = before.get(placed.parent)
            if around is None or placed.entry is None:
                continue  # never entered
            before[placed] = around | placed.entry
        missing = placed.needs & ~before[placed] & ~data.nullable
        if missing:
            for name, key in _reading(checked, placed, missing):
                _report_read(checked, placed, name, key, before)
        for name, key in _reading(checked, placed, placed.needs & data.nullable):
            at = mark_of(placed.node.raw, "in", name)
            message = (
                f"{key.name!r} may be none, which input {name!r} of {placed.node.target} is not"
            )
            hint = "an output that may be none is written to it"
            checked.error("F02", message, at, hint, (key.at, "declared here"))


def _reading(checked: CheckedChart, placed: PlacedNode, mask: int) -> list[tuple[str, DataKey]]:
    if not mask:
        return []
    keys = {key.name: key for key in checked.data.within(mask)}
    bound = ((name, placed.names.get(key)) for name, key in placed.node.reads.items())
    return [(name, keys[real]) for name, real in bound if real in keys]


def _report_read(
    checked: CheckedChart,
    placed: PlacedNode,
    name: str,
    key: DataKey,
    before: dict[PlacedNode, int],
) -> None:
    path = _path(checked, placed, checked.data.bits[key.name], before)
    what = "may still be none" if key.optional else "may be read before it is written"
    message = f"{key.name!r} {what}{path}"
    hint = "write it on every path to here" + ("" if key.optional else ", or give it `initial:`")
    at = mark_of(placed.node.raw, "in", name)
    checked.error("F01", message, at, hint, (key.at, "declared here"))


def _path(
    checked: CheckedChart, placed: PlacedNode, bit: int, before: dict[PlacedNode, int]
) -> str:
    """Names the last edge of a path to `placed` on which the key of `bit` is not written."""
    while placed.parent is not None:
        parent, around = placed.parent, before[placed.parent]
        checked.effort -= len(parent.children)
        if checked.effort < 0:
            return ""
        if parent.form == "states" and placed is not parent.children[0]:
            for child in parent.reached:
                for outcome, target in _edges(child):
                    written = around | (child.entry or 0) | child.gives.get(outcome, 0)
                    if target == placed.node.name and not written & bit:
                        return f", coming from {child.node.name!r} by {outcome!r}"
        placed = parent
    return ", at the start"


def _check_results(checked: CheckedChart) -> None:
    """F01: an output of the chart is written on every path to its outcome."""
    chart, data = checked.chart, checked.data
    for outcome, named in chart.outputs.items():
        written = checked.root.gives.get(outcome)
        for name in named if written is not None else ():
            bit = data.bits[name]
            at = key_mark_of(chart.root.raw["outputs"], outcome, name)
            if not (data.start | (written or 0)) & bit:
                message = f"the chart can end with {outcome!r} before {name!r} is written"
                checked.error("F01", message, at, "write it on every path to it")
            elif data.nullable & bit:
                message = f"{name!r} may be none"
                checked.error("F02", message, at, "an output that may be none is written to it")


def _check_unused(checked: CheckedChart) -> None:
    """F04: declared keys and parameters are used."""
    chart, data = checked.chart, checked.data
    results = {name for named in chart.outputs.values() for name in named}
    for key in chart.keys.values():
        bit = data.bits[key.name]
        if key.name in results or data.read & bit:
            continue
        what = "written but never read" if data.written & bit else "never used"
        checked.warning("F04", f"{key.name!r} is {what}", key.at, "leave it out")
    for name, parameter in chart.parameters.items():
        if name not in checked.parameters_used:
            checked.warning("F04", f"${name} is never used", parameter.at, "leave it out")
