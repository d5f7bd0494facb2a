"""Text that libyaml rejects, and the wrongly indented lines in it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

Spot = tuple[int, int]  # line and column, from 1

KEY = re.compile(
    r"[ \t]*(?:- +)*(?:\"[^\"]*\"|'[^']*'|[^\s:#\[\]{},&*!|>'\"%@`][^:#]*?) *:(?=\s|\Z)"
)
"""Matches a line up to the colon after its key."""


class Malformed(NamedTuple):
    """Text that libyaml rejects: its message, where, and where the construct in question began."""

    lines: list[str]
    problem: str
    at: Spot
    begun: Spot | None = None

    @property
    def line(self) -> str:
        """The line at which libyaml gave up."""
        return self.lines[self.at[0] - 1]

    @property
    def before(self) -> str:
        """The text of that line before the problem."""
        return self.line[: self.at[1] - 1]

    @property
    def character(self) -> str:
        """The character at the problem; empty at the end of the line."""
        return self.line[self.at[1] - 1 : self.at[1]]

    def near(self) -> Iterator[tuple[int, str]]:
        """The lines, numbered, that the problem can come from: its own and the two above."""
        for number in range(max(1, self.at[0] - 2), self.at[0] + 1):
            yield number, self.lines[number - 1]


class Diagnosis(NamedTuple):
    """The place of a mistake, what it is, and how to fix it."""

    at: Spot
    message: str
    hint: str


def indentation(text: Malformed) -> Diagnosis | None:
    """A line indented deeper than the line above allows, or to a depth that no other line has."""
    is_deeper = "mapping values are not allowed" in text.problem
    if not is_deeper and "expected key" not in text.problem:
        return None
    if KEY.match(text.line) is None:
        return None
    above = line_above(text)
    here = depth(text.line)
    if above is None:
        return None
    wanted = depth(text.lines[above - 1])
    if is_deeper:
        if _below(text) == here:  # two against one: the line above is the odd one
            return _indent(text, above, here)
        return _indent(text, text.at[0], wanted)
    culprit = _dedented_above(text)
    if culprit is not None:
        return _indent(text, culprit, here)
    return _indent(text, text.at[0], min(_levels(text), key=lambda level: abs(level - here)))


def _indent(text: Malformed, number: int, wanted: int) -> Diagnosis:
    has = depth(text.lines[number - 1])
    what = "indented too far" if has > wanted else "not indented far enough"
    hint = f"indent it by {wanted} spaces, it has {has}"
    return Diagnosis((number, has + 1), f"this line is {what}", hint)


def line_above(text: Malformed) -> int | None:
    """The number of the nearest line above with content."""
    for number in range(text.at[0] - 1, 0, -1):
        if text.lines[number - 1].split("#")[0].strip():
            return number
    return None


def _below(text: Malformed) -> int | None:
    """The depth of the nearest line below with content."""
    lines = (line for line in text.lines[text.at[0] :] if line.split("#")[0].strip())
    return next(map(depth, lines), None)


def _levels(text: Malformed) -> list[int]:
    """The depths that a key in the line of the problem could have."""
    levels: list[int] = []
    for line in text.lines[: text.at[0] - 1]:
        if KEY.match(line):
            here = depth(line)
            levels = [*(level for level in levels if level < here), here]
    return levels or [0]


def _dedented_above(text: Malformed) -> int | None:
    """The line that ended a block too early, if the problem's line continues that block."""
    here = depth(text.line)
    keys = [n for n in range(text.at[0] - 1, 0, -1) if KEY.match(text.lines[n - 1])]
    ending = next((n for n in keys if depth(text.lines[n - 1]) < here), 0)
    for before in (depth(text.lines[n - 1]) for n in keys if n < ending):
        if before == here:
            return ending
        if before < depth(text.lines[ending - 1]):
            return None
    return None


def depth(line: str) -> int:
    """The number of spaces that a line begins with."""
    return len(line) - len(line.lstrip(" "))
