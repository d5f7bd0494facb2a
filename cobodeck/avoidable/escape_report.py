"""Judged runs as text for people and as values for programs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cobodeck.avoidable.judged import EARLIER_S, JudgedEvent, avoidable_contacts, judge
from cobodeck.avoidable.motion_search import BestMotion
from cobodeck.avoidable.recorded_escapes import RecordedRun, read_run
from cobodeck.avoidable.safety_envelope import EscapePoint, escape_points
from cobodeck.record.read import Record
from cobodeck.terminal import table

HEAD = (
    "at", "what", "decision", "avoidable", "latest", "best gap", "as recorded", "real gap",
    "clear after",
)  # fmt: skip
NUMBERS = frozenset((0, 2, 4, 5, 6, 7, 8))
"""The columns that are aligned to the right."""
ESCAPE = "failed Escape"
POINTS_HEAD = ("record", "at", "what", "person", "distance", "least", "inside", "way out")
POINTS_NOTE = (
    "least: distance of centres from which a robot at rest can escape somebody who walks straight "
    "at it\nat this speed, on open floor · way out: of the search, had they walked straight on"
)
NOTE = (
    "decision, latest: s relative to the event and to the decision · gaps in m: of the best motion "
    "from\nthe decision on, without the stop sign and with the person's recorded future; of what "
    "the robot did"
)


@dataclass(frozen=True, slots=True)
class JudgedRun:
    """A record with its judged events and its Escapes, in order; `broken`: where it breaks off."""

    path: Path
    run: RecordedRun
    events: tuple[JudgedEvent, ...]
    escapes: tuple[EscapePoint, ...] = ()
    broken: str | None = None

    def plain(self) -> dict[str, Any]:
        """As values for JSON."""
        return {
            "record": str(self.path),
            "run": self.run.name,
            "broken": self.broken,
            **counts(self.events),
            "events": [event.plain() for event in self.events],
            "escapes": [point.plain() for point in self.escapes],
        }


def judged_run(path: Path) -> JudgedRun:
    """Read and judge a record.

    Raises:
        FileError: the record cannot be read, or does not tell enough.
    """
    record = Record(path)
    run = read_run(record)
    events, escapes = tuple(judge(run)), tuple(escape_points(run))
    return JudgedRun(path, run, events, escapes, record.broken)


def counts(events: Iterable[JudgedEvent]) -> dict[str, int]:
    """Numbers of failed Escapes and of contacts, and how many of each were avoidable."""
    found = list(events)
    failed = [event for event in found if event.what == ESCAPE]
    contacts = [event for event in found if event.what != ESCAPE]
    return {
        "escape_failures": len(failed),
        "escape_failures_avoidable": sum(event.avoidable for event in failed),
        "contacts": len(contacts),
        "contacts_avoidable": sum(event.avoidable for event in contacts),
    }


def contacts_avoidable(path: Path) -> int:
    """How many of the contacts of base and user in a record were avoidable, as `judged_run` tells.

    Raises:
        FileError: the record cannot be read, or does not tell enough.
    """
    return avoidable_contacts(read_run(Record(path)))


def text(runs: Sequence[JudgedRun]) -> str:
    """The events of each run in columns, and what they come to."""
    parts = [_run_text(found) for found in runs]
    events = [event for found in runs for event in found.events]
    if events:
        parts.append(NOTE)
    points = [point for found in runs for point in found.escapes]
    rows = [
        _point_cells(found.path.stem, point)
        for found in runs
        for point in found.escapes
        if not (point.inside and point.free)
    ]
    if rows:
        parts += [table([POINTS_HEAD, *rows], frozenset((1, 3, 4, 5))), POINTS_NOTE]
    parts.append(_sum(events, points))
    return "\n\n".join(parts)


def _run_text(found: JudgedRun) -> str:
    breaks = "" if found.broken is None else f"; {found.broken}"
    head = f"{found.path}: {found.run.name}{breaks}"
    if not found.events:
        return f"{head}\nno failed Escape, no contact"
    return f"{head}\n\n{table([HEAD, *map(_cells, found.events)], NUMBERS)}"


def _cells(event: JudgedEvent) -> tuple[str, ...]:
    free, recorded = event.best, event.other
    if event.future == "recorded":
        free, recorded = recorded, free
    return (
        f"{event.at_s:.2f} s",
        event.what,
        f"{event.decided_s - event.at_s:+.2f}",
        "yes" if event.avoidable else "no",
        _latest(event),
        _gap(free),
        _gap(recorded),
        f"{event.real_gap:.2f}",
        _clear(event.best),
    )


def _latest(event: JudgedEvent) -> str:
    if event.latest_s is None:
        return f"before {-EARLIER_S:+.1f}"
    return f"{event.latest_s - event.decided_s:+.1f}"


def _clear(motion: BestMotion | None) -> str:
    return "never" if motion is None or motion.clear_s is None else f"{motion.clear_s:.2f} s"


def _gap(motion: BestMotion | None) -> str:
    return "wall" if motion is None else f"{motion.gap:.2f}"


def _point_cells(record: str, point: EscapePoint) -> tuple[str, ...]:
    return (
        record,
        f"{point.at_s:.2f} s",
        f"Escape: {point.outcome or 'broken off'}",
        f"{point.speed:.2f} m/s",
        f"{point.distance:.2f} m",
        "-" if point.least is None else f"{point.least:.2f} m",
        "yes" if point.inside else "no",
        "yes" if point.free else "no",
    )


def _sum(events: Iterable[JudgedEvent], points: Sequence[EscapePoint]) -> str:
    n = counts(events)
    rows = [
        ("failed Escapes", _share(n["escape_failures"], n["escape_failures_avoidable"])),
        ("contacts", _share(n["contacts"], n["contacts_avoidable"])),
        ("Escapes", _escaped(points)),
    ]
    return table(rows)


def _escaped(points: Sequence[EscapePoint]) -> str:
    late = [point for point in points if not point.inside]
    shut = sum(not point.free for point in points)
    failed = sum(point.outcome == "failed" for point in late)
    outside = f"outside of the envelope {len(late)} ({failed} failed)"
    return f"{len(points)}, {outside}, without a way out {shut}"


def _share(count: int, avoidable: int) -> str:
    return f"{count}, avoidable {avoidable} ({avoidable / count:.0%})" if count else "0"
