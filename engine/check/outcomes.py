"""Checks of the targets of outcomes (N03, N05, N06, N07, S09).

Containers collect the outcomes of their children, so that an outcome without a target is reported
where it originates.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from engine.chart import Node, key_mark_of, mark_of
from engine.check.checked_chart import CheckedChart, Origin, PlacedNode
from engine.files import Map, Mark, Seq
from engine.state_class import RESERVED_OUTCOMES


def check_outcomes(checked: CheckedChart) -> None:
    """Check all nodes, the inner ones first, and note what each can end with."""
    for placed in reversed(checked.nodes):
        placed.ends = _container_ends(placed) if placed.is_container else _leaf_ends(placed)
        if placed.parent is not None:
            _check_next(checked, placed, placed.parent)
            _check_unmapped(checked, placed, placed.parent)
            _check_limits(checked, placed)
        if placed.node.when:
            _check_rules(checked, placed)
    _check_top(checked)


def _leaf_ends(placed: PlacedNode) -> Mapping[str, Sequence[Origin]]:
    node, callee = placed.node, placed.callee
    if callee is None:  # unknown: assumed to have the outcomes that are mapped
        return {outcome: () for outcome in node.next if outcome != "error"}
    return {**callee.ends, "timeout": ()} if "timeout" in node.raw else callee.ends


def _container_ends(placed: PlacedNode) -> dict[str, list[Origin]]:
    ends: dict[str, list[Origin]] = {}
    node = placed.node
    for child in placed.children:
        routes = child.node.next
        for outcome, target in routes.items():
            if target[:1] == ".":
                ends.setdefault(target[1:], []).append((child.node, outcome))
        if child.is_container and not node.keeps:
            for outcome, origins in child.ends.items():
                if outcome not in routes and outcome != "timeout":
                    ends.setdefault(outcome, []).extend(origins)
    marks = _outcome_marks(node)
    for rule in node.rules:
        ends.setdefault(rule.outcome, []).append(marks.get(rule.at, rule.at))
    if "timeout" in node.raw:
        ends["timeout"] = []
    return ends


def _outcome_marks(node: Node) -> Mapping[Mark, Mark]:
    """The marks of the outcomes in the items of `when`, by the marks of these items."""
    if not node.when:
        return {}
    listed = node.raw["when"]
    pairs = zip(listed.values_at, listed, strict=True)
    return {at: mark_of(item, "outcome") for at, item in pairs if isinstance(item, Map)}


def _check_next(checked: CheckedChart, placed: PlacedNode, parent: PlacedNode) -> None:
    node, siblings = placed.node, parent.node.raw[parent.form]
    in_sequence = parent.form == "states"
    for outcome, target in node.next.items():
        if outcome not in placed.ends and outcome != "error":
            _no_outcome(checked, placed, outcome, key_mark_of(node.raw, "next", outcome))
        if in_sequence and target in siblings:
            continue
        at = mark_of(node.raw, "next", outcome)
        if target[:1] == ".":
            if target[1:] in RESERVED_OUTCOMES or target == ".":
                message = f"{target!r} is no outcome that a chart can end with"
                checked.error("N07", message, at, "use a name of your own, such as `.failed`")
        elif in_sequence:
            ways_out = (f".{outcome}" for outcome in checked.chart.outcomes)
            hint = checked.near(target, siblings, ways_out)
            checked.error("N03", f"no node {target!r} here", at, hint)
        else:
            message = f"the children of {parent.form!r} all run; none follows another"
            checked.error("N07", message, at, f"write `.{target}` to end {parent.form!r}")


def _no_outcome(checked: CheckedChart, placed: PlacedNode, outcome: str, at: Mark) -> None:
    if placed.callee is None and not placed.is_container:
        return  # its outcomes are not known
    if outcome == "timeout":
        checked.error("N05", f"{placed.node.name!r} has no timeout", at, "give it `timeout: 5 s`")
        return
    what = placed.node.target if placed.callee is not None else repr(placed.node.name)
    hint = checked.near(outcome, placed.ends, ("error",))
    if placed.callee is not None and placed.callee.ending:
        hint = f"{hint}; `{placed.callee.ending[0]}` may name others".removeprefix("; ")
    checked.error("N05", f"{what} has no outcome {outcome!r}", at, hint)


def _check_unmapped(checked: CheckedChart, placed: PlacedNode, parent: PlacedNode) -> None:
    node = placed.node
    if parent.node.keeps or (placed.is_container and "timeout" not in node.raw):
        return
    if not placed.is_container and placed.ends.keys() <= node.next.keys():
        return
    said = node.raw.get("next", {})
    if not isinstance(said, dict):
        return  # reported when the file was loaded
    wanted: Iterable[str] = ("timeout",) if placed.is_container else placed.ends
    missing = [outcome for outcome in wanted if outcome not in said]
    if missing:
        at = key_mark_of(node.raw, "next") if "next" in node.raw else node.at
        names = ", ".join(map(repr, missing))
        what = f"{node.name!r} can end with {names}, which leads nowhere"
        hint = f"`next: {{{', '.join(f'{outcome}: …' for outcome in missing)}}}`"
        checked.error("N06", what, at, hint)


def _check_limits(checked: CheckedChart, placed: PlacedNode) -> None:
    """Check `retry`, `autonomy` and `priority`."""
    node = placed.node
    if node.retry is not None:
        for number, outcome in enumerate(node.retry.on):
            if outcome == "timeout" or (outcome not in placed.ends and outcome != "error"):
                listed, at = node.raw["retry"]["on"], mark_of(node.raw, "retry", "on")
                at = listed.values_at[number] if isinstance(listed, Seq) else at
                _no_outcome(checked, placed, outcome, at)
        if placed.guard:
            at, hint = key_mark_of(node.raw, "retry"), "let it go on watching instead"
            checked.warning("S09", "a guard that tries again does not watch meanwhile", at, hint)
    for outcome in node.autonomy:
        at = key_mark_of(node.raw, "autonomy", outcome)
        if outcome in ("error", "timeout"):
            checked.error("N05", f"{outcome!r} never waits for consent", at, "leave it out")
        elif outcome not in placed.ends:
            _no_outcome(checked, placed, outcome, at)
    if node.autonomy and placed.guard:
        at, hint = key_mark_of(node.raw, "autonomy"), "leave it out, or ask after it"
        checked.error("S09", "a guard never waits for consent", at, hint)
    if node.priority and placed.form == "watch" and not placed.guard:
        at, hint = key_mark_of(node.raw, "priority"), "guards stand directly inside any or all"
        checked.warning("S09", "'priority' has a meaning on guards only", at, hint)


def _check_rules(checked: CheckedChart, placed: PlacedNode) -> None:
    children = {child.node.name: child for child in placed.children}
    listed, inside = placed.node.raw["when"], placed.node.raw[placed.form]
    readable = isinstance(inside, Map)
    items = dict(zip(listed.values_at, listed, strict=True))
    for rule in placed.node.when:
        for name, outcome in rule.conditions.items():
            at = mark_of(items[rule.at], "if", name)
            if name in children:
                _check_condition(checked, children[name], outcome, at)
            elif readable and name not in inside:
                at = key_mark_of(items[rule.at], "if", name)
                checked.error("N03", f"no node {name!r} here", at, checked.near(name, children))
        if rule.outcome in RESERVED_OUTCOMES:
            message = f"{rule.outcome!r} is no outcome that a chart can end with"
            checked.error("N07", message, rule.at, "use a name of your own")


def _check_condition(checked: CheckedChart, child: PlacedNode, outcome: str, at: Mark) -> None:
    if outcome == "error":
        message = "an error ends the container before the list is looked at"
        checked.error("N05", message, at, "leave it out")
    elif outcome not in child.ends:
        _no_outcome(checked, child, outcome, at)


def _check_top(checked: CheckedChart) -> None:
    outcomes = checked.chart.outcomes
    if not outcomes and checked.root.node.raw.get("outcomes", []) != []:
        return  # reported when the file was loaded
    parents = {placed.node: placed.parent for placed in checked.nodes}
    for outcome, origins in checked.root.ends.items():
        if outcome in outcomes or outcome in RESERVED_OUTCOMES or not outcome:
            continue
        for origin in origins:
            at = _origin_mark(origin)
            parent = parents[origin[0]] if isinstance(origin[0], Node) else None
            hint = _top_hint(checked, outcome, parent)
            message = f"{outcome!r} leads out of the chart and is not among its outcomes"
            checked.error("N07", message, at, hint)


def _top_hint(checked: CheckedChart, outcome: str, parent: PlacedNode | None) -> str:
    """Hint for an undeclared outcome of the chart; `parent` is that of the node it comes from."""
    outcomes = checked.chart.outcomes
    if not outcomes:
        return f"`outcomes: [{outcome}]`"
    if parent is None:  # it comes from `when`, where outcomes have no dot
        return checked.near(outcome, outcomes)
    if parent.form == "states" and outcome in parent.node.raw["states"]:
        return f"did you mean {outcome!r}, without the dot? `.{outcome}` ends the container"
    return checked.near(f".{outcome}", [f".{known}" for known in (*outcomes, *parent.node.next)])


def _origin_mark(origin: Origin) -> Mark:
    if isinstance(origin[0], Node):
        return mark_of(origin[0].raw, "next", str(origin[1]))
    return origin
