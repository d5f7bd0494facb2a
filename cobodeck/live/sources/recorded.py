"""One or two records as a source of pages: any instant, played at any speed, figures of a range.

All pages of a server see the same instant.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Sequence
from pathlib import Path

from cobodeck.live.access import Rules
from cobodeck.live.clients import FASTEST, SLOWEST, Page, PageMessage, Pages, ack, number
from cobodeck.live.figures import health_of, range_message, range_of
from cobodeck.live.model import RunModel
from cobodeck.live.sources.seen_record import SeenRecord
from cobodeck.live.sources.seen_room import FRAME_S, SeenRoom, tell_frames

HEALTH_S = 0.5
"""Between two messages of health while a record is played, s."""


class RecordSource:
    """Records as a source; see the module.

    Raises:
        FileError, Problem: one cannot be read, or does not hold what was run.
    """

    rules = Rules()

    def __init__(self, paths: Sequence[Path]) -> None:
        self._runs = [SeenRecord(path, slot) for slot, path in enumerate(paths)]
        self._at = 0.0
        self._speed = 0.0
        self._pages = Pages()
        self._changed = asyncio.Event()

    @property
    def until(self) -> float:
        """The end of the longer one, s."""
        return max(run.end_ns for run in self._runs) / 1e9

    def hello(self) -> PageMessage:
        """The message `hello`."""
        first = self._runs[0]
        records = [run.record for run in self._runs]
        files = [record.path.name for record in records]
        found = first.seen.hello()
        about = [*files, *found["about"]]
        about += [f"{r.record.path.name}: {r.broken}" for r in self._runs if r.broken]
        if any(r.header["scene"] != first.record.header["scene"] for r in records):
            about.append(f"their rooms differ: the map has that of {files[0]}")
        signals = [run.seen.hello()["signals"] for run in self._runs]
        runs = [{"title": n, "signals": s} for n, s in zip(files, signals, strict=True)]
        moves = sorted({at for run in self._runs for at in run.moves_s})
        ends = {"until": self.until, "moves": moves}
        return {**found, "mode": "record", "about": about, "runs": runs, **ends}

    def snapshot(self, page: Page) -> Iterable[PageMessage]:  # noqa: ARG002
        """All that a page has to know."""
        yield self._runs[0].seen.place.message()
        for run in self._runs:
            yield run.chart()
            yield self._state(run)
            yield from run.seen.over_time()
            yield self._figures(run)
            yield self._health(run)

    def _state(self, run: SeenRecord) -> PageMessage:
        return {**run.model.state(), "at": self._at, "speed": self._speed, **run.seen.slotted}

    def _figures(self, run: SeenRecord) -> PageMessage:
        is_over = round(self._at * 1e9) >= run.end_ns
        return run.seen.figures(run.model, run.record.result if is_over else None)

    def _health(self, run: SeenRecord) -> PageMessage:
        return {**health_of(run.model), "pages": len(self._pages), **run.seen.slotted}

    async def run(self, pages: Pages) -> None:
        """Play while there is a speed, and show what moves."""
        self._pages = pages
        await asyncio.gather(self._play_on(), tell_frames(pages, self._seen))

    def _seen(self) -> list[tuple[SeenRoom, RunModel, int]]:
        return [(run.seen.place, run.model, run.seen.slot) for run in self._runs]

    async def _play_on(self) -> None:
        clock = asyncio.get_running_loop()
        before = health = clock.time()
        while True:
            if not self._speed:
                self._changed.clear()
                await self._changed.wait()
                before = clock.time()
            await asyncio.sleep(FRAME_S)
            now = clock.time()
            self._at = min(self.until, self._at + (now - before) * self._speed)
            before = now
            await self._show()
            if now >= health:
                health = now + HEALTH_S
                self._tell_figures()
            if self._at >= self.until:
                self._play(0.0)

    async def _show(self) -> None:
        for run in self._runs:
            before = run.version
            run.go_on(round(self._at * 1e9))
            if run.version != before:
                await self._tell_chart(run)
            changes = run.model.changes() or {"t": "ev"}
            self._pages.tell({**changes, "at": self._at, **run.seen.slotted})

    async def _tell_chart(self, run: SeenRecord) -> None:
        self._pages.tell(await asyncio.to_thread(run.chart))

    def _tell_figures(self) -> None:
        for run in self._runs:
            self._pages.tell(self._figures(run), f"figures{run.seen.slot}")
            self._pages.tell(self._health(run), f"health{run.seen.slot}")

    def _play(self, speed: float) -> None:
        self._speed = speed
        self._changed.set()
        self._pages.tell({"t": "ev", "at": self._at, "speed": speed})

    async def asked(self, page: Page, message: PageMessage) -> Iterable[PageMessage]:  # noqa: ARG002
        """Seek and play for all pages; plots and figures of a range for the one that asks."""
        kind = message["t"]
        if kind == "seek":
            self._at = min(self.until, max(0.0, number(message, "at", "s in the run")))
            await self._seek()
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
            between = range_of(message)
            return [await asyncio.to_thread(self._range, run, between) for run in self._runs]
        return []

    def _range(self, run: SeenRecord, between: tuple[float, float]) -> PageMessage:
        return range_message(run.course, between) | run.seen.slotted

    async def _seek(self) -> None:
        """Charts, states and figures of another instant; what does not depend on it stays."""
        for run in self._runs:
            before = run.version
            run.seek(round(self._at * 1e9))
            if run.version != before:
                await self._tell_chart(run)
            run.model.changes()
            self._pages.tell({**self._state(run), "operator": {"name": None, "you": False}})
        self._tell_figures()

    async def commanded(self, page: Page, message: PageMessage) -> PageMessage | None:  # noqa: ARG002
        """Refuse: what is on record has happened."""
        return ack(message, "this is a record")
