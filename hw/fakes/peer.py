"""A peer: a fake device in a process of its own, with faults on demand."""

from __future__ import annotations

import time
from typing import Any

from hw.links.datagrams import Hearer, Outlet
from hw.links.processes import Child


class Peer:
    """Starts a child whose ready line has the address for faults: `control`, (host, port).

    `module` has the child's `main`; `settings` are its arguments; `tells` is the peer that it sends
    to, or None.
    """

    def __init__(self, module: str, settings: dict[str, Any], tells: Hearer | None = None) -> None:
        self.ready: dict[str, Any] = {}
        world = None if tells is None else tuple(tells.address)
        self._child = Child(module, {**settings, "tells": world})
        self._faults = Outlet("fault")

    def wait(self) -> None:
        """Wait until it is ready.

        Raises:
            OSError: it cannot start, with the cause.
        """
        self.ready = self._child.wait()
        self._faults.addresses = [(str(self.ready["control"][0]), int(self.ready["control"][1]))]

    @property
    def pid(self) -> int:
        """Process id."""
        return self._child.pid

    @property
    def alive(self) -> bool:
        """True while its process runs."""
        return self._child.alive

    def fault(self, name: str, value: Any = None) -> int:
        """Inject a fault, as its module describes. Returns when it was sent, ns."""
        stamp = time.monotonic_ns()
        self._faults.send(name, stamp, value)
        return stamp

    def close(self) -> None:
        """End its process."""
        self._faults.close()
        self._child.close()
