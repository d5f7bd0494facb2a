"""The connection to the wheels of an RB-KAIROS: velocities out, odometry and stop button in.

It has a websocket of its own, which is opened once; a lost one is replaced by a new one.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from hw.drivers.clock_offsets import StampedClock, set_by
from hw.drivers.gates import ODOMETRY_OLD_NS, SETTLING_NS
from hw.drivers.ros import (
    CONNECTING_S,
    FIRST_S,
    RosbridgeClient,
    Version,
    kind_of,
    stamp_of,
    yaw_of,
)
from hw.geometry import Pose2, Twist2

AGAIN_S = 0.5
"""Period of attempts to replace a lost connection, s."""
UNLATCHED = (
    "if it tells changes only, press and release the button, or name another (topics: "
    "emergency_stop)"
)
TYPES: Mapping[str, str] = {
    "cmd_vel": "geometry_msgs/Twist",
    "odom": "nav_msgs/Odometry",
    "emergency_stop": "std_msgs/Bool",
}


class KairosLink:
    """One connection; `newest` is the last odometry: its stamp, ns, pose and velocity.

    The stamp is the robot's, converted to our clock as if the fastest message had taken no time: so
    messages that are held up count as old, be it one or all of them. Odometry with a stamp that
    does not rise is ignored; while the robot's clock seems to have been set, all is. `stopped` is
    the reported state of the emergency stop; None: not reported yet, which counts as stopped.
    """

    def __init__(
        self,
        address: tuple[str, int],
        topics: Mapping[str, str],
        version: Version,
        tell: Callable[[str], None],
    ) -> None:
        """Begin to open it.

        Raises:
            OSError: roslibpy is missing.
        """
        self.newest: tuple[int, Pose2, Twist2] | None = None
        self.stopped: bool | None = None
        self._address, self._topics = address, topics
        self._clock = StampedClock()
        self._odd = ""
        self._heard_ns = 0
        self._bridge = RosbridgeClient(*address, tell)
        self._begun_ns = time.monotonic_ns()  # after the import of the library, which takes a while
        kinds = {name: kind_of(kind, version) for name, kind in TYPES.items()}
        self._bridge.subscribe(topics["odom"], kinds["odom"], self._take_odom)
        stop = "emergency_stop"
        self._bridge.subscribe(topics[stop], kinds[stop], self._take_stop)
        self._publish = self._bridge.publisher(topics["cmd_vel"], kinds["cmd_vel"])

    def cause(self, now_ns: int) -> str | None:
        """Why nothing may move, or None."""
        host, port = self._address
        if self._bridge.lost:
            return f"rosbridge at {host}:{port}: the connection is lost"
        if not self._bridge.up:
            return f"rosbridge at {host}:{port} does not answer"
        if self.newest is None:
            return self._nothing_on("odom")
        age_ns = now_ns - self.newest[0]
        if age_ns > ODOMETRY_OLD_NS:
            return self._why_old(now_ns, age_ns)
        if self.stopped is None:
            return f"{self._nothing_on('emergency_stop')}, which counts as stopped; {UNLATCHED}"
        return "the robot's emergency stop is engaged" if self.stopped else None

    def opening(self, now_ns: int) -> bool:
        """True while the only cause is that it was opened a moment ago."""
        opened_ns = self._bridge.opened_ns
        if opened_ns is None:
            return now_ns - self._begun_ns < CONNECTING_S * 1e9
        if self._bridge.lost or self.stopped or now_ns - opened_ns > FIRST_S * 1e9:
            return False
        return self.newest is None or self.stopped is None

    def is_over(self, now_ns: int) -> bool:
        """True if it is lost, or silent for so long that it should be replaced."""
        if self._bridge.lost:
            return now_ns - self._begun_ns > AGAIN_S * 1e9
        opened_ns = self._bridge.opened_ns
        if opened_ns is None:
            return not self.opening(now_ns)
        heard_ns = opened_ns if self.newest is None else max(opened_ns, self.newest[0])
        return now_ns - heard_ns > FIRST_S * 1e9

    def usable(self, now_ns: int) -> bool:
        """True if odometry arrives in time."""
        newest = self.newest
        return self._bridge.up and newest is not None and now_ns - newest[0] <= ODOMETRY_OLD_NS

    def send(self, velocity: Twist2) -> None:
        """Send a velocity (base frame); dropped while the connection is not open."""
        linear = {"x": velocity.vx, "y": velocity.vy, "z": 0.0}
        self._publish({"linear": linear, "angular": {"x": 0.0, "y": 0.0, "z": velocity.wz}})

    def close(self, in_order: bool = False) -> None:
        """Close it; `in_order`: after what was sent last."""
        self._bridge.close(in_order)

    def _why_old(self, now_ns: int, age_ns: int) -> str:
        """Why there is no timely odometry."""
        step_ns = self._clock.set_by_ns
        if 2 * (now_ns - self._heard_ns) > ODOMETRY_OLD_NS:  # the last one was a little late, too
            why = ": nothing comes any more; is it the WLAN, or does the robot's PC hang?"
        elif step_ns is not None:
            host, _ = self._address
            again = f"it counts again after {SETTLING_NS * 1e-9:g} s"
            return f"the clock of {host} {set_by(step_ns)}; {again}"
        else:
            why = self._odd or ": its messages come late; is it the WLAN, or the robot's PC?"
        return f"odometry is {1e-6 * age_ns:.0f} ms old{why}"

    def _nothing_on(self, name: str) -> str:
        kind, said = TYPES[name], self._bridge.said
        told = f"; rosbridge says: {said}" if said else ""
        return f"no {name} on {self._topics[name]} within {FIRST_S:g} s ({kind}){self._odd}{told}"

    def _take_odom(self, message: Mapping[str, Any]) -> None:
        self._heard_ns = time.monotonic_ns()
        try:
            stamp = stamp_of(message)
            place, turn = message["pose"]["pose"], message["twist"]["twist"]
            at, linear = place["position"], turn["linear"]
            pose = Pose2.checked(float(at["x"]), float(at["y"]), yaw_of(place["orientation"]))
            speeds = (linear["x"], linear["y"], turn["angular"]["z"])
            twist = Twist2.checked(*(float(speed) for speed in speeds))
        except (KeyError, TypeError, ValueError) as error:
            self._odd = f"; the last message was none: {type(error).__name__} {error}"
            return
        at_ns = self._clock.instant(stamp, self._heard_ns)
        if at_ns is not None:
            self.newest = (at_ns, pose, twist)
        self._odd = "" if at_ns is not None else "; it repeats itself"

    def _take_stop(self, message: Mapping[str, Any]) -> None:
        self.stopped = message.get("data") is not False
