"""All static checks of charts, done before anything moves.

Each chart is checked once, used charts before those that use them. What these need to know about
it is summarized in `Facts`, so `use` is never expanded and nothing recurses. Rules about single
nodes apply to every chart, rules about paths only to charts without errors so far.
engine/CODES.md lists the codes.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from engine.chart import Library
from engine.check.callee import Facts, KnownNames
from engine.check.checked_chart import CheckedChart, resolve_names
from engine.check.endless import check_endless, report_dead_ends
from engine.check.flow import check_flow
from engine.check.follow_ups import drop_follow_ups
from engine.check.outcomes import check_outcomes
from engine.check.parts import check_parts, report_unmapped, unmapped
from engine.check.reachability import check_reach
from engine.check.uses import check_recursion, components, measure, uses
from engine.check.values import check_arguments, check_declarations, name_by_nodes
from engine.check.when import check_rules
from engine.files import Finding, in_order
from engine.interfaces import Interface
from engine.machine import NamedValues
from engine.signals import Signal, types_of
from engine.types import Type, known_types

__all__ = ["check"]


def check(
    library: Library,
    interfaces: Mapping[str, Interface],
    *,
    types: Mapping[str, Type] | None = None,
    signals: Collection[str] | Mapping[str, Signal] | None = None,
    parts: Collection[str] | None = None,
    strangers: Mapping[str, str] | None = None,
    around: NamedValues | None = None,
) -> list[Finding]:
    """All findings in the charts of a library, sorted by place.

    If there is no error among them, an `engine.machine.machine.Machine` can be built from each
    chart, given values for its parameters, and every outcome in a run leads somewhere.

    Args:
        library: charts as loaded; their findings of loading are part of the result.
        interfaces: the state classes by name.
        types: types beyond the built-in ones, by name.
        signals: the declared signals, or their names; `None`: what is read is not checked.
        parts: the parts of the robot; `None`: what classes command is not checked.
        strangers: what is no state class although a chart may take it for one, and why, by name.
        around: what names in values may stand for; of its `named`, a run may know others.
    """
    scope = KnownNames(
        library,
        interfaces,
        known_types(types or {}),
        None if signals is None else types_of(signals),
        parts,
        around or NamedValues(),
        strangers or {},
    )
    charts = {name: CheckedChart(chart, scope) for name, chart in library.items()}
    for checked in charts.values():
        resolve_names(checked)
        name_by_nodes(checked)
    graph = {name: uses(checked) for name, checked in charts.items()}
    recursive = check_recursion(charts, graph)
    order = [charts[name] for component in components(graph) for name in component]
    for checked in order:
        _check_chart(checked, recursive=checked.chart.name in recursive)
    report_dead_ends(order)
    report_unmapped(order)
    drop_follow_ups(charts, graph)
    found = [finding for checked in order for finding in checked.findings]
    return in_order([*library.findings, *found])


def _check_chart(checked: CheckedChart, *, recursive: bool) -> None:
    check_declarations(checked)
    check_arguments(checked)
    check_outcomes(checked)
    check_rules(checked)
    check_parts(checked)
    vertices, levels = (1, 1) if recursive else measure(checked)
    if checked.sound:
        check_reach(checked)
        check_endless(checked)
        check_flow(checked)
    callee = checked.scope.chart(checked.chart.name)
    assert callee is not None
    callee.facts = Facts(
        commands=checked.root.commands,
        unmapped=bool(unmapped(checked.root)),
        instant=checked.root.instant,
        vertices=vertices,
        depth=levels,
        limits=checked.limits,
        beside=frozenset(checked.beside),
    )
