"""The message of a page that shows a chart: its picture and its nodes, and that of a finding.

The picture is that of `cobodeck render`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from functools import cache, lru_cache
from typing import Any

from behaviors.profile import Profile
from cobodeck.live.charts.drawer import Drawer
from cobodeck.live.charts.seen_chart import SeenNode, outcomes_at, path_of, seen_nodes, shown_values
from engine import Interface, Type, as_json, description_of, known_types
from engine.chart import Chart
from engine.draw import MOST_NODES, CannotRender, dot, nodes_shown, value_text
from engine.files import Finding, Map, si_unit


def chart_message(  # noqa: PLR0913  one message says all there is to say
    chart: Chart,
    library: Mapping[str, Chart],
    profile: Profile,
    *,
    interfaces: Mapping[str, Interface] | None = None,
    types: Mapping[str, Type] | None = None,
    unfolded: Collection[str] | None = None,
    stale: bool = False,
    slot: int = 0,
) -> dict[str, Any]:
    """The message `chart`.

    Args:
        chart: the chart, with the values of the profile, as `Setup` and `with_values` give it.
        library: the charts that it uses, likewise.
        profile: the values that constants of charts have.
        interfaces: of the states, by name; without them outcomes are those that charts name.
        types: beyond the built-in ones, by name; of the fields of the form.
        unfolded: the paths of the `use` nodes that are drawn open; None: all.
        stale: the text is broken, this is how it last was.
        slot: which of two charts side by side.
    """
    known, constants = interfaces or {}, profile.constants
    nodes = seen_nodes(chart, library, constants)
    drawn, trouble = picture_of(chart, library, profile, unfolded)
    return {
        "t": "chart",
        "name": chart.name,
        "file": chart.file,
        "svg": drawn,
        "trouble": trouble,
        "nodes": {seen.path: _node(seen, library, known) for seen in nodes},
        "form": list(form_of(chart, constants, types or {})),
        "stale": stale,
        "slot": slot,
    }


def picture_of(
    chart: Chart,
    library: Mapping[str, Chart],
    profile: Profile,
    unfolded: Collection[str] | None = None,
) -> tuple[str, str]:
    """The picture as SVG and, if there is none, why."""
    depth = None if unfolded is None else 0
    if depth is None and nodes_shown(chart.name, library, None) > MOST_NODES:
        depth = 0
    text = dot(chart, library, depth, constants=profile.constants, unfolded=unfolded or ())
    try:
        return _svg(text), ""
    except CannotRender as error:
        return "", str(error)


@lru_cache(maxsize=64)
def _svg(text: str) -> str:
    """The picture of a DOT text; one that was drawn is kept."""
    return _drawer().svg(text)


def stop_drawing() -> None:
    """Let the picture that is being drawn fail, because nobody wants it any more."""
    _drawer().stop()


@cache
def _drawer() -> Drawer:
    return Drawer()


def finding_message(finding: Finding, nodes: list[SeenNode]) -> dict[str, Any]:
    """A finding, with the path of the node that it belongs to."""
    return {**as_json(finding), "path": path_of(finding.place, nodes)}


def form_of(
    chart: Chart, constants: Mapping[str, Any], types: Mapping[str, Type]
) -> Iterator[dict[str, Any]]:
    """The fields with which a chart is started: its parameters and inputs.

    `default` is its value as text; None: it has to be given.
    """
    known = known_types(types)
    for p in chart.parameters.values():
        default = None if p.required else value_text(p.default, constants)
        yield _field(p.name, "parameter", p.type, default, p.about, known)
    for key in chart.inputs.values():
        given = key.has_initial or key.optional
        default = value_text(key.initial, constants) if given else None
        yield _field(key.name, "input", key.type, default, _about_input(chart, key.name), known)


def _field(
    name: str, kind: str, type_: str, default: str | None, about: str, known: Mapping[str, Type]
) -> dict[str, Any]:
    found = known.get(type_)
    return {
        "name": name,
        "kind": kind,
        "unit": si_unit(type_),
        "what": type_ if found is None else description_of(found),
        "default": default,
        "about": about,
    }


def _about_input(chart: Chart, name: str) -> str:
    inputs = chart.root.raw.get("inputs")
    raw = inputs.get(name) if isinstance(inputs, Map) else None
    about = raw.get("about") if isinstance(raw, Map) else None
    return about if isinstance(about, str) else ""


def _node(
    seen: SeenNode, charts: Mapping[str, Chart], interfaces: Mapping[str, Interface]
) -> dict[str, Any]:
    node = seen.node
    return {
        "kind": node.form,
        "target": node.target,
        "about": seen.about,
        "values": shown_values(seen, interfaces),
        "outcomes": outcomes_at(seen, charts, interfaces),
        "break": node.breaks,
        "file": seen.chart.file,
        "line": node.at[0],
    }
