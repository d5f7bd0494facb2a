"""Serves pages: files by HTTP, everything else through one WebSocket `/ws`, on one port.

What it serves may be loaded by anybody who reaches the port; see `access.py` for who may do what.
Requests for other hosts (names that were made to point here) and from pages of others are refused.
Connections, messages and what waits to be sent are bounded.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve as serve_sockets
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from cobodeck.live.access import Access, PageAddress, is_ours, is_same_origin
from cobodeck.live.clients import LARGEST_MESSAGE, Page, Pages, Source, parsed
from cobodeck.live.conversation import Conversation
from cobodeck.live.page_files import page_file, refusal

MOST_PAGES, MOST_CONNECTIONS = 64, 128
UNREAD = 4 << 20
"""A connection that does not read is cut off above so many bytes."""
RATE, BURST = 50.0, 200.0
"""Messages of one page: per s, and at once."""
PING_S, PATIENCE_S, OPENING_S = 5.0, 10.0, 5.0
UNLOGGED = logging.getLogger(__name__)
"""What clients do wrong is told to them, and does not fill the terminal of a run."""
UNLOGGED.addHandler(logging.NullHandler())
UNLOGGED.propagate = False


class PageServer:
    """Serves one source to many pages.

    Args:
        source: what is shown.
        address: where; `port` is the bound one once `start` has returned.
        token: what commands need.
        now: a clock, s.
    """

    def __init__(
        self,
        source: Source,
        address: PageAddress,
        token: str,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.source, self.address = source, address
        self.port = address.port
        self.pages = Pages()
        self.access = Access(source.rules, token, now)
        self._talk = Conversation(source, self.pages, self.access)
        self._now, self._numbers = now, 0
        self._server: Server | None = None
        self._open: set[PageConnection] = set()
        self._tasks: list[asyncio.Task[None]] = []

    @property
    def url(self) -> str:
        """Where a browser finds it."""
        host = f"[{self.address.host}]" if ":" in self.address.host else self.address.host
        return f"http://{host}:{self.port}/"

    async def start(self) -> None:
        """Listen.

        Raises:
            OSError: the address cannot be had.
        """
        self._server = await serve_sockets(
            self._serve_page,
            self.address.host,
            self.address.port,
            process_request=self._answer,
            create_connection=self._door,  # type: ignore[arg-type]
            compression=None,
            max_size=LARGEST_MESSAGE,
            open_timeout=OPENING_S,
            ping_interval=PING_S,
            ping_timeout=PATIENCE_S,
            close_timeout=1.0,
            logger=UNLOGGED,
        )
        self.port = next(iter(self._server.sockets)).getsockname()[1]
        self._tasks = [
            asyncio.create_task(self.source.run(self.pages)),
            asyncio.create_task(self._talk.look_after()),
        ]

    async def close(self) -> None:
        """Close all connections."""
        for task in self._tasks:
            task.cancel()
        if self._server is not None:
            await self._told_all()
            self._server.close()
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._server.wait_closed(), 2.0)

    async def over(self) -> None:
        """Wait until the source has nothing more to come.

        Raises:
            Exception: it has failed.
        """
        await self._tasks[0]

    async def _told_all(self) -> None:
        """Wait a little until pages have what was told last."""
        for _ in range(20):
            if not any(page.waiting for page in self.pages):
                return
            await asyncio.sleep(0.05)

    # connections

    def _door(self, *args: Any, **kwargs: Any) -> PageConnection:
        return PageConnection(self._open, *args, **kwargs)

    def _answer(self, _connection: ServerConnection, request: Request) -> Response | None:
        """A file, a refusal, or None: the WebSocket is opened."""
        hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
        if len(hosts) != 1 or not is_ours(hosts[0], self.port, self.address):
            told = f"{', '.join(hosts) or 'no host'} is not served here, but {self.url}; a tunnel"
            told += f" (`ssh -L`) has port {self.port} at both ends"
            return refusal(HTTPStatus.MISDIRECTED_REQUEST, told)
        path = request.path.partition("?")[0]
        if path != "/ws":
            return page_file(path)
        if not is_same_origin(origins, hosts[0]):
            return refusal(HTTPStatus.FORBIDDEN, "only pages of this server may ask")
        if len(self.pages) >= MOST_PAGES:
            return refusal(HTTPStatus.SERVICE_UNAVAILABLE, f"{MOST_PAGES} pages are open already")
        return None

    async def _serve_page(self, connection: ServerConnection) -> None:
        if len(self.pages) >= MOST_PAGES:
            await connection.close(1013, f"{MOST_PAGES} pages are open already")
            return
        self._numbers += 1
        page = Page(self._numbers)
        self.pages.add(page)
        sending = asyncio.create_task(self._send(page, connection))
        answering = asyncio.create_task(self._talk.answer_all(page))
        try:
            with suppress(ConnectionClosed):
                await self._hear(page, connection)
        finally:
            sending.cancel()
            with suppress(asyncio.CancelledError):
                await sending
            page.leave()
            self.pages.remove(page)
            await self._talk.left(page)
            await answering

    async def _send(self, page: Page, connection: ServerConnection) -> None:
        try:
            await page.send_all(connection.send, self._talk.snapshot)
        except ConnectionClosed:
            return
        except Exception as error:  # noqa: BLE001  of a source; other pages go on
            self.pages.unforeseen(error)
            await connection.close(1011, "an error of the program")

    async def _hear(self, page: Page, connection: ServerConnection) -> None:
        allowed, before = BURST, self._now()
        async for text in connection:
            now = self._now()
            allowed, before = min(BURST, allowed + RATE * (now - before)), now
            allowed -= 1.0
            if allowed < 0.0:
                await connection.close(1008, "too many messages")
                return
            message = parsed(text)
            if message is None:
                await connection.close(1003, "a message is a small JSON object with `t`")
                return
            await self._talk.take(page, message)
            if self.access.tries_too_much(page.number):
                await connection.close(1008, "too many wrong tokens")
                return


class PageConnection(ServerConnection):
    """A connection; cut off at once if there are too many, or if it is written to in vain."""

    def __init__(self, others: set[PageConnection], *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._others = others

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Refuse it if there are too many."""
        super().connection_made(transport)
        self._others.add(self)
        if len(self._others) > MOST_CONNECTIONS:
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """It is gone."""
        self._others.discard(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take what has come, unless answers to it pile up."""
        if self.transport.get_write_buffer_size() > UNREAD:
            self.transport.abort()
            return
        super().data_received(data)


async def serve(
    source: Source, address: PageAddress, token: str, announce: Callable[[PageServer], None]
) -> None:
    """Serve a source until it has nothing more to come; `announce` is called once it listens.

    Raises:
        OSError: the address cannot be had.
    """
    server = PageServer(source, address, token)
    await server.start()
    announce(server)
    try:
        await server.over()
    finally:
        await server.close()
