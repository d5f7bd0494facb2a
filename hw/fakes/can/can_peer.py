"""The fake CAN nodes as a peer of a connection.

peers:
  nodes:
    driver: CanNodes
    bus: {interface: local, channel: loopback}
    wheels: {nodes: [1, 2, 3, 4], signs: [1, -1, 1, -1], gear: 12.52, increments: 4096}
    tells: world
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hw.fakes.peer import Peer
from hw.ipc import LOOPBACK, Hearer


class CanNodes(Peer):
    """Four drives and a bumper's board; `fault` as in `hw.fakes.can.nodes`.

    The line is closed by hand at the relay `by_hand` s after a touch is over; None: only by
    `fault("unlatch")`. `lacks` are objects that the drives do not have; `rtr`: they take remote
    requests.

    Args:
        bus: as for `CanBase`.
        wheels: as for `CanBase`.
        tells: the world that the wheels move.
        by_hand: how long after a touch the line is closed by hand, s; none: only by a fault that
            says so.
        bumper: whether its board is on the bus.
        rtr: whether the drives take remote requests.
        lacks: objects that the drives lack.
    """

    sources = ("drives",)
    needs = ("canopen",)

    def __init__(
        self,
        bus: Mapping[str, Any],
        wheels: Mapping[str, Any],
        tells: Hearer | None = None,
        by_hand: float | None = 1.0,
        bumper: bool = True,
        rtr: bool = True,
        lacks: Sequence[int | str] = (),
    ) -> None:
        channel = str(bus.get("channel", ""))
        settings: dict[str, Any] = {
            "bus": dict(bus),
            "host": channel if channel.startswith("127.") else LOOPBACK,
            "nodes": tuple(wheels["nodes"]),
            "signs": tuple(wheels.get("signs", (1, 1, 1, 1))),
            "gear": float(wheels.get("gear", 1.0)),
            "increments": float(wheels.get("increments", 4096.0)),
            "by_hand_ns": None if by_hand is None else round(1e9 * by_hand),
            "bumper": bumper,
            "unit": str(wheels.get("unit", "increments/s")),
            "rtr": rtr,
            "lacks": tuple(int(str(index), 0) for index in lacks),
        }
        super().__init__("hw.fakes.can.can_nodes", settings, tells, "the fake CAN nodes")
