"""The observer's program: tells the safety chain again and again that somebody watches (R55).

    observer = Observer(("192.168.0.10", 7401))
    observer.here()                # every PERIOD_S, from the loop that has the person before it
    observer.pull("observer")      # the software stop

It is no safety device: the observer has the hardware's own stop in their hand.
"""

from __future__ import annotations

import time

from hw.links.datagrams import Address, Outlet

PERIOD_S = 0.1
TIMES = 3
"""A stop is sent so often, because datagrams get lost on the way from another machine."""


class ObserverLink:
    """Sends to the chain; hears nothing."""

    def __init__(self, chain: Address) -> None:
        self._outlet = Outlet("observer", [chain])

    def here(self) -> None:
        """The observer is there."""
        self._outlet.send("observer.here", time.monotonic_ns(), True)

    def pull(self, reason: str = "observer") -> None:
        """Stop the robot for good."""
        for _ in range(TIMES):
            self._outlet.send("pull", time.monotonic_ns(), reason)

    def close(self) -> None:
        """Send no more; the chain takes that for a stop, too."""
        self._outlet.close()
