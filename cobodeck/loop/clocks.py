"""The clocks of a loop: virtual time, which never waits, and real time, which sleeps."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import ClassVar, Protocol

SLACK_NS = 50_000_000
"""So much of what is late is made up for by `Paced`, ns: a tick that took long."""


class Clock(Protocol):
    """The time of a run.

    `waits` is True where time passes by itself; `paced` where each instant of virtual time has its
    time by the wall clock, so that none is skipped.
    """

    waits: ClassVar[bool]
    paced: ClassVar[bool]

    def wait(self, until_ns: int) -> int:
        """Wait until an instant, ns since the start, or until woken; returns the time reached."""
        ...

    def wake(self) -> None:
        """End the current wait, or the next one; may be called from any thread."""
        ...


class Virtual:
    """Virtual time: each wait ends at once, at the instant waited for."""

    waits: ClassVar[bool] = False
    paced: ClassVar[bool] = False

    def wait(self, until_ns: int) -> int:
        """Return at once."""
        return until_ns

    def wake(self) -> None:
        """Do nothing; nothing sleeps."""


class Paced:
    """Virtual time that passes at a pace, so that somebody can watch.

    Each wait sleeps for as long as its span takes at `speed`, and ends at the instant waited for,
    whatever the wall clock says: a run is the same as in `Virtual` time.

    Attributes:
        speed: run time per wall time; may be set from any thread, and holds after `wake`.
    """

    waits: ClassVar[bool] = False
    paced: ClassVar[bool] = True

    def __init__(self, speed: float = 1.0, reading: Callable[[], int] = time.monotonic_ns) -> None:
        self.speed = speed
        self._reading = reading
        self._now = 0
        self._due: int | None = None  # when the present instant began by the wall clock, ns
        self._woken = SimpleQueue[None]()

    def wait(self, until_ns: int) -> int:
        """Sleep until the instant is due; see the class."""
        now = self._reading()
        begun = now if self._due is None else max(self._due, now - SLACK_NS)
        left, self._now = float(until_ns - self._now), until_ns
        speed = self.speed
        while (wait_ns := begun + left / speed - self._reading()) > 0.0:
            try:
                self._woken.get(timeout=wait_ns * 1e-9)
            except Empty:
                break
            now = self._reading()
            left, begun, speed = left - (now - begun) * speed, now, self.speed
        self._due = round(begun + left / speed)
        return until_ns

    def wake(self) -> None:
        """Look again at how long to wait; may be called from any thread."""
        self._woken.put(None)


class RealTime:
    """Real time since the first `wait`, by a monotonic clock in ns."""

    waits: ClassVar[bool] = True
    paced: ClassVar[bool] = False

    def __init__(self, reading: Callable[[], int] = time.monotonic_ns) -> None:
        self._reading = reading
        self._start: int | None = None
        self._woken = SimpleQueue[None]()  # can be filled from a signal handler, unlike an Event

    def wait(self, until_ns: int) -> int:
        """Sleep; see `Clock`. Returns at once if the instant has passed."""
        if self._start is None:
            self._start = self._reading()
        left = until_ns - self.now()
        with suppress(Empty):
            if left > 0:
                self._woken.get(timeout=left * 1e-9)
            while True:
                self._woken.get_nowait()
        return self.now()

    def now(self) -> int:
        """The time now, ns; 0 before the first wait. May be called from any thread."""
        return 0 if self._start is None else self._reading() - self._start

    def wake(self) -> None:
        """End the wait, as after the arrival of a sample; see `Clock`."""
        self._woken.put(None)
