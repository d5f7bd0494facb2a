"""Waiting for threads and processes, as long as it takes but not for ever."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

PATIENCE_S = 10.0


def until(reached: Callable[[], object]) -> None:
    """Threads need their time; a test that waits in vain fails."""
    end, waited = time.monotonic() + PATIENCE_S, threading.Event()
    while not reached():
        assert time.monotonic() < end
        waited.wait(0.002)
