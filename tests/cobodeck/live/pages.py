"""A server with a source of the tests, and clients of it."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Coroutine, Iterable
from contextlib import asynccontextmanager
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

from cobodeck.live.access import PageAddress, Rules
from cobodeck.live.clients import Page, PageMessage, Pages
from cobodeck.live.server import PageServer

TOKEN = "right"
PATIENCE_S = 20.0
COMMANDED = Rules(commands=True)


class Shown:
    """A source that keeps what it is told."""

    def __init__(self, rules: Rules = COMMANDED, size: int = 0) -> None:
        self.rules = rules
        self.orders: list[PageMessage] = []
        self.questions: list[PageMessage] = []
        self.pages = Pages()
        self._filling = "x" * size

    def hello(self) -> PageMessage:
        return {"mode": "live", "title": "shown"}

    def snapshot(self, page: Page) -> Iterable[PageMessage]:
        return [{"t": "state", "at": 0.0, "filling": self._filling}]

    async def run(self, pages: Pages) -> None:
        self.pages = pages
        await asyncio.Event().wait()

    async def asked(self, page: Page, message: PageMessage) -> Iterable[PageMessage]:
        self.questions.append(message)
        return [{"t": "say", "text": "asked"}]

    async def commanded(self, page: Page, message: PageMessage) -> PageMessage | None:
        self.orders.append(message)
        return {"t": "ack", "id": message.get("id"), "ok": True, "text": "done"}

    @property
    def done(self) -> list[str]:
        return [str(order["do"]) for order in self.orders if order["t"] == "cmd"]


class Client:
    """A page, as the tests see it."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket

    async def tell(self, **message: Any) -> None:
        await self.socket.send(json.dumps(message))

    async def hear(self, kind: str, **wanted: Any) -> dict[str, Any]:
        """The next message of a kind with these values."""
        async with asyncio.timeout(PATIENCE_S):
            while True:
                found = json.loads(await self.socket.recv())
                if found["t"] == kind and wanted.items() <= found.items():
                    return dict(found)

    async def command(self, do: str, **more: Any) -> dict[str, Any]:
        await self.tell(t="cmd", id=do, do=do, **more)
        return await self.hear("ack", id=do)

    async def authorize(self, name: str, token: str = TOKEN) -> dict[str, Any]:
        await self.tell(t="auth", id="auth", token=token, name=name)
        return await self.hear("ack", id="auth")


def client(server: PageServer, **more: Any) -> connect:
    more.setdefault("origin", server.url.rstrip("/"))
    return connect(f"{server.url.replace('http', 'ws')}ws", max_size=None, **more)


@asynccontextmanager
async def serving(source: Any, now: Callable[[], float] | None = None) -> Any:
    more = {} if now is None else {"now": now}
    server = PageServer(source, PageAddress(), TOKEN, **more)
    await server.start()
    try:
        yield server
    finally:
        await server.close()


def run(main: Coroutine[Any, Any, None], limit_s: float = 60.0) -> None:
    async def limited() -> None:
        async with asyncio.timeout(limit_s):
            await main

    asyncio.run(limited())


async def until(held: Callable[[], object]) -> None:
    """Wait until something holds."""
    async with asyncio.timeout(PATIENCE_S):
        while not held():
            await asyncio.sleep(0.01)
