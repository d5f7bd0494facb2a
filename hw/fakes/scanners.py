"""The fake scanners as a peer of a connection: started with it, ended with it.

peers:
  scanners:
    driver: "hw.fakes.scanners:S300"
    tells: world
    scanners: {front_laser: {host: loopback, port: 4001}, rear_laser: {host: loopback, port: 4002}}
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from hw.links.datagrams import Address, Outlet
from hw.links.processes import Child


class S300:
    """Fake S300 scanners in a process of their own; `fault` makes them misbehave (`hw.fakes.s300`).

    `tells` is the world whose scans they send; without one they send what `address` is told.
    """

    def __init__(
        self,
        scanners: Mapping[str, Mapping[str, Any]],
        now: Callable[[], int],
        tells: Any = None,
        beyond: int = 4,
    ) -> None:
        del now
        addresses = {name: (entry["host"], entry["port"]) for name, entry in scanners.items()}
        host = next(iter(addresses.values()))[0]
        world = None if tells is None else tells.address
        settings = {"scanners": addresses, "host": host, "tells": world, "beyond": beyond}
        self._child = Child("hw.fakes.s300", settings)
        self._outlet = Outlet("test")
        self.address: Address = (host, 0)

    @property
    def pid(self) -> int:
        """The number of its process."""
        return self._child.pid

    def wait(self) -> None:
        """Until they listen.

        Raises:
            OSError: they cannot.
        """
        host, port = self._child.wait()["address"]
        self.address = (host, port)
        self._outlet.addresses = [self.address]

    def fault(self, name: str) -> None:
        """Misbehave like this from now on; an empty text ends it."""
        self._outlet.send("fault", time.monotonic_ns(), name)

    def close(self) -> None:
        """End them."""
        self._child.close()
        self._outlet.close()
