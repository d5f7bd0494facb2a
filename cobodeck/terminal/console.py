"""Shared by all commands: exit codes, problems that a user can fix, tables, progress.

Control characters in names, files, exceptions and arguments are shown as escapes, so that nothing
printed can command the terminal.
"""

from __future__ import annotations

import codecs
import io
import shutil
import sys
import time
from collections.abc import Callable, Iterable, Sequence

from engine.files import escaped, visible

OK, FAILED, USAGE, REFUSED = range(4)
"""Exit codes: fine; a finding or a failure; wrong arguments; refused for safety."""


class Problem(Exception):
    """Something a user can fix; the text says where, what, and what would be right."""

    def __init__(self, message: str, code: int = USAGE) -> None:
        super().__init__(message)
        self.code = code


_LAYOUT = "\n\t"


def show(text: str = "") -> None:
    """Print a result."""
    print(visible(text, _LAYOUT))


def complain(message: str) -> None:
    """Say what is wrong, on standard error."""
    print(visible(f"cobodeck: {message}", _LAYOUT), file=sys.stderr)


def show_what_can_be_shown() -> None:
    """Print characters that a stream's encoding lacks as escapes, instead of raising."""
    codecs.register_error("cobodeck", _as_escapes)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="cobodeck")


def _as_escapes(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    return "".join(map(escaped, error.object[error.start : error.end])), error.end


def table(rows: Iterable[Sequence[object]], right: frozenset[int] = frozenset()) -> str:
    """Columns of equal width; the columns `right` are aligned to the right."""
    cells = [["" if cell is None else visible(str(cell)) for cell in row] for row in rows]
    widths = [max(len(row[n]) for row in cells) for n in range(len(cells[0]))]
    lines = []
    for row in cells:
        padded = [
            cell.rjust(width) if n in right else cell.ljust(width)
            for n, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(padded).rstrip())
    return "\n".join(lines)


def terminal_width() -> int | None:
    """The terminal's width, columns; None if results do not go to a terminal."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else None


SOON_S, PLAIN_S = 1.0, 30.0
"""Where there is no terminal: work that is shorter is not told, and the time between lines, s."""


class ProgressLine:
    """A progress line on standard error, overwritten in place.

    Where that is no terminal it is silent, or with `plainly` prints a line after SOON_S, then one
    in every PLAIN_S, and one at the end.

    Args:
        what: the work, as the line names it.
        every_s: least time between two updates, s.
        clock: returns the time, s, like `time.monotonic`.
        plainly: what to say of it at first where there is no terminal.
    """

    def __init__(
        self,
        what: str,
        every_s: float = 0.2,
        clock: Callable[[], float] = time.monotonic,
        plainly: str = "",
    ) -> None:
        self._what = what
        self._every = every_s
        self._clock = clock
        self._begin = clock()
        self._next = self._begin + every_s
        self._shown = False
        self._on = sys.stderr.isatty()
        self._plainly = "" if self._on else plainly

    def at(self, text: str, share: float | None = None) -> None:
        """Show progress; with the `share` done, 0 to 1, also the estimated time left."""
        now = self._clock()
        if self._plainly:
            self._print_plainly(text, share, now)
        if not self._on or now < self._next:
            return
        self._next = now + self._every
        self._shown = True
        left = "" if share is None else _left(min(share, 1.0), now - self._begin)
        line = visible(f"{self._what}: {text}{left}")
        print(f"\r{line}\x1b[K", end="", file=sys.stderr, flush=True)

    def done(self) -> None:
        """Clear the line; where there is no terminal, say how long it took."""
        if self._shown and self._plainly:
            spent_s = self._clock() - self._begin
            print(visible(f"{self._what}: done in {spent_s:.0f} s"), file=sys.stderr, flush=True)
        elif self._shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def _print_plainly(self, text: str, share: float | None, now: float) -> None:
        """A line of its own, at first and then from time to time."""
        if now < (self._next if self._shown else self._begin + SOON_S):
            return
        left = "" if share is None else _left(min(share, 1.0), now - self._begin)
        line = f"{text}{left}" if self._shown else self._plainly
        self._shown, self._next = True, now + PLAIN_S
        print(visible(f"{self._what}: {line}"), file=sys.stderr, flush=True)


def _left(share: float, spent_s: float) -> str:
    """`, 25 %, 12 s left`, assuming that the pace so far continues."""
    if share <= 0.0:
        return ", 0 %"
    left_s = spent_s * (1.0 - share) / share
    left = f"{left_s:.0f} s" if left_s < 90.0 else f"{left_s / 60.0:.0f} min"
    return f", {share:.0%}, {left} left".replace("%", " %")
