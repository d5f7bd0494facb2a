"""Charts from files: those that are requested, and those that they may use.

Charts refer to each other by `use`. A chart that is not among the given files is looked up in
their folders, then in the projects, then among the shipped charts; the first match counts.
"""

from __future__ import annotations

import os
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from cobodeck.project.named_files import head_of, kind_of
from cobodeck.project.names_in_values import known_names
from cobodeck.project.state_catalogue import Catalogue, shipped_charts
from cobodeck.terminal import FAILED, Problem
from engine import text
from engine.chart import Chart, Library, load_files
from engine.check import check
from engine.files import MAX_BYTES, FileError, Finding, SourceFile, did_you_mean, read_text
from engine.files.declared import YAML

SKIPPED = frozenset((".git", ".venv", "venv", "node_modules", "build", "dist", "__pycache__"))


def files_in(paths: Iterable[Path]) -> list[tuple[Path, str]]:
    """The files given, with their kinds; of a folder only the YAML files of a known kind.

    A given file of no known kind counts as a chart, so that its findings say what is missing.

    Raises:
        Problem: a path does not exist, is no regular file, or is a folder without such files.
    """
    found: dict[Path, str] = {}
    for path in paths:
        if path.is_dir():
            kinds = {file: kind_of(file) for file in yaml_files(path)}
            inside = {file: kind for file, kind in kinds.items() if kind is not None}
            if not inside:
                raise Problem(f"{path}: no charts, scenes, robots … in this folder")
            found |= inside
        elif path.is_file():
            found[path] = kind_of(path) or "chart"
        else:
            if path.exists():
                raise Problem(f"{path}: is no regular file", FAILED)
            raise Problem(f"{path}: no such file or folder")
    return list(found.items())


def yaml_files(folder: Path) -> Iterator[Path]:
    """The YAML files in a folder and below; hidden folders and those in `SKIPPED` are left out."""
    for place, folders, files in os.walk(folder):
        folders[:] = sorted(f for f in folders if not f.startswith(".") and f not in SKIPPED)
        yield from (Path(place, f) for f in sorted(files) if f.endswith(YAML))


def load_beside(files: Sequence[Path], catalogue: Catalogue) -> Library:
    """The charts of `files`, then those they may use; the findings are those of `files` alone."""
    library = load_files(files)
    beside = _Beside(files)
    while names := used_charts(library.values(), library) & beside.files.keys():
        for name in sorted(names):
            _add(library, beside.files.pop(name))
    for file in (*_own_charts(catalogue), *shipped_charts()):
        _add(library, file)
    if used_charts(library.values(), library):  # a misspelt name: load more for `did you mean`
        for file in beside.files.values():
            _add(library, file)
    return library


def _yaml_in(folder: Path) -> set[Path]:
    return {file for ending in YAML for file in folder.glob(f"*{ending}")}


class _Beside:
    """Chart files in the same folders as the given files, by the chart's name."""

    def __init__(self, files: Sequence[Path]) -> None:
        self.files: dict[str, Path] = {}
        for folder in dict.fromkeys(file.parent for file in files):
            for file in sorted(_yaml_in(folder).difference(files)):
                head = head_of(file)
                if head is not None and head[0] == "chart":
                    self.files.setdefault(head[1], file)


def _add(library: Library, file: Path) -> None:
    """Add the charts in a file whose names are not taken; their findings are left out."""
    for name, chart in load_files([file]).items():
        if name not in library:
            library[name] = chart
            library.sources[chart.file] = chart.source


def _own_charts(catalogue: Catalogue) -> list[Path]:
    files = [file for project in catalogue.projects for file in project.yaml_files()]
    return [file for file in files if kind_of(file) == "chart"]


def used_charts(charts: Iterable[Chart], known: Container[str]) -> set[str]:
    """The names of charts that these charts `use` and that are not `known`."""
    named = {node.target for c in charts for node in c.root.walk() if node.form == "use"}
    return {name for name in named if name not in known}


def findings_of(library: Library, catalogue: Catalogue, files: Iterable[Path]) -> list[Finding]:
    """Check a library; returns the findings in `files`, in order."""
    named = {str(file) for file in files}
    found = check(
        library,
        catalogue.interfaces,
        types=catalogue.types,
        signals=catalogue.signals,
        parts=catalogue.parts,
        strangers=catalogue.strangers,
        around=known_names(library, catalogue),
    )
    return [finding for finding in found if finding.place.file in named]


def strictly(findings: Iterable[Finding]) -> list[Finding]:
    """The findings, with warnings as errors; notes stay notes."""
    return [f if f.severity == "note" else replace(f, severity="error") for f in findings]


def chart_file(name_or_path: str, catalogue: Catalogue) -> Path:
    """The file of a chart given by name or by path.

    Raises:
        Problem: there is no such chart.
    """
    path = Path(name_or_path)
    if path.suffix in YAML or path.is_file():
        if path.is_file():
            return path
        raise Problem(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}")
    names = chart_names(catalogue)
    if name_or_path in names:
        return names[name_or_path]
    raise Problem(f"no chart {name_or_path!r}; {did_you_mean(name_or_path, names)}")


def chart_names(catalogue: Catalogue) -> dict[str, Path]:
    """All charts by name: those of projects and the shipped ones."""
    found: dict[str, Path] = {}
    for file in (*_own_charts(catalogue), *shipped_charts()):
        head = head_of(file)
        if head is not None:
            found.setdefault(head[1], file)
    return found


def open_chart(name_or_path: str, catalogue: Catalogue) -> tuple[Chart, Library]:
    """A chart that can run, and the library of charts that it may use.

    Raises:
        Problem: it cannot run; the text shows every error.
    """
    file = chart_file(name_or_path, catalogue)
    library = load_beside([file], catalogue)
    findings = findings_of(library, catalogue, [file])
    errors = [finding for finding in findings if finding.severity == "error"]
    errors += errors_in_used(library, catalogue, [file])
    if errors:
        sources = {f.place.file: library.sources[f.place.file] for f in errors}
        raise Problem(f"{file} cannot run\n{text(errors, sources)}".rstrip(), FAILED)
    return next(chart for chart in library.values() if chart.file == str(file)), library


def errors_in_used(library: Library, catalogue: Catalogue, files: Iterable[Path]) -> list[Finding]:
    """Errors outside `files`, in used charts, that keep the charts in `files` from running."""
    named = {str(file) for file in files}
    own = {name for name, chart in library.items() if chart.file in named}
    used = {library[name].file for name in reached(own, library)} - named
    if not used:
        return []
    found = findings_of(library, catalogue, map(Path, sorted(used)))
    return [finding for finding in found if finding.severity == "error"]


def reached(names: Iterable[str], library: Mapping[str, Chart]) -> set[str]:
    """The names of these charts and of all that they use, directly or indirectly."""
    found = set(names)
    while more := used_charts([library[name] for name in found], found) & library.keys():
        found |= more
    return found


def read_source(file: str) -> SourceFile:
    """The text of any file, for showing findings in it."""
    try:
        return SourceFile(file, read_text(Path(file), MAX_BYTES))
    except FileError:
        return SourceFile(file, "")
