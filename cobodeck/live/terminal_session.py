"""`watch --tty`: a page in a terminal, of a server elsewhere or of a source in this process."""

from __future__ import annotations

import asyncio
import json
import os
import select
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from queue import Empty, SimpleQueue
from typing import Any
from urllib.parse import urlsplit

from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.sync.client import connect

from cobodeck.live.clients import FASTEST, SLOWEST, Page, PageMessage, Pages, Source
from cobodeck.live.terminal_view import WatchedPage, view
from cobodeck.terminal import FAILED, OK, Problem, complain, show
from engine.files import visible

LOOK_S = 0.1
PATIENCE_S = 10.0
FIRST_S = 60.0
"""Time until there is something to show, s."""
MOST = 256
"""Messages that are taken before the keys are looked at again, and that may wait."""
LARGEST = 64 << 20
"""Of a message, bytes: a chart of thousands of nodes has a large picture."""
STEP_S = 1.0
LEFT, RIGHT, UP, DOWN = "\x1b[D", "\x1b[C", "\x1b[A", "\x1b[B"


class FarLink:
    """A server by its URL; `is_over`: nothing more will come.

    Raises:
        Problem: there is none.
    """

    def __init__(self, url: str) -> None:
        self.is_over = False
        try:
            self._socket = connect(
                socket_url(url), max_size=LARGEST, open_timeout=PATIENCE_S, compression=None
            )
        except (OSError, WebSocketException, ValueError) as error:
            told = visible(str(error) or type(error).__name__)
            raise Problem(f"{url}: no live page there: {told}", FAILED) from None

    def messages(self, wait_s: float) -> Iterator[PageMessage]:
        """Those that are there, or come within `wait_s`."""
        for _ in range(MOST):
            try:
                found = json.loads(self._socket.recv(wait_s))
            except TimeoutError:
                return
            except (ConnectionClosed, ValueError):
                self.is_over = True
                return
            if isinstance(found, dict):
                yield found
            wait_s = 0.0

    def ask(self, message: PageMessage) -> None:
        """Say something, as a page does."""
        with suppress(ConnectionClosed):
            self._socket.send(json.dumps(message))

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


class NearLink:
    """A source in this process, with one page, in a loop of its own.

    What it raises is raised by `messages`.
    """

    def __init__(self, source: Source) -> None:
        self._queue: SimpleQueue[PageMessage] = SimpleQueue()
        self._source, self._page = source, Page(1)
        self._page.layers = set()
        self._error: Exception | None = None
        self._loop = asyncio.new_event_loop()
        self._over = asyncio.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def is_over(self) -> bool:
        """See `FarLink`."""
        return not self._thread.is_alive() and self._queue.empty() and self._error is None

    def messages(self, wait_s: float) -> Iterator[PageMessage]:
        """See `FarLink`."""
        if self._error is not None and self._queue.empty():
            raise self._error
        with suppress(Empty):
            yield self._queue.get(timeout=wait_s)
            for _ in range(MOST):
                yield self._queue.get_nowait()

    def ask(self, message: PageMessage) -> None:
        """See `FarLink`."""
        self._soon(lambda: self._loop.create_task(self._asked(message)))

    def close(self) -> None:
        """End the source."""
        self._soon(self._over.set)
        self._thread.join(PATIENCE_S)

    def _soon(self, act: Callable[[], object]) -> None:
        with suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(act)

    async def _asked(self, message: PageMessage) -> None:
        for answer in await self._source.asked(self._page, message):
            self._page.tell(answer)

    def _run(self) -> None:
        try:
            with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
                runner.run(self._serve())
        except Exception as error:  # noqa: BLE001  raised where messages are taken
            self._error = error

    async def _serve(self) -> None:
        """As a server does, until the source or this ends."""
        pages = Pages()
        pages.add(self._page)
        works = self._source.run(pages), self._page.send_all(self._send, self._snapshot)
        tasks = [asyncio.create_task(work) for work in (*works, self._over.wait())]
        done, others = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in others:
            task.cancel()
        await asyncio.gather(*others, return_exceptions=True)
        for task in done:
            task.result()

    async def _send(self, text: str) -> None:
        while self._queue.qsize() >= MOST:  # the terminal stands still
            await asyncio.sleep(LOOK_S)
        self._queue.put(json.loads(text))

    def _snapshot(self, page: Page) -> list[PageMessage]:
        return [{"t": "hello", **self._source.hello()}, *self._source.snapshot(page)]


Link = FarLink | NearLink


def socket_url(url: str) -> str:
    """The WebSocket of a page, `ws://…/ws`, by its URL."""
    found = urlsplit(url)
    scheme = {"http": "ws", "https": "wss"}.get(found.scheme, found.scheme)
    return f"{scheme}://{found.netloc}/ws"


def watch_in_terminal(link: Link) -> int:
    """The exit code, once `q`, Ctrl-C or the end has come; without a screen all is shown once.

    Raises:
        Problem: it is not what a page is told; what the source raises.
    """
    page = WatchedPage()
    try:
        if not (sys.stdout.isatty() and sys.stdin.isatty()) or os.environ.get("TERM") == "dumb":
            return _once(link, page)
        with suppress(KeyboardInterrupt), _keys(), _screen():
            _loop(link, page)
        _leave(page)
        if link.is_over:
            complain("it has ended")
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        told = f"what comes is not what pages of this version are told: {error!r}"
        raise Problem(told, FAILED) from error
    finally:
        link.close()
    return OK


def _leave(page: WatchedPage) -> None:
    """What was seen last, without the line of keys."""
    show("\n".join(_lines(page, colour=False)[:-1]).rstrip())


def _once(link: Link, page: WatchedPage) -> int:
    until = time.monotonic() + FIRST_S
    while not page.is_there and not link.is_over and time.monotonic() < until:
        for message in link.messages(LOOK_S):
            page.take(message)
    for message in link.messages(LOOK_S):
        page.take(message)
    if not page.is_there:
        complain("it tells nothing")
        return FAILED
    _leave(page)
    return OK


def _loop(link: Link, page: WatchedPage) -> None:
    colour, before = "NO_COLOR" not in os.environ, ""
    while not link.is_over:
        for message in link.messages(LOOK_S):
            page.take(message)
        for key in _pressed():
            if key in ("q", "\x03", "\x04"):
                return
            if page.mode == "record" and (asked := asked_by(key, page)) is not None:
                link.ask(asked)
        shown = "\x1b[K\r\n".join(_lines(page, colour=colour))
        if shown != before:
            before = shown
            sys.stdout.write(f"\x1b[H{shown}\x1b[K\x1b[J")
            sys.stdout.flush()


def asked_by(key: str, page: WatchedPage) -> dict[str, Any] | None:
    """What a key asks of a record: to play, pause, seek; None: nothing."""
    speed = float(page.state.get("speed") or 0.0)
    playing = bool(speed) and not page.state.get("paused")
    if key == " ":
        return {"t": "play", "speed": 0 if playing else 1}
    if key in (LEFT, RIGHT):
        until = page.hello.get("until")
        at = page.at + (STEP_S if key == RIGHT else -STEP_S)
        most = float(until) if isinstance(until, int | float) else at
        return {"t": "seek", "at": max(0.0, min(at, most))}
    if key in (UP, DOWN):
        faster = (speed or 1.0) * (2.0 if key == UP else 0.5)
        return {"t": "play", "speed": min(max(faster, SLOWEST), FASTEST)}
    return None


def _lines(page: WatchedPage, *, colour: bool) -> list[str]:
    size = shutil.get_terminal_size()
    return view(page, size.columns, size.lines, colour=colour)


def _pressed() -> Iterator[str]:
    """The keys that were pressed; an arrow is one of them."""
    typed = ""
    while select.select([sys.stdin], [], [], 0.0)[0]:
        data = os.read(sys.stdin.fileno(), 1024)
        if not data:
            yield "q"  # the terminal is closed
            return
        typed += data.decode(errors="replace")
    while typed:
        length = 3 if typed.startswith("\x1b[") else 1
        yield typed[:length]
        typed = typed[length:]


@contextmanager
def _keys() -> Iterator[None]:
    """Keys come one by one and are not shown."""
    import termios
    import tty

    before = termios.tcgetattr(sys.stdin)
    try:
        tty.setcbreak(sys.stdin.fileno())
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


@contextmanager
def _screen() -> Iterator[None]:
    """A screen of its own, without a cursor; the old one comes back."""
    try:
        sys.stdout.write("\x1b[?1049h\x1b[?25l")
        yield
    finally:
        sys.stdout.write("\x1b[?25h\x1b[?1049l")
        sys.stdout.flush()
