"""Checks of signals and parts (N12, S08, S10)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from itertools import chain, product

from engine.chart import Reference, mark_of
from engine.check.callee import Callee
from engine.check.checked_chart import CheckedChart, PlacedNode
from engine.interfaces import What
from engine.state import State

MOST_NOTES = 7  # maximum number of further nodes that one finding names


def check_parts(checked: CheckedChart) -> None:
    """Check all nodes, the inner ones first, and note which parts each commands."""
    for placed in reversed(checked.nodes):
        if placed.is_container:
            placed.commands = frozenset().union(*[child.commands for child in placed.children])
            if placed.form != "states" and placed.commands:
                _check_shared(checked, placed)
        elif placed.form == "use" and placed.callee is not None:
            _note_used(checked, placed, placed.callee)
        elif placed.callee is not None:
            placed.commands = placed.callee.facts.commands
    _check_defaults(checked)
    _check_known(checked)


def _check_defaults(checked: CheckedChart) -> None:
    """S08: with the chart's own defaults, concurrent nodes command different parts."""
    for (first, second), (owner, other) in [*checked.beside.items()]:
        shared = {*_by_default(checked, first)} & {*_by_default(checked, second)}
        if shared:
            message = f"by default {first} and {second} are the same part, {min(shared)!r}"
            related = () if owner is other else ((owner.node.at, "one of them"),)
            hint = "give one of them another default"
            checked.error("S08", message, other.node.at, hint, *related)


def _by_default(checked: CheckedChart, name: str) -> tuple[str, ...]:
    """The parts that a name, or the default of a parameter, stands for."""
    if name[0] != "$":
        return (name,)
    declared = checked.chart.parameters.get(name[1:])
    value = None if declared is None else checked.scope.meant(declared.default)
    return tuple(str(item) for item in (value if isinstance(value, list) else [value]) if item)


def _note_used(checked: CheckedChart, placed: PlacedNode, callee: Callee) -> None:
    """Note what a used chart commands, with the parts that this node names; N12, S08 among them."""
    named = {name: _parts_of(checked, placed, name) for name in callee.facts.commands}
    placed.commands = frozenset(chain.from_iterable(named.values()))
    for first, second in callee.facts.beside:
        for one, other in product(named[first], named[second]):
            _note_beside(checked, placed, one, other, placed)
    for name in named if checked.scope.parts is not None else ():
        if name[0] == "$":
            _check_named_parts(checked, [placed], name[1:], checked.scope.parts or ())


def _parts_of(checked: CheckedChart, placed: PlacedNode, name: str) -> tuple[str, ...]:
    """What a part is called here that a used chart commands, by its name or by `$parameter`."""
    if name[0] != "$":
        return (name,)
    scope = checked.scope
    declared = scope.library[placed.node.target].parameters.get(name[1:])
    default = None if declared is None else declared.default
    value = scope.meant(placed.node.parameters.get(name[1:], default))
    if isinstance(value, Reference):
        return (f"${value.name}",)
    return tuple(map(str, value if isinstance(value, list) else [value] if value else ()))


def _note_beside(
    checked: CheckedChart, owner: PlacedNode, first: str, second: str, other: PlacedNode
) -> None:
    """Two nodes that run side by side command these parts, of which parameters may name some."""
    if first == second:
        names = f"{owner.node.name!r} and {other.node.name!r} both command"
        names = f"nodes in {owner.node.name!r} command" if owner is other else names
        message = f"{names} {first!r} at the same time"
        related = () if owner is other else ((owner.node.at, "one of them"),)
        checked.error("S08", message, other.node.at, "put them one after the other", *related)
    elif "$" in (first[0], second[0]):
        pair = (min(first, second), max(first, second))
        checked.beside.setdefault(pair, (owner, other))


def _check_shared(checked: CheckedChart, placed: PlacedNode) -> None:
    """S08: concurrent nodes command different parts."""
    owners: dict[str, PlacedNode] = {}
    for child in placed.children:
        for part in sorted(child.commands):
            owner = owners.setdefault(part, child)
            if owner is not child:
                _note_beside(checked, owner, part, part, child)
    named = [part for part in owners if part[0] == "$"]
    for part in named:
        for other, owner in owners.items():
            if owner is not owners[part]:
                _note_beside(checked, owners[part], part, other, owner)


def _check_known(checked: CheckedChart) -> None:
    """N12: signals and parts exist; one finding per class and name, with the nodes concerned."""
    scope = checked.scope
    if scope.signals is None and scope.parts is None:
        return
    users: dict[str, list[PlacedNode]] = {}
    for placed in checked.nodes:
        if placed.form in ("do", "watch") and placed.node.target in scope.interfaces:
            users.setdefault(placed.node.target, []).append(placed)
    for name, nodes in users.items():
        interface = scope.interfaces[name]
        _check_names(checked, nodes, "signal", interface.reads, scope.signals)
        _check_names(checked, nodes, "part", interface.commands, scope.parts)
        for template in interface.commands if scope.parts is not None else ():
            if template[0] == "$":
                known, means = scope.parts or (), interface.stands_for
                _check_named_parts(checked, nodes, template[1:], known, means)


def _check_names(
    checked: CheckedChart,
    nodes: Sequence[PlacedNode],
    what: str,
    names: Iterable[str],
    known: Collection[str] | None,
) -> None:
    if known is None:
        return
    verb = {"signal": "reads", "part": "commands"}[what]
    first, *others = (mark_of(placed.node.raw, placed.form) for placed in nodes)
    for name in names:
        if name[0] != "$" and name not in known:
            message = f"{nodes[0].node.target} {verb} {name!r}, and there is no such {what}"
            also = ((mark, "and here") for mark in others[:MOST_NOTES])
            checked.error("N12", message, first, checked.near(name, known), *also)


def _check_named_parts(
    checked: CheckedChart,
    nodes: Sequence[PlacedNode],
    parameter: str,
    known: Collection[str],
    means: Callable[[str, What], tuple[str, ...]] = State.stands_for,
) -> None:
    """N12: the parts that a parameter of these nodes names exist."""
    for placed in nodes:
        value = checked.scope.meant(placed.node.parameters.get(parameter))
        at, what = mark_of(placed.node.raw, "with", parameter), parameter
        declared = checked.chart.parameters.get(getattr(value, "name", ""))
        if declared is not None and isinstance(declared.default, str):
            value, what = declared.default, declared.name
            at = checked.chart.declared_mark("parameters", what, "default")
        given = value if isinstance(value, list) else [value]
        texts = [name for name in given if isinstance(name, str)]
        for name in (part for text in texts for part in means(text, "part")):
            if name not in known:
                message, hint = f"{what}: there is no part {name!r}", checked.near(name, known)
                checked.error("N12", message, at, hint)


def unmapped(placed: PlacedNode) -> list[PlacedNode]:
    """The leaves and `use` nodes in `placed` that command a part and whose errors leave it.

    Nodes that errors lead to are left out, as they are the ones that handle them.
    """
    if "error" in placed.node.next:
        return []
    if placed.callee is not None:
        facts = placed.callee.facts
        return [placed] if facts.commands and facts.unmapped else []
    handlers = {child.node.next.get("error") for child in placed.children}
    open_ones = (child for child in placed.children if child.node.name not in handlers)
    return [found for child in open_ones for found in unmapped(child)]


def report_unmapped(charts: Sequence[CheckedChart]) -> None:
    """S10, for charts that no other chart uses; errors of the others can be mapped at the `use`."""
    used = {s.node.target for checked in charts for s in checked.nodes if s.form == "use"}
    for checked in charts:
        found = unmapped(checked.root) if checked.chart.name not in used else []
        if found:
            names = " or ".join(repr(placed.node.name) for placed in found[: MOST_NOTES + 1])
            also = ((placed.node.at, "and here") for placed in found[1 : MOST_NOTES + 1])
            hint = "`next: {error: …}` here, or on what encloses it"
            message = f"an error of {names} ends the chart; nothing handles it"
            checked.warning("S10", message, found[0].node.at, hint, *also)
