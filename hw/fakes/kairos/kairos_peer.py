"""The fake RB-KAIROS as a peer of a connection.

peers:
  kairos: {driver: Kairos, host: loopback, port: 9090, tells: world}
"""

from __future__ import annotations

from hw.connection import RunInfo
from hw.fakes.peer import Peer
from hw.ipc import Hearer


class Kairos(Peer):
    """A fake RB-KAIROS in a process of its own; `kairos_process` describes its faults.

    `tells` is the world that its wheels move; without one it drives in a plane of its own. Its
    scanners are mounted `upside_down`, like the real ones, or not; `stop` is the topic that tells
    of its emergency stop.

    Args:
        host: the address to serve at.
        opening: of the run.
        port: of rosbridge.
        ros: 1 or 2: how message types are named.
        upside_down: how its scanners are mounted.
        stop: the topic that tells of its emergency stop.
        tells: the world that its wheels move.
    """

    sources = ("drives", "scanners")
    needs = ("websockets",)

    def __init__(
        self,
        host: str,
        opening: RunInfo,
        port: int = 9090,
        ros: int = 1,
        upside_down: bool = False,
        stop: str = "robotnik_base_hw/emergency_stop",
        tells: Hearer | None = None,
    ) -> None:
        base = opening.body.base
        settings = {
            "host": host, "port": port, "ros": ros, "upside_down": upside_down, "stop": stop,
            "radius": base.wheel_radius, "lever": base.lever,
        }  # fmt: skip
        super().__init__("hw.fakes.kairos.kairos_process", settings, tells, "the fake RB-KAIROS")
