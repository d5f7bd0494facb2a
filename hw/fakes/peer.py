"""A peer: a fake device in a process of its own, with faults on demand."""

from __future__ import annotations

import time
from typing import Any

from hw.ipc import Child, Door, Hearer, Outlet


class Peer:
    """Starts a child whose ready line has the door for faults: `control`.

    `module` has the child's `main`; `settings` are its arguments; `tells` is the world that it
    sends to as each of its `sources`, or None; `name` is what an operator calls it. The child
    imports the modules that it `needs`.
    """

    sources: tuple[str, ...] = ()

    def __init__(
        self, module: str, settings: dict[str, Any], tells: Hearer | None, name: str
    ) -> None:
        self.ready: dict[str, Any] = {}
        world = None if tells is None else {name: tells.door(name) for name in self.sources}
        self.child = Child(module, {**settings, "tells": world}, name)
        self._faults = Outlet()

    def wait(self) -> None:
        """Wait until it is ready.

        Raises:
            OSError: it cannot start, with the cause.
        """
        self.ready = self.child.wait()
        self._faults.doors = [self.control]

    @property
    def control(self) -> Door:
        """Where its faults are sent to."""
        return Door(*self.ready["control"])

    @property
    def pid(self) -> int:
        """Process id."""
        return self.child.pid

    @property
    def alive(self) -> bool:
        """True while its process runs."""
        return self.child.alive

    def fault(self, name: str, value: Any = None) -> int:
        """Inject a fault, as its module describes. Returns when it was sent, ns."""
        stamp = time.monotonic_ns()
        self._faults.send(name, stamp, value)
        return stamp

    def close(self) -> None:
        """End its process."""
        self._faults.close()
        self.child.close()
