"""The observer's program: a heartbeat to the safety chain while a person watches (R55).

    observer = Observer(("192.168.0.10", 7401))
    observer.here()                # every PERIOD_S, from the loop of the observer's user interface
    observer.pull("observer")      # the software stop

It is not a safety device: the observer has the hardware's own stop at hand.
"""

from __future__ import annotations

import time

from hw.links.datagrams import Address, Outlet

PERIOD_S = 0.1
"""Period of the heartbeat, s."""
TIMES = 3
"""Copies sent of a stop: datagrams from another machine may get lost."""


class ObserverLink:
    """Sends to the chain; receives nothing."""

    def __init__(self, chain: Address) -> None:
        self._outlet = Outlet("observer", [chain])

    def here(self) -> None:
        """Send a heartbeat."""
        self._outlet.send("observer.here", time.monotonic_ns(), True)

    def pull(self, reason: str = "observer") -> None:
        """Stop the robot until the operator's reset."""
        for _ in range(TIMES):
            self._outlet.send("pull", time.monotonic_ns(), reason)

    def close(self) -> None:
        """Close the socket; the chain treats the silence as a stop, too."""
        self._outlet.close()
