"""The fake RB-KAIROS as a peer of a connection: started with it, ended with it.

peers:
  kairos: {driver: "hw.fakes.kairos:Kairos", host: loopback, port: 9090, tells: world}
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from hw.connection import Opening
from hw.links.datagrams import Address, Outlet
from hw.links.processes import Child


class Kairos:
    """A fake RB-KAIROS in a process of its own; `fault` is told in `hw.fakes.kairos_process`.

    `tells` is the world that its wheels move; without one it drives in a plane of its own.
    """

    def __init__(
        self,
        host: str,
        now: Callable[[], int],
        opening: Opening,
        port: int = 9090,
        ros: int = 1,
        namespace: str = "robot",
        tells: Any = None,
    ) -> None:
        del now
        base = opening.body.base
        settings = {
            "host": host, "port": port, "ros": ros, "namespace": namespace,
            "tells": None if tells is None else tells.address,
            "radius": base.wheel_radius, "lever": base.half_wheelbase + base.half_track,
        }  # fmt: skip
        self._child = Child("hw.fakes.kairos_process", settings)
        self._outlet = Outlet("test")
        self.address: Address = (host, 0)

    @property
    def pid(self) -> int:
        """The number of its process."""
        return self._child.pid

    def wait(self) -> None:
        """Until it listens.

        Raises:
            OSError: it cannot.
        """
        host, port = self._child.wait()["address"]
        self.address = (host, port)
        self._outlet.addresses = [self.address]

    def fault(self, name: str) -> None:
        """Misbehave like this from now on; an empty text ends it."""
        self._outlet.send("fault", time.monotonic_ns(), name)

    def close(self) -> None:
        """End it."""
        self._child.close()
        self._outlet.close()
