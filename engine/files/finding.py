"""What is wrong with a file, where, and what would be right."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, NamedTuple

Severity = Literal["error", "warning"]

LONGEST_GUESS = 60  # letters of a word that is compared with others; it takes their square


class Place(NamedTuple):
    """A stretch of one file; lines and columns count from 1, the end column is exclusive."""

    file: str
    line: int
    column: int
    end_column: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Finding:
    """One mistake: `code` names the rule (engine/README.md lists them all)."""

    code: str
    message: str
    place: Place
    hint: str = ""
    severity: Severity = "error"
    related: tuple[tuple[Place, str], ...] = ()


def one_line(finding: Finding) -> str:
    """`file:line:column: error[CODE] message; hint`."""
    hint = f"; {finding.hint}" if finding.hint else ""
    return f"{finding.place}: {finding.severity}[{finding.code}] {finding.message}{hint}"


def did_you_mean(word: object, known: Iterable[str]) -> str:
    """A suggestion for a misspelt `word`, or the allowed values when nothing is near."""
    names = sorted(set(known))
    short = [name for name in names if len(name) <= LONGEST_GUESS]
    near = difflib.get_close_matches(str(word)[:LONGEST_GUESS], short, n=1, cutoff=0.6)
    if near:
        return f"did you mean {near[0]!r}?"
    if not names:
        return "nothing is allowed here"
    shown = ", ".join(names[:12]) + (", …" if len(names) > 12 else "")
    return f"allowed: {shown}"


def in_order(findings: Iterable[Finding]) -> list[Finding]:
    """Sorted by file and place, without repetitions."""
    return sorted(dict.fromkeys(findings), key=lambda f: (f.place, f.severity, f.code, f.message))
