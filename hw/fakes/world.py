"""The world of the fakes, as the engine sees it: started and ended here, the truth comes back.

For the evaluator alone: nothing that drives may look at it.
"""

from __future__ import annotations

import select
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from hw.connection import RunInfo
from hw.fakes.subscription import Subscription
from hw.fakes.world_process import WorldSettings, later
from hw.geometry import Pose3
from hw.links.datagrams import Address, Datagram, Intake, Outlet
from hw.links.processes import Child
from hw.robot import RobotModel
from hw.samples import UserPose
from hw.truth import Truth

FIRST_S = 5.0
"""The first truth comes within so long after the world is ready, s."""
CATCH_UP_NS = 100_000_000
"""The first tick waits so long for a truth of its own time, ns."""
SILENT_NS = 2_000_000_000
"""A world that tells nothing for so long has failed."""


class WorldPeer:
    """The process of the world; peers that are given it as `tells` send to its `address`.

    `truth` stays as it is between two calls of `advance`; its times are those of the run.
    `finished`: has the person done what they were going to do? `late` counts steps of the world
    that came more than 50 ms late.
    """

    def __init__(self, port: int, opening: RunInfo, host: str = "127.0.0.1", *, now: Any) -> None:
        """Start it.

        Raises:
            ValueError: there is no room to host.
        """
        if opening.play is None:
            raise ValueError("a world needs a room; give one with --scene")
        self.address: Address = (host, port)
        self.truth: Truth | None = None
        self.truth_ns = 0
        self.finished = False
        self.late = 0
        self.failures: list[Exception] = []
        self._now: Callable[[], int] = now
        self._shift: int | None = None
        self._begun = False
        self._heard = time.monotonic_ns()
        self._intake, self._outlet = Intake(host), Outlet("evaluator", [self.address])
        self._subscription = Subscription(self._outlet, self._intake.address)
        settings = WorldSettings(self.address, opening.play, _plain(opening.body), opening.motion)
        self._child = Child("hw.fakes.world_process", settings)

    @property
    def pid(self) -> int:
        """Of its process."""
        return self._child.pid

    def wait(self) -> None:
        """It is ready, and its first truth is known.

        Raises:
            OSError: it cannot start, and why.
        """
        self._child.wait()
        self._subscription.tell(time.monotonic_ns())
        until = time.monotonic() + FIRST_S
        while self.truth is None:
            left = until - time.monotonic()
            if left <= 0.0:
                raise OSError("the world of the fakes tells nothing")
            select.select([self._intake], [], [], left)
            self._poll()

    def advance(self) -> None:
        """The run goes on: take what the world has told; at first, the person begins."""
        real = time.monotonic_ns()
        if self._shift is None:
            self._shift, self._heard = self._now() - real, real
            self._catch_up(real)
        if not self._begun:
            self._outlet.send("begin", real)
        self._subscription.renew(real)
        self._poll()
        if real - self._heard > SILENT_NS and not self.failures:
            self.failures.append(OSError("the world of the fakes has been silent for 2 s"))

    def _catch_up(self, real_ns: int) -> None:
        """Nobody listened since the start: the truth of that time does not count."""
        self._poll()
        self._subscription.tell(real_ns)
        until, old = real_ns + CATCH_UP_NS, self.truth
        while self.truth is old and (left := until - time.monotonic_ns()) > 0:
            select.select([self._intake], [], [], left * 1e-9)
            self._poll()

    def push_off(self) -> None:
        """An operator pushes the robot off a person that it touches; call it for as long."""
        self._outlet.send("push_off", time.monotonic_ns())

    def place(self, pose: UserPose) -> None:
        """A person who is `live` is here from now on."""
        self._outlet.send("place", time.monotonic_ns(), pose)

    def ask(self, deep: Pose3 | None) -> None:
        """A person who is `live` asks for a touch there, or does no more."""
        self._outlet.send("ask", time.monotonic_ns(), deep)

    def close(self) -> None:
        """End it."""
        self._child.close()
        self._intake.close()
        self._outlet.close()

    def _poll(self) -> None:
        while heard := self._intake.poll():
            for told in heard:
                self._take(told)

    def _take(self, told: Datagram) -> None:
        self._heard = time.monotonic_ns()
        if told.name == "truth":
            shift = self._shift or 0
            self.truth_ns = told.stamp_ns + shift
            self.truth = _kept(later(told.value, shift), self.truth)
        elif told.name == "finished":
            self._begun, self.finished = told.value is not None, told.value is True
        elif told.name == "world.late":
            self.late = told.value


def _kept(truth: Truth, before: Truth | None) -> Truth:
    """The truth, with the same objects as before where nothing has changed."""
    if before is None:
        return truth
    pairs = zip(before, truth, strict=True)
    return Truth._make(old if old == new else new for old, new in pairs)


def _plain(body: RobotModel) -> RobotModel:
    """A body that can be sent to a process."""
    sensing = body.sensing
    plain = replace(sensing, lidars=dict(sensing.lidars), trackers=dict(sensing.trackers))
    return replace(body, sensing=plain)
