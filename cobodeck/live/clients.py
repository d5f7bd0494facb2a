"""The pages that are connected: what waits to be sent to each, and what a server shows them.

A page that reads slowly gets the newest frame only. Its events wait, up to a bound; beyond it they
are replaced by a new snapshot.
"""

from __future__ import annotations

import asyncio
import json
from collections import deque
from collections.abc import Awaitable, Callable, Iterable, Iterator, Mapping
from typing import Any, Protocol

from cobodeck.live.access import Rules
from cobodeck.terminal import complain
from engine.run import raised

PageMessage = Mapping[str, Any]
"""A message of the page's protocol: JSON values, with its kind as `t`."""
LARGEST_MESSAGE = 64 << 10
"""Of a page, bytes."""
DEEPEST, LARGEST_NUMBER, LONGEST_ID = 3, 1 << 53, 40
"""Of a message of a page: objects in objects, numbers, characters of its `id` and `do`."""
BOUND = 2 << 20
"""Events that may wait for a page, in characters of JSON."""
MOST_ANSWERS = MOST_QUESTIONS = 200
"""Answers to commands that may wait for a page, and questions of a page that may wait for us; far
more than anybody has at once."""
SLOWEST, FASTEST = 0.1, 100.0
"""Speeds at which runs go on and records are played."""


def encoded(message: PageMessage) -> str:
    """A message as it is sent."""
    return json.dumps(message, separators=(",", ":"))


def parsed(text: str | bytes) -> dict[str, Any] | None:
    """A message of a page; None if it is none that any page sends."""
    try:
        found = json.loads(text)
        json.dumps(found, ensure_ascii=False).encode()  # raises at what is no character
    except (ValueError, RecursionError):
        return None
    if not isinstance(found, dict) or not isinstance(found.get("t"), str):
        return None
    named = found.get("id", 0)
    is_id = isinstance(named, int) or (isinstance(named, str) and len(named) <= LONGEST_ID)
    return found if is_id and _is_plain(found, DEEPEST) else None


def _is_plain(value: object, depth: int) -> bool:
    if isinstance(value, dict | list):
        inside = value.values() if isinstance(value, dict) else value
        return depth > 0 and all(_is_plain(one, depth - 1) for one in inside)
    if isinstance(value, int | float):
        return abs(value) <= LARGEST_NUMBER  # NaN is not
    return True


def number(message: PageMessage, key: str, what: str) -> float:
    """A number in a message of a page; `what` it is, with its unit.

    Raises:
        ValueError: it is none.
    """
    found = message.get(key)
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise ValueError(f"`{key}` is a number, {what}")
    return float(found)


def ack(message: PageMessage, wrong: str | None, text: str = "") -> PageMessage:
    """The answer to a command: `text`, or what is `wrong`."""
    return {"t": "ack", "id": message.get("id"), "ok": wrong is None, "text": wrong or text}


def said(text: str) -> PageMessage:
    """A line for the log."""
    return {"t": "say", "text": text}


class Page:
    """One connection; `number` is never used twice by a server.

    Attributes:
        name: what its operator gave with the token; None without.
        layers: those shown; None: those on by default.
        plots: how many samples of each signal that it plots it was told.
        snapshots: how many it got.
        gone: whether its connection is closed.
    """

    def __init__(self, number: int, bound: int = BOUND) -> None:
        self.number = number
        self.name: str | None = None
        self.layers: set[str] | None = None
        self.plots: dict[str, int] = {}
        self.snapshots = 0
        self._bound, self._size = bound, 0
        self._events: deque[str] = deque()
        self._answers = deque[str](maxlen=MOST_ANSWERS)
        self._questions: deque[dict[str, Any]] = deque()
        self._asked = asyncio.Event()
        self.gone = False
        self._newest: dict[str, str] = {}
        self._renew = True
        self._ready = asyncio.Event()
        self._ready.set()

    @property
    def waiting(self) -> int:
        """Characters that wait to be sent."""
        beside = (*self._answers, *self._newest.values())
        return self._size + sum(map(len, beside))

    def tell(self, message: PageMessage, key: str | None = None) -> None:
        """Send a message; of those with the same `key` only the newest."""
        self.put(encoded(message), key)

    def put(self, text: str, key: str | None = None) -> None:
        """As `tell`, of a message that was encoded already."""
        if key is not None:
            self._newest[key] = text
        elif self._size and self._size + len(text) > self._bound:
            self.renew()
        elif not self._renew:
            self._events.append(text)
            self._size += len(text)
        self._ready.set()

    def answer(self, message: PageMessage) -> None:
        """Answer a command: no snapshot has that, so none replaces it."""
        self._answers.append(encoded(message))
        self._ready.set()

    def ask(self, question: dict[str, Any]) -> bool:
        """Keep a question until it is its turn; False if too many wait.

        Of instants that are sought one after the other, the last one is all that matters.
        """
        waiting = self._questions
        if waiting and waiting[-1]["t"] == question["t"] == "seek":
            waiting.pop()
        if len(waiting) >= MOST_QUESTIONS:
            return False
        waiting.append(question)
        self._asked.set()
        return True

    async def question(self) -> dict[str, Any] | None:
        """The next question, once there is one; None once the page is gone."""
        while not self._questions and not self.gone:
            self._asked.clear()
            await self._asked.wait()
        return None if self.gone else self._questions.popleft()

    def leave(self) -> None:
        """It is gone, and wants no more answers."""
        self.gone = True
        self._asked.set()

    def renew(self) -> None:
        """Send a new snapshot instead of all that waits, but for answers."""
        self._events.clear()
        self._newest.clear()
        self._size, self._renew = 0, True
        self._ready.set()

    async def send_all(
        self,
        send: Callable[[str], Awaitable[None]],
        snapshot: Callable[[Page], Iterable[PageMessage]],
    ) -> None:
        """Send whatever there is to send, until cancelled."""
        while True:
            await self._ready.wait()
            self._ready.clear()
            if self._renew:
                self.snapshots += 1
                told = list(snapshot(self))  # what it is told meanwhile is in there
                self._renew = False
                for message in told:
                    await send(encoded(message))
            while self._answers:
                await send(self._answers.popleft())
            while self._events and not self._renew:
                text = self._events.popleft()
                self._size -= len(text)
                await send(text)
            while self._newest and not self._renew:
                await send(self._newest.pop(next(iter(self._newest))))


class Pages:
    """All pages of a server."""

    def __init__(self) -> None:
        self.by_number: dict[int, Page] = {}
        self._some = asyncio.Event()
        self._wrong = ""

    def add(self, page: Page) -> None:
        """A page has come."""
        self.by_number[page.number] = page
        self._some.set()

    def remove(self, page: Page) -> None:
        """A page has gone."""
        del self.by_number[page.number]
        if not self.by_number:
            self._some.clear()

    async def some(self) -> None:
        """Wait until there is a page."""
        await self._some.wait()

    def __iter__(self) -> Iterator[Page]:
        return iter(list(self.by_number.values()))

    def __len__(self) -> int:
        return len(self.by_number)

    def page(self, number: int) -> Page | None:
        """A page by its number, None if it has gone."""
        return self.by_number.get(number)

    def tell(self, message: PageMessage, key: str | None = None) -> None:
        """Send a message to all; it is encoded once."""
        if self.by_number:
            text = encoded(message)
            for page in self:
                page.put(text, key)

    def renew(self) -> None:
        """Send a new snapshot to all."""
        for page in self:
            page.renew()

    def unforeseen(self, error: Exception) -> str:
        """Tell an error of ours on the terminal and to all, not again and again; returns it."""
        told = f"an error of the program: {raised(0, '', error)}"
        if told != self._wrong:
            self._wrong = told
            complain(f"live page: {told}")
            self.tell(said(told))
        return told


class Source(Protocol):
    """What a server shows; its methods run in the server's event loop."""

    rules: Rules

    def hello(self) -> PageMessage:
        """The message `hello`, as far as the server does not know it itself."""
        ...

    def snapshot(self, page: Page) -> Iterable[PageMessage]:
        """All that a page has to know: charts, room, state, lanes, figures."""
        ...

    async def run(self, pages: Pages) -> None:
        """Tell the pages what changes, until there is nothing more to come."""
        ...

    async def asked(self, page: Page, message: PageMessage) -> Iterable[PageMessage]:
        """The answers to `seek`, `play`, `plot`, `range`, `profile`, `second`."""
        ...

    async def commanded(self, page: Page, message: PageMessage) -> PageMessage | None:
        """Carry out a command with `who`; its `ack`, or None if that comes later.

        Messages of the server itself, too: `beat`, a sign of life of the page that has control,
        and `held`, the `name` of who has it.
        """
        ...
