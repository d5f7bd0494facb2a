"""Findings: what is wrong with a file, where, and how to fix it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, NamedTuple

from engine.files.suggestions import advice

Severity = Literal["error", "warning", "note"]

CODE = "D01"
"""The code of mistakes in files other than charts, in their keys and values."""
OLD = "D02"
"""The code of notes on what is still read, and now written otherwise."""


class Place(NamedTuple):
    """A range in one line of a file; lines and columns count from 1, the end column is exclusive.

    An empty range stands for the whole file.
    """

    file: str
    line: int
    column: int
    end_column: int

    def __str__(self) -> str:
        if self.end_column == self.column:
            return self.file
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Finding:
    """One mistake: `code` names the rule (engine/CODES.md lists them all)."""

    code: str
    message: str
    place: Place
    hint: str = ""
    severity: Severity = "error"
    related: tuple[tuple[Place, str], ...] = ()


class FileError(ValueError):
    """Files that cannot be used. `findings` has all mistakes; the text has a line for each."""

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(in_order(findings))
        super().__init__(self.findings)

    def __str__(self) -> str:
        return "\n".join(
            f"{finding.place}: {finding.message}{_hint(finding)}{_notes(finding)}"
            for finding in self.findings
        )


class NotFound(FileError):
    """A file, or a name of one, that does not exist."""


def not_found(name: object, message: str, hint: str = "", code: str = CODE) -> NotFound:
    """The error for a file or name that does not exist."""
    return NotFound([Finding(code, message, Place(str(name), 1, 1, 1), hint)])


def mistake(
    file: object, message: str, line: int = 0, hint: str = "", code: str = CODE
) -> FileError:
    """The error for one mistake in a line of a file, or in the file as a whole (line 0)."""
    place = Place(str(file), line, 1, 2) if line else Place(str(file), 1, 1, 1)
    return FileError([Finding(code, message, place, hint)])


def _hint(finding: Finding) -> str:
    return f"; {finding.hint}" if finding.hint else ""


def _notes(finding: Finding) -> str:
    return "".join(f" ({note}: {place})" for place, note in finding.related)


def did_you_mean(word: object, known: Iterable[str]) -> str:
    """A suggestion for an unknown `word`, or the allowed words if none is similar."""
    return advice(str(word), known)


def in_order(findings: Iterable[Finding]) -> list[Finding]:
    """Sorted by file and place, without repetitions."""
    return sorted(dict.fromkeys(findings), key=lambda f: (f.place, f.severity, f.code, f.message))
