"""The wheels of a stock RB-KAIROS through rosbridge, for the process of the safety chain.

hardware:
  driver: "hw.drivers.kairos.base:KairosBase"
  host: 192.168.0.200
  port: 9090
  ros: 1                 # or 2: how message types are named
  namespace: robot
  topics: {cmd_vel: …}   # only those that are named otherwise on this robot; see TOPICS
  stops:                 # both measured on this robot
    timeout: 0.5         # s, of its own watchdog
    ramp: 0.6            # m/s2, of its drives

The connection is alone on its websocket: scans on the same one held odometry up by 40 ms.

What this robot cannot do: it drives on for `timeout` after the last command, whoever has died, and
its drives have no quick stop that a topic reaches, so that it then slows down with `ramp`. "Zero
within 100 ms of the chain's death" is not met. Instead the speed is bounded so that a stop without
any further command takes `STOP_M` at most: (timeout v) + v2 / (2 ramp). The `limits` of the
connection have to say so, and no faster command leaves here.

Velocities are sent in every cycle; the robot's emergency stop is one of its own hardware.
"""

from __future__ import annotations

import math
import select
import time
from collections.abc import Mapping

from hw.drivers.kairos.link import TYPES, KairosLink
from hw.drivers.ros.rosbridge import Version, reachable, topic_of
from hw.geometry import STILL, Pose2, Twist2
from hw.robot import BaseModel
from hw.samples import BumperHit, Odometry

STOP_M = 0.5
"""A stop that nobody commands takes no longer way, m."""
TOPICS: Mapping[str, str] = {
    "cmd_vel": "robotnik_base_control/cmd_vel",
    "odom": "robotnik_base_control/odom",
    "emergency_stop": "robotnik_base_hw/emergency_stop",
}
"""Names on a stock robot, to be confirmed on each (`rostopic list`)."""
STOCK: Mapping[str, float] = {"timeout": 0.5, "ramp": 0.6}
"""Its watchdog, s, and its drives, m/s2."""
GRACE_S = 0.5
"""Odometry that comes, and is old as yet, has so long, s, to come in time."""
_SLACK = 1.0 + 1e-9
_LOOK_S = 0.01


def fastest(timeout: float, ramp: float, way: float = STOP_M) -> float:
    """The speed, m/s, from which a robot that hears nothing more stands within `way`, m.

    `timeout` is that of its watchdog, s; `ramp` its deceleration after it, m/s2.
    """
    return ramp * (math.sqrt(timeout * timeout + 2.0 * way / ramp) - timeout)


class KairosBase:
    """Wheels behind rosbridge; see `hw.drivers.hardware.Hardware`.

    Odometry counts from the first message on, and goes on over a connection that was lost. A lost
    connection is opened again; the fault that it was stays, and nothing but zero is sent.

    Raises:
        OSError: nobody is there, or no odometry comes within 2 s.
        ValueError: an unknown topic, or a body that is faster than its stop allows.
    """

    needs = ("roslibpy",)

    def __init__(
        self,
        model: BaseModel,
        host: str,
        port: int = 9090,
        ros: Version = 1,
        namespace: str = "robot",
        topics: Mapping[str, str] | None = None,
        stops: Mapping[str, float] = STOCK,
    ) -> None:
        self.odometry: tuple[int, Odometry] | None = None
        self.fault: str | None = None
        self._fastest = _bounded(model, **stops)
        self._topics = _topics(topics or {}, namespace)
        self._address, self._version = (host, port), ros
        self._from_first: Pose2 | None = None
        self._standing = False
        reachable(host, port)
        self._link = KairosLink(self._address, self._topics, ros)
        self._await_first()

    @property
    def ready(self) -> bool:
        """Would a velocity be sent? See `Hardware`."""
        return self.fault is None and not self._standing

    def poll(self, now_ns: int) -> None:
        """Take the newest odometry, and look what is wrong; see `Hardware`."""
        self._take_newest()
        self.fault = self.fault or self._link.cause(now_ns)
        if self._link.is_over(now_ns):
            self._link.close()
            self._link = KairosLink(self._address, self._topics, self._version)

    def hits(self) -> list[BumperHit]:
        """It tells of no touch."""
        return []

    def drive(self, velocity: Twist2, now_ns: int) -> None:  # noqa: ARG002
        """Send a velocity, no faster than its stop allows; see `Hardware`."""
        if self._standing or self.fault is not None:
            velocity = STILL
        scale = self._fastest / max(velocity.speed, self._fastest)
        self._link.send(Twist2(scale * velocity.vx, scale * velocity.vy, velocity.wz))

    def stop(self) -> None:
        """Send zero, now and until `acknowledge`; the drives have no quick stop for a topic."""
        self._standing = True
        self._link.send(STILL)

    def acknowledge(self) -> bool:
        """Let the wheels turn again, unless a cause holds; see `Hardware`."""
        cause = self._link.cause(time.monotonic_ns())
        if cause is not None:
            self.fault = cause
            return False
        self.fault, self._standing = None, False
        return True

    def close(self) -> None:
        """Stand, and let go of the connection."""
        self._link.send(STILL)
        self._link.close(in_order=True)

    def _take_newest(self) -> None:
        newest = self._link.newest
        if newest is None or (self.odometry is not None and newest[0] <= self.odometry[0]):
            return
        stamp_ns, pose, twist = newest
        if self._from_first is None:
            self._from_first = pose.inverse()
        self.odometry = (stamp_ns, Odometry(self._from_first @ pose, twist))

    def _await_first(self) -> None:
        """Until odometry comes, and the robot has said whether it is stopped."""
        link = self._link
        while link.opening(time.monotonic_ns()):
            select.select([], [], [], _LOOK_S)
        until = time.monotonic() + GRACE_S
        while link.newest and not link.usable(time.monotonic_ns()) and time.monotonic() < until:
            select.select([], [], [], _LOOK_S)
        now_ns = time.monotonic_ns()
        if not link.usable(now_ns):
            cause = link.cause(now_ns)
            link.close()
            raise OSError(cause)
        self.poll(now_ns)


def _bounded(model: BaseModel, timeout: float, ramp: float) -> float:
    """The speed of the body, if its stop is short enough.

    Raises:
        ValueError: it is not.
    """
    if not (0.0 < timeout < 10.0 and 0.01 < ramp < 10.0):
        raise ValueError(f"stops: {timeout} s and {ramp} m/s2: write what was measured")
    most = fastest(timeout, ramp)
    told = f"it drives on for {timeout:g} s, then brakes with {ramp:g} m/s2"
    if model.max_speed > _SLACK * most:
        cut = math.floor(1000.0 * most) / 1000.0
        raise ValueError(f"limits: speed: {cut:g} m/s is most for a stop in {STOP_M:g} m: {told}")
    if model.brake_deceleration > _SLACK * ramp:
        raise ValueError(f"limits: brakes: {ramp:g} m/s2 is most: {told}")
    return most


def _topics(given: Mapping[str, str], namespace: str) -> dict[str, str]:
    if strange := sorted(set(given) - set(TOPICS)):
        raise ValueError(f"topics: {', '.join(strange)}: there are {', '.join(TYPES)}")
    return {name: topic_of(namespace, given.get(name, own)) for name, own in TOPICS.items()}
