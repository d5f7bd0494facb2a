"""What all commands share: exit codes, problems that a user can mend, tables, progress."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterable, Sequence
from typing import Any

OK, FAILED, USAGE, REFUSED = range(4)
"""Exit codes: fine; a finding or a failure; wrong arguments; refused for safety."""


class Problem(Exception):
    """Something a user can mend: the text says where, what, and what would be right."""

    def __init__(self, message: str, code: int = USAGE) -> None:
        super().__init__(message)
        self.code = code


def show(text: str = "") -> None:
    """Print a result."""
    print(text)


def show_json(value: Any) -> None:
    """Print a result for programs."""
    print(json.dumps(value, indent=2, ensure_ascii=False))


def complain(message: str) -> None:
    """Say what is wrong, on standard error."""
    print(f"cobodeck: {message}", file=sys.stderr)


def table(rows: Iterable[Sequence[object]], right: frozenset[int] = frozenset()) -> str:
    """Columns of equal width; the columns `right` are aligned to the right."""
    cells = [["" if cell is None else str(cell) for cell in row] for row in rows]
    widths = [max(len(row[n]) for row in cells) for n in range(len(cells[0]))]
    lines = []
    for row in cells:
        padded = [
            cell.rjust(width) if n in right else cell.ljust(width)
            for n, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(padded).rstrip())
    return "\n".join(lines)


class Progress:
    """One line on standard error that is written over; nothing where nobody looks on."""

    def __init__(self, what: str, every_s: float = 0.2) -> None:
        self._what = what
        self._every = every_s
        self._next = time.monotonic() + every_s
        self._shown = False
        self._on = sys.stderr.isatty()

    def at(self, text: str) -> None:
        """Where the work has got to."""
        if not self._on or time.monotonic() < self._next:
            return
        self._next = time.monotonic() + self._every
        self._shown = True
        print(f"\r{self._what}: {text}\x1b[K", end="", file=sys.stderr, flush=True)

    def done(self) -> None:
        """Take the line away."""
        if self._shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
