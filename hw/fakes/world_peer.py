"""The world of the fakes as the engine sees it: starts and ends it, receives the ground truth.

The truth is for the evaluator alone: nothing that drives may use it.
"""

from __future__ import annotations

import secrets
import select
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from hw.connection import RunInfo
from hw.fakes.subscription import Subscription
from hw.fakes.world_process import WorldSettings, later
from hw.geometry import Pose3
from hw.ipc import Address, Child, Datagram, Door, Intake, Outlet
from hw.model import RobotModel
from hw.samples import UserPose
from hw.sim import EVALUATOR
from hw.truth import Truth

NAME = "the world of the fakes"
FIRST_S = 5.0
"""Time limit for the first truth, s."""
CATCH_UP_NS = 100_000_000
"""Time that the first tick waits for a truth of its own time, ns."""
SILENT_NS = 800_000_000
"""Silence after which the world has failed, ns."""


class WorldPeer:
    """The process of the world; peers with it as `tells` send to its doors.

    `truth` is constant between two calls of `advance`; its times are those of the run. `finished`:
    the person has finished. `late` counts steps of the world that were more than 50 ms late.

    Args:
        port: of UDP.
        opening: of the run.
        host: the address to bind.
        now: the time of the run, ns.
    """

    def __init__(self, port: int, opening: RunInfo, host: str = "127.0.0.1", *, now: Any) -> None:
        """Start it.

        Raises:
            ValueError: there is no scene to host.
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
        self._secret = secrets.token_bytes(16)
        self._intake, self._outlet = Intake(("world",), host), Outlet([self.door(EVALUATOR)])
        self._subscription = Subscription(self._outlet, self._intake.door("world"))
        settings = WorldSettings(
            self.address, self._secret, opening.play, _plain(opening.body), opening.motion
        )
        self.child = Child("hw.fakes.world_process", settings, NAME)

    def door(self, source: str) -> Door:
        """See `Hearer`."""
        return Door.of(self.address, self._secret, source)

    @property
    def pid(self) -> int:
        """Process id."""
        return self.child.pid

    @property
    def fault(self) -> str | None:
        """Why nothing moves in it any more; None if it runs."""
        silent = time.monotonic_ns() - self._heard > SILENT_NS
        return self.child.fault or (f"{NAME} is silent" if silent else None)

    def wait(self) -> None:
        """Wait until it is ready, and its first truth is known.

        Raises:
            OSError: it cannot start, with the cause.
        """
        self.child.wait()
        self._subscription.subscribe(time.monotonic_ns())
        until = time.monotonic() + FIRST_S
        while self.truth is None:
            left = until - time.monotonic()
            if left <= 0.0:
                raise OSError(f"{NAME} is silent")
            select.select([self._intake], [], [], left)
            self._poll()

    def advance(self) -> None:
        """Take the world's messages; at first, let the person begin."""
        real = time.monotonic_ns()
        if self._shift is None:
            self._shift, self._heard = self._now() - real, real
            self._catch_up(real)
        if not self._begun:
            self._outlet.send("begin", real)
        self._subscription.renew(real)
        self._poll()
        if self.fault is not None and not self.failures:
            self.failures.append(OSError(self.fault))

    def _catch_up(self, real_ns: int) -> None:
        """Skip what was sent since the start: a truth of that time does not count."""
        self._poll()
        self._subscription.subscribe(real_ns)
        until, old = real_ns + CATCH_UP_NS, self.truth
        while self.truth is old and (left := until - time.monotonic_ns()) > 0:
            select.select([self._intake], [], [], left * 1e-9)
            self._poll()

    def push_off(self) -> None:
        """Push the robot away from a person it touches; call it repeatedly."""
        self._outlet.send("push_off", time.monotonic_ns())

    def place(self, pose: UserPose) -> None:
        """Place a `live` person."""
        self._outlet.send("place", time.monotonic_ns(), pose)

    def ask(self, deep: Pose3 | None) -> None:
        """Let a `live` person request a touch, or end the request."""
        self._outlet.send("ask", time.monotonic_ns(), deep)

    def close(self) -> None:
        """End its process."""
        self.child.close()
        self._intake.close()
        self._outlet.close()

    def _poll(self) -> None:
        while heard := self._intake.poll():
            for datagram in heard:
                self._on_datagram(datagram)

    def _on_datagram(self, datagram: Datagram) -> None:
        self._heard = time.monotonic_ns()
        if datagram.name == "truth":
            shift = self._shift or 0
            self.truth_ns = datagram.stamp_ns + shift
            self.truth = _kept(later(datagram.value, shift), self.truth)
        elif datagram.name == "finished":
            self._begun, self.finished = datagram.value is not None, datagram.value is True
        elif datagram.name == "world.late":
            self.late = datagram.value


def _kept(truth: Truth, before: Truth | None) -> Truth:
    """The truth, with the same objects as before where nothing has changed."""
    if before is None:
        return truth
    pairs = zip(before, truth, strict=True)
    return Truth._make(old if old == new else new for old, new in pairs)


def _plain(body: RobotModel) -> RobotModel:
    """A body that can be pickled."""
    sensing = body.sensing
    plain = replace(sensing, lidars=dict(sensing.lidars), trackers=dict(sensing.trackers))
    return replace(body, sensing=plain)
