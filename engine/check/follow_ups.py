"""Findings that are only echoes of a mistake in another chart, and go with it.

A chart whose declarations are wrong seems to lack outcomes, inputs and parameters to those that use
it; and what is never reached or never handled depends on the charts around.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping

from engine.check.checked_chart import CheckedChart
from engine.files import Finding

OF_CALLEE = ("N05", "N06", "N08", "N10")
"""Codes of what does not fit the chart that a node uses."""
_OF_PATHS = ("F", "S")
_UNREAD = "CY"
_QUOTED = re.compile(r"'([^']*)'")


def drop_follow_ups(
    charts: Mapping[str, CheckedChart], graph: Mapping[str, Collection[str]]
) -> None:
    """Take the echoes out of the findings of all charts; `graph` says which others each uses."""
    wrong = {name: _errors(checked) for name, checked in charts.items() if not checked.sound}
    around = _reached(wrong, graph) | _reached(wrong, _turned(graph))
    is_unclear = any(error.code == "N02" for errors in wrong.values() for error in errors)
    for name, checked in charts.items():
        used = {other: wrong[other] for other in graph[name] if other in wrong and other != name}
        is_doubtful = name in around or _uses_unread(checked)
        doubted = (*(_OF_PATHS if is_doubtful else ()), *(("S10",) if is_unclear else ()))
        if doubted and checked.findings:
            checked.findings[:] = [
                found
                for found in checked.findings
                if not (_is_warning(found, doubted) or _echoes(found, used))
            ]


def _errors(checked: CheckedChart) -> list[Finding]:
    found = (*checked.chart.source.findings, *checked.findings)
    return [finding for finding in found if finding.severity == "error"]


def _uses_unread(checked: CheckedChart) -> bool:
    """Whether it uses a chart that could not be read."""
    library = checked.scope.library
    return any(p.form == "use" and p.node.target not in library for p in checked.nodes)


def _is_warning(found: Finding, doubted: tuple[str, ...]) -> bool:
    return found.severity != "error" and found.code.startswith(doubted)


def _echoes(found: Finding, used: Mapping[str, list[Finding]]) -> bool:
    """Whether it misses in a used chart what is wrong there: all, if that could not be read."""
    if found.code not in OF_CALLEE:
        return False
    for name, errors in used.items():
        if found.message.startswith(f"{name} "):
            missing = set(_QUOTED.findall(found.message))
            return any(e.code[0] in _UNREAD or missing & set(_names_in(e)) for e in errors)
    return False


def _names_in(error: Finding) -> Iterator[str]:
    yield from _QUOTED.findall(error.message)
    yield error.message.partition(":")[0]


def _reached(start: Iterable[str], graph: Mapping[str, Collection[str]]) -> set[str]:
    """What one of these leads to, directly or indirectly."""
    found: set[str] = set()
    waiting = list(start)
    while waiting:
        new = [name for name in graph.get(waiting.pop(), ()) if name not in found]
        found.update(new)
        waiting += new
    return found


def _turned(graph: Mapping[str, Collection[str]]) -> dict[str, list[str]]:
    """For each chart those that use it."""
    found: dict[str, list[str]] = {}
    for name, used in graph.items():
        for other in used:
            found.setdefault(other, []).append(name)
    return found
