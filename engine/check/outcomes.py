"""Where outcomes lead (N03, N05, N06, N07, S09).

Every box is told what it can end with by its children, so that an outcome without a way out is
found at the place where it comes up.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from engine.chart import Node, key_mark_of, mark_of
from engine.check.checked_chart import NodeInPlace, Origin, Subject
from engine.files.source import Map, Mark
from engine.state import RESERVED_OUTCOMES


def check_outcomes(subject: Subject) -> None:
    """Look at all nodes, the inner ones first; notes what each can end with."""
    for site in reversed(subject.sites):
        site.ends = _box_ends(site) if site.box else _leaf_ends(site)
        if site.parent is not None:
            _check_next(subject, site, site.parent)
            _check_unmapped(subject, site, site.parent)
            _check_limits(subject, site)
        if site.node.when:
            _check_rules(subject, site)
    _check_top(subject)


def _leaf_ends(site: NodeInPlace) -> Mapping[str, Sequence[Origin]]:
    node, callee = site.node, site.callee
    if callee is None:  # believe what is said about it
        return {outcome: () for outcome in node.next if outcome != "error"}
    return {**callee.ends, "timeout": ()} if "timeout" in node.raw else callee.ends


def _box_ends(site: NodeInPlace) -> dict[str, list[Origin]]:
    ends: dict[str, list[Origin]] = {}
    node = site.node
    for child in site.children:
        routes = child.node.next
        for outcome, target in routes.items():
            if target[:1] == ".":
                ends.setdefault(target[1:], []).append((child.node, outcome))
        if child.box and not node.keeps:
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
    """Where the items of `when` name their outcomes, by where they begin."""
    if not node.when:
        return {}
    listed = node.raw["when"]
    pairs = zip(listed.values_at, listed, strict=True)
    return {at: mark_of(item, "outcome") for at, item in pairs if isinstance(item, Map)}


def _check_next(subject: Subject, site: NodeInPlace, parent: NodeInPlace) -> None:
    node, siblings = site.node, parent.node.raw[parent.form]
    in_sequence = parent.form == "states"
    for outcome, target in node.next.items():
        if outcome not in site.ends and outcome != "error":
            _no_outcome(subject, site, outcome, key_mark_of(node.raw, "next", outcome))
        if in_sequence and target in siblings:
            continue
        at = mark_of(node.raw, "next", outcome)
        if target[:1] == ".":
            if target[1:] in RESERVED_OUTCOMES or target == ".":
                message = f"{target!r} is no outcome that a chart can end with"
                subject.error("N07", message, at, "use a name of your own, such as `.failed`")
        elif in_sequence:
            ways_out = (f".{outcome}" for outcome in subject.chart.outcomes)
            hint = subject.near(target, siblings, ways_out)
            subject.error("N03", f"no node {target!r} here", at, hint)
        else:
            message = f"the children of {parent.form!r} all run; none follows another"
            subject.error("N07", message, at, f"write `.{target}` to end {parent.form!r}")


def _no_outcome(subject: Subject, site: NodeInPlace, outcome: str, at: Mark) -> None:
    if site.callee is None and not site.box:
        return  # nobody knows its outcomes
    if outcome == "timeout":
        subject.error("N05", f"{site.node.name!r} has no timeout", at, "give it `timeout: 5 s`")
        return
    what = site.node.target if site.callee is not None else repr(site.node.name)
    hint = subject.near(outcome, site.ends, ("error",))
    subject.error("N05", f"{what} has no outcome {outcome!r}", at, hint)


def _check_unmapped(subject: Subject, site: NodeInPlace, parent: NodeInPlace) -> None:
    node = site.node
    if parent.node.keeps or (site.box and "timeout" not in node.raw):
        return
    if not site.box and site.ends.keys() <= node.next.keys():
        return
    said = node.raw.get("next", {})
    if not isinstance(said, dict):
        return  # its shape has been complained about
    wanted: Iterable[str] = ("timeout",) if site.box else site.ends
    missing = [outcome for outcome in wanted if outcome not in said]
    if missing:
        at = key_mark_of(node.raw, "next") if "next" in node.raw else node.at
        names = ", ".join(map(repr, missing))
        what = f"{node.name!r} can end with {names}, which leads nowhere"
        hint = f"`next: {{{', '.join(f'{outcome}: …' for outcome in missing)}}}`"
        subject.error("N06", what, at, hint)


def _check_limits(subject: Subject, site: NodeInPlace) -> None:
    """`retry`, `autonomy` and `priority`."""
    node = site.node
    if node.retry is not None:
        for outcome in node.retry.on:
            if outcome == "timeout" or (outcome not in site.ends and outcome != "error"):
                _no_outcome(subject, site, outcome, mark_of(node.raw, "retry", "on"))
        if site.guard:
            at, hint = key_mark_of(node.raw, "retry"), "let it go on watching instead"
            subject.warning("S09", "a guard that tries again does not watch meanwhile", at, hint)
    for outcome in node.autonomy:
        at = key_mark_of(node.raw, "autonomy", outcome)
        if outcome in ("error", "timeout"):
            subject.error("N05", f"{outcome!r} never waits for consent", at, "leave it out")
        elif outcome not in site.ends:
            _no_outcome(subject, site, outcome, at)
    if node.autonomy and site.guard:
        at, hint = key_mark_of(node.raw, "autonomy"), "leave it out, or ask after it"
        subject.error("S09", "a guard never waits for consent", at, hint)
    if node.priority and site.form == "watch" and not site.guard:
        at, hint = key_mark_of(node.raw, "priority"), "guards stand directly inside any or all"
        subject.warning("S09", "'priority' has a meaning on guards only", at, hint)


def _check_rules(subject: Subject, site: NodeInPlace) -> None:
    children = {child.node.name: child for child in site.children}
    listed, inside = site.node.raw["when"], site.node.raw[site.form]
    readable = isinstance(inside, Map)
    items = dict(zip(listed.values_at, listed, strict=True))
    for rule in site.node.when:
        for name, outcome in rule.conditions.items():
            at = mark_of(items[rule.at], "if", name)
            if name in children:
                _check_condition(subject, children[name], outcome, at)
            elif readable and name not in inside:
                at = key_mark_of(items[rule.at], "if", name)
                subject.error("N03", f"no node {name!r} here", at, subject.near(name, children))
        if rule.outcome in RESERVED_OUTCOMES:
            message = f"{rule.outcome!r} is no outcome that a chart can end with"
            subject.error("N07", message, rule.at, "use a name of your own")


def _check_condition(subject: Subject, child: NodeInPlace, outcome: str, at: Mark) -> None:
    if outcome == "error":
        message = "an error ends the box before the list is looked at"
        subject.error("N05", message, at, "leave it out")
    elif outcome not in child.ends:
        _no_outcome(subject, child, outcome, at)


def _check_top(subject: Subject) -> None:
    outcomes = subject.chart.outcomes
    if not outcomes and subject.root.node.raw.get("outcomes", []) != []:
        return  # their shape has been complained about
    parents = {site.node: site.parent for site in subject.sites}
    for outcome, origins in subject.root.ends.items():
        if outcome in outcomes or outcome in RESERVED_OUTCOMES or not outcome:
            continue
        for origin in origins:
            at = _origin_mark(origin)
            parent = parents[origin[0]] if isinstance(origin[0], Node) else None
            hint = _top_hint(subject, outcome, parent)
            message = f"{outcome!r} leads out of the chart and is not among its outcomes"
            subject.error("N07", message, at, hint)


def _top_hint(subject: Subject, outcome: str, parent: NodeInPlace | None) -> str:
    """Help with an outcome of the chart that is not declared; `parent`: of the node it leaves."""
    outcomes = subject.chart.outcomes
    if not outcomes:
        return f"`outcomes: [{outcome}]`"
    if parent is None:  # of `when`, where outcomes have no dot
        return subject.near(outcome, outcomes)
    if parent.form == "states" and outcome in parent.node.raw["states"]:
        return f"did you mean {outcome!r}, without the dot? `.{outcome}` ends the container"
    return subject.near(f".{outcome}", [f".{known}" for known in outcomes])


def _origin_mark(origin: Origin) -> Mark:
    if isinstance(origin[0], Node):
        return mark_of(origin[0].raw, "next", str(origin[1]))
    return origin
