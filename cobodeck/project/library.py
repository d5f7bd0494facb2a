"""Charts from files: those that are requested, and those that they may use.

Charts refer to each other by `use`. A chart that is not among the given files is looked up in
their folders, then in the projects, then among the shipped charts; the first match counts, for
shipped charts that use it, too.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from cobodeck.project.chart_files import (
    chart_file,
    chart_names,
    charts_beside,
    is_replacement,
    own_replacements,
    shipped_by_name,
    twins,
)
from cobodeck.project.named_files import kind_of
from cobodeck.project.names_in_values import known_names
from cobodeck.project.project import folder_of_project, is_project
from cobodeck.project.replaced_charts import is_shipped, name_place, told_of_replacements
from cobodeck.project.state_catalogue import Catalogue
from cobodeck.terminal import FAILED, Problem
from engine import text
from engine.chart import Chart, Library, load_files
from engine.check import check
from engine.files import MAX_BYTES, FileError, Finding, SourceFile, in_order, read_text
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
                what = f"{path}: no charts, scenes, robots … in this folder"
                raise Problem(f"{what}; projects in it are validated from their own folders")
            found |= inside
        elif path.is_file():
            found[path] = kind_of(path) or "chart"
        else:
            if path.exists():
                raise Problem(f"{path}: is no regular file", FAILED)
            raise Problem(f"{path}: no such file or folder")
    return list(found.items())


def yaml_files(folder: Path) -> Iterator[Path]:
    """The YAML files in a folder and below.

    Left out are hidden folders, those in `SKIPPED`, and projects, which have states of their own.
    """
    for place, folders, files in os.walk(folder):
        kept = (f for f in folders if not f.startswith(".") and f not in SKIPPED)
        folders[:] = sorted(f for f in kept if not is_project(Path(place, f)))
        yield from (Path(place, f) for f in sorted(files) if f.endswith(YAML))


def load_beside(
    files: Sequence[Path],
    catalogue: Catalogue,
    load: Callable[[Sequence[Path]], Library] = load_files,
) -> Library:
    """The charts of `files`, then those they may use.

    The findings are those of `files`, and of used files in which no chart could be read. `load`
    reads chart files; who loads often may keep what has not changed.
    """
    library = load(files)
    beside, known = charts_beside(files), chart_names(catalogue)
    given = {file.resolve() for file in files}
    waiting = {
        name: file for name, file in {**known, **beside}.items() if file.resolve() not in given
    }
    while names := used_charts(library.values(), library) & waiting.keys():
        for name in sorted(names):
            _add(library, load([waiting.pop(name)]), used=True)
    for file in known.values():
        if file.resolve() not in given:
            _add(library, load([file]))
    if used_charts(library.values(), library):  # a misspelt name: load more for `did you mean`
        for file in beside.values():
            _add(library, load([file]))
    return library


def _add(library: Library, loaded: Library, *, used: bool = False) -> None:
    """Add the charts of a file whose names are not taken; of a used one, else what is wrong."""
    for name, chart in loaded.items():
        if name not in library:
            library[name] = chart
            library.sources[chart.file] = chart.source
    if used and not loaded:
        library.sources |= loaded.sources
        library.findings += loaded.findings


def used_charts(charts: Iterable[Chart], known: Container[str]) -> set[str]:
    """The names of charts that these charts `use` and that are not `known`."""
    named = {node.target for c in charts for node in c.root.walk() if node.form == "use"}
    return {name for name in named if name not in known}


def findings_of(library: Library, catalogue: Catalogue, files: Iterable[Path]) -> list[Finding]:
    """Check a library; returns the findings in `files`, in order.

    What does not fit a shipped chart among them is told where the shipped one is replaced.
    """
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
    charts = [chart for chart in library.values() if chart.file in named]
    inside = [finding for finding in found if finding.place.file in named]
    told = told_of_replacements(inside, library)
    return in_order([*told, *_shared_names(charts, catalogue)])


def _shared_names(charts: Iterable[Chart], catalogue: Catalogue) -> Iterator[Finding]:
    """A finding in each chart whose name is that of another chart of its project."""
    others = twins(catalogue)
    for chart in charts:
        other = others.get(Path(chart.file).resolve())
        if other is not None:
            message = f"a chart {chart.name!r} is also in {other}"
            yield Finding("N02", message, name_place(chart), "give it another name")


def strictly(findings: Iterable[Finding]) -> list[Finding]:
    """The findings, with warnings as errors; notes stay notes."""
    return [f if f.severity == "note" else replace(f, severity="error") for f in findings]


def open_chart(name_or_path: str, catalogue: Catalogue) -> tuple[Chart, Library]:
    """A chart that can run, and the library of charts that it may use.

    Raises:
        Problem: it cannot run; the text shows every error.
    """
    file = chart_file(name_or_path, catalogue)
    library = load_beside([file], catalogue)
    findings = findings_of(library, catalogue, [file])
    errors = _errors(findings) + errors_in_used(library, catalogue, [file])
    if errors:
        places = {place for f in errors for place in (f.place, *(other for other, _ in f.related))}
        sources = {place.file: library.sources[place.file] for place in places}
        told = f"{file} cannot run\n{text(errors, sources)}{_elsewhere(file, catalogue)}"
        raise Problem(told.rstrip(), FAILED)
    return next(chart for chart in library.values() if chart.file == str(file)), library


def _elsewhere(file: Path, catalogue: Catalogue) -> str:
    """A line about a file of a project whose states and charts are not known from here."""
    there = folder_of_project(file)
    known = {own.folder.resolve() for own in catalogue.projects if own.folder is not None}
    if there is None or there in known:
        return ""
    return f"it is in the project {there}, whose states and charts are known there: cd {there}"


def errors_in_used(library: Library, catalogue: Catalogue, files: Iterable[Path]) -> list[Finding]:
    """Errors outside `files`, in used charts, that keep the charts in `files` from running."""
    named = {str(file) for file in files}
    read = {chart.file for chart in library.values()}
    own = {name for name, chart in library.items() if chart.file in named}
    used = {library[name].file for name in reached(own, library)} | library.sources.keys() - read
    used -= named
    if not used:
        return []
    return _errors(findings_of(library, catalogue, map(Path, sorted(used))))


def errors_in_users(library: Library, catalogue: Catalogue, files: Iterable[Path]) -> list[Finding]:
    """Errors outside `files`, where charts use one in `files` in place of a shipped chart."""
    named = {str(file) for file in files}
    own = own_replacements(catalogue)
    replacing = {name for name in own if name in library and library[name].file in named}
    using = {chart.file for chart in library.values() if used_charts([chart], ()) & replacing}
    if not using - named:
        return []
    return _errors(findings_of(library, catalogue, map(Path, using - named)))


def replacements(
    library: Mapping[str, Chart], catalogue: Catalogue, names: Iterable[str]
) -> list[str]:
    """A message for each of these charts that whoever names it gets in place of a shipped one."""
    charts = [library[name] for name in sorted(names)]
    known = own_replacements(catalogue).keys() | used_charts(charts, ())
    shipped = shipped_by_name()
    return [
        f"chart {chart.name}: {chart.file} replaces the shipped one"
        for chart in charts
        if chart.name in known and is_replacement(chart.name, chart.file, shipped)
    ]


def misfits(library: Library, catalogue: Catalogue, names: Collection[str]) -> list[str]:
    """A message for each replacement among these charts that does not fit another one of them."""
    if not own_replacements(catalogue).keys() & names:
        return []
    shipped = {library[name].file for name in names if is_shipped(library[name])}
    found = _errors(findings_of(library, catalogue, map(Path, shipped)))
    told = (replace(error, related=()) for error in found if error.place.file not in shipped)
    return [str(FileError([error])) for error in told]


def _errors(findings: Iterable[Finding]) -> list[Finding]:
    return [finding for finding in findings if finding.severity == "error"]


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
