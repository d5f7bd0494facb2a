"""A UR arm as a part: its worker process, its samples, and recovery from its loss."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from typing import Any, Protocol

from hw.connection import RunInfo
from hw.drivers.feed import DatagramFeed, up_to
from hw.drivers.gates import JOINTS_LATE_NS, WORKER_SILENT_NS
from hw.drivers.ur.probe import probe
from hw.drivers.ur.ur_settings import Servo, WorkerSettings, ur_arm_of
from hw.ipc import Child, Datagram, Door, Hearer, Outlet
from hw.model import check_pace
from hw.samples import ArmState, Sample, TimedJoints

SOURCE = "arm"
"""The source under which engine and chain know the worker."""
WORKER, NAME = "hw.drivers.ur.worker", "the arm's process"
HERE_S = 0.01
LOOKS = 3
"""Checks in a row that must find it silent: after a stall of our own, queued data is read first."""
COUNTED_S = 0.1
"""Reaction time of the arm that its separation from people counts on, s."""
PIECE = 200
"""Points of a trajectory per datagram."""
MISSING = (
    "the package ur-rtde is not installed: it comes for Linux on x86-64 and Python below 3.13; "
    "simulation and mock do without it"
)


class RunStopLine(Protocol):
    """The stop line of the run."""

    @property
    def reason(self) -> str | None:
        """Why nothing may move, or None."""
        ...

    def pull(self, reason: str) -> None:
        """Stop everything."""
        ...


class UrArm:
    """A UR arm of the CB3 series at `host`; `tells` is the chain, which gets its joints too.

    `servo: {lookahead: 0.03, gain: 500}` is how it follows set-points
    (`hw.drivers.ur.ur_settings`).

    A fault of the arm or its link pulls the stop line, and nothing moves until the operator has
    acknowledged: then a new worker is started, and the arm stands until a new trajectory. `late`
    counts joints that arrived more than 24 ms after those before.

    Args:
        host: the address of the controller.
        opening: of the run.
        now: the time of the run, ns.
        tells: the safety chain, which gets the joints too.
        servo: how it follows set-points: `lookahead`, s, and `gain`; by default 0.03 and 500.

    Raises:
        OSError: the client library is missing, or the arm cannot be reached.
    """

    signals: tuple[str, ...] = ("arm.joints",)
    needs = ("rtde_control", "rtde_receive")

    def __init__(
        self,
        host: str,
        opening: RunInfo,
        now: Callable[[], int],
        tells: Hearer | None = None,
        servo: Mapping[str, float] | None = None,
    ) -> None:
        if find_spec("rtde_control") is None:
            raise OSError(MISSING)
        body = opening.body
        arm = ur_arm_of(body)
        follows = Servo.of(servo or {})
        if follows.lookahead > COUNTED_S:
            opening.tell(
                f"arm: with a lookahead of {follows.lookahead:g} s it lags by about as much, and "
                f"its separation from people counts on {COUNTED_S:g} s: limit its speed, too"
            )
        self.line: RunStopLine | None = None
        self.wake: Callable[[], None] = _nobody
        self.late = 0
        self._model, self._number = arm, 0
        self._feed = DatagramFeed(SOURCE, now, self._on_datagram)
        doors = (self._feed.door, *(() if tells is None else (tells.door(SOURCE),)))
        prop = body.prop
        mass, center = (0.0, (0.0, 0.0, 0.0)) if prop is None else (prop.mass, prop.center_of_mass)
        self._settings = WorkerSettings(host, doors, arm, mass, center, servo=follows)
        self._samples: deque[Sample] = deque(maxlen=1000)
        self._orders = Outlet()
        self._ticked = self._heard = self._begun = 0
        self._fault: str | None = "it has not been opened"
        self._renewing: threading.Thread | None = None
        self._over = threading.Event()
        self._watching = threading.Thread(target=self._watch, name="arm", daemon=True)
        self.child = Child(WORKER, self._settings, NAME)

    @staticmethod
    def probe(host: str, **_: Any) -> str:
        """The version of the controller, without moving the arm."""
        return f"{host} says that it is {probe(host)}"

    def wait(self) -> None:
        """Wait until the arm can be moved.

        Raises:
            OSError: it cannot, with the cause.
        """
        self._feed.start()
        self._begin()
        self._watching.start()

    # ---- the part

    def follow(self, points: Sequence[TimedJoints]) -> int:
        """Follow a trajectory; see `Arm`."""
        self._model.check_course(points)
        self._number += 1
        self._ticked = time.monotonic_ns()
        self._tell_here()
        for first in range(0, len(points), PIECE):
            piece = tuple((time, tuple(joints)) for time, joints in points[first : first + PIECE])
            self._orders.send(
                "follow", time.monotonic_ns(), (self._number, first, len(points), piece)
            )
        return self._number

    def pace(self, share: float, separation: float | None = None, needed: float = 0.0) -> None:  # noqa: ARG002  why is for the record
        """Follow the present trajectory at this share of its speed; see `Arm`."""
        check_pace(share)
        self._orders.send("pace", time.monotonic_ns(), share)

    def stop(self) -> None:
        """Brake to standstill; see `Arm`. May be called from any thread."""
        self._tell_here()
        self._orders.send("stop", time.monotonic_ns())

    def samples(self, now_ns: int) -> list[Sample]:
        """Joints since the last call; also tells the worker that the loop still runs."""
        self._ticked = time.monotonic_ns()
        return up_to(self._samples, now_ns)

    @property
    def fault(self) -> str | None:
        """Why the arm does not move until the operator has acknowledged, or None."""
        return self._fault

    @property
    def pid(self) -> int:
        """Process id of its worker."""
        return self.child.pid

    def acknowledge(self) -> bool:
        """Restart a lost arm on the operator's order; False until it is ready: then ask again."""
        if self._fault is None:
            return True
        if self._renewing is None or not self._renewing.is_alive():
            self._renewing = threading.Thread(target=self._renew, name="arm again", daemon=True)
            self._renewing.start()
        return False

    def close(self) -> None:
        """Stop the arm, and end its worker."""
        self._over.set()
        for thread in (self._watching, self._renewing):
            if thread is not None and thread.is_alive():
                thread.join()
        self.child.close()
        self._feed.close()
        self._orders.close()

    # ---- the worker

    def _begin(self) -> None:
        found = self.child.wait()
        self._orders.doors = [Door(*found["orders"])]
        self._heard = self._begun = time.monotonic_ns()
        self._fault = None

    def _renew(self) -> None:
        """Start a worker in place of a lost one; if that fails, the fault says why."""
        self.child.close()
        settings = replace(self._settings, course=self._number, acknowledged=True)
        self.child = Child(WORKER, settings, NAME)
        try:
            self._begin()
        except OSError as error:
            self._fault = f"arm: {error}"

    def _watch(self) -> None:
        """Send heartbeats to the worker, and monitor those it sends."""
        looks = 0
        while not self._over.wait(HERE_S):
            self._tell_here()
            looks = looks + 1 if time.monotonic_ns() - self._heard > WORKER_SILENT_NS else 0
            silent = looks >= LOOKS
            fault = self.child.fault or (f"{NAME} is silent" if silent else None)
            if self._fault is None and fault is not None:
                self._lose(fault)
            if self._fault is not None and silent:
                self._end_worker()

    def _end_worker(self) -> None:
        """Kill the worker: a client that has lost its link would otherwise retry by itself."""
        if not (self._renewing is not None and self._renewing.is_alive()) and self.child.alive:
            self.child.kill()

    def _lose(self, reason: str) -> None:
        self._fault = f"arm: {reason}"
        if self.line is not None:
            self.line.pull(self._fault)
        self.wake()

    def _on_datagram(self, datagram: Datagram, stamp_ns: int) -> None:
        """Take a datagram of the worker, in the thread of the feed."""
        if datagram.stamp_ns < self._begun:
            return
        if datagram.name == "arm.joints" and isinstance(datagram.value, ArmState):
            self.late += self._fault is None and datagram.stamp_ns - self._heard > JOINTS_LATE_NS
            self._heard = min(datagram.stamp_ns, time.monotonic_ns())  # a stamp ahead is none
            self._samples.append(Sample("arm.joints", stamp_ns, datagram.value))
            self.wake()
        elif datagram.name == "arm.link" and datagram.value is not None and self._fault is None:
            self._lose(str(datagram.value))

    def _tell_here(self) -> None:
        stopped = self.line is not None and self.line.reason is not None
        held = self._fault or ("the stop line is pulled" if stopped else None)
        self._orders.send("here", self._ticked, held)


def _nobody() -> None:
    """No loop was started yet."""
