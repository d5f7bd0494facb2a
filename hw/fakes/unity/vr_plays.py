"""The user of the fake VR application: a simulated person, or one hosted by the world."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

from hw.geometry import Pose2
from hw.ipc import Door, Intake, Outlet
from hw.people.walking import Person
from hw.sim.sensors import SimTrackers, SimVr

AGAIN_NS = 100_000_000
"""Period at which the subscription, and whether the robot is shown, are repeated."""
STEP_NS = 10_000_000
AWAY = Pose2(100.0, 100.0)
"""The robot's pose until it is known."""
SEEN = ("user.pose", "rover.tracker", "vr.haptic_request", "vr.release", "vr.restart")


class PlayedEvent(NamedTuple):
    """An event of the user, named as in `hw.samples`; stamped by the monotonic clock, ns."""

    name: str
    stamp_ns: int
    value: Any


class Alone:
    """A simulated person in the application itself, in real time."""

    def __init__(self, person: Person) -> None:
        self._person, self._trackers, self._vr = person, SimTrackers(person), SimVr(person)
        self._begun_ns = time.monotonic_ns()
        self._now_ns = 0

    @property
    def finished(self) -> bool:
        """True once the person has finished."""
        return self._person.finished

    def step(self, now_ns: int, robot: Pose2 | None, shown: bool) -> list[PlayedEvent]:
        """See `UserPlay`."""
        found = []
        self._vr.inform(shown)
        while self._now_ns + STEP_NS <= now_ns - self._begun_ns:
            self._now_ns += STEP_NS
            self._person.step(self._now_ns, robot or AWAY, shown)
            self._trackers.step()
            self._vr.step(self._now_ns)
            for part in (self._trackers, self._vr):
                found += part.samples(self._now_ns)
        return [PlayedEvent(name, stamp + self._begun_ns, value) for name, stamp, value in found]


class HostedPerson:
    """A person hosted by a world: events arrive, and what they are shown is sent, as datagrams."""

    def __init__(self, world: Door) -> None:
        self._intake, self._outlet = Intake(("world",), world.host), Outlet([world])
        self._told: bool | None = None
        self._told_ns = 0

    def step(self, now_ns: int, robot: Pose2 | None, shown: bool) -> list[PlayedEvent]:  # noqa: ARG002
        """See `UserPlay`; the world knows the robot's pose."""
        if shown is not self._told or now_ns - self._told_ns >= AGAIN_NS:
            self._told, self._told_ns = shown, now_ns
            self._outlet.send("subscribe", now_ns, tuple(self._intake.door("world")))
            self._outlet.send("inform", now_ns, shown)
        heard = [told for told in self._intake.poll() if told.name in SEEN]
        return [PlayedEvent(told.name, told.stamp_ns, told.value) for told in heard]

    def close(self) -> None:
        """Close the sockets."""
        self._intake.close()
        self._outlet.close()
