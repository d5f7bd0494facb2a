"""The VR link, to which a Unity project connects by the unmodified ROS-TCP-Connector.

links:
  vr: {driver: Unity, port: 10000, tells: chain}
parts:
  trackers: {driver: UnityTrackers, link: vr}
  rover_trackers: {driver: UnityRoverTrackers, link: vr}
  vr: {driver: UnityVr, link: vr}

A process of its own serves the clients (`server.py`). Topics are in `topics.py`; UNITY.md has all
that a Unity project needs to know.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from engine.files.declared import number
from hw.connection import RunInfo
from hw.drivers import gates
from hw.drivers.feed import DatagramFeed
from hw.drivers.needs import Listening
from hw.drivers.unity.bridge import Bridged
from hw.drivers.unity.client_slots import ANYBODY, peers_of
from hw.drivers.unity.inbox import Checks
from hw.drivers.unity.protocol import Topics
from hw.drivers.unity.server import ServerSetup
from hw.geometry import Pose2, Twist2
from hw.ipc import Address, Child, Datagram, Door, Outlet
from hw.samples import ArmState, RobotView, Sample
from hw.sign import StopSign

Now = Callable[[], int]
SOURCE = "vr"
"""The source under which engine and chain know the VR link."""
OPEN = (
    "the VR link has no password and no `peer`: whoever reaches port {port} first can be the person"
)
KEPT = 4096
"""Longest queue of samples of each signal for the engine; older ones are dropped."""
JOINTS = (
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint",
    "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
)  # fmt: skip


class Unity:
    """The link: a process that serves clients, and a thread that takes its datagrams.

    Args:
        port: of TCP; 0: any free one, see `address`.
        now: the time of the run, ns.
        opening: of the run; gives the tracking frame and the arm.
        host: the address to serve at; by default all addresses of this machine.
        peer: address or network of the headset's computer, or several; by default clients of this
            machine alone if `host` is a loopback address, else anybody.
        build: `ros1` or `ros2`, as the Unity project was built.
        topics: names and messages by role, where they differ (`topics.py`).
        trackers: topics by the names of the trackers on the rover; by default `vr/NAME` each.
        definitions: texts of additional message definitions, by `package/Type`.
        tells: the safety chain, which gets the same datagrams.
        stamps: `header`, or `receipt` for a project without stamps: ages then count from receipt.
        predicted: how far ahead poses are predicted, s or `50 ms`.
        one_way: least transmission time, s, which stamps of one direction cannot show.
        debug: show the robot at all times (R18), not only with the stop sign.

    Raises:
        ValueError: a topic or a value is wrong; OSError: the process cannot be started.
    """

    needs = ("rosbags",)

    def __init__(  # noqa: PLR0913
        self,
        port: int,
        now: Now,
        opening: RunInfo,
        host: str = "0.0.0.0",
        peer: str | Sequence[str] | None = None,
        build: str = "ros1",
        topics: Mapping[str, Any] | None = None,
        trackers: Mapping[str, str] | None = None,
        definitions: Mapping[str, str] | None = None,
        tells: Any = None,
        stamps: str = "header",
        predicted: float | str = 0.0,
        one_way: float | str = "2 ms",
        debug: bool = False,
    ) -> None:
        if stamps not in ("header", "receipt"):
            raise ValueError(f"stamps: {stamps!r} is neither 'header' nor 'receipt'")
        peers = peers_of(peer, host)
        if ANYBODY in peers:
            opening.tell(OPEN.format(port=port))
        tracking = opening.tracking
        named = {name: f"vr/{name}" for name in tracking.mounts} if trackers is None else trackers
        checks = Checks(
            tracking, stamps == "receipt", ahead_ns(predicted), _ns(one_way, "one_way", 1.0)
        )
        arm = opening.body.arm
        count = 0 if arm is None else len(arm.lower)
        joints = JOINTS if count == len(JOINTS) else tuple(f"joint_{i + 1}" for i in range(count))
        known = Topics.of(topics or {}, named)
        bridged = Bridged(build, known, checks, joints, dict(definitions or {}))
        self.debug, self._host = debug, host
        self.heard_ns: int | None = None
        self._queues: dict[str, deque[Sample]] = {}
        self._wakes: dict[str, Callable[[], None]] = {}
        self._feed = DatagramFeed(SOURCE, now, self._on_datagram)
        chain = () if tells is None else (tells.door(SOURCE),)
        self._outlet = Outlet()
        self._address: Address | None = None
        settings = ServerSetup(host, port, peers, (self._feed.door, *chain), bridged)
        self.child = Child("hw.drivers.unity.server", settings, "the VR server")

    @staticmethod
    def listens(
        port: int, host: str = "0.0.0.0", peer: str | Sequence[str] | None = None, **_: Any
    ) -> list[Listening]:
        """The port for clients, who have no password."""
        peers = peers_of(peer, host)
        whoever = f"the first headset at {', '.join(peers)} is the person"
        if ANYBODY in peers:
            whoever = (
                "whoever connects first, from anywhere, is the person; write `peer: ADDRESS`, that "
                "of the headset's computer"
            )
        believes = f"the VR link has no password: {whoever}"
        return [Listening("tcp", host, port, believes, ANYBODY in peers)]

    def wait(self) -> None:
        """Wait until clients can connect.

        Raises:
            OSError: they cannot, for example because the port is in use.
        """
        ready = self.child.wait()
        self._address = (self._host, ready["port"])
        self._outlet.doors = [Door(*ready["intake"])]
        self._feed.start()

    @property
    def address(self) -> Address:
        """The address for clients."""
        assert self._address is not None, "wait() first"
        return self._address

    @property
    def pid(self) -> int:
        """Process id."""
        return self.child.pid

    @property
    def fault(self) -> str | None:
        """That its process is silent; None while it is heard."""
        return self._feed.silence(gates.LINK_SILENT_NS, self.child.name)

    def queue(self, name: str) -> deque[Sample]:
        """The queue of samples of a name, oldest first."""
        return self._queues.setdefault(name, deque(maxlen=KEPT))

    def wake_at(self, names: tuple[str, ...], wake: Callable[[], None]) -> None:
        """Call `wake`, in a thread of the link, when a sample of one of the names has come."""
        self._wakes |= dict.fromkeys(names, wake)

    def show(self, stamp_ns: int, view: RobotView) -> None:
        """Show the robot like this; stamp_ns by `time.monotonic_ns()`."""
        self._outlet.send("robot.view", stamp_ns, view)

    def close(self) -> None:
        """End the process and all its connections."""
        self.child.close()
        self._feed.close()
        self._outlet.close()

    def _on_datagram(self, datagram: Datagram, stamp_ns: int) -> None:
        if datagram.name == "vr.link":
            ahead_ns = max(0, datagram.stamp_ns - time.monotonic_ns())  # a stamp ahead is none
            self.heard_ns = stamp_ns - ahead_ns
        waiting = self._queues.get(datagram.name)
        if waiting is None:
            return
        waiting.append(Sample(datagram.name, stamp_ns, datagram.value))
        if datagram.name in self._wakes:
            self._wakes[datagram.name]()


class UnityTrackers:
    """The part `trackers`: the person, as the VR application tracks them."""

    signals: tuple[str, ...] = ("user.pose",)

    def __init__(self, link: Unity) -> None:
        self._queues = [link.queue(name) for name in self.signals]

    def samples(self, now_ns: int) -> list[Sample]:
        """Samples since the last call."""
        return [sample for queue in self._queues for sample in drained(queue, now_ns)]


class UnityRoverTrackers(UnityTrackers):
    """The part `rover_trackers`: each tracker on the rover, in the frame of the tracking system."""

    signals = ("rover.tracker",)


class UnityVr:
    """The part `vr`: requests, releases, restarts; shows the robot and the stop sign."""

    signals: tuple[str, ...] = (
        "vr.haptic_request", "vr.release", "vr.restart", "vr.clock", "vr.fault",
    )  # fmt: skip
    hears: tuple[str, ...] = ("base.pose", "base.twist", "arm.joints")

    def __init__(self, link: Unity, now: Now) -> None:
        self.wake: Callable[[], None] = _nothing
        self._link, self._now = link, now
        self._queues = {name: link.queue(name) for name in self.signals}
        self._levels: dict[str, object] = {}
        self._heard: dict[str, Sample] = {}
        self._shown, self._sign = False, StopSign()
        self._begun_ns = now()
        link.wake_at(("vr.release", "vr.restart"), lambda: self.wake())

    def samples(self, now_ns: int) -> list[Sample]:
        """Samples since the last call; levels on change."""
        found = [Sample("vr.haptic_request", self._begun_ns, None)] if not self._levels else []
        for queue in self._queues.values():
            found += drained(queue, now_ns)
        heard = self._link.heard_ns
        if heard is None or now_ns - heard > gates.LINK_SILENT_NS:
            found = [sample for sample in found if sample.name != "vr.haptic_request"]
            found.append(Sample("vr.haptic_request", now_ns, None))
        return [sample for sample in found if self._is_news(sample)]

    def inform(self, show: bool, sign: bool = True, least: float = 0.0) -> None:
        """Show the robot, with or without the stop sign, or hide them; see `Vr`."""
        self._shown = show
        self._sign.want(show and sign, least)
        self.show(self._now())

    def hear(self, sample: Sample, now_ns: int) -> None:  # noqa: ARG002
        """Take a sample of the robot's own state."""
        self._heard[sample.name] = sample

    def show(self, stamp_ns: int) -> None:
        """Show the robot at an instant of the run: called in each tick, after the states.

        A slightly older pose is extrapolated by the velocity of the base.
        """
        pose, twist, arm = (self._value(name) for name in self.hears)
        sign = self._sign.shown(stamp_ns)
        view = RobotView(
            self._moved_on(pose, twist, stamp_ns) if isinstance(pose, Pose2) else None,
            twist if isinstance(twist, Twist2) else None,
            arm.joints if isinstance(arm, ArmState) else None,
            self._shown or sign or self._link.debug,
            sign,
        )
        self._link.show(time.monotonic_ns() - (self._now() - stamp_ns), view)

    def _is_news(self, sample: Sample) -> bool:
        """True for events, and for levels that have changed."""
        if sample.name not in ("vr.haptic_request", "vr.fault"):
            return True
        known = self._levels
        if sample.name in known and known[sample.name] == sample.value:
            return False
        known[sample.name] = sample.value
        return True

    def _value(self, name: str) -> object:
        sample = self._heard.get(name)
        return None if sample is None else sample.value

    def _moved_on(self, pose: Pose2, twist: object, stamp_ns: int) -> Pose2:
        age_ns = stamp_ns - self._heard["base.pose"].stamp_ns
        if not isinstance(twist, Twist2) or not 0 < age_ns <= gates.SHOWN_OLD_NS:
            return pose
        age = age_ns * 1e-9
        half = Pose2(0.0, 0.0, 0.5 * twist.wz * age)  # along the chord of the arc
        return pose @ half @ Pose2(twist.vx * age, twist.vy * age) @ half


def drained(queue: deque[Sample], now_ns: int) -> list[Sample]:
    """Empty a queue that another thread fills; samples from before the run are dropped."""
    found = [queue.popleft() for _ in range(len(queue))]
    return [
        sample._replace(stamp_ns=min(sample.stamp_ns, now_ns))
        for sample in found
        if sample.stamp_ns >= 0
    ]


def ahead_ns(predicted: float | str) -> int:
    """How far in the future stamps may be if poses are predicted by this much, ns.

    Raises:
        ValueError: not a time of 0 to 50 ms.
    """
    return max(gates.AHEAD_NS, _ns(predicted, "predicted", gates.PREDICTED_NS * 1e-9))


def _ns(value: float | str, name: str, most: float) -> int:
    seconds = number(value, "duration")
    if not 0.0 <= seconds <= most:
        raise ValueError(f"{name}: {value}; 0 to {most:g} s")
    return round(seconds * 1e9)


def _nothing() -> None:
    """No loop waits for samples."""
