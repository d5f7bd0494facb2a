"""Serves pages: files by HTTP, everything else through one WebSocket `/ws`, on one port.

What it serves may be loaded by anybody who reaches the port; see `access.py` for who may do what.
Requests for other hosts (names that were made to point here) and from pages of others are refused.
Connections, messages and what waits to be sent are bounded.
"""

from __future__ import annotations

import asyncio
import json
import mimetypes
import time
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from pathlib import Path
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve as serve_sockets
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from cobodeck.live.access import Access, PageAddress, is_ours, is_same_origin
from cobodeck.live.clients import Message, Page, Pages, Source

PAGE = Path(__file__).parent / "page"
"""Its files are served: `index.html` as `/`, the others as `/page/NAME`."""
VERSION = 1
STOP_IS = "a software stop, not a safety device"
MOST_PAGES, MOST_CONNECTIONS = 64, 128
LARGEST_MESSAGE = 64 << 10
"""Of a page, bytes."""
UNREAD = 4 << 20
"""A connection that does not read is cut off above so many bytes."""
RATE, BURST = 50.0, 200.0
"""Messages of one page: per s, and at once."""
PING_S, PATIENCE_S, OPENING_S = 5.0, 10.0, 5.0
LOOK_S = 0.1
"""Between two looks at whether the controlling page is still there, s."""
SECURE = {
    "Content-Security-Policy": "default-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data:; connect-src 'self'; frame-ancestors 'none'; base-uri 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


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
        )
        self.port = next(iter(self._server.sockets)).getsockname()[1]
        self._tasks = [
            asyncio.create_task(self.source.run(self.pages)),
            asyncio.create_task(self._look_after()),
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
        host = request.headers.get("Host")
        if not is_ours(host, self.port, self.address):
            return _refusal(HTTPStatus.MISDIRECTED_REQUEST, f"{host!r} is not served here")
        path = request.path.partition("?")[0]
        if path != "/ws":
            return _file(path)
        if not is_same_origin(request.headers.get("Origin"), str(host)):
            return _refusal(HTTPStatus.FORBIDDEN, "only pages of this server may ask")
        if len(self.pages) >= MOST_PAGES:
            return _refusal(HTTPStatus.SERVICE_UNAVAILABLE, f"{MOST_PAGES} pages are open already")
        return None

    async def _serve_page(self, connection: ServerConnection) -> None:
        if len(self.pages) >= MOST_PAGES:
            await connection.close(1013, f"{MOST_PAGES} pages are open already")
            return
        self._numbers += 1
        page = Page(self._numbers)
        self.pages.add(page)
        sending = asyncio.create_task(page.send_all(connection.send, self._snapshot))
        try:
            with suppress(ConnectionClosed):
                await self._hear(page, connection)
        finally:
            sending.cancel()
            with suppress(asyncio.CancelledError, ConnectionClosed):
                await sending
            self.pages.remove(page)
            self._left(page)

    async def _hear(self, page: Page, connection: ServerConnection) -> None:
        allowed, before = BURST, self._now()
        async for text in connection:
            now = self._now()
            allowed, before = min(BURST, allowed + RATE * (now - before)), now
            allowed -= 1.0
            if allowed < 0.0:
                await connection.close(1008, "too many messages")
                return
            message = _parsed(text)
            if message is None:
                await connection.close(1003, "a message is a JSON object with `t`")
                return
            await self._take(page, message)
            if self.access.tries_too_much(page.number):
                await connection.close(1008, "too many wrong tokens")
                return

    def _left(self, page: Page) -> None:
        held = self.access.holder
        self.access.left(page.number)
        if held != self.access.holder:
            self._show_operator()

    # messages

    def _snapshot(self, page: Page) -> list[Message]:
        hello = {
            "t": "hello", "v": VERSION, "mode": "charts", "title": "", "about": [], "real": False,
            "commands": self.source.rules.commands, "tick_hz": 0, "until": None, "signals": [],
            "layers": [], "profiles": [], "stop_is": STOP_IS, **self.source.hello(),
        }  # fmt: skip
        operator = {"operator": self._operator(page)}
        told = map(dict, self.source.snapshot(page))
        return [hello, *(m | operator if m["t"] == "state" else m for m in told)]

    def _operator(self, page: Page) -> dict[str, Any]:
        return {"name": self.access.name, "you": self.access.holder == page.number}

    def _show_operator(self) -> None:
        for page in self.pages:
            page.tell({"t": "ev", "operator": self._operator(page)})

    async def _take(self, page: Page, message: dict[str, Any]) -> None:
        kind = message["t"]
        if kind == "auth":
            self._authorize(page, message)
        elif kind == "beat":
            if self.access.beat(page.number):
                await self.source.commanded(page, {"t": "cmd", "do": "beat"})
        elif kind == "layers":
            page.layers = {str(name) for name in _list(message.get("on"))}
        elif kind == "cmd":
            await self._command(page, message)
        else:
            try:
                answers = await self.source.asked(page, message)
            except (ValueError, TypeError, KeyError) as error:
                answers = [{"t": "say", "text": f"{kind}: {error}"}]
            for answer in answers:
                page.tell(answer)

    def _authorize(self, page: Page, message: dict[str, Any]) -> None:
        wrong = self.access.authorize(page.number, message.get("token"), message.get("name"))
        page.name = self.access.name_of(page.number)
        page.tell(_ack(message, wrong, f"you are {page.name}"))

    async def _command(self, page: Page, message: dict[str, Any]) -> None:
        do = str(message.get("do"))
        before = self.access.holder
        wrong = self.access.refusal(page.number, do)
        if wrong is not None:
            page.tell(_ack(message, wrong))
            return
        if do in ("take", "release"):
            await self._hand_over(page, message, do)
            return
        if before != self.access.holder:
            await self._tell_holder()
        who = page.name or f"page {page.number}"
        answer = await self.source.commanded(page, {**message, "do": do, "who": who})
        if answer is not None:
            page.tell(answer)

    async def _hand_over(self, page: Page, message: dict[str, Any], do: str) -> None:
        if do == "release":
            wrong = None if self.access.release(page.number) else "this page has no control"
            page.tell(_ack(message, wrong, "released"))
        else:
            before = self.access.take(page.number)
            page.tell(_ack(message, None, f"taken over from {before}" if before else "taken"))
            self.pages.tell({"t": "say", "text": f"{self.access.name} has control"})
        await self._tell_holder()

    async def _tell_holder(self) -> None:
        """Show who has control, and tell the run, which watches over it, too."""
        self._show_operator()
        told = {"t": "cmd", "do": "held", "name": self.access.name}
        await self.source.commanded(Page(0), told)

    async def _look_after(self) -> None:
        while True:
            await asyncio.sleep(LOOK_S)
            name = self.access.lost()
            if name is not None:
                lost = {"t": "cmd", "do": "stop", "who": f"the page of {name} is gone"}
                await self.source.commanded(Page(0), lost)
                await self._tell_holder()


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


def _parsed(text: str | bytes) -> dict[str, Any] | None:
    """A message of a page; None if it is none."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    is_message = isinstance(found, dict) and isinstance(found.get("t"), str)
    return found if is_message else None


def _list(value: object) -> list[Any]:
    return value if isinstance(value, list) else []


def _ack(message: Message, wrong: str | None, text: str = "") -> Message:
    return {"t": "ack", "id": message.get("id"), "ok": wrong is None, "text": wrong or text}


def _file(path: str) -> Response:
    """A file of the page, by its name; names are compared, so no path leads elsewhere."""
    name = "index.html" if path == "/" else path.removeprefix("/page/")
    file = {found.name: found for found in PAGE.iterdir() if found.is_file()}.get(name)
    if file is None or (path != "/" and not path.startswith("/page/")):
        return _refusal(HTTPStatus.NOT_FOUND, "there is no such page")
    kind = mimetypes.guess_type(name)[0] or "application/octet-stream"
    return _response(HTTPStatus.OK, file.read_bytes(), kind)


def _refusal(status: HTTPStatus, text: str) -> Response:
    return _response(status, f"{text}\n".encode(), "text/plain")


def _response(status: HTTPStatus, body: bytes, kind: str) -> Response:
    text = f"{kind}; charset=utf-8" if kind.startswith("text/") else kind
    length = str(len(body))
    headers = {"Content-Type": text, "Content-Length": length, "Connection": "close", **SECURE}
    return Response(status.value, status.phrase, Headers(headers), body)


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
