"""The process of the fake CAN nodes: bus, faults by datagrams (`nodes`), and the world.

With a world it sends source `drives`, name `wheels`: the four rates, rad/s, every 10 ms; and it
receives `bumper`: a `BumperHit` when the foam is touched, None when it is free.
"""

from __future__ import annotations

import math
import time
from typing import Any

from hw.fakes.can.can_wire import Bus, Hub, open_wire, wait
from hw.fakes.can.drive import Traits
from hw.fakes.can.nodes import Nodes
from hw.fakes.subscription import Subscription
from hw.ipc import DEVICES, Door, Intake, Outlet, Parent, Ready, serve
from hw.samples import BumperHit

TELL_NS = 10_000_000
PER_TURN = {"rpm": 60.0, "0.1 rpm": 600.0, "mrpm": 60_000.0}
"""Units of a motor that turns once a second."""
STEP_S = 0.002


class Teller:
    """Sends the wheel rates to the world, and subscribes to touches."""

    def __init__(self, world: Door, own: Door, scales: list[float]) -> None:
        """`scales` are drive units per rad of the wheel, negative if mounted reversed."""
        self._outlet = Outlet([world])
        self._subscription, self._scales = Subscription(self._outlet, own), scales
        self._told_ns = 0

    def step(self, velocities: list[float], now_ns: int) -> None:
        """Send what is due."""
        self._subscription.renew(now_ns)
        if now_ns - self._told_ns >= TELL_NS:
            late = now_ns - self._told_ns > 2 * TELL_NS
            self._told_ns = now_ns if late else self._told_ns + TELL_NS
            rates = tuple(v / scale for v, scale in zip(velocities, self._scales, strict=True))
            self._outlet.send("wheels", now_ns, rates)

    def close(self) -> None:
        """Close the sockets."""
        self._outlet.close()


def main(settings: dict[str, Any], ready: Ready, parent: Parent) -> None:
    """Run until the parent has gone."""
    wire = open_wire(settings["bus"])
    intake = Intake(("fault", "world"), settings["host"])
    traits = Traits(settings["rtr"], frozenset(settings["lacks"]), settings["unit"])
    nodes = Nodes(wire, settings["nodes"], settings["by_hand_ns"], settings["bumper"], traits)
    teller = None
    if settings["tells"] is not None:
        per_turn = PER_TURN.get(settings["unit"], settings["increments"])
        scale = settings["gear"] * per_turn / (2.0 * math.pi)
        scales = [sign * scale for sign in settings["signs"]]
        teller = Teller(settings["tells"]["drives"], intake.door("world"), scales)
    ready({"control": intake.door("fault"), "wire": type(wire).__name__})
    try:
        _live(wire, intake, nodes, teller, parent)
    finally:
        wire.close()
        intake.close()
        if teller is not None:
            teller.close()


def _live(
    wire: Bus | Hub, intake: Intake, nodes: Nodes, teller: Teller | None, parent: Parent
) -> None:
    while parent.lives():
        wait([intake, parent, *wire.files()], STEP_S)
        now_ns = time.monotonic_ns()
        for datagram in intake.poll():
            if datagram.source == "world":
                _feel(nodes, datagram.name, datagram.value)
            else:
                nodes.fault(datagram.name, datagram.value)
        nodes.on_frames(wire.poll(), now_ns)
        nodes.step(now_ns)
        if teller is not None:
            teller.step(nodes.velocities(), now_ns)


def _feel(nodes: Nodes, name: str, value: Any) -> None:
    if name != "bumper":
        return
    if isinstance(value, BumperHit):
        nodes.fault("touch", value.bearing)
    else:
        nodes.fault("release")


if __name__ == "__main__":
    serve(main, DEVICES)
