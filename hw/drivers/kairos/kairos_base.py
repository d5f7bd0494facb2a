"""The wheels of a stock RB-KAIROS through rosbridge, for the process of the safety chain.

hardware:
  driver: KairosBase
  host: 192.168.0.200
  port: 9090
  ros: 1                 # or 2: how message types are named
  namespace: robot
  topics: {cmd_vel: …}   # only those with other names on this robot; see TOPICS
  stops:                 # both measured on this robot
    timeout: 0.5         # s, of its own watchdog
    ramp: 0.6            # m/s2, of its drives

The connection has a websocket of its own: scans on the same one delayed odometry by 40 ms.

Limits of this robot: after the last command it drives on for `timeout`, and its drives have no
quick stop by topic, so that it then brakes with `ramp` only. "Zero within 100 ms of the chain's
death" is not met. Instead the speed v is limited so that a stop without any further command takes
at most `STOP_M`: v timeout + v^2 / (2 ramp). The `limits` of the connection must say so, and no
faster command is sent.

Velocities are sent in every cycle; the robot's emergency stop is that of its own hardware.
"""

from __future__ import annotations

import math
import select
import time
from collections import deque
from collections.abc import Mapping

from hw.drivers.kairos.kairos_link import TYPES, KairosLink
from hw.drivers.ros import Version, reachable, topic_of
from hw.geometry import STILL, Pose2, Twist2
from hw.model import BaseModel
from hw.safety import require_rolling
from hw.samples import BumperHit, Odometry

STOP_M = 0.5
"""Longest stopping distance after the last command, m."""
TOPICS: Mapping[str, str] = {
    "cmd_vel": "robotnik_base_control/cmd_vel",
    "odom": "robotnik_base_control/odom",
    "emergency_stop": "robotnik_base_hw/emergency_stop",
}
"""Names on a stock robot, to be confirmed on each (`rostopic list`)."""
STOCK: Mapping[str, float] = {"timeout": 0.5, "ramp": 0.6}
"""Its watchdog, s, and the ramp of its drives, m/s2."""
GRACE_S = 0.5
"""Time for odometry that arrives late at first to become timely, s."""
_SLACK = 1.0 + 1e-9
_LOOK_S = 0.01


def fastest(timeout: float, ramp: float, way: float = STOP_M) -> float:
    """The speed, m/s, from which a robot without further commands stops within `way`, m.

    The positive root of v timeout + v^2 / (2 ramp) = way; `timeout` is its watchdog's, s, and
    `ramp` its deceleration, m/s2.
    """
    return ramp * (math.sqrt(timeout * timeout + 2.0 * way / ramp) - timeout)


class KairosBase:
    """Wheels behind rosbridge; see `hw.drivers.hardware.Hardware`.

    Odometry counts from the first message on, and continues across a lost connection. A lost
    connection is reopened; its fault stays, and only zero is sent.

    Args:
        model: of the base.
        host: the computer of the robot.
        port: of rosbridge.
        ros: 1 or 2: how message types are named.
        namespace: before all topics.
        topics: those with other names on this robot: `cmd_vel`, `odom`, `emergency_stop`.
        stops: its own time-out `timeout`, s, and the `ramp` of its drives, m/s2, as measured on it;
            by default 0.5 and 0.6.

    Raises:
        OSError: there is no server, or no odometry within 2 s.
        ValueError: an unknown topic, or a body faster than its stop allows.
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
        self._fastest, self._sideways = _bounded(model, **stops), model.sideways
        self._topics = _topics(topics or {}, namespace)
        self._address, self._version = (host, port), ros
        self._from_first: Pose2 | None = None
        self._standing = False
        self._remarks: deque[str] = deque()
        reachable(host, port)
        self._link = KairosLink(self._address, self._topics, ros, self._remarks.append)
        self._await_first()

    @property
    def ready(self) -> bool:
        """True if velocities are sent; see `Hardware`."""
        return self.fault is None and not self._standing

    def poll(self, now_ns: int) -> None:
        """Take the newest odometry, and check for faults; see `Hardware`."""
        self._take_newest()
        self.fault = self.fault or self._link.cause(now_ns)
        if self._link.is_over(now_ns):
            self._link.close()
            tell = self._remarks.append
            self._link = KairosLink(self._address, self._topics, self._version, tell)

    def hits(self) -> list[BumperHit]:
        """The robot reports no touches."""
        return []

    def remarks(self) -> list[str]:
        """What the client library did not understand, since the last call."""
        return [self._remarks.popleft() for _ in range(len(self._remarks))]

    def drive(self, velocity: Twist2, now_ns: int) -> None:  # noqa: ARG002
        """Send a velocity, limited to what its stop allows; see `Hardware`."""
        if not self._sideways:
            require_rolling(velocity)
        if self._standing or self.fault is not None:
            velocity = STILL
        scale = self._fastest / max(velocity.speed, self._fastest)
        self._link.send(Twist2(scale * velocity.vx, scale * velocity.vy, velocity.wz))

    def stop(self) -> None:
        """Send zero, now and until `acknowledge`; the drives have no quick stop by topic."""
        self._standing = True
        self._link.send(STILL)

    def acknowledge(self) -> bool:
        """Let the wheels turn again, unless a cause persists; see `Hardware`."""
        cause = self._link.cause(time.monotonic_ns())
        if cause is not None:
            self.fault = cause
            return False
        self.fault, self._standing = None, False
        return True

    def close(self) -> None:
        """Stop, and close the connection."""
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
        """Wait for odometry and the state of the emergency stop."""
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
    """The speed allowed, if that of the body does not exceed it.

    Raises:
        ValueError: it does, or the brakes do.
    """
    if not (0.0 < timeout < 10.0 and 0.01 < ramp < 10.0):
        raise ValueError(f"stops: {timeout} s and {ramp} m/s2: write what was measured")
    most = fastest(timeout, ramp)
    told = f"it drives on for {timeout:g} s, then brakes with {ramp:g} m/s2"
    if model.max_speed > _SLACK * most:
        cut = math.floor(1000.0 * most) / 1000.0
        raise ValueError(f"limits: speed: {cut:g} m/s at most for a stop in {STOP_M:g} m: {told}")
    if model.brake_deceleration > _SLACK * ramp:
        raise ValueError(f"limits: brakes: {ramp:g} m/s2 at most: {told}")
    return most


def _topics(given: Mapping[str, str], namespace: str) -> dict[str, str]:
    if strange := sorted(set(given) - set(TOPICS)):
        raise ValueError(f"topics: {', '.join(strange)}: there are {', '.join(TYPES)}")
    return {name: topic_of(namespace, given.get(name, own)) for name, own in TOPICS.items()}
