"""Edit and see: the source of pages that show charts, checked and drawn anew at each save.

Each page has two places side by side, each with a chart, a profile and the used charts that are
unfolded. While a chart's text is broken, its place keeps the last good picture.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from behaviors.profile import profile_names
from cobodeck.live.charts.chart_folder import ChartFolder, Message, Shown
from cobodeck.live.charts.started_runs import StartedRuns
from cobodeck.setup import PROFILE
from engine.files import did_you_mean

if TYPE_CHECKING:
    from cobodeck.live.access import Rules
    from cobodeck.live.source import Page, Pages
    from cobodeck.project import Catalogue

EVERY_S = 0.1
"""How often files are looked at, s."""
SLOTS = 2
MOST_UNFOLDED = 1000
ABOUT = (
    "a chart is checked and drawn at each save",
    "the code of states is read once: start `cobodeck watch` again after changing it",
)


class EditedCharts:
    """A folder of charts, or a chart and those beside it, as a source of the server.

    Args:
        target: the folder or file.
        known: what charts can name.
        profile: the one that is used first, by name or file.

    Raises:
        Problem: there are no charts.
    """

    def __init__(self, target: Path, known: Catalogue, profile: str = PROFILE) -> None:
        self._folder = ChartFolder(target, known)
        self._begin: tuple[Shown | None, ...] = (Shown(self._folder.first, profile), None)
        self._shown: dict[int, list[Shown | None]] = {}
        self._told: dict[Shown, Message] = {}
        self._profiles = sorted({*profile_names(), profile})
        self._turn = asyncio.Lock()
        self._runs = StartedRuns()
        self._list: Message = {"t": "charts", "charts": []}

    def hello(self) -> Message:
        """What a page is told first."""
        return {
            "mode": "charts",
            "title": str(self._folder.target),
            "about": list(ABOUT),
            "commands": True,
            "profiles": self._profiles,
        }

    def access(self) -> Rules:
        """Nothing moves here: only starting a run needs the token."""
        from cobodeck.live.access import Rules

        return Rules()

    def snapshot(self, page: Page) -> Iterable[Message]:
        """The list of charts, and those that the page shows."""
        return [self._list, *self._charts(self._of(page))]

    async def run(self, pages: Pages) -> None:
        """Look at the files again and again, and tell pages what has changed."""
        try:
            await self._tell_list(pages)
            while True:
                await asyncio.sleep(EVERY_S)
                async with self._turn:
                    changed = await asyncio.to_thread(self._folder.look)
                    if changed:
                        await self._renew(pages)
        finally:
            await self._runs.close()

    async def asked(self, page: Page, message: Message) -> Iterable[Message]:
        """Another chart, profile or fold of one of the page's places."""
        slot = 1 if message["t"] == "second" else message.get("slot", 0)
        if slot not in range(SLOTS):
            return [_said(f"no place {slot!r}; 0 or 1")]
        async with self._turn:
            slots = self._of(page)
            chosen = self._chosen(message, slots[slot])
            if isinstance(chosen, str):
                return [_said(chosen)]
            slots[slot] = chosen
            if chosen is None:
                return []
            return [await asyncio.to_thread(self._message, chosen, slot)]

    async def commanded(self, page: Page, message: Message) -> Message:
        """Start a run; there is nothing else to command."""
        if message.get("do") != "start":
            return _ack(message, "nothing runs here; start a chart, its page has all commands")
        file = self._folder.file_of(message.get("chart"))
        if isinstance(file, str):
            return _ack(message, file)
        shown = next((s for s in self._of(page) if s is not None and s.file == file), None)
        profile = PROFILE if shown is None else shown.profile
        result = await self._runs.start(file, profile, message)
        return {**_ack(message, result.text), "ok": result.url is not None, "url": result.url}

    def _chosen(self, message: Mapping[str, Any], before: Shown | None) -> Shown | None | str:
        """What a place is to show now; text: why that cannot be."""
        kind = message["t"]
        if kind in ("second", "show"):
            if message.get("chart") is None:
                return None
            file = self._folder.file_of(message["chart"])
            profile = before.profile if before is not None else self._profile()
            return file if isinstance(file, str) else Shown(file, profile)
        if before is None:
            return "no chart is shown there"
        if kind == "profile":
            name = str(message.get("name"))
            if name not in self._profiles:
                return f"no profile {name!r}; {did_you_mean(name, self._profiles)}"
            return replace(before, profile=name)
        if kind == "unfold":
            paths = message.get("paths")
            if not isinstance(paths, list) or len(paths) > MOST_UNFOLDED:
                return f"`paths` is a list of at most {MOST_UNFOLDED} paths of nodes"
            return replace(before, unfolded=frozenset(map(str, paths)))
        return f"{kind!r} is not for charts that are edited"

    def _profile(self) -> str:
        first = self._begin[0]
        assert first is not None
        return first.profile

    def _of(self, page: Page) -> list[Shown | None]:
        return self._shown.setdefault(page.number, list(self._begin))

    def _message(self, shown: Shown, slot: int) -> Message:
        found = self._folder.chart(shown, slot)
        self._told[shown] = found
        return found

    def _charts(self, slots: Iterable[Shown | None]) -> Iterator[Message]:
        for slot, shown in enumerate(slots):
            if shown is not None:
                yield self._message(shown, slot)

    async def _renew(self, pages: Pages) -> None:
        """Tell each page what is new in its places, then all of them the list of charts."""
        there = {page.number for page in pages}
        self._shown = {number: slots for number, slots in self._shown.items() if number in there}
        before, self._told = self._told, {}
        for page in pages:
            for slot, shown in enumerate(self._of(page)):
                if shown is None:
                    continue
                found = await asyncio.to_thread(self._message, shown, slot)
                if {**found, "slot": None} != {**before.get(shown, {}), "slot": None}:
                    page.tell(found)
        await self._tell_list(pages)

    async def _tell_list(self, pages: Pages) -> None:
        found = await asyncio.to_thread(self._folder.list)
        if found != self._list:
            self._list = found
            pages.tell(found)


def _said(text: str) -> Message:
    return {"t": "say", "text": text}


def _ack(message: Mapping[str, Any], text: str) -> Message:
    return {"t": "ack", "id": message.get("id"), "ok": False, "text": text}
