"""Checks that nodes and outcomes can be reached (S01, S02)."""

from __future__ import annotations

from engine.chart import key_mark_of
from engine.check.checked_chart import CheckedChart, PlacedNode

_UNREACHED = "map an outcome to it, or delete it"


def check_reach(checked: CheckedChart) -> None:
    """Check all nodes, the inner ones first, and note what can be reached and produced."""
    for placed in reversed(checked.nodes):
        if placed.is_container:
            placed.reached = _reached(placed)
            for child in placed.children:
                if child not in placed.reached:
                    message, hint = f"{child.node.name!r} is never reached", _UNREACHED
                    checked.warning("S01", message, child.node.at, hint)
            placed.produced = _produced(placed)
            _check_produced(checked, placed)
        else:
            placed.produced = placed.ends
        placed.routes = _routes(placed)
    listed = checked.chart.root.raw.get("outcomes")
    for outcome, at in zip(listed, listed.values_at, strict=True) if listed else ():
        if outcome not in checked.root.produced:
            hint = f"map an outcome to `.{outcome}`, or leave it out"
            checked.warning("S02", f"nothing ends the chart with {outcome!r}", at, hint)


def _check_produced(checked: CheckedChart, placed: PlacedNode) -> None:
    """S02: each outcome that `next` of a container maps can occur, if all inside it is reached."""
    if len(placed.reached) < len(placed.children):
        return
    for outcome in placed.node.next:
        if outcome in placed.ends and outcome not in placed.produced:
            at = key_mark_of(placed.node.raw, "next", outcome)
            message = f"{placed.node.name!r} can never end with {outcome!r}"
            checked.warning("S02", message, at, "leave it out")


def _routes(placed: PlacedNode) -> list[tuple[str, str]]:
    """Outcomes with their targets, a sibling or `.x`, including those passed on or kept.

    An unmapped `error` is left out; every node can end with it.
    """
    mapped = placed.node.next
    routes = [(outcome, mapped.get(outcome) or f".{outcome}") for outcome in placed.produced]
    if "error" in mapped:
        routes.append(("error", mapped["error"]))
    return routes


def _reached(placed: PlacedNode) -> dict[PlacedNode, None]:
    if placed.form != "states":
        return dict.fromkeys(placed.children)
    named = {child.node.name: child for child in placed.children}
    found = dict.fromkeys(placed.children[:1])
    queue = list(found)
    for child in queue:
        for _, target in child.routes:
            sibling = named.get(target)
            if sibling is not None and sibling not in found:
                found[sibling] = None
                queue.append(sibling)
    return found


def _produced(placed: PlacedNode) -> dict[str, None]:
    node = placed.node
    found: dict[str, None] = {}
    for child in placed.reached:
        for outcome, target in child.routes:
            if target[0] == "." and (not node.keeps or outcome in child.node.next):
                found[target[1:]] = None
    if node.keeps:
        kept = {child.node.name: _kept(child) for child in placed.children}
        for rule in placed.rules:
            conditions = rule.conditions.items()
            if conditions:
                possible = all(outcome in kept[name] for name, outcome in conditions)
            else:
                possible = all(kept.values())
            if possible:
                found[rule.outcome] = None
    if node.timeout is not None:
        found["timeout"] = None
    return found


def _kept(child: PlacedNode) -> list[str]:
    return [outcome for outcome in child.produced if outcome not in child.node.next]
