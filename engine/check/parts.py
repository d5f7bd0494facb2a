"""Signals and parts (N12, S08, S10)."""

from __future__ import annotations

from collections.abc import Iterable

from engine.chart import mark_of
from engine.check.checked_chart import NodeInPlace, Subject


def check_parts(subject: Subject) -> None:
    """Look at all nodes, the inner ones first; notes which parts each commands."""
    for site in reversed(subject.sites):
        if site.box:
            site.commands = frozenset().union(*[child.commands for child in site.children])
            if site.form != "states" and site.commands:
                _check_shared(subject, site)
        elif site.callee is not None:
            site.commands = site.callee.facts.commands
    _check_known(subject)


def _check_shared(subject: Subject, site: NodeInPlace) -> None:
    """S08: what runs at the same time commands different parts."""
    owners: dict[str, NodeInPlace] = {}
    for child in site.children:
        for part in sorted(child.commands):
            owner = owners.setdefault(part, child)
            if owner is not child:
                names = f"{owner.node.name!r} and {child.node.name!r}"
                message = f"{names} both command {part!r} at the same time"
                first = (owner.node.at, "one of them")
                hint = "put them one after the other"
                subject.error("S08", message, child.node.at, hint, first)


def _check_known(subject: Subject) -> None:
    """N12: signals and parts exist; said once for each class."""
    world = subject.world
    if world.signals is None and world.parts is None:
        return
    for site in subject.sites:
        interface = world.interfaces.get(site.node.target)
        if site.form not in ("do", "watch") or interface is None:
            continue
        if interface.name not in world.looked_at:
            world.looked_at.add(interface.name)
            _check_names(subject, site, "signal", interface.reads, world.signals)
            _check_names(subject, site, "part", interface.commands, world.parts)


def _check_names(
    subject: Subject,
    site: NodeInPlace,
    what: str,
    names: Iterable[str],
    known: Iterable[str] | None,
) -> None:
    verb = {"signal": "reads", "part": "commands"}[what]
    for name in names if known is not None else ():
        if name not in (known or ()):
            message = f"{site.node.target} {verb} {name!r}, and there is no such {what}"
            at = mark_of(site.node.raw, site.form)
            subject.error("N12", message, at, subject.near(name, known or ()))


def unmapped(site: NodeInPlace) -> NodeInPlace | None:
    """The first leaf or `use` in `site` that commands a part and whose error comes out of it.

    A node to which errors lead is left out: it is there to tell somebody.
    """
    if "error" in site.node.next:
        return None
    if site.callee is not None:
        facts = site.callee.facts
        return site if facts.commands and facts.unmapped else None
    told = {child.node.next.get("error") for child in site.children}
    open_ones = (child for child in site.children if child.node.name not in told)
    return next((found for child in open_ones if (found := unmapped(child))), None)


def report_unmapped(subjects: Iterable[Subject]) -> None:
    """S10, for charts that no other one uses; the others can have it mapped where they are used."""
    subjects = list(subjects)
    used = {s.node.target for subject in subjects for s in subject.sites if s.form == "use"}
    for subject in subjects:
        found = unmapped(subject.root) if subject.chart.name not in used else None
        if found is not None:
            hint = "`next: {error: …}` here, or on what encloses it"
            message = f"an error of {found.node.name!r} leads out of the chart, and nobody is told"
            subject.warning("S10", message, found.node.at, hint)
