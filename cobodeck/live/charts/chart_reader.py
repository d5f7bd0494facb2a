"""Reads and checks chart files again and again, as `validate` does, and fast.

What was read from bytes that are still the same is kept: charts and profiles.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from behaviors.profile import Profile
from cobodeck.project import (
    Catalogue,
    chart_names,
    errors_in_users,
    findings_of,
    load_beside,
    reached,
)
from cobodeck.setup import profile_with, with_values
from cobodeck.terminal import Problem
from engine.chart import Chart, Library, load_files
from engine.files import (
    MAX_BYTES,
    FileError,
    Finding,
    Place,
    in_order,
    noting,
    read_bytes,
)


@dataclass(frozen=True, slots=True)
class ReadChart:
    """A chart file as it is now.

    Attributes:
        chart: with the values of the profile; None if there is none, or the profile cannot be read.
        charts: those that it may use, likewise.
        profile: None if it cannot be read.
        findings: as `validate` tells them, and what is wrong with the profile.
        whole: whether all of the text was read, so that nothing is missing in a picture.
    """

    file: Path
    chart: Chart | None
    charts: dict[str, Chart]
    profile: Profile | None
    findings: tuple[Finding, ...]
    whole: bool


class ChartReader:
    """Reads chart files.

    Args:
        known: what charts can name; the code of states stays as it was when this was made.

    Attributes:
        files: what was read so far; if one of these changes, so may what is found.
    """

    def __init__(self, known: Catalogue) -> None:
        self.known = known
        self.files: set[Path] = set()
        self._charts: dict[Path, tuple[bytes | None, Library]] = {}
        self._profiles: dict[str, tuple[dict[Path, bytes], Profile]] = {}

    def forget(self, changed: Collection[Path]) -> None:
        """Read anew what these files say; where places and signals come from is not remembered."""
        if not self._charts.keys() >= set(changed):
            self.known = replace(self.known)  # has no cached places, signals and values yet

    def read(self, file: Path, profile: str) -> ReadChart:
        """A chart file with the values of a profile, given by name or file."""
        with noting() as noted:
            library = load_beside([file], self.known, self._load)
            findings = self._findings(library, file)
            chart = next((c for c in library.values() if c.file == str(file)), None)
            charts: dict[str, Chart] = dict(library)
            values = None
            try:
                values = self._profile(profile, noted)
                if chart is not None:
                    charts = with_values(values, library, reached({chart.name}, library))
                    chart = charts[chart.name]
            except FileError as error:
                chart, findings = None, [*findings, *error.findings]
            except Problem as problem:
                chart, findings = None, [*findings, _of_problem(profile, problem)]
            whole = chart is not None and not self._load([file]).findings
        self.files |= noted.keys()
        return ReadChart(file, chart, charts, values, tuple(dict.fromkeys(findings)), whole)

    def counts(self, files: Sequence[Path]) -> dict[Path, tuple[int, int]]:
        """The numbers of errors and warnings in each of these chart files."""
        library = load_beside(files, self.known, self._load)
        found = findings_of(library, self.known, files)
        return {
            file: (_count(found, file, "error"), _count(found, file, "warning")) for file in files
        }

    def sources(self) -> list[Path]:
        """The files of all charts that can be named."""
        return [*chart_names(self.known).values()]

    def _findings(self, library: Library, file: Path) -> list[Finding]:
        """The findings in a file, and errors elsewhere that keep its chart from running."""
        read = {chart.file for chart in library.values()}
        own = {name for name, chart in library.items() if chart.file == str(file)}
        used = {
            library[name].file for name in reached(own, library)
        } | library.sources.keys() - read
        files = [file, *map(Path, sorted(used - {str(file)}))]
        found = findings_of(library, self.known, files)
        inside = [f for f in found if f.place.file == str(file) or f.severity == "error"]
        return in_order([*inside, *errors_in_users(library, self.known, [file])])

    def _load(self, files: Sequence[Path]) -> Library:
        if len(files) != 1:
            return load_files(files)
        (file,) = files
        data, kept = _bytes(file), self._charts.get(file)
        if kept is None or data is None or kept[0] != data:
            kept = self._charts[file] = data, load_files(files)
        return _copy(kept[1])

    def _profile(self, name: str, noted: Mapping[Path, bytes]) -> Profile:
        kept, before = self._profiles.get(name), set(noted)
        if kept is not None and all(_bytes(file) == data for file, data in kept[0].items()):
            return kept[1]
        found = profile_with(name, ())
        read = {file: data for file, data in noted.items() if file not in before}
        self._profiles[name] = read, found
        return found


def _bytes(file: Path) -> bytes | None:
    try:
        return read_bytes(file, MAX_BYTES)
    except FileError:
        return None


def _copy(library: Library) -> Library:
    found = Library()
    found.update(library)
    found.findings += library.findings
    found.sources |= library.sources
    return found


def _of_problem(name: str, problem: Problem) -> Finding:
    return Finding("D01", str(problem), Place(name, 1, 1, 1))


def _count(findings: Sequence[Finding], file: Path, severity: str) -> int:
    return sum(f.severity == severity and f.place.file == str(file) for f in findings)
