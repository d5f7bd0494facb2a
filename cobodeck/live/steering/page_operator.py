"""The operator on pages: commands come as lines of JSON, from the process that serves pages.

Two threads take them. One reads: it pulls the stop line at once, whatever the run and the other are
doing, and misses the page that controls a run on parts (R55). The other makes ready what takes a
while, such as another chart. What changes the run is carried out at the start of the next tick, and
what comes of it goes back to the page.
"""

from __future__ import annotations

import json
import select
import socket
import time
from collections import deque
from functools import partial
from queue import SimpleQueue
from threading import Thread

from cobodeck.live.access import ITSELF, LOST_S
from cobodeck.live.feed import Feed
from cobodeck.live.steering.orders import Act, Order, Orders, Refused, operator_of
from cobodeck.live.steering.run_status import RunStatus, unforeseen
from cobodeck.loop import Loop
from cobodeck.setup import Setup
from engine.operator import Operator

LARGEST = 1 << 20
"""Of a line, bytes."""
CHUNK = 1 << 16
MOST_ASKED = 100
"""Commands that may wait to be made ready."""
CLOSING_S = 1.0
"""How long the end of a run waits for the command that is made ready, s."""
LOOK_S = 0.1
"""Between two looks at whether the controlling page is still heard, s."""
BESIDE = frozenset({"reset", "ack", "speed"})
"""Commands that the run itself does not know: they are put on record as remarks, as a stop is."""
OVER = "the run has ended"


class PageOperator:
    """Carries out the commands of pages; an observer of the loop.

    Whatever goes wrong in here is told to the page and on the terminal, and the run goes on.

    Args:
        setup: what is run.
        loop: the run.
        feed: takes the answers.
        commands: the lines.
        real: these are real parts, whose stop is reset at the console.
    """

    leaps = False

    def __init__(
        self, setup: Setup, loop: Loop, feed: Feed, commands: socket.socket, real: bool
    ) -> None:
        self._loop, self._feed, self._socket = loop, feed, commands
        self._orders = Orders(setup, loop, real)
        self._asked = SimpleQueue[tuple[Order, int] | None]()  # with the stops before it
        self._ready: deque[tuple[Order, Act]] = deque()
        self._holder: str | None = None
        self._heard = time.monotonic()
        self._over = False
        self._stops, self._last = 0, ("", "")  # who has stopped it, and why
        self._preparing = Thread(target=self._prepare, daemon=True, name="page operator")

    def attend(self, on_parts: bool) -> None:
        """Take commands from now on; `on_parts`: who has control must be heard all the time."""
        Operator(self._loop.wired.run).attend()
        self._loop.observers = (self, *self._loop.observers)
        self._loop.taps = (*self._loop.taps, RunStatus(self._loop, self._feed))
        self._preparing.start()
        Thread(target=self._read, args=(on_parts,), daemon=True, name="page reader").start()

    def close(self) -> None:
        """Take nothing any more, and miss nobody: the run is over, and what waits is refused."""
        self._over = True
        while not self._asked.empty():
            if (asked := self._asked.get()) is not None:
                self._answer(asked[0], OVER)
        self._asked.put(None)
        if self._preparing.is_alive():
            self._preparing.join(CLOSING_S)
        while self._ready:
            order, _ = self._ready.popleft()
            self._answer(order, None if order["do"] == "stop" else OVER)

    # in the run's thread

    def watch(self, now_ns: int) -> None:  # noqa: ARG002
        """Carry out what is ready."""
        for _ in range(len(self._ready)):
            order, act = self._ready.popleft()
            try:
                self._carry_out(order, act)
            except Exception as error:  # noqa: BLE001  the next one may be an end
                self._answer(order, unforeseen(self._loop, error))

    def _carry_out(self, order: Order, act: Act) -> None:
        wrong = act()
        if wrong is None and order["do"] in BESIDE:
            operator_of(self._loop, order).remark(_said(order))
        self._answer(order, wrong)

    def _answer(self, order: Order, wrong: str | None) -> None:
        told = {"page": order.get("page"), "id": order.get("id")}
        self._feed.tell("ack", {**told, "ok": wrong is None, "text": wrong or "done"})

    # in the thread that prepares

    def _prepare(self) -> None:
        while (asked := self._asked.get()) is not None:
            order, stops = asked
            try:
                act = self._orders.act(order)
            except Refused as refused:
                act = partial(str, refused)
            except Exception as error:  # noqa: BLE001  the next one may be an end
                act = partial(unforeseen, self._loop, error)
            if order["do"] == "reset":
                act = partial(self._unless_stopped, stops, act)
            self._ready.append((order, act))
            self._loop.clock.wake()

    def _unless_stopped(self, stops: int, reset: Act) -> str | None:
        """Reset what was stopped before, not what has been stopped since somebody asked for it."""
        if stops == self._stops:
            wrong = reset()
            if stops == self._stops:
                return wrong
            self._orders.pull(*self._last)  # in that moment, so that it may be undone
        return "not reset: it was stopped again meanwhile"

    # in the thread that reads

    def _read(self, on_parts: bool) -> None:
        begun = b""
        while (data := self._received()) is None or data:
            *lines, begun = (begun + (data or b"")).split(b"\n")
            for line in lines:
                self._hear(line)
            if len(begun) > LARGEST:
                begun = b""
            if on_parts and time.monotonic() - self._heard > LOST_S:
                self._miss("is not heard any more")
        if on_parts:
            self._miss("is not served any more")
        self._socket.close()

    def _received(self) -> bytes | None:
        """What has come; None: nothing yet; empty: nothing comes any more."""
        try:
            ready, _, _ = select.select([self._socket], [], [], LOOK_S)
            return self._socket.recv(CHUNK) if ready else None
        except (OSError, ValueError):
            return b""

    def _hear(self, line: bytes) -> None:
        try:
            order = json.loads(line)
            self._take(order["t"], order)
        except Exception as error:  # noqa: BLE001  the next line may be a stop
            unforeseen(self._loop, error)

    def _take(self, kind: str, order: Order) -> None:
        if kind == "cmd" and order["do"] == "stop":  # of any page: no sign of who has control
            why = str(order.get("why") or "")  # of the server; pages give none
            self._ready.append((order, self._stopped(str(order.get("who")), why)))
            return
        self._heard = time.monotonic()
        if kind == "held":
            self._hold(order["name"])
        elif kind == "cmd" and self._asked.qsize() < MOST_ASKED:
            self._asked.put((order, self._stops))
        elif kind == "cmd":
            self._ready.append((order, partial(str, "too many commands wait")))

    def _hold(self, name: str | None) -> None:
        """Who has control now, which is on record."""
        before, self._holder = self._holder, name
        run = self._loop.wired.run
        if name is not None and name != before:
            Operator(run, name).remark("takes control" + (f" from {before}" if before else ""))
        elif name is None and before is not None:
            Operator(run, before).remark("has no control any more")

    def _miss(self, how: str) -> None:
        """Stop the robot if who had control has none any more (R55)."""
        name, self._holder = self._holder, None
        if name is not None:
            self._stop(ITSELF, f"the page of {name} {how}")

    def _stopped(self, by: str, why: str) -> Act:
        """Stop; what answers it."""
        try:
            self._stop(by, why)
        except Exception as error:  # noqa: BLE001  the next one may succeed
            return partial(unforeseen, self._loop, error)
        return _done

    def _stop(self, by: str, why: str = "") -> None:
        if not self._over:
            self._last = by, why
            self._stops += 1
            self._orders.stop(by, why)


def _done() -> None:
    """Nothing is left to do."""


def _said(order: Order) -> str:
    return f"speed {order['speed']}" if order["do"] == "speed" else str(order["do"])
