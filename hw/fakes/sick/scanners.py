"""The fake scanners as a peer of a connection.

peers:
  scanners:
    driver: S300Peer
    tells: world
    scanners: {front_laser: {host: loopback, port: 4001}, rear_laser: {host: loopback, port: 4002}}
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hw.fakes.peer import Peer
from hw.ipc import Hearer


class S300Peer(Peer):
    """Fake S300 scanners in a process of their own; `s300_device` describes their faults.

    `tells` is the world whose scans they send; without one they send those of `base.scan`
    datagrams at their `control`.

    Args:
        scanners: by name the `host` and `port` at which each serves.
        tells: the world whose scans they send.
        beyond: how many bytes of a telegram its length does not count.
    """

    sources = ("scanners",)

    def __init__(
        self,
        scanners: Mapping[str, Mapping[str, Any]],
        tells: Hearer | None = None,
        beyond: int = 4,
    ) -> None:
        addresses = {name: (entry["host"], entry["port"]) for name, entry in scanners.items()}
        host = next(iter(addresses.values()))[0]
        settings = {"scanners": addresses, "host": host, "beyond": beyond}
        super().__init__("hw.fakes.sick.s300_device", settings, tells, "the fake scanners")
