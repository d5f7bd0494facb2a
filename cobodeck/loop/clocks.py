"""The clocks of a loop: virtual time, which never waits, and real time, which sleeps."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import ClassVar, Protocol


class Clock(Protocol):
    """The time of a run; `waits` is True where time passes by itself."""

    waits: ClassVar[bool]

    def wait(self, until_ns: int) -> int:
        """Wait until an instant, ns since the start, or until woken; returns the time reached."""
        ...

    def wake(self) -> None:
        """End the current wait, or the next one; may be called from any thread."""
        ...


class Virtual:
    """Virtual time: each wait ends at once, at the instant waited for."""

    waits: ClassVar[bool] = False

    def wait(self, until_ns: int) -> int:
        """Return at once."""
        return until_ns

    def wake(self) -> None:
        """Do nothing; nothing sleeps."""


class RealTime:
    """Real time since the first `wait`, by a monotonic clock in ns."""

    waits: ClassVar[bool] = True

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
