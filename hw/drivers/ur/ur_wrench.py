"""The force at the tool of a UR arm, as its controller states it.

parts:
  wrench: {driver: UrWrench, host: 192.168.0.20}   # the controller of the arm

It is read by a link of its own, beside that of the arm. The e-series measures it at the flange. A
CB3 estimates it from the currents of its motors, to some ten newtons while it stands, and worse
while it moves. In both the controller takes off the weight of its payload, as it knows it.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from hw.connection import RunInfo
from hw.drivers.feed import up_to
from hw.drivers.gates import WRENCH_SILENT_NS
from hw.drivers.ur.output_stream import LOOK_S, OutputStream
from hw.drivers.ur.probe import TIMEOUT_S
from hw.drivers.ur.ur_settings import ur_arm_of
from hw.geometry import Pose3
from hw.model import FlangeChain
from hw.samples import Sample, WrenchReading

OUTPUTS = {"timestamp": 1, "actual_q": 6, "actual_TCP_pose": 6, "actual_TCP_force": 6}
"""The controller's own time, s; joints, rad; base_from_tcp as position and rotation vector, m and
rad; force, N, and torque about the tcp, Nm, along the axes of the base."""
SILENT_S = 2.0
"""Silence after which the link is opened anew, s: the controller may have restarted."""
AGAIN_S = 0.5
"""Period of attempts to reach the controller, s."""
OPENING_S = 5.0
"""Time limit for the first reading, s."""
NO_LOAD = WrenchReading((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


class UrWrench:
    """The force sensor of a UR arm whose controller is at `host`. Gives `wrench.reading`.

    A controller that says nothing for 0.2 s is a fault, which stops the robot.

    Args:
        host: the address of the controller.
        opening: of the run.
        now: the time of the run, ns.

    Raises:
        ValueError: the robot has no UR arm.
    """

    signals: tuple[str, ...] = ("wrench.reading",)

    def __init__(self, host: str, opening: RunInfo, now: Callable[[], int]) -> None:
        arm = ur_arm_of(opening.body)
        self.wake: Callable[[], None] = _nobody
        self._host, self._now, self._chain = host, now, FlangeChain(arm)
        self._arrived: deque[Sample] = deque(maxlen=1000)
        self._cause: str | None = "not connected yet"
        self._load = self._zero = NO_LOAD
        self._stamp = -math.inf
        self._heard_ns = self._looked_ns = time.monotonic_ns()
        self._first, self._over = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="wrench", daemon=True)
        self._thread.start()

    @staticmethod
    def probe(host: str, **_: Any) -> str:
        """That the controller states the force, without moving the arm."""
        stream = OutputStream(host, OUTPUTS)
        stream.close()
        return f"{host} states the force at its tool"

    @property
    def fault(self) -> str | None:
        """Why there are no readings, or None.

        Without a cause, time counts up to the last look at the link: a thread that was held up has
        not heard silence.
        """
        until_ns = self._looked_ns if self._cause is None else time.monotonic_ns()
        if until_ns - self._heard_ns <= WRENCH_SILENT_NS:
            return None
        return f"the force of the arm at {self._host}: {self._cause or 'silent'}"

    def wait(self) -> None:
        """Wait for the first reading.

        Raises:
            OSError: none came within OPENING_S, with the cause.
        """
        if not self._first.wait(OPENING_S):
            raise OSError(f"{self._host}: {self._cause or 'silent'}")

    def samples(self, now_ns: int) -> list[Sample]:
        """Readings since the last call."""
        return up_to(self._arrived, now_ns)

    def zero(self) -> None:
        """Take the present reading as no load; see `Wrench`."""
        self._zero = self._load

    def close(self) -> None:
        """Close the link."""
        self._over.set()
        self._thread.join(TIMEOUT_S + LOOK_S)

    def _run(self) -> None:
        while not self._over.is_set():
            try:
                stream = OutputStream(self._host, OUTPUTS)
            except OSError as error:
                self._cause = f"not connected: {error}"
            else:
                self._follow(stream)
            self._over.wait(AGAIN_S)

    def _follow(self, stream: OutputStream) -> None:
        self._cause, spoke_ns = None, time.monotonic_ns()
        try:
            while not self._over.is_set():
                rows = stream.rows()
                self._looked_ns = time.monotonic_ns()
                spoke_ns = self._looked_ns if rows else spoke_ns
                if self._looked_ns - spoke_ns > SILENT_S * 1e9:
                    raise OSError("silent")
                for row in rows:
                    self._take(row)
        except OSError as error:
            self._cause = f"the link is gone: {error}"
        finally:
            stream.close()

    def _take(self, row: tuple[float, ...]) -> None:
        stamp, joints, tcp, load = row[0], row[1:7], row[7:13], row[13:]
        stands, self._stamp = stamp == self._stamp, stamp
        if stands or not all(map(math.isfinite, row)):
            self._cause = "its time stands still" if stands else "it states no finite force"
            return
        self._cause, self._heard_ns = None, self._looked_ns
        self._load = on_flange(self._chain.on_base(joints), tcp, load)
        reading = _tared(self._load, self._zero)
        self._arrived.append(Sample("wrench.reading", self._now(), reading))
        self._first.set()
        self.wake()


def on_flange(flange: Pose3, tcp: tuple[float, ...], load: tuple[float, ...]) -> WrenchReading:
    """Force and torque on the flange, in its frame.

    `flange` is base_from_flange; `tcp` begins with the place of the tcp in the base, m; `load` are
    force, N, and torque about the tcp, Nm, along the axes of the base. About the flange the torque
    is that about the tcp plus the lever from the flange to it, times the force.
    """
    x, y, z = tcp[0] - flange.x, tcp[1] - flange.y, tcp[2] - flange.z
    fx, fy, fz, tx, ty, tz = load
    about = (tx + y * fz - z * fy, ty + z * fx - x * fz, tz + x * fy - y * fx)
    seen = Pose3(0.0, 0.0, 0.0, flange.qx, flange.qy, flange.qz, flange.qw).inverse()
    return WrenchReading(seen.transform(fx, fy, fz), seen.transform(*about))


def _tared(load: WrenchReading, zero: WrenchReading) -> WrenchReading:
    (fx, fy, fz), (tx, ty, tz) = load.force, load.torque
    (gx, gy, gz), (ux, uy, uz) = zero.force, zero.torque
    return WrenchReading((fx - gx, fy - gy, fz - gz), (tx - ux, ty - uy, tz - uz))


def _nobody() -> None:
    """No loop waits for a reading."""
