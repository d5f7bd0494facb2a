"""What pages say to a server, and what they are told: access, control, commands and questions."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

from cobodeck.live.access import ITSELF, Access
from cobodeck.live.clients import LONGEST_ID, Page, PageMessage, Pages, Source, ack, said

STOP_IS = "a software stop, not a safety device"
AT_ONCE = frozenset({"auth", "beat", "cmd", "layers"})
"""Kinds of messages that wait for nothing; all others are questions."""
ANSWERED_AT_ONCE = 4
"""So many questions, of all pages together: also those of pages that have gone meanwhile."""
NOBODY = Page(0)
"""Whom the server itself speaks for."""
LOOK_S = 0.1
"""Between two looks at whether the controlling page is still there, s."""


class Conversation:
    """Takes the messages of pages.

    Args:
        source: what is shown and commanded.
        pages: those of the server.
        access: who may do what.
    """

    def __init__(self, source: Source, pages: Pages, access: Access) -> None:
        self._source, self._pages, self._access = source, pages, access
        self._answering = asyncio.Semaphore(ANSWERED_AT_ONCE)

    def snapshot(self, page: Page) -> list[PageMessage]:
        """All that a page has to know."""
        hello = {
            "t": "hello", "about": [], "real": False, "commands": self._source.rules.commands,
            "on_parts": self._source.rules.on_parts, "until": None, "signals": [], "layers": [],
            "profiles": [], "stop_is": STOP_IS, **self._source.hello(),
        }  # fmt: skip
        operator = {"operator": self._operator(page)}
        told = map(dict, self._source.snapshot(page))
        return [hello, *(m | operator if m["t"] == "state" else m for m in told)]

    def _operator(self, page: Page) -> dict[str, Any]:
        return {"name": self._access.name, "you": self._access.holder == page.number}

    def _show_operator(self) -> None:
        for page in self._pages:
            page.tell({"t": "ev", "operator": self._operator(page)})

    async def left(self, page: Page) -> None:
        """A page has gone."""
        held = self._access.holder
        self._access.left(page.number)
        if held != self._access.holder:
            with suppress(ConnectionError):  # the run is over
                await self._tell_holder()

    async def take(self, page: Page, message: dict[str, Any]) -> None:
        """Do what a page wants. Questions wait their turn: a stop and signs of life do not."""
        if message["t"] in AT_ONCE:
            await self._try(self._do, page, message)
        elif not page.ask(message):
            page.answer(said(f"{message['t']}: too many questions wait"))

    async def answer_all(self, page: Page) -> None:
        """Answer the questions of a page, one after the other, until it is gone."""
        while (question := await page.question()) is not None:
            async with self._answering:
                if not page.gone:
                    await self._try(self._tell_answers, page, question)

    async def _try(
        self,
        do: Callable[[Page, dict[str, Any]], Awaitable[None]],
        page: Page,
        message: dict[str, Any],
    ) -> None:
        """Do it; whatever is wrong with it, the page is told."""
        try:
            await do(page, message)
        except ConnectionError:
            page.answer(_wrong(message, "the run is over"))
        except (ValueError, TypeError, KeyError) as error:
            page.answer(_wrong(message, f"{message['t']}: {error}"))
        except Exception as error:  # noqa: BLE001  the next one may be a stop
            page.answer(_wrong(message, self._pages.unforeseen(error)))

    async def _do(self, page: Page, message: dict[str, Any]) -> None:
        kind = message["t"]
        if kind == "auth":
            await self._authorize(page, message)
        elif kind == "beat":
            if self._access.beat(page.number):
                await self._source.commanded(page, {"t": "beat"})
        elif kind == "layers":
            page.layers = _layers(message.get("on"))
        else:
            await self._command(page, message)

    async def _tell_answers(self, page: Page, question: dict[str, Any]) -> None:
        for answer in await self._source.asked(page, question):
            page.tell(answer)

    async def _authorize(self, page: Page, message: dict[str, Any]) -> None:
        wrong = self._access.authorize(page.number, message.get("token"), message.get("name"))
        page.name = self._access.name_of(page.number)
        page.answer(ack(message, wrong, f"you are {page.name}"))
        if wrong is None and self._access.holder == page.number:
            await self._tell_holder()

    async def _command(self, page: Page, message: dict[str, Any]) -> None:
        do = str(message.get("do"))[:LONGEST_ID]
        before = self._access.holder
        wrong = self._access.refusal(page.number, do)
        if wrong is not None:
            page.answer(ack(message, wrong))
            return
        if do in ("take", "release"):
            await self._hand_over(page, message, do)
            return
        if before != self._access.holder:
            await self._tell_holder()
        who = page.name or f"page {page.number}"
        answer = await self._source.commanded(page, {**message, "do": do, "who": who, "why": None})
        if answer is not None:
            page.answer(answer)

    async def _hand_over(self, page: Page, message: dict[str, Any], do: str) -> None:
        if do == "release":
            wrong = None if self._access.release(page.number) else "this page has no control"
            page.answer(ack(message, wrong, "released"))
        else:
            before = self._access.take(page.number)
            page.answer(ack(message, None, f"taken over from {before}" if before else "taken"))
            self._pages.tell(said(f"{self._access.name} has control"))
        await self._tell_holder()

    async def _tell_holder(self) -> None:
        """Show who has control, and tell the run, which watches over it, too."""
        self._show_operator()
        await self._source.commanded(NOBODY, {"t": "held", "name": self._access.name})

    async def look_after(self) -> None:
        """Stop a run on parts whose controlling page is missed, until cancelled (R55)."""
        while True:
            await asyncio.sleep(LOOK_S)
            name = self._access.lost()
            if name is None:
                continue
            why = f"the page of {name} is gone"
            lost = {"t": "cmd", "do": "stop", "who": ITSELF, "why": why}
            with suppress(ConnectionError):  # the run is over
                await self._source.commanded(NOBODY, lost)
                await self._tell_holder()


def _layers(on: object) -> set[str]:
    """The layers that a page names.

    Raises:
        ValueError: these are none.
    """
    if not isinstance(on, list) or not all(isinstance(name, str) for name in on):
        raise ValueError("`on` is a list of names of layers")
    return set(on)


def _wrong(message: PageMessage, text: str) -> PageMessage:
    """What is wrong with a message, as its page is told it."""
    return ack(message, text) if message["t"] in ("cmd", "auth") else said(text)
