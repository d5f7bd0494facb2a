"""Edit and see: the source of pages that show charts, checked and drawn anew at each save.

Each page has two places side by side, each with a chart, a profile and the used charts that are
unfolded. While a chart's text is broken, its place keeps the last good picture.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

from behaviors.profile import profile_names
from cobodeck.live.access import PageAddress, Rules
from cobodeck.live.charts.chart_folder import EVERY_S, ChartFolder, Shown
from cobodeck.live.charts.drawn_chart import stop_drawing
from cobodeck.live.charts.file_watch import stamp_of
from cobodeck.live.charts.started_runs import StartedRuns
from cobodeck.live.clients import Page, PageMessage, Pages, ack, said
from cobodeck.setup import PROFILE
from engine.files import did_you_mean
from hw.people.walking import route, script_names, wanderer
from hw.scene import scene_names

if TYPE_CHECKING:
    from cobodeck.project import Catalogue

SLOTS = 2
LONG_S = 2.0
"""A picture that takes longer, s, is given up when its chart is saved again."""
ABOUT = (
    "a chart is checked and drawn at each save",
    "the code of states is read once: start `cobodeck watch` again after changing it",
)


@dataclass(slots=True)
class _Place:
    """One of the places of a page: what it shows, and what was told of it last."""

    shown: Shown | None
    told: PageMessage | None = None


class EditedCharts:
    """A folder of charts, or a chart and those beside it, as a source of the server.

    Nothing moves here: the one command is to start a run, which needs the token.

    Args:
        target: the folder or file.
        known: what charts can name.
        profile: the one that is used first, by name or file.
        host: the address at which the pages of runs are served that are started here.

    Raises:
        Problem: there are no charts.
    """

    rules = Rules(commands=True, open=frozenset())

    def __init__(
        self, target: Path, known: Catalogue, profile: str = PROFILE, host: str = PageAddress().host
    ) -> None:
        self._folder = ChartFolder(target, known)
        self._profile = profile
        self._places: WeakKeyDictionary[Page, tuple[_Place, ...]] = WeakKeyDictionary()
        self._profiles = sorted({*profile_names(), profile})
        self._turn = asyncio.Lock()
        self._runs = StartedRuns(host=host)
        self._starting: dict[Page, asyncio.Task[None]] = {}
        self._list: PageMessage = {"t": "charts", "charts": []}

    def hello(self) -> PageMessage:
        """What a page is told first."""
        target = self._folder.target
        return {
            "mode": "charts",
            "title": str(target if target.name else target.resolve().name),
            "about": list(ABOUT),
            "profiles": self._profiles,
            "scenes": list(scene_names()),
            "users": [*script_names(), *(source.NAME for source in (route, wanderer))],
        }

    def snapshot(self, page: Page) -> Iterable[PageMessage]:
        """The list of charts, and those that were told already; the others follow."""
        return [self._list, *(p.told for p in self._of(page) if p.told is not None)]

    async def run(self, pages: Pages) -> None:
        """Look at the files again and again, and tell pages what has changed."""
        try:
            await self._tell_list(pages)
            while True:
                await pages.some()
                async with self._turn:
                    await self._look(pages)
                await asyncio.sleep(EVERY_S)
        finally:
            stop_drawing()
            await self._runs.close()

    async def asked(self, page: Page, message: PageMessage) -> Iterable[PageMessage]:
        """Another chart, profile or fold of one of the page's places."""
        slot = 1 if message["t"] == "second" else message.get("slot", 0)
        if slot not in range(SLOTS):
            return [said(f"no place {slot!r}; 0 or 1")]
        async with self._turn:
            place = self._of(page)[slot]
            chosen = await asyncio.to_thread(self._chosen, message, place.shown)
            if isinstance(chosen, str):
                return [said(chosen)]
            place.shown, place.told = chosen, None
            if chosen is None:
                return []
            found = await self._told(place, chosen, slot)
            return [] if found is None else [found]

    async def commanded(self, page: Page, message: PageMessage) -> PageMessage | None:
        """Start a run; there is nothing else to command."""
        if message["t"] != "cmd":  # who controls is nothing to a chart
            return None
        if message["do"] != "start":
            return ack(message, "nothing runs here; start a chart, its page has all commands")
        file = self._folder.file_of(message.get("chart"))
        if isinstance(file, str):
            return ack(message, file)
        all_shown = (place.shown for place in self._of(page))
        shown = next((s for s in all_shown if s is not None and s.file == file), None)
        profile = self._profile if shown is None else shown.profile
        if page in self._starting:
            return ack(message, "a run begins already; wait until it has")
        starting = asyncio.create_task(self._start(page, message, file, profile))
        self._starting[page] = starting
        starting.add_done_callback(lambda _: self._starting.pop(page))
        return None

    async def _start(self, page: Page, message: PageMessage, file: Path, profile: str) -> None:
        try:
            result = await self._runs.start(file, profile, message, lambda t: page.tell(said(t)))
        except Exception as error:  # noqa: BLE001  the page waits for an answer
            page.answer(ack(message, f"it cannot be started: {type(error).__name__}: {error}"))
            return
        wrong = result.text if result.url is None else None
        page.answer({**ack(message, wrong, result.text), "url": result.url})

    def _chosen(self, message: Mapping[str, Any], before: Shown | None) -> Shown | str | None:
        """What a place is to show now; text: why that cannot be."""
        kind = message["t"]
        if kind in ("second", "show"):
            if message.get("chart") is None:
                return None
            file = self._folder.file_of(message["chart"])
            profile = before.profile if before is not None else self._profile
            return file if isinstance(file, str) else Shown(file, profile)
        if before is None:
            return "no chart is shown there"
        if kind == "profile":
            name = str(message.get("name"))
            if name not in self._profiles:
                return f"no profile {name!r}; {did_you_mean(name, self._profiles)}"
            return replace(before, profile=name)
        if kind == "unfold":
            return replace(before, unfolded=self._unfolded(message, before))
        return f"{kind!r} is not for charts that are edited"

    def _unfolded(self, message: Mapping[str, Any], before: Shown) -> frozenset[str] | None:
        """What is open once a page has opened or closed one `path`, or all of them (None)."""
        path, on = message.get("path"), bool(message.get("on"))
        if path is None:
            return None if on else frozenset()
        nodes = self._folder.chart(before, 0)["nodes"]
        used = frozenset(path for path, node in nodes.items() if node["kind"] == "use")
        open_ = used if before.unfolded is None else before.unfolded
        return (open_ | {str(path)} if on else open_ - {str(path)}) & used

    def _of(self, page: Page) -> tuple[_Place, ...]:
        first = Shown(self._folder.first, self._profile)
        return self._places.setdefault(page, (_Place(first), _Place(None)))

    async def _told(self, place: _Place, shown: Shown, slot: int) -> PageMessage | None:
        """The message of what a place shows, which is told now; None: it is saved again already."""
        clock, stamp = asyncio.get_running_loop().time, stamp_of(shown.file)
        making = asyncio.create_task(asyncio.to_thread(self._folder.chart, shown, slot))
        begin, stopped = clock(), False
        while not (await asyncio.wait([making], timeout=EVERY_S))[0]:
            if clock() - begin > LONG_S and stamp_of(shown.file) != stamp:
                stopped = True
                stop_drawing()
        if stopped:
            return None
        place.told = making.result()
        return place.told

    async def _look(self, pages: Pages) -> None:
        try:
            changed = await asyncio.to_thread(self._folder.look)
            for page in pages:
                for slot, place in enumerate(self._of(page)):
                    if place.shown is not None and (changed or place.told is None):
                        before = place.told
                        found = await self._told(place, place.shown, slot)
                        if found is not None and found != before:
                            page.tell(found)
            if changed:
                await self._tell_list(pages)
        except Exception as error:  # noqa: BLE001  pages outlive whatever files bring about
            pages.tell(said(f"{type(error).__name__}: {error}"))

    async def _tell_list(self, pages: Pages) -> None:
        found = await asyncio.to_thread(self._folder.listing)
        if found != self._list:
            self._list = found
            pages.tell(found)
