"""A thread that takes the datagrams of a child process as they arrive in the engine."""

from __future__ import annotations

import select
import threading
import time
from collections import deque
from collections.abc import Callable

from hw.ipc import Datagram, Intake, Outlet
from hw.samples import Sample

OWN = "feed"
"""The source of the datagram by which a feed wakes its own thread."""
LOOK_S = 0.2
"""Longest time until the thread notices its end, s."""


class DatagramFeed:
    """Receives from one source, at its `door`, and passes each datagram on, in its thread.

    `on_datagram` is called with a datagram and its stamp in the time of the run, ns; `watch`, if
    given, at least every `look_s` with an instant (CLOCK_MONOTONIC, ns) up to which all that had
    arrived has been passed on, so that silence is not mistaken for a thread that was held up.
    """

    def __init__(
        self,
        source: str,
        now: Callable[[], int],
        on_datagram: Callable[[Datagram, int], None],
        watch: Callable[[int], None] | None = None,
        look_s: float = LOOK_S,
    ) -> None:
        self._now, self._on_datagram, self._watch, self._look_s = now, on_datagram, watch, look_s
        self._intake = Intake((source, OWN))
        self.door = self._intake.door(source)
        self._over = False
        self._heard_ns: int | None = None
        self._silent_ns = 0
        self._thread = threading.Thread(target=self._run, name="feed", daemon=True)

    def start(self) -> None:
        """Start taking datagrams."""
        self._thread.start()

    def silence(self, within_ns: int, name: str) -> str | None:
        """That `name`, who sends here, is silent; None if it was heard within this time."""
        return f"{name} is silent" if self._silent_ns > within_ns else None

    def close(self) -> None:
        """Take what has arrived, and end."""
        self._over = True
        awake = Outlet([self._intake.door(OWN)])
        awake.send("over", 0)
        awake.close()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(2.0 * LOOK_S)
        self._intake.close()

    def _run(self) -> None:
        while not self._over:
            select.select([self._intake], [], [], self._look_s)
            looked_ns = time.monotonic_ns()
            if self._take_all() or self._heard_ns is None:
                self._heard_ns = looked_ns
            self._silent_ns = looked_ns - self._heard_ns
            if self._watch is not None:
                self._watch(looked_ns)
        self._take_all()

    def _take_all(self) -> bool:
        """Take all that has arrived; False if nothing had."""
        some = False
        while found := self._intake.poll():
            some = True
            for datagram in found:
                if datagram.source != OWN:
                    self._hand_on(datagram)
        return some

    def _hand_on(self, datagram: Datagram) -> None:
        """Let it be taken; a mistake of the taker is printed, and the thread goes on."""
        try:
            self._on_datagram(datagram, self._now() - (time.monotonic_ns() - datagram.stamp_ns))
        except Exception as error:  # noqa: BLE001  the next datagrams are not to be lost with it
            threading.excepthook(
                threading.ExceptHookArgs((type(error), error, error.__traceback__, self._thread))
            )


def up_to(waiting: deque[Sample], now_ns: int) -> list[Sample]:
    """Remove the samples of a queue up to an instant, in order of arrival; later ones stay."""
    found = []
    while waiting and waiting[0].stamp_ns <= now_ns:
        found.append(waiting.popleft())
    return found


def by_stamps(waiting: deque[Sample], now_ns: int) -> list[Sample]:
    """Remove all samples of a queue, by stamp; those ahead of now are dropped."""
    found = [waiting.popleft() for _ in range(len(waiting))]
    past = [sample for sample in found if sample.stamp_ns <= now_ns]
    return sorted(past, key=lambda sample: sample.stamp_ns)
