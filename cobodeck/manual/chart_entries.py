"""The page of charts: what each takes, how it ends, and what it hands on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cobodeck.manual.page import ManualPage, PageBlock, PageEntry, PageTable, sentence, table_of
from cobodeck.manual.wording import REQUIRED
from cobodeck.project import CHARTS, Catalogue
from engine.chart import Chart, DataKey, Parameter
from engine.draw import value_text
from engine.files import written_text

_ABOUT = (
    "What a chart can name with `use`, and `cobodeck simulate` and `run` can run. Parameters are "
    "given under `with`, inputs under `in`. Where a default is picked from the profile, its value "
    "in the default profile is told. Every chart can also end with `error`.",
)


def chart_page(known: Catalogue, charts: Mapping[str, Chart]) -> ManualPage:
    """The page of these charts; the defaults of their parameters are those of a profile."""
    entries = tuple(_entry(charts[name], known) for name in sorted(charts))
    return ManualPage("charts", "Charts", _ABOUT, entries)


def _entry(chart: Chart, known: Catalogue) -> PageEntry:
    blocks: list[PageBlock] = [chart.about] if chart.about else []
    blocks += _outcomes(chart)
    blocks += _parameters(chart.parameters)
    blocks += _keys("input", chart.inputs)
    blocks += _keys("data", {name: key for name, key in chart.keys.items() if not key.is_input})
    blocks += _inside(chart, known)
    is_own = CHARTS.resolve() not in Path(chart.file).resolve().parents
    return PageEntry(chart.name, tuple(blocks), is_own)


def _outcomes(chart: Chart) -> tuple[PageTable | str, ...]:
    if not chart.outcomes:
        return ("It has no outcomes: it goes on until something else ends it.",)
    rows = [
        (outcome, ", ".join(f"{k}: {kind}" for k, kind in chart.outputs.get(outcome, {}).items()))
        for outcome in chart.outcomes
    ]
    return table_of(("outcome", "outputs"), rows)


def _parameters(parameters: Mapping[str, Parameter]) -> tuple[PageTable, ...]:
    rows = [
        (
            p.name,
            p.type,
            REQUIRED if p.required else value_text(p.default, {}),
            p.origin,
            sentence(p.about),
        )
        for p in parameters.values()
    ]
    return table_of(("parameter", "type", "default", "from", "meaning"), rows)


def _keys(head: str, keys: Mapping[str, DataKey]) -> tuple[PageTable, ...]:
    start = "default" if head == "input" else "initial"
    rows = [(key.name, key.type, _start(key, head), sentence(key.about)) for key in keys.values()]
    return table_of((head, "type", start, "meaning"), rows)


def _start(key: DataKey, head: str) -> str:
    if key.has_initial:
        return written_text(key.initial)
    if key.optional:
        return "none"
    return REQUIRED if head == "input" else ""


def _inside(chart: Chart, known: Catalogue) -> list[PageBlock]:
    """The charts and states that it uses, and its file within the project or what is shipped."""
    nodes = list(chart.root.walk())
    told = []
    for form, what in (("use", "charts"), ("do", "actions"), ("watch", "monitors")):
        names = dict.fromkeys(node.target for node in nodes if node.form == form)
        if names:
            told.append(f"Uses the {what} {', '.join(f'`{name}`' for name in names)}.")
    return [" ".join([*told, f"File: `{_file(chart, known)}`."])]


def _file(chart: Chart, known: Catalogue) -> str:
    """The path from the folder of the project, or of what is shipped, on."""
    file = Path(chart.file).resolve()
    folders = [project.folder for project in known.projects if project.folder is not None]
    for base in (CHARTS.parent, *folders):
        if file.is_relative_to(base.resolve()):
            return file.relative_to(base.resolve()).as_posix()
    return file.name
