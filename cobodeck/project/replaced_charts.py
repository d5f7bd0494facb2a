"""Charts in the place of shipped ones: what their users ask of them, and whether they fit.

Who replaces a shipped chart cannot change those that use it. What these give and map is no mistake
of the replacement; what does not fit them is told in its file, once for each of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from cobodeck.project.chart_files import is_replacement, shipped_by_name
from cobodeck.project.state_catalogue import shipped_charts
from engine.chart import Chart, Node, mark_of
from engine.files import Finding, Place

MOST_NOTES = 3
"""Misfits that one finding lists."""
_OF_INTERFACE = ("F04", "S02")


def name_place(chart: Chart) -> Place:
    """The place of a chart's name in its file."""
    return chart.place(mark_of(chart.source.value, "chart"))


def is_shipped(chart: Chart) -> bool:
    """Whether it is one of the shipped charts."""
    return Path(chart.file).resolve() in {file.resolve() for file in shipped_charts()}


def told_of_replacements(
    findings: Iterable[Finding], library: Mapping[str, Chart]
) -> list[Finding]:
    """The findings as they concern whoever has replaced shipped charts.

    Left out is what a replacement does not use and its users need. Errors of shipped charts where
    they use a replacement are one finding in its file; others get a note.
    """
    charts = {chart.file: chart for chart in library.values()}
    shipped = shipped_by_name()
    needed = {
        place
        for chart in library.values()
        if is_replacement(chart.name, chart.file, shipped)
        for place in _needed(chart, library)
    }
    found: list[Finding] = []
    misfits: dict[tuple[str, str], list[Finding]] = {}
    for finding in findings:
        if finding.code in _OF_INTERFACE and finding.place in needed:
            continue
        user = charts.get(finding.place.file)
        used = None if user is None else _replacement_at(finding, user, library, shipped)
        if user is None or used is None:
            found.append(finding)
        elif finding.severity == "error" and is_shipped(user):
            misfits.setdefault((used.name, user.name), []).append(finding)
        else:
            note = (name_place(used), "replaces the shipped chart")
            found.append(replace(finding, related=(*finding.related, note)))
    told = (_misfit(library[name], library[user], all_) for (name, user), all_ in misfits.items())
    return [*found, *told]


def _replacement_at(
    finding: Finding, user: Chart, library: Mapping[str, Chart], shipped: Mapping[str, Path]
) -> Chart | None:
    """The replacement that is used where a finding is."""
    above = [node for node in user.root.walk() if node.at[0] <= finding.place.line]
    used = library.get(above[-1].target) if above and above[-1].form == "use" else None
    if used is None or not is_replacement(used.name, used.file, shipped):
        return None
    return used


def _misfit(chart: Chart, user: Chart, errors: list[Finding]) -> Finding:
    """One finding for all the errors of a shipped chart where it uses a replacement."""
    message = f"chart {chart.name!r} replaces the shipped one and does not fit {user.name!r}"
    notes = tuple((error.place, error.message) for error in errors[:MOST_NOTES])
    place = name_place(chart)
    return Finding(errors[0].code, message, place, _how_used(chart.name, user), related=notes)


def _how_used(name: str, user: Chart) -> str:
    """What a chart gives to the one that it uses by this name, and expects of it."""
    nodes = list(_uses(name, user))
    sections = {
        "parameters": [word for node in nodes for word in node.parameters],
        "inputs": [word for node in nodes for word in node.inputs],
        "outputs": [word for node in nodes for word in node.outputs],
        "outcomes": [word for node in nodes for word in node.next if word != "error"],
    }
    told = (
        f"{what} {', '.join(dict.fromkeys(words))}" for what, words in sections.items() if words
    )
    return f"{user.name} uses it with {'; '.join(told)}"


def _uses(name: str, user: Chart) -> Iterator[Node]:
    """The nodes of a chart that use the one of this name."""
    return (node for node in user.root.walk() if node.form == "use" and node.target == name)


def _needed(chart: Chart, library: Mapping[str, Chart]) -> Iterator[Place]:
    """The places in a chart where what other charts give it, or map, is declared."""
    nodes = [node for user in library.values() for node in _uses(chart.name, user)]
    given = {name for node in nodes for name in (*node.parameters, *node.inputs)}
    yield from (chart.place(p.at) for name, p in chart.parameters.items() if name in given)
    yield from (chart.place(key.at) for name, key in chart.inputs.items() if name in given)
    mapped = {outcome for node in nodes for outcome in node.next}
    listed = chart.root.raw.get("outcomes")
    for outcome, at in zip(listed, listed.values_at, strict=True) if listed else ():
        if outcome in mapped:
            yield chart.place(at)
