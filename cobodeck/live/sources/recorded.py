"""One or two records as a source of pages: any instant, played at any speed, figures of a range.

A record is read once. Its ticks are kept compressed, in blocks, with what the run looked like
before each, so that any instant is near. All pages of a server see the same instant.
"""

from __future__ import annotations

import asyncio
import pickle
import zlib
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import hypot
from pathlib import Path
from typing import Any

from cobodeck.live.access import Rules
from cobodeck.live.clients import Message, Page, Pages, number
from cobodeck.live.model import RunModel
from cobodeck.live.sources.seen_room import FRAME_S, SeenRoom, tell_frames
from cobodeck.live.sources.seen_run import SeenRun, numbers_of
from cobodeck.pictures.run import Course, course_of
from cobodeck.project import catalogue
from cobodeck.record.format import TOPIC, sample_of
from cobodeck.record.read import Group, Record

BLOCK = 300
"""Ticks in a block: 10 s at 30 Hz."""
SLOWEST, FASTEST = 0.1, 100.0
MOST_POINTS = 5000
"""Of a plotted signal; of more only some are sent."""


@dataclass(frozen=True, slots=True)
class _Block:
    """Ticks from `from_ns` on, and the run before them."""

    from_ns: int
    packed: bytes
    before: RunModel

    def groups(self) -> list[Group]:
        found: list[Group] = pickle.loads(zlib.decompress(self.packed))  # packed by ourselves
        return found


class SeenRecord:
    """A record, read; `seen` is what a page shows of all of it, `model` the run at an instant.

    Raises:
        FileError, Problem: the record does not hold what was run.
    """

    def __init__(self, path: Path, slot: int = 0) -> None:
        self.record = Record(path)
        self.record.require_ticks()
        self.seen = SeenRun(self.record, catalogue(own=False), slot)
        self._blocks: list[_Block] = []
        self._read()
        self.model = self._blocks[0].before.copied()
        self._rest: Iterator[Group] = iter(())
        self._next: Group | None = None
        self.seek(0)

    def _read(self) -> None:
        model, groups = RunModel(), list[Group]()
        before = model.copied()

        def close() -> None:
            packed = zlib.compress(pickle.dumps(groups, pickle.HIGHEST_PROTOCOL), 1)
            self._blocks.append(_Block(groups[0].ticked.at_ns, packed, before))

        for group in self.record.groups():
            with self.record.understood(group):
                self.seen.add(group)
                model.add(group)
            groups.append(group)
            if len(groups) == BLOCK:
                close()
                groups, before = [], model.copied()
        if groups:
            close()
        self.end_ns = model.at_ns

    def groups(self, from_ns: int = 0) -> Iterator[Group]:
        """The ticks, from those of the block that has this instant."""
        for block in self._blocks[self._number(from_ns) :]:
            yield from block.groups()

    def _number(self, at_ns: int) -> int:
        return max(0, bisect_right(self._blocks, at_ns, key=lambda block: block.from_ns) - 1)

    def seek(self, at_ns: int) -> None:
        """Go to an instant: all ticks up to it have been taken."""
        self.model = self._blocks[self._number(at_ns)].before.copied()
        self._rest = self.groups(at_ns)
        self._next = next(self._rest, None)
        self.go_on(at_ns)

    def go_on(self, at_ns: int) -> None:
        """Go forward to an instant."""
        while self._next is not None and self._next.ticked.at_ns <= at_ns:
            self.model.add(self._next)
            self._next = next(self._rest, None)

    @cached_property
    def course(self) -> Course:
        """The whole run, judged as in its figures."""
        return course_of(self.record)

    def plot(self, signal: str) -> Message | None:
        """All values of a signal, as numbers; None if it has none."""
        fields: list[str] = []
        times, rows = list[float](), list[list[float]]()
        for group in self.groups():
            for told in group.told:
                if told.topic == TOPIC + signal:
                    sample = sample_of(signal, told.schema, told.data)
                    found = dict(numbers_of(sample.value))
                    fields = fields or list(found)
                    if list(found) == fields and fields:
                        times.append(sample.stamp_ns / 1e9)
                        rows.append(list(found.values()))
        if not rows:
            return None
        step = -(-len(rows) // MOST_POINTS)
        plot = {"t": "plot", "signal": signal, "fields": fields, "at": times[::step]}
        values = [list(column) for column in zip(*rows[::step], strict=True)]
        return {**plot, "values": values, "more": False, **self.seen.slotted}


class RecordSource:
    """Records as a source; see the module."""

    rules = Rules()

    def __init__(self, runs: Sequence[SeenRecord]) -> None:
        self._runs = runs
        self._at = 0.0
        self._speed = 0.0
        self._pages = Pages()
        self._changed = asyncio.Event()

    @classmethod
    def of(cls, paths: Sequence[Path]) -> RecordSource:
        """Read records.

        Raises:
            FileError, Problem: one cannot be read, or does not hold what was run.
        """
        return cls([SeenRecord(path, slot) for slot, path in enumerate(paths)])

    @property
    def until(self) -> float:
        """The end of the longer one, s."""
        return max(run.end_ns for run in self._runs) / 1e9

    def hello(self) -> Message:
        """The message `hello`."""
        first = self._runs[0]
        files = [run.record.path.name for run in self._runs]
        found = first.seen.hello()
        about = [*files, *found["about"], *filter(None, [first.record.broken])]
        return {**found, "mode": "record", "about": about, "until": self.until}

    def snapshot(self, page: Page) -> Iterable[Message]:  # noqa: ARG002
        """All that a page has to know."""
        for run in self._runs:
            yield from run.seen.charts()
            yield run.seen.room()
            yield self._state(run)
            yield run.seen.lanes()
            yield self._figures(run)

    def _state(self, run: SeenRecord) -> Message:
        return {**run.model.state(), "at": self._at, "speed": self._speed, **run.seen.slotted}

    def _figures(self, run: SeenRecord) -> Message:
        return {"t": "figures", "rows": run.model.figures(), "range": None, **run.seen.slotted}

    async def run(self, pages: Pages) -> None:
        """Play while there is a speed, and show what moves."""
        self._pages = pages
        await asyncio.gather(self._play_on(), tell_frames(pages, self._seen))

    def _seen(self) -> list[tuple[SeenRoom, RunModel, int]]:
        return [(run.seen.place, run.model, run.seen.slot) for run in self._runs]

    async def _play_on(self) -> None:
        clock = asyncio.get_running_loop()
        before = clock.time()
        while True:
            if not self._speed:
                self._changed.clear()
                await self._changed.wait()
                before = clock.time()
            await asyncio.sleep(FRAME_S)
            now = clock.time()
            self._at = min(self.until, self._at + (now - before) * self._speed)
            before = now
            self._show()
            if self._at >= self.until:
                self._play(0.0)

    def _show(self) -> None:
        for run in self._runs:
            run.go_on(round(self._at * 1e9))
            changes = run.model.changes() or {"t": "ev"}
            self._pages.tell({**changes, "at": self._at, **run.seen.slotted})
            self._pages.tell(self._figures(run), f"figures{run.seen.slot}")

    def _play(self, speed: float) -> None:
        self._speed = speed
        self._changed.set()
        self._pages.tell({"t": "ev", "at": self._at, "speed": speed})

    async def asked(self, page: Page, message: Message) -> Iterable[Message]:  # noqa: ARG002
        """Seek and play for all pages; plots and figures of a range for the one that asks."""
        kind = message["t"]
        if kind == "seek":
            self._at = min(self.until, max(0.0, number(message, "at", "s in the run")))
            for run in self._runs:
                run.seek(round(self._at * 1e9))
                run.model.changes()
            self._tell_states()
        elif kind == "play":
            speed = number(message, "speed", f"0 or from {SLOWEST:g} to {FASTEST:g}")
            self._play(min(FASTEST, max(SLOWEST, speed)) if speed else 0.0)
        elif kind == "plot":
            if not message.get("on"):
                return []
            signal = str(message.get("signal"))
            plots = [await asyncio.to_thread(run.plot, signal) for run in self._runs]
            return [plot for plot in plots if plot is not None]
        elif kind == "range":
            ends = (number(message, key, "s in the run") for key in ("from", "to"))
            between = next(ends), next(ends)
            return [await asyncio.to_thread(range_message, run, between) for run in self._runs]
        return []

    def _tell_states(self) -> None:
        """States and frames at another instant; what does not depend on it stays as it is."""
        for run in self._runs:
            self._pages.tell({**self._state(run), "operator": {"name": None, "you": False}})
            self._pages.tell(self._figures(run), f"figures{run.seen.slot}")

    async def commanded(self, page: Page, message: Message) -> Message | None:  # noqa: ARG002
        """Refuse: what is on record has happened."""
        return {"t": "ack", "id": message.get("id"), "ok": False, "text": "this is a record"}


def range_message(run: SeenRecord, between: tuple[float, float]) -> Message:
    """The figures of a part of a run.

    Raises:
        ValueError: that part is empty.
    """
    course = run.course.between(*between)
    rows = list(_figures_of(course))
    return {"t": "figures", "rows": rows, "range": list(between), **run.seen.slotted}


def _figures_of(course: Course) -> Iterator[tuple[str, Any]]:
    yield "time", f"{course.end_s - course.start_s:.1f} s"
    poses = [instant.robot for instant in course.instants]
    if poses:
        travelled = sum(hypot(b.x - a.x, b.y - a.y) for a, b in pairwise(poses))
        yield "travelled", f"{travelled:.1f} m"
    gaps = [instant.gap for instant in course.instants if instant.gap is not None]
    if gaps:
        yield "least gap", f"{min(gaps):.2f} m"
    served = [r for r in course.requests if r.served_s is not None]
    if course.requests:
        yield "requests", f"{len(course.requests)}, served {len(served)}"
    times = [r.served_s - r.start_s for r in served if r.served_s is not None]
    if times:
        yield "response", f"{sum(times) / len(times):.2f} s on average"
    if course.contacts is not None:
        yield "contacts", str(len(course.contacts))
    if course.hits:
        yield "touches of walls and things", str(len(course.hits))
    for lane in course.lanes:
        spans = course.spans_of(lane)
        low, high = course.start_s, course.end_s
        lasted = sum(min(s.end_s, high) - max(s.start_s, low) for s in spans)
        if spans:
            yield course.charts.get(lane, lane), f"{len(spans)} times, {lasted:.1f} s"
