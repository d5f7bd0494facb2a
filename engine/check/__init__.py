"""Everything that can be found out about charts before anything moves.

Charts are looked at from the used to the using ones, each once: what is known of a used chart
(`Facts`) is all that its users need, so nothing is put in for `use` and nothing recurses. In a
chart all rules about single nodes are applied; those about paths only where all names are known.
engine/CODES.md lists the codes.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from engine.check.arguments import check_arguments
from engine.check.callee import Facts, KnownNames
from engine.check.checked_chart import Subject, grow
from engine.check.declarations import check_declarations
from engine.check.endless import check_endless, report_dead_ends
from engine.check.flow import check_flow
from engine.check.outcomes import check_outcomes
from engine.check.parts import check_parts, report_unmapped, unmapped
from engine.check.reach import check_reach
from engine.check.rules import check_rules
from engine.check.uses import check_recursion, components, measure, uses
from engine.files.finding import Finding, in_order
from engine.load import Library
from engine.state import Interface
from engine.types import Type, known_types

__all__ = ["check"]


def check(
    library: Library,
    interfaces: Mapping[str, Interface],
    *,
    types: Mapping[str, Type] | None = None,
    signals: Collection[str] | None = None,
    parts: Collection[str] | None = None,
) -> list[Finding]:
    """All that is wrong with the charts of a library, in order of place.

    Without an error among the findings, `engine.machine.Machine` can be built from each chart
    whose parameters are given, and a run finds a way for every outcome.

    Args:
        library: charts as loaded; what was found then is in the result too.
        interfaces: the state classes by name.
        types: names of types beyond the built-in ones.
        signals: the declared signals; without them, what classes read is not looked at.
        parts: the parts of the robot; likewise.
    """
    world = KnownNames(library, interfaces, known_types(types or {}), signals, parts)
    subjects = {name: Subject(chart, world) for name, chart in library.items()}
    for subject in subjects.values():
        grow(subject)
    graph = {name: uses(subject) for name, subject in subjects.items()}
    recursive = check_recursion(subjects, graph)
    order = [subjects[name] for component in components(graph) for name in component]
    for subject in order:
        _check_chart(subject, recursive=subject.chart.name in recursive)
    report_dead_ends(order)
    report_unmapped(order)
    found = [finding for subject in order for finding in subject.findings]
    return in_order([*library.findings, *found])


def _check_chart(subject: Subject, *, recursive: bool) -> None:
    check_declarations(subject)
    check_arguments(subject)
    check_outcomes(subject)
    check_rules(subject)
    check_parts(subject)
    vertices, levels = (1, 1) if recursive else measure(subject)
    if subject.sound:
        check_reach(subject)
        check_endless(subject)
        check_flow(subject)
    callee = subject.world.chart(subject.chart.name)
    assert callee is not None
    callee.facts = Facts(
        commands=subject.root.commands,
        unmapped=unmapped(subject.root) is not None,
        instant=subject.root.instant,
        vertices=vertices,
        depth=levels,
        deadlines=subject.deadlines,
    )
