"""The schemas with which editors complete and check files, one for each kind of file."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import nullcontext
from functools import reduce
from pathlib import Path

from cobodeck.project import CHARTS, PLACE, Catalogue, catalogue, chart_names, known_places
from engine.chart import load_files
from engine.files import FileError, SourceFile, is_file, read_text
from engine.files.declared import document, either_of, no_files, text_of, with_own_files
from engine.schema import schema_text

_MODELINE = re.compile(r"^#\s*yaml-language-server:\s*\$schema=(\S+)", re.MULTILINE)
_LARGEST = 10_000_000  # bytes of a schema


def schema_for(kind: str, known: Catalogue) -> str:
    """The JSON Schema of a kind of file; that of charts has the catalogue's states and charts."""
    if kind == "chart":
        return _of_charts(known)
    found = (document(declared, layered=kind == "profile") for declared in declarations(kind))
    return text_of(reduce(either_of, found))


def _of_charts(known: Catalogue) -> str:
    """The schema of charts, with names for values; without a project, the shipped ones."""
    charts = load_files(chart_names(known).values())
    with nullcontext() if known.projects else with_own_files(no_files):
        names = {PLACE: sorted(known_places(charts, known).by_name)}
    constants = {name: constant.value for name, constant in known.tuned.constants.items()}
    return schema_text(known.interfaces, charts, known.types, known.signals, constants, names)


def declarations(kind: str) -> tuple[type, ...]:
    """The dataclasses that declare the keys of a kind of file: of an arm, by lengths or by URDF."""
    if kind == "arm":
        from hw.model import DescribedArmFile

        return declaration(kind), DescribedArmFile
    return (declaration(kind),)


def declaration(kind: str) -> type:
    """The dataclass that declares the keys of a kind of file."""
    from behaviors.profile import ProfileFile
    from cobodeck.campaign import CampaignFile
    from cobodeck.flexbe_states import TopicFile
    from hw.connection import ConnectionFile
    from hw.model import ArmShape, CalibrationFile, PropFile, RobotFile, TrackingFile
    from hw.people.walking import UserFile
    from hw.scene import SceneFile

    declared = {
        "scene": SceneFile,
        "robot": RobotFile,
        "arm": ArmShape,
        "prop": PropFile,
        "user": UserFile,
        "profile": ProfileFile,
        "connection": ConnectionFile,
        "tracking": TrackingFile,
        "calibration": CalibrationFile,
        "campaign": CampaignFile,
        "topics": TopicFile,
    }
    return declared[kind]


def schema_notes(files: Iterable[tuple[str, SourceFile]], known: Catalogue) -> Iterator[str]:
    """A message for each schema that files name and that is missing or out of date.

    Args:
        files: the kind and the text of each.
        known: the states and charts that a schema of charts has to know.
    """
    named: dict[Path, tuple[str, str]] = {}
    for kind, source in files:
        found = _MODELINE.search(source.text)
        if found is not None and "://" not in found[1]:
            named.setdefault(Path(source.file).parent / found[1], (kind, source.file))
    for schema, (kind, file) in named.items():
        command = "schema" if kind == "chart" else f"schema {kind}"
        writes = f"`cobodeck {command} -o {schema}` writes it anew"
        if not is_file(schema):
            yield f"{file}: names the schema {schema}, which is not there; {writes}"
        elif not _is_current(schema, kind, known):
            yield f"{schema}: is not up to date, editors complete from it; {writes}"


def _is_current(schema: Path, kind: str, known: Catalogue) -> bool:
    """True if a file has the text that would be written; the shipped one is without projects."""
    is_shipped = schema.resolve().parent == CHARTS.resolve()
    if is_shipped and known.projects:
        known = catalogue(own=False)
    try:
        return read_text(schema, _LARGEST) == schema_for(kind, known)
    except FileError:
        return False
