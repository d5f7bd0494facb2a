"""Findings as text for people, and as JSON, GitHub annotations and SARIF for programs."""

from __future__ import annotations

import json
import os
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import Any, Literal, get_args
from urllib.parse import quote

from engine.files import Finding, Place, Severity, SourceFile, visible

WIDTH = 100  # columns of a shown source line
TAB = "    "

ReportFormat = Literal["text", "json", "github", "sarif"]
FORMATS: tuple[ReportFormat, ...] = get_args(ReportFormat)
Sources = Mapping[str, SourceFile]

_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")  # the line breaks of YAML 1.1
_SARIF_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def report(findings: Sequence[Finding], sources: Sources, form: ReportFormat = "text") -> str:
    """The findings in one of the `FORMATS`."""
    if form == "text":
        return text(findings, sources)
    if form == "json":
        return json_object(findings, sources)
    writers = {"github": github, "sarif": sarif}
    return writers[form](findings)


def text(findings: Sequence[Finding], sources: Sources) -> str:
    """For people: each finding with its source line, a caret and how to fix it.

    The last line is the summary. Lines longer than `WIDTH` columns are cut around the caret.
    """
    lines = _Lines(sources)
    blocks = [line for finding in findings for line in _block(finding, lines)]
    return "\n".join([*blocks, summary(findings, len(sources))]) + "\n"


def summary(findings: Sequence[Finding], files: int) -> str:
    """`2 errors and 1 warning in 5 files`."""
    given = Counter(finding.severity for finding in findings)
    counts = [_count(given[what], what) for what in get_args(Severity) if given[what]]
    return f"{' and '.join(counts) or 'no errors'} in {_count(files, 'file')}"


def json_object(findings: Sequence[Finding], files: Iterable[str]) -> str:
    """A JSON object with the names of the `files` and one object per finding."""
    return _json({"files": [*files], "findings": [as_json(finding) for finding in findings]})


def as_json(finding: Finding) -> dict[str, Any]:
    """A finding as JSON values."""
    return {
        "code": finding.code,
        "severity": finding.severity,
        "message": finding.message,
        "hint": finding.hint,
        **finding.place._asdict(),
        "related": [{**place._asdict(), "message": note} for place, note in finding.related],
    }


def github(findings: Sequence[Finding]) -> str:
    """One workflow command per finding; GitHub shows them beside the changed lines."""
    return "".join(f"{_command(finding)}\n" for finding in findings)


def sarif(findings: Sequence[Finding]) -> str:
    """One run in SARIF 2.1.0 (OASIS), columns counted in code points."""
    codes = sorted({finding.code for finding in findings})
    driver = {"name": "cobodeck", "rules": [{"id": code} for code in codes]}
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_result(finding, codes.index(finding.code)) for finding in findings],
    }
    return _json({"$schema": _SARIF_SCHEMA, "version": "2.1.0", "runs": [run]})


class _Lines:
    """The lines of the sources; each file is split once."""

    def __init__(self, sources: Sources) -> None:
        self.sources = sources
        self.split: dict[str, list[str]] = {}

    def at(self, place: Place) -> str | None:
        """The line of `place`; `None` if it is empty or does not exist."""
        if place.file not in self.split:
            source = self.sources.get(place.file)
            self.split[place.file] = _BREAK.split(source.text) if source else []
        lines = self.split[place.file]
        line = lines[place.line - 1] if 0 < place.line <= len(lines) else ""
        return line if line.strip() else None


def _block(finding: Finding, lines: _Lines) -> Iterator[str]:
    yield visible(f"{finding.place}: {finding.severity}[{finding.code}] {finding.message}")
    yield from _excerpt(finding.place, lines)
    if finding.hint:
        yield visible(f"      = help: {finding.hint}")
    for place, note in finding.related:
        yield visible(f"{place}: note: {note}")
        yield from _excerpt(place, lines)


def _excerpt(place: Place, lines: _Lines) -> Iterator[str]:
    line = lines.at(place)
    if line is None:
        return
    start = min(place.column - 1, len(line))
    end = min(max(place.end_column - 1, start + 1), max(len(line), start + 1))
    before, marked, after = (_shown(part) for part in (line[:start], line[start:end], line[end:]))
    before, marked, after = _cut(before, marked, after)
    yield f"{place.line:5} | {before}{marked}{after}".rstrip()
    yield f"      | {' ' * _width(before)}^{'~' * (_width(marked) - 1)}"


def _cut(before: str, marked: str, after: str) -> tuple[str, str, str]:
    """The parts shortened to `WIDTH` columns together; the marked part is shown from its start."""
    if _width(before + marked + after) <= WIDTH:
        return before, marked, after
    if _width(marked) > WIDTH // 2:
        marked, after = _head(marked, WIDTH // 2) + "…", ""
    kept = max(WIDTH // 4, WIDTH - _width(marked + after))
    if _width(before) > kept:
        before = "…" + _head(before[::-1], kept)[::-1]
    room = WIDTH - _width(before + marked)
    if _width(after) > room:
        after = _head(after, room) + "…"
    return before, marked, after


def _head(shown: str, columns: int) -> str:
    used = 0
    for index, character in enumerate(shown):
        used += _width(character)
        if used > columns:
            return shown[:index]
    return shown


def _shown(part: str) -> str:
    """`part` made safe for a terminal: tabs widened, control characters as escapes."""
    return visible(part.replace("\t", TAB))


def _width(shown: str) -> int:
    """The columns that `shown` takes in a terminal: two for wide characters, none for accents."""
    if shown.isascii():
        return len(shown)
    return sum(
        0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1
        for c in shown
    )


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _json(value: Any) -> str:
    return json.dumps(value, indent=2, ensure_ascii=False) + "\n"


def _command(finding: Finding) -> str:
    place = finding.place
    properties = {
        "file": place.file,
        "line": place.line,
        "col": place.column,
        "endColumn": place.end_column,
        "title": finding.code,
    }
    shown = ",".join(f"{name}={_escaped(str(value), ':,')}" for name, value in properties.items())
    level = "notice" if finding.severity == "note" else finding.severity
    return f"::{level} {shown}::{_escaped(_full_message(finding))}"


def _escaped(value: str, also: str = "") -> str:
    """`value` with the characters that would end a field of a workflow command percent-encoded."""
    for character in "%\r\n" + also:  # the percent sign first: all the other codes contain it
        value = value.replace(character, f"%{ord(character):02X}")
    return value


def _full_message(finding: Finding) -> str:
    return f"{finding.message}; {finding.hint}" if finding.hint else finding.message


def _result(finding: Finding, rule: int) -> dict[str, Any]:
    result = {
        "ruleId": finding.code,
        "ruleIndex": rule,
        "level": finding.severity,
        "message": {"text": _full_message(finding)},
        "locations": [_location(finding.place)],
    }
    if finding.related:
        result["relatedLocations"] = [
            {"id": number, **_location(place), "message": {"text": note}}
            for number, (place, note) in enumerate(finding.related)
        ]
    return result


def _location(place: Place) -> dict[str, Any]:
    region = {
        "startLine": place.line,
        "startColumn": place.column,
        "endColumn": max(place.end_column, place.column),
    }
    artifact = {"uri": _uri(place.file)}
    return {"physicalLocation": {"artifactLocation": artifact, "region": region}}


def _uri(file: str) -> str:
    path = PurePath(file)
    return path.as_uri() if path.is_absolute() else quote(os.fsencode(path.as_posix()))
