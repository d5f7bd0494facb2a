"""Compares two records: what was run, the results, and when they begin to differ.

Both are read once, side by side, tick by tick; neither is held in memory.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Any

from cobodeck.evaluate import OF_THE_MACHINE
from cobodeck.record.format import trace_line, truth_again
from cobodeck.record.read.header_differences import HeaderDifference, header_differences
from cobodeck.record.read.reader import Group, Record
from engine.run import encode
from hw import Pose2, wrap

NEAR_M, NEAR_RAD = 1e-3, 1e-3
"""Poses within these tolerances count as equal, m, rad."""
ASKED = {"chart", "inputs", "scene", "robot", "user", "profile", "set", "tier", "seed", "tick_hz"}
"""Figures that say what was run; the headers are compared instead."""
COMPUTING = {*OF_THE_MACHINE, "left_out", "missed", "overruns", "signals"}
"""Figures about the computation, not its result."""

TraceLine = list[Any]
"""A record of the trace: time in ns, kind, subject, details."""


@dataclass(frozen=True, slots=True)
class FigureTolerance:
    """By how much two numbers may differ and still be equal: by the larger of both bounds.

    `absolute` is in the unit of the figure (SI: m, s, rad, m/s); `relative` is a share of the
    larger number. Texts are compared exactly. The defaults are above the rounding of sums of
    doubles and below what any sensor resolves; counts differ by at least 1, more than they allow.
    """

    absolute: float = 1e-9
    relative: float = 1e-9

    def covers(self, a: Any, b: Any) -> bool:
        """Whether two values of JSON are equal, numbers and those in lists within the bounds."""
        if isinstance(a, list) and isinstance(b, list):
            return len(a) == len(b) and all(map(self.covers, a, b))
        if isinstance(a, Mapping) and isinstance(b, Mapping):
            return a.keys() == b.keys() and all(self.covers(a[key], b[key]) for key in a)
        if _is_number(a) and _is_number(b):
            return math.isclose(a, b, rel_tol=self.relative, abs_tol=self.absolute)
        return encode(a) == encode(b)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure of both runs by its dotted name in JSON; None where a run lacks it."""

    name: str
    a: Any
    b: Any

    tolerance: FigureTolerance = FigureTolerance()

    @property
    def same(self) -> bool:
        """Whether it is the same in both, numbers within the tolerance."""
        return self.tolerance.covers(self.a, self.b)

    @property
    def computing(self) -> bool:
        """Whether it is about the computation, not its result."""
        return self.name.partition(".")[0] in COMPUTING


@dataclass(slots=True)
class Traces:
    """The comparison of both traces, without notes.

    `equal` counts the records before the first that differs, at `at_ns`; `a` and `b` are the two
    that differ, None where a trace has ended. `last` is the last equal move before them: time, ns,
    container, child, outcome, next child.
    """

    equal: int = 0
    at_ns: int | None = None
    a: str | None = None
    b: str | None = None
    last: tuple[int, str, str, str, str] | None = None

    @property
    def same(self) -> bool:
        """Whether the traces are equal to their ends."""
        return self.at_ns is None

    def compare(self, a: list[TraceLine], b: list[TraceLine]) -> None:
        """Compare the trace records of one instant; either list may be empty."""
        if self.at_ns is not None and self.a is not None and self.b is not None:
            return
        for one, other in zip_longest(a, b):
            if self.at_ns is not None:
                self.a, self.b = self.a or _text(one), self.b or _text(other)
            elif one is None or other is None or encode(one) != encode(other):
                self.at_ns = min(line[0] for line in (one, other) if line is not None)
                self.a, self.b = _text(one), _text(other)
            else:
                self.equal += 1
                if one[1] == "move":
                    self.last = (one[0], *one[2:])


_Poses = tuple[Pose2 | None, Pose2 | None]


@dataclass(slots=True)
class Motions:
    """From when on base and person differ, if both records have the truth.

    `base` and `person`: the first instant at which they differ, ns, and their poses in A and B.
    """

    known: bool = False
    base: tuple[int, Pose2, Pose2] | None = None
    person: tuple[int, Pose2, Pose2] | None = None
    _poses: list[_Poses] = field(default_factory=lambda: [(None, None), (None, None)])

    def know(self, n: int, group: Group) -> None:
        """Take the truth of A (0) or B (1) at this tick."""
        for found in group.messages("truth"):
            truth = truth_again(found, None)
            self._poses[n] = truth.base, truth.body

    def compare(self, at_ns: int) -> None:
        """Compare the poses at an instant that both records have."""
        (base_a, body_a), (base_b, body_b) = self._poses
        if base_a is None or base_b is None:
            return
        self.known = True
        self.base = self.base or _apart(at_ns, base_a, base_b)
        self.person = self.person or _apart(at_ns, body_a, body_b)


@dataclass(frozen=True, slots=True)
class Comparison:
    """The differences of two records.

    `ends_ns` are the instants of their last ticks, `altered_ns` those of the first altered ticks.
    """

    headers: tuple[HeaderDifference, ...]
    figures: tuple[Figure, ...]
    traces: Traces
    motions: Motions
    ends_ns: tuple[int, ...]
    altered_ns: tuple[int | None, ...]

    @property
    def same(self) -> bool:
        """Whether the results are the same; figures about the computation may differ."""
        return self.traces.same and all(f.same or f.computing for f in self.figures)


def compare(a: Record, b: Record, tolerance: FigureTolerance = FigureTolerance()) -> Comparison:
    """Compare two records; both are read to their ends, which sets their `result` and `broken`.

    `tolerance` is that of figures; traces are compared exactly.

    Raises:
        FileError: one of them cannot be read.
    """
    for record in (a, b):
        record.require_ticks()
    traces, motions = Traces(), Motions()
    ends = [0, 0]
    altered: list[int | None] = [None, None]
    for pair in _together(a.groups(), b.groups()):
        lines: list[list[TraceLine]] = [[], []]
        for n, (record, group) in enumerate(zip((a, b), pair, strict=True)):
            if group is None:
                continue
            ends[n] = group.ticked.at_ns
            if group.altered and altered[n] is None:
                altered[n] = ends[n]
            with record.understood(group):
                lines[n] = _trace(group)
                motions.know(n, group)
        traces.compare(*lines)
        if None not in pair:
            motions.compare(ends[0])
    figures = tuple(_figures(a.result or {}, b.result or {}, tolerance))
    headers = tuple(header_differences(a, b))
    return Comparison(headers, figures, traces, motions, tuple(ends), tuple(altered))


def _together(
    a: Iterator[Group], b: Iterator[Group]
) -> Iterator[tuple[Group | None, Group | None]]:
    """The ticks of both in the order of their instants; those of equal instants as pairs."""
    one, other = next(a, None), next(b, None)
    while one is not None or other is not None:
        both = [group.ticked.at_ns for group in (one, other) if group is not None]
        mine = one if one is not None and one.ticked.at_ns == min(both) else None
        its = other if other is not None and other.ticked.at_ns == min(both) else None
        yield mine, its
        one = one if mine is None else next(a, None)
        other = other if its is None else next(b, None)


def _trace(group: Group) -> list[TraceLine]:
    found = [trace_line(told) for told in group.messages("trace")]
    return [line for line in found if line[1] not in ("note", "tick")]


def _text(line: TraceLine | None) -> str | None:
    return None if line is None else encode(line)


def _apart(at_ns: int, a: Pose2 | None, b: Pose2 | None) -> tuple[int, Pose2, Pose2] | None:
    if a is None or b is None or a == b:
        return None
    near = a.distance_to(b) <= NEAR_M and abs(wrap(a.yaw - b.yaw)) <= NEAR_RAD
    return None if near else (at_ns, a, b)


# figures


def _figures(
    a: Mapping[str, Any], b: Mapping[str, Any], tolerance: FigureTolerance
) -> Iterator[Figure]:
    one, other = (
        dict(_flat({name: held for name, held in found.items() if name not in ASKED}))
        for found in (a, b)
    )
    for name in sorted({*one, *other}):
        yield Figure(name, one.get(name), other.get(name), tolerance)


def _flat(found: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for name, held in found.items():
        if isinstance(held, Mapping):
            yield from _flat(held, f"{before}{name}.")
        else:
            yield before + name, held
