"""The world of the fakes as a process: peers report their motors and receive their senses.

Its address is known beforehand. All messages are `hw.ipc.datagrams`; stamps are instants of
measurement. A peer subscribes by sending `subscribe` there, from the start and every 200 ms, under
a source that names its kind; the value is the door of its own intake for the source `world`.

| source | receives (from source `world`) |
|---|---|
| `vr_client` | `user.pose`, `rover.tracker`, `vr.haptic_request` (a level), `vr.release`, … |
| `drives` | `bumper`: `BumperHit` at the start of a touch, None while free (a level) |
| `scanners` | `base.scan` |
| `evaluator` | `truth` (times of the monotonic clock), `finished` (None: not begun), `world.late` |

| source | sends |
|---|---|
| `drives` | `wheels`: rates of front left, front right, rear left, rear right, rad/s |
| `cb3` | `joints`, rad |
| `vr_client` | `inform`: whether the robot is shown to the user |
| `evaluator` | `begin`: the person may start; `push_off`: the operator pushes the robot away |
| `evaluator` | `place` (UserPose), `ask` (the DEEP, None: none), for a `live` person |

Levels are sent every 100 ms and on change. Only the evaluator receives the truth.
"""

from __future__ import annotations

import select
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from hw.connection import HostedScene
from hw.ipc import DEVICES, Address, Datagram as Heard, Door, Intake, Outlet, Parent, Ready, serve
from hw.model import MotionLimits, RobotModel
from hw.sim import DRIVES, EVALUATOR, SCANNERS, STEP_NS, VR, HostedWorld, PeerMessage
from hw.truth import Truth

SOURCES = (VR, DRIVES, SCANNERS, "cb3")
"""The peers that may send."""
KEPT_S = 1.0
"""Time after which a subscription ends without renewal, s."""
LATE_NS = 50_000_000
"""Steps later than this are counted."""


@dataclass(frozen=True)
class WorldSettings:
    """The hosted scene, its robot, the address, and the secret of its doors."""

    address: Address
    secret: bytes
    play: HostedScene
    robot: RobotModel
    motion: MotionLimits


class Audience:
    """Subscribers: doors by the kind of peer, while they renew."""

    def __init__(self) -> None:
        self._outlets = {kind: Outlet() for kind in (VR, DRIVES, SCANNERS, EVALUATOR)}
        self._until: dict[tuple[str, Door], float] = {}

    def welcome(self, kind: str, told: Any, now_s: float) -> None:
        """Add or renew a subscriber, of a kind that is told something.

        Raises:
            TypeError, ValueError: there is none, or it is no door.
        """
        host, port, key = told
        door = Door(str(host), int(port), bytes.fromhex(key).hex())
        if kind not in self._outlets:
            raise ValueError("nobody to be told anything")
        self._until[kind, door] = now_s + KEPT_S
        if door not in self._outlets[kind].doors:
            self._outlets[kind].doors.append(door)

    def send(self, told: Iterable[PeerMessage], began_ns: int, now_s: float) -> None:
        """Deliver messages, and drop expired subscribers."""
        for (kind, door), until in list(self._until.items()):
            if until < now_s:
                del self._until[kind, door]
                self._outlets[kind].doors.remove(door)
        for one in told:
            outlet, value = self._outlets[one.to], one.value
            if outlet.doors:
                if isinstance(value, Truth):
                    value = later(value, began_ns)
                outlet.send(one.name, began_ns + one.stamp_ns, value)

    def close(self) -> None:
        """Close all outlets."""
        for outlet in self._outlets.values():
            outlet.close()


def later(truth: Truth, by_ns: int) -> Truth:
    """The same truth with its times shifted."""
    contacts = truth.contacts
    if contacts is not None:
        contacts = tuple(replace(one, at_ns=one.at_ns + by_ns) for one in contacts)
    seen, since = (
        None if stamp is None else stamp + by_ns
        for stamp in (truth.seen_ns, truth.tracked_since_ns)
    )
    return truth._replace(seen_ns=seen, tracked_since_ns=since, contacts=contacts)


class Host:
    """Steps a world in real time; `late` counts late steps."""

    def __init__(self, world: HostedWorld, intake: Intake, audience: Audience) -> None:
        self.late, self.worst_ns, self.steps = 0, 0, 0
        self._world, self._intake, self._audience = world, intake, audience
        self._began = time.monotonic_ns()

    def run(self, parent: Parent) -> None:
        """Step until the parent has gone."""
        while True:
            due = self._began + self._world.now_ns + STEP_NS
            left = (due - time.monotonic_ns()) * 1e-9
            watched: list[Any] = [self._intake, parent]
            readable, _, _ = select.select(watched, [], [], max(0.0, left))
            if parent in readable:
                return
            if self._intake in readable:
                self._receive()
            behind = time.monotonic_ns() - due
            if behind >= 0:
                self._step(behind)

    def _receive(self) -> None:
        for heard in self._intake.poll():
            try:
                self._handle(heard)
            except (TypeError, ValueError) as error:
                sys.stderr.write(f"world: {heard.source} {heard.name}: {error}\n")

    def _handle(self, heard: Heard) -> None:
        if heard.name == "subscribe":
            self._audience.welcome(heard.source, heard.value, time.monotonic())
            return
        self._world.on_message(heard.source, heard.name, heard.stamp_ns - self._began, heard.value)

    def _step(self, behind_ns: int) -> None:
        told = self._world.step()
        self.steps += 1
        self.worst_ns = max(self.worst_ns, behind_ns)
        if behind_ns > LATE_NS:
            self.late += 1
            told.append(PeerMessage(EVALUATOR, "world.late", self._world.now_ns, self.late))
        self._audience.send(told, self._began, time.monotonic())


def main(settings: WorldSettings, ready: Ready, parent: Parent) -> None:
    """Host the world until the parent has gone."""
    intake = Intake((*SOURCES, EVALUATOR), *settings.address, settings.secret)
    audience = Audience()
    try:
        world = HostedWorld(settings.play, settings.robot, settings.motion)
        ready({"host": intake.address[0], "port": intake.address[1]})
        host = Host(world, intake, audience)
        host.run(parent)
        if host.late:
            worst = host.worst_ns * 1e-6
            sys.stderr.write(
                f"the world of the fakes was late in {host.late} of {host.steps} steps, "
                f"by up to {worst:.0f} ms\n"
            )
    finally:
        intake.close()
        audience.close()


if __name__ == "__main__":
    serve(main, DEVICES)
