"""Text that libyaml refuses, and the lines in it that are indented wrongly."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

Spot = tuple[int, int]  # line and column, from 1

KEY = re.compile(
    r"[ \t]*(?:- +)*(?:\"[^\"]*\"|'[^']*'|[^\s:#\[\]{},&*!|>'\"%@`][^:#]*?) *:(?=\s|\Z)"
)
"""A line up to the colon of its key."""


class Malformed(NamedTuple):
    """Text that libyaml refuses: what it says, where, and where the construct in question began."""

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
        """That line up to the problem."""
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
    """The place of a mistake, what it is, and the mend."""

    at: Spot
    message: str
    hint: str


def indentation(text: Malformed) -> Diagnosis | None:
    """A line that stands deeper than the one above allows, or at a depth that nothing has."""
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
    """The depths at which a key could stand in the line of the problem."""
    levels: list[int] = []
    for line in text.lines[: text.at[0] - 1]:
        if KEY.match(line):
            here = depth(line)
            levels = [*(level for level in levels if level < here), here]
    return levels or [0]


def _dedented_above(text: Malformed) -> int | None:
    """The line that ended too early the block that the problem's line continues."""
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
