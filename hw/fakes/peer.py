"""A peer: a fake device in a process of its own, which can be told to misbehave."""

from __future__ import annotations

import time
from typing import Any

from hw.links.datagrams import Hearer, Outlet
from hw.links.processes import Child


class Peer:
    """Starts a child that says in its ready line where it takes faults: `control`, (host, port).

    `module` has the child's `main`; `settings` are what it is called with, and `tells` the address
    of whom it tells, or None.
    """

    def __init__(self, module: str, settings: dict[str, Any], tells: Hearer | None = None) -> None:
        self.ready: dict[str, Any] = {}
        world = None if tells is None else tuple(tells.address)
        self._child = Child(module, {**settings, "tells": world})
        self._faults = Outlet("fault")

    def wait(self) -> None:
        """Wait until it can be talked to.

        Raises:
            OSError: it cannot start, and why.
        """
        self.ready = self._child.wait()
        self._faults.addresses = [(str(self.ready["control"][0]), int(self.ready["control"][1]))]

    @property
    def pid(self) -> int:
        """Of its process."""
        return self._child.pid

    @property
    def alive(self) -> bool:
        """Does its process run?"""
        return self._child.alive

    def fault(self, name: str, value: Any = None) -> int:
        """Let it misbehave; its module says how it can. Gives when it was told to, ns."""
        stamp = time.monotonic_ns()
        self._faults.send(name, stamp, value)
        return stamp

    def close(self) -> None:
        """End it."""
        self._faults.close()
        self._child.close()
