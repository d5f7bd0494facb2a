"""A run that goes on, as a source of pages: from its feed, in a process of its own."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Collection, Iterable, Mapping
from functools import cached_property
from typing import Any

from cobodeck.live.access import Rules
from cobodeck.live.clients import Page, PageMessage, Pages, number, said
from cobodeck.live.feed import frames
from cobodeck.live.figures import health_of, range_message, range_of
from cobodeck.live.model import RunModel
from cobodeck.live.sources.past import SeenInstant, SeenTicks
from cobodeck.live.sources.plots import SeenSignals, plot_of
from cobodeck.live.sources.seen_room import FRAME_S, SeenRoom, shown_on, tell_frames
from cobodeck.live.sources.seen_run import SeenRun
from cobodeck.pictures.run import Course, CourseReader
from cobodeck.record.read import Group

PAST_BYTES = 64 << 20
"""Of the ticks that pages can look back at, compressed; about an hour of a run with scans."""
HEALTH_S = 1.0
"""Between two messages of health, s."""


class LiveSource:
    """A run from its feed; commands go back on the same socket, as lines of JSON.

    Args:
        run: what is run, made before it begins.
        reader: the feed.
        writer: takes the commands.
        rules: what may be commanded.
    """

    def __init__(
        self,
        run: SeenRun,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        rules: Rules,
    ) -> None:
        self.rules = rules
        self._run, self._reader, self._writer = run, reader, writer
        self._model, self._past = RunModel(), SeenTicks(PAST_BYTES)
        self._fresh = SeenSignals()
        self._looking = asyncio.Lock()
        self._speed = 1.0
        self._replaced = False
        self._health: dict[str, Any] = {}
        self._result: Mapping[str, Any] | None = None
        self._pages = Pages()

    def hello(self) -> PageMessage:
        """The message `hello`."""
        return {**self._run.hello(), "mode": "live", "real": self.rules.real, "until": None}

    def snapshot(self, page: Page) -> Iterable[PageMessage]:  # noqa: ARG002
        """All that a page has to know."""
        self._tell_changes()  # to others: what is new is in there
        seen = self._run
        told = [seen.chart(), seen.place.message(), self._state(), *seen.over_time()]
        return [*told, self._figure_rows()]

    async def run(self, pages: Pages) -> None:
        """Read the feed to its end, telling pages what happens."""
        self._pages = pages
        reading = asyncio.create_task(self._read())
        tasks = [
            reading,
            asyncio.create_task(self._tell_often()),
            asyncio.create_task(tell_frames(pages, self._seen)),
        ]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            for task in tasks:
                task.cancel()
        self._tell_changes()
        self._pages.tell(self._figure_rows())
        self._pages.tell({"t": "ev", "over": True})

    def _seen(self) -> list[tuple[SeenRoom, RunModel, int]]:
        return [(self._run.place, self._model, 0)]

    async def _read(self) -> None:
        async for kind, content in frames(self._reader):
            try:
                self._take(kind, content)
                if self._replaced:
                    await asyncio.to_thread(self._run.chart)  # meanwhile, pages can stop the run
                    self._replaced = False
                    self._pages.renew()
            except Exception as error:  # noqa: BLE001  who watches can still stop
                self._pages.unforeseen(error)

    async def asked(self, page: Page, message: PageMessage) -> Iterable[PageMessage]:
        """An instant that is past, figures of a range, a plot, or the text of a chart."""
        kind = message["t"]
        if kind == "text":
            return [self._run.text(message.get("chart"))]
        if kind == "plot":
            return await self._plot(page, message)
        if kind == "range":
            between = range_of(message)
            return [range_message(await asyncio.to_thread(self._course), between)]
        if kind != "seek":
            return [said(f"{kind}: only for records, this run goes on")]
        if message.get("at") is None:  # back to what is now
            page.renew()
            return []
        at_ns = round(number(message, "at", "s in the run") * 1e9)
        async with self._looking:
            return await asyncio.to_thread(self._look, at_ns, shown_on(page))

    @cached_property
    def _then(self) -> SeenInstant:
        return SeenInstant(self._past, SeenRoom(self._run.setup))

    def _look(self, at_ns: int, shown: Collection[str]) -> list[PageMessage]:
        """State and map of an instant that is past, and the charts if others run now."""
        then = self._then
        then.seek(at_ns)
        charts = [self._run.chart(then.model.at_ns)] if self._run.version() else []
        state = {**then.model.state(), "speed": self._speed, "back": True}
        shapes = then.place.shapes(then.place.moment(then.model), shown)
        return [*charts, state, {"t": "frame", "at": state["at"], "shapes": shapes, "back": True}]

    def _course(self) -> Course:
        reader = CourseReader(self._run.setup)
        for group in self._past.groups():
            reader.add(group)
        return reader.course()

    async def _plot(self, page: Page, message: PageMessage) -> list[PageMessage]:
        signal = str(message.get("signal"))
        if signal not in self._run.signals:
            return [said(f"no signal {signal!r}; the list has all")]
        if not message.get("on"):
            page.plots.pop(signal, None)
            return []
        count = self._fresh.count[signal]
        found = await asyncio.to_thread(plot_of, signal, self._past.samples(signal))
        page.plots[signal] = count
        return [] if found is None else [found]

    async def commanded(self, page: Page, message: PageMessage) -> PageMessage | None:
        """Pass a command, or what the server says itself, on to the run; an `ack` comes later."""
        told = {**message, "page": page.number}
        self._writer.write(json.dumps(told).encode() + b"\n")
        await self._writer.drain()
        return None

    def _state(self) -> dict[str, Any]:
        return {**self._model.state(), "speed": self._speed}

    def _take(self, kind: str, content: Any) -> None:
        if kind == "begin":
            self._run.begin(content)
            self._pages.renew()
        elif kind == "tick":
            self._tick(content)
        elif kind == "whole":
            self._past.close()
            self._model.renew(content)
            self._run.renew(content)
            self._replaced |= content.charts is not None
            self._pages.renew()
        elif kind == "result":
            self._result = content
        elif kind == "ack":
            page = self._pages.page(content.pop("page"))
            if page is not None:
                page.answer({"t": "ack", **content})
        elif kind == "say":
            self._pages.tell(said(content))
        elif kind == "health":
            self._health = content
        elif kind == "status":
            self._status(content)

    def _tick(self, group: Group) -> None:
        self._past.add(group, self._model)
        self._fresh.add(group)
        self._model.add(group)
        self._run.add(group)
        self._run.place.obstacles.add(group)
        commands = group.messages("operator")
        self._replaced |= any(told["command"] == "Replace" for told in commands)

    def _status(self, told: Mapping[str, Any]) -> None:
        for key, value in told.items():
            if key == "speed":
                self._speed = value
                self._pages.tell({"t": "ev", "speed": value})
            else:
                self._model.tell(key, value)

    async def _tell_often(self) -> None:
        clock = asyncio.get_running_loop()
        due = health = clock.time()
        while True:
            await self._pages.some()
            due = max(due + FRAME_S, clock.time())
            await asyncio.sleep(due - clock.time())
            try:
                self._tell_changes()
                if clock.time() >= health:
                    health = clock.time() + HEALTH_S
                    self._tell_figures()
            except Exception as error:  # noqa: BLE001  who watches can still stop
                self._pages.unforeseen(error)

    def _tell_figures(self) -> None:
        self._pages.tell(self._health_message(), "health")
        self._pages.tell(self._figure_rows(), "figures")

    def _tell_changes(self) -> None:
        changes = self._model.changes()
        if changes is not None:
            self._pages.tell(changes)
        if not len(self._pages):
            return
        for told in self._run.news():
            self._pages.tell(told)
        for page in self._pages:
            for signal, count in page.plots.items():
                new = self._fresh.since(signal, count)
                page.plots[signal] = self._fresh.count[signal]
                if (more := plot_of(signal, new, more=True)) is not None:
                    page.tell(more)

    def _health_message(self) -> PageMessage:
        return {**health_of(self._model), **self._health, "pages": len(self._pages)}

    def _figure_rows(self) -> PageMessage:
        return self._run.figures(self._model, self._result)
