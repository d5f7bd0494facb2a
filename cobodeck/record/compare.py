"""How two records differ: in what was run, in what came out, and from which instant on.

Both are read once, side by side, tick by tick; neither is held.
"""

from __future__ import annotations

import difflib
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Any

from cobodeck.record.header import sha256
from cobodeck.record.messages import trace_line, truth_again
from cobodeck.record.reader import Group, Record
from engine.trace import encode
from hw.geometry import Pose2, wrap

NEAR_M, NEAR_RAD = 1e-3, 1e-3
"""Poses that are not farther apart are taken for the same."""
LEFT_OUT = {"format", "began", "command", "given", "named", "charts", "files"}
"""Entries that differ between any two runs, that stand in the header twice, or that stand apart."""
WORDS = {"versions": "version of {}", "code": "code of {}", "parts": "part {}", "options": "{}"}
"""What an entry inside another is called."""
ASKED = {"chart", "scene", "robot", "user", "profile", "tier", "seed", "tick_hz"}
"""Figures that say what was run; the headers have them."""
COMPUTING = {"wall_s", "realtime_factor", "left_out", "missed", "overruns", "signals"}
"""Figures of the machine, and of what was left out on it; no part of what came out."""
PROFILE_TEXT = "text of the profile"
LINES = 3
"""So many lines of a text are shown of each place of each of the two, and twice as many in all."""

TraceLine = list[Any]
"""A record of the trace."""


@dataclass(frozen=True, slots=True)
class HeaderDifference:
    """One entry of both headers that differs; `lines` of a text, of which `first` shows some."""

    what: str
    a: Any
    b: Any
    lines: int | None = None
    first: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure of both runs by its name in JSON, parts of it behind dots; None: it has none."""

    name: str
    a: Any
    b: Any

    @property
    def same(self) -> bool:
        """Is it the same in both?"""
        return encode(self.a) == encode(self.b)

    @property
    def computing(self) -> bool:
        """Is it no part of what came out?"""
        return self.name.partition(".")[0] in COMPUTING


@dataclass(slots=True)
class Traces:
    """The traces of both, without notes.

    `equal` are the records up to the first that differs, at `at_ns`; `a` and `b` are those two,
    None where a trace is over. `last` is the move before it: container, child, outcome, next child.
    """

    equal: int = 0
    at_ns: int | None = None
    a: str | None = None
    b: str | None = None
    last: tuple[int, str, str, str, str] | None = None

    @property
    def same(self) -> bool:
        """Are they equal to their ends?"""
        return self.at_ns is None

    def take(self, a: list[TraceLine], b: list[TraceLine]) -> None:
        """The records of one instant, of which only one has any, or both."""
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
    """From which instant on, ns, base and person are elsewhere, as far as both know the truth."""

    known: bool = False
    base: tuple[int, Pose2, Pose2] | None = None
    person: tuple[int, Pose2, Pose2] | None = None
    _poses: list[_Poses] = field(default_factory=lambda: [(None, None), (None, None)])

    def know(self, n: int, group: Group) -> None:
        """What is known of A (0) or B (1) from this tick on."""
        for found in group.of("truth"):
            truth = truth_again(found, None)
            self._poses[n] = truth.base, truth.body

    def take(self, at_ns: int) -> None:
        """Compare an instant that both have."""
        (base_a, body_a), (base_b, body_b) = self._poses
        if base_a is None or base_b is None:
            return
        self.known = True
        self.base = self.base or _apart(at_ns, base_a, base_b)
        self.person = self.person or _apart(at_ns, body_a, body_b)


@dataclass(frozen=True, slots=True)
class Comparison:
    """What there is to say of two records.

    `ends_ns` are the instants of their last ticks, `altered_ns` of the first that was altered.
    """

    headers: tuple[HeaderDifference, ...]
    figures: tuple[Figure, ...]
    traces: Traces
    motions: Motions
    ends_ns: tuple[int, ...]
    altered_ns: tuple[int | None, ...]

    @property
    def same(self) -> bool:
        """Did the same come out, whatever it took to compute it?"""
        return self.traces.same and all(f.same or f.computing for f in self.figures)


def compare(a: Record, b: Record) -> Comparison:
    """Read both to their ends; then `result` and `broken` of both are there, too.

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
        traces.take(*lines)
        if None not in pair:
            motions.take(ends[0])
    figures = tuple(_figures(a.result or {}, b.result or {}))
    headers = tuple(_headers(a, b))
    return Comparison(headers, figures, traces, motions, tuple(ends), tuple(altered))


def _together(
    a: Iterator[Group], b: Iterator[Group]
) -> Iterator[tuple[Group | None, Group | None]]:
    """The ticks of both in the order of their instants; of equal instants both."""
    one, other = next(a, None), next(b, None)
    while one is not None or other is not None:
        both = [group.ticked.at_ns for group in (one, other) if group is not None]
        mine = one if one is not None and one.ticked.at_ns == min(both) else None
        its = other if other is not None and other.ticked.at_ns == min(both) else None
        yield mine, its
        one = one if mine is None else next(a, None)
        other = other if its is None else next(b, None)


def _trace(group: Group) -> list[TraceLine]:
    found = [trace_line(told) for told in group.of("trace")]
    return [line for line in found if line[1] not in ("note", "tick")]


def _text(line: TraceLine | None) -> str | None:
    return None if line is None else encode(line)


def _apart(at_ns: int, a: Pose2 | None, b: Pose2 | None) -> tuple[int, Pose2, Pose2] | None:
    if a is None or b is None or a == b:
        return None
    near = a.distance_to(b) <= NEAR_M and abs(wrap(a.yaw - b.yaw)) <= NEAR_RAD
    return None if near else (at_ns, a, b)


# figures


def _figures(a: Mapping[str, Any], b: Mapping[str, Any]) -> Iterator[Figure]:
    one, other = (dict(_flat(found)) for found in (a, b))
    for name in sorted({*one, *other} - ASKED):
        yield Figure(name, one.get(name), other.get(name))


def _flat(found: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for name, held in found.items():
        if isinstance(held, Mapping):
            yield from _flat(held, f"{before}{name}.")
        else:
            yield before + name, held


# headers


def _headers(a: Record, b: Record) -> Iterator[HeaderDifference]:
    one, other = (dict(_entries(record.header)) for record in (a, b))
    for what in dict.fromkeys((*one, *other)):
        if one.get(what) != other.get(what):
            yield HeaderDifference(what, one.get(what), other.get(what))
    yield from _files(a, b)


def _entries(header: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Each entry by its name in words."""
    for name, held in header.items():
        if name in LEFT_OUT:
            continue
        if not isinstance(held, Mapping):
            yield name, held
        elif {"name", "sha256"} <= set(held) <= {"name", "sha256", "values"}:
            yield name, f"{held['name']} {held['sha256']}"
            yield from held.get("values", {}).items()
        else:
            words = WORDS.get(name, f"{name} {{}}")
            yield from ((words.format(key), part) for key, part in held.items())


def _files(a: Record, b: Record) -> Iterator[HeaderDifference]:
    """The charts and the profile that were run, wherever they lay; all other files by name."""
    used = [_used(record) for record in (a, b)]
    if not all(PROFILE_TEXT in files for files in used):  # one has a base, or values of its own
        for files in used:
            files.pop(PROFILE_TEXT, None)
    apart = {file for files in used for file in files.values()}
    one, other = (_read(*given, apart) for given in zip((a, b), used, strict=True))
    for what in sorted({*one, *other}):
        (before, mine), (after, its) = (found.get(what, (None, None)) for found in (one, other))
        if before != after:
            lines = () if mine is None or its is None else _differing(mine, its)
            yield HeaderDifference(what, before, after, *lines)


def _used(record: Record) -> dict[str, str]:
    """The files of the charts and of the profile that were run, by what they are."""
    header = record.header
    found = {f"chart {name}": file for name, file in header["charts"].items()}
    for file, told in _hashes(record).items():
        if told == header["profile"]["sha256"]:
            found[PROFILE_TEXT] = file
    return found


def _read(
    record: Record, used: Mapping[str, str], apart: Container[str]
) -> dict[str, tuple[str, list[str] | None]]:
    """Hash and text of what is used, and of the files that are not kept apart."""
    hashes = _hashes(record)
    files = {**used, **{f"file {name}": name for name in hashes if name not in apart}}
    return {what: (hashes[file], _lines(record, file)) for what, file in files.items()}


def _hashes(record: Record) -> dict[str, str]:
    attached = {name: sha256(data) for name, data in record.attachments.items()}
    return {**attached, **record.header["files"]}


def _lines(record: Record, name: str) -> list[str] | None:
    """The text of an attached file; None if there is none, or it is no text."""
    try:
        return record.attachments[name].decode().splitlines()
    except (KeyError, UnicodeDecodeError):
        return None


def _differing(a: list[str], b: list[str]) -> tuple[int, tuple[str, ...]]:
    """How many lines differ, and some of them, from the first place on."""
    found = difflib.SequenceMatcher(None, a, b, autojunk=False).get_opcodes()
    places = [(a[i:j], b[k:m], i, k) for tag, i, j, k, m in found if tag != "equal"]
    count = sum(max(len(mine), len(its)) for mine, its, _, _ in places)
    if not places:
        return 0, ("the ends of lines",)
    shown: list[str] = []
    for mine, its, i, k in places:
        shown += [f"A {n}: {line.strip()}" for n, line in enumerate(mine[:LINES], i + 1)]
        shown += [f"B {n}: {line.strip()}" for n, line in enumerate(its[:LINES], k + 1)]
    return count, tuple(shown[: 2 * LINES])
