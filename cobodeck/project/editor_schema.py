"""Compares schema files that charts name for editors with what `cobodeck schema` would write."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from cobodeck.project.library import chart_names
from cobodeck.project.state_catalogue import CHARTS, Catalogue, catalogue
from engine.chart import load_files
from engine.files import FileError, SourceFile, is_file, read_text
from engine.schema import schema_text

_MODELINE = re.compile(r"^#\s*yaml-language-server:\s*\$schema=(\S+)", re.MULTILINE)
_LARGEST = 10_000_000  # bytes of a schema


def schema_for(known: Catalogue) -> str:
    """The JSON Schema of charts, with the states and charts of a catalogue."""
    return schema_text(known.interfaces, load_files(chart_names(known).values()), known.types)


def schema_notes(charts: Iterable[SourceFile], known: Catalogue) -> Iterator[str]:
    """A message for each schema file named by charts that is missing or out of date."""
    named: dict[Path, str] = {}
    for chart in charts:
        found = _MODELINE.search(chart.text)
        if found is not None and "://" not in found[1]:
            named.setdefault(Path(chart.file).parent / found[1], chart.file)
    for schema, chart_file in named.items():
        writes = f"`cobodeck schema -o {schema}` writes it anew"
        if not is_file(schema):
            yield f"{chart_file}: names the schema {schema}, which is not there; {writes}"
        elif not _is_current(schema, known):
            yield f"{schema}: is not up to date, editors complete from it; {writes}"


def _is_current(schema: Path, known: Catalogue) -> bool:
    """True if a file has the text that would be written; the shipped one is without projects."""
    is_shipped = schema.resolve().parent == CHARTS.resolve()
    if is_shipped and known.projects:
        known = catalogue(own=False)
    try:
        return read_text(schema, _LARGEST) == schema_for(known)
    except FileError:
        return False
