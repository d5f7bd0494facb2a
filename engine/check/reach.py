"""What can happen at all: reachable nodes and outcomes (S01, S02)."""

from __future__ import annotations

from engine.check.checked_chart import NodeInPlace, Subject


def check_reach(subject: Subject) -> None:
    """Look at all nodes, the inner ones first; notes what can be reached and produced."""
    for site in reversed(subject.sites):
        if site.box:
            site.reached = _reached(site)
            for child in site.children:
                if child not in site.reached:
                    message = f"{child.node.name!r} is never reached"
                    subject.warning("S01", message, child.node.at, "lead an outcome to it")
            site.produced = _produced(site)
        else:
            site.produced = site.ends
        site.routes = _routes(site)
    listed = subject.chart.root.raw.get("outcomes")
    for outcome, at in zip(listed, listed.values_at, strict=True) if listed else ():
        if outcome not in subject.root.produced:
            hint = f"lead to it with `.{outcome}`, or leave it out"
            subject.warning("S02", f"nothing ends the chart with {outcome!r}", at, hint)


def _routes(site: NodeInPlace) -> list[tuple[str, str]]:
    """Where outcomes lead: to a sibling or `.x`, also where they are handed on or kept.

    An `error` that is not mapped is left out; it can come out of everything.
    """
    mapped = site.node.next
    routes = [(outcome, mapped.get(outcome) or f".{outcome}") for outcome in site.produced]
    if "error" in mapped:
        routes.append(("error", mapped["error"]))
    return routes


def _reached(site: NodeInPlace) -> dict[NodeInPlace, None]:
    if site.form != "states":
        return dict.fromkeys(site.children)
    named = {child.node.name: child for child in site.children}
    found = dict.fromkeys(site.children[:1])
    queue = list(found)
    for child in queue:
        for _, target in child.routes:
            sibling = named.get(target)
            if sibling is not None and sibling not in found:
                found[sibling] = None
                queue.append(sibling)
    return found


def _produced(site: NodeInPlace) -> dict[str, None]:
    node = site.node
    found: dict[str, None] = {}
    for child in site.reached:
        for outcome, target in child.routes:
            if target[0] == "." and (not node.keeps or outcome in child.node.next):
                found[target[1:]] = None
    if node.keeps:
        kept = {child.node.name: _kept(child) for child in site.children}
        for rule in site.rules:
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


def _kept(child: NodeInPlace) -> list[str]:
    return [outcome for outcome in child.produced if outcome not in child.node.next]
