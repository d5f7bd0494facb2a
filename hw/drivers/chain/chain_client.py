"""Wheels, bumper and stop line behind the process of the safety chain.

links:
  chain:
    driver: ChainLink
    port: 7400
    hardware: {driver: "module:Class", …}
  arm: {…, tells: chain}
parts:
  base: {driver: ChainBase, link: chain}
  stop_line: {driver: ChainStopLine, link: chain}
  bumper: {driver: ChainBumper, link: chain}

Commands of the engine go there as datagrams that age. A thread receives its datagrams and stops all
other parts as soon as the chain has stopped the wheels, or falls silent. A chain that was silent is
not trusted again: the run has to be restarted.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import count
from typing import Any

from hw.connection import RunInfo
from hw.drivers.chain.chain_settings import (
    SOURCES,
    ChainSettings,
    ObserverSettings,
    hardware_of,
    observer_address,
)
from hw.drivers.chain.cycle import LONGEST_TEXT
from hw.drivers.chain.remote_chain import RemoteChain
from hw.drivers.feed import DatagramFeed, up_to
from hw.drivers.gates import CHAIN_SILENT_NS
from hw.drivers.needs import Listening, Observed
from hw.drivers.observer_key import OWN
from hw.geometry import STILL, Twist2
from hw.interfaces import DriveMode
from hw.ipc import AGAIN, LOOPBACK, Address, Child, Datagram, Door, Outlet, is_loopback
from hw.samples import BumperHit, Odometry, Sample

MODULE = "hw.drivers.chain.process"
LOOK_S = 0.02
NAME = "the safety chain"
SILENT = f"{NAME} is silent"
NEAR = (
    "only processes of this machine speak to the chain: leave it out; an observer on another one "
    "has a port of its own, `observer: {host: …, port: …, key: …}`"
)
RESET_S = 0.5
CLOSING_S = 4.0
"""Time for the wheels to stop and to be switched off, s."""
AHEAD_S = 0.05
"""Stamps of VR poses, which are predicted, may be this far ahead of the clock, s."""
KEPT = 512
"""Longest queue of samples for the engine; older ones are dropped."""
Now = Callable[[], int]


class ChainLink:
    """The link: the process, the datagrams to it and from it.

    Args:
        port: of the chain; a second engine on the same port is refused.
        hardware: `driver: "module:Class"` of the wheels, and its arguments.
        now: the time of the run, ns.
        opening: of the run.
        host: the address of the chain, as 127.x.y.z.
        observer: None, or `{timeout: 0.5}`, s: an observer's heartbeat is required (R55); with
            `host` and `port` of its own port, the one after the chain's by default; and `key`, the
            file of its key, which a host beyond this machine needs.
        rate: cycles per second.
        arm: True to require the link of an arm.
    """

    def __init__(  # noqa: PLR0913
        self,
        port: int,
        hardware: Mapping[str, Any],
        now: Now,
        opening: RunInfo,
        *,
        host: str = LOOPBACK,
        observer: Mapping[str, Any] | None = None,
        rate: int = 100,
        arm: bool = True,
    ) -> None:
        self.address: Address = (host, int(port))
        if not is_loopback(host):
            raise ValueError(f"chain: host: {host}: {NEAR}")
        self.base: deque[Sample] = deque(maxlen=KEPT)
        self.hits: deque[Sample] = deque(maxlen=KEPT)
        self.stopped: str | None = None
        self.why: str | None = None
        self.wake: Callable[[], None] = _nobody
        self.modes = opening.body.base.modes
        self._tell = opening.tell
        self._wheels = hardware_of(hardware)
        self._observer = None if observer is None else ObserverSettings.of(observer, self.address)
        self._secret = secrets.token_bytes(16)
        self._outlet = Outlet([self.door("engine")])
        self.remote = RemoteChain(
            opening.safety, self.modes[0], self._outlet, now, self.reset, self.pull
        )
        self._feed = DatagramFeed("chain", now, self._receive, self._watch, LOOK_S)
        self._heard_ns: int | None = None
        self._dead: str | None = None
        self._announced = self._closing = False
        self._tokens, self._answer = count(1), threading.Condition()
        self._one_reset = threading.Lock()
        self._asked: int | None = None
        self._answered: tuple[int, str | None] = (-1, None)
        try:
            self.child = Child(MODULE, self._settings(opening, rate, arm), NAME)
        except BaseException:
            self._feed.close()
            self._outlet.close()
            raise

    def _settings(self, opening: RunInfo, rate: int, arm: bool) -> ChainSettings:
        return ChainSettings(
            address=self.address,
            secret=self._secret,
            engine=self._feed.door,
            hardware=self._wheels,
            model=opening.body.base,
            motion=opening.motion,
            safety=replace(opening.safety, ahead=max(AHEAD_S, opening.safety.ahead)),
            tracking=replace(opening.tracking, mounts=dict(opening.tracking.mounts)),
            rate=rate,
            arm=arm,
            observer=self._observer,
        )

    @staticmethod
    def listens(
        port: int, host: str = LOOPBACK, observer: Mapping[str, Any] | None = None, **_: Any
    ) -> list[Listening]:
        """The chain's own port, and the observer's."""
        found = [Listening("udp", host, int(port), "its own arm, VR link and engine")]
        if observer is not None:
            believes = "an observer who has the key"
            found.append(Listening("udp", *observer_address(observer, (host, int(port))), believes))
        return found

    @staticmethod
    def observed(
        port: int, host: str = LOOPBACK, observer: Mapping[str, Any] | None = None, **_: Any
    ) -> Observed | None:
        """The observer's port, if an observer is required."""
        if not isinstance(observer, Mapping):
            return None
        key = str(observer["key"] or OWN) if "key" in observer else None
        return Observed(*observer_address(observer, (host, int(port))), key)

    def wait(self) -> None:
        """Wait until it cycles.

        Raises:
            OSError: the wheels cannot be opened, or another engine uses them.
        """
        self.child.wait()
        self._heard_ns = time.monotonic_ns()
        self._feed.start()

    def door(self, source: str) -> Door:
        """Where the arm's or the VR link's process sends to; see `Hearer`."""
        if source not in SOURCES:
            raise KeyError(source)
        return Door.of(self.address, self._secret, source)

    @property
    def pid(self) -> int:
        """Process id."""
        return self.child.pid

    @property
    def fault(self) -> str | None:
        """Why the chain is not trusted any more: the run has to be restarted; None if it is."""
        return self._dead

    def pull(self, reason: str) -> None:
        """Stop the wheels until a reset; may be called from any thread."""
        if self.stopped is None:
            self.stopped = reason
        self.child.send("pull", reason[:LONGEST_TEXT])

    def reset(self) -> bool:
        """Ask to release the stop; waits RESET_S at most. `why` says why it stays."""
        if self.stopped is None:
            return True
        if self._dead is not None:
            self.why = f"{self._dead}; {AGAIN}"
            return False
        with self._one_reset, self._answer:
            if self.stopped is None:  # by another reset, meanwhile
                return True
            token = next(self._tokens)
            self._asked = token
            self.child.send("reset", token)
            heard = self._answer.wait_for(lambda: self._answered[0] == token, RESET_S)
            self._asked = None
            self.why = self._answered[1] if heard else "no answer"
            return heard and self.why is None and self._dead is None

    def close(self) -> None:
        """Stop the wheels, switch them off, and end the process.

        Raises:
            OSError: not all records of its cycles have arrived.
        """
        self._closing = True
        self.child.close(CLOSING_S)
        self._feed.close()
        self._outlet.close()
        if self.remote.lost > 0:
            sent = self.remote.status.records
            raise OSError(f"{self.remote.lost} of {sent} records of the safety chain are lost")

    # in the thread of the feed

    def _receive(self, datagram: Datagram, stamp_ns: int) -> None:
        heard_ns = min(datagram.stamp_ns, time.monotonic_ns())  # a stamp ahead is none
        self._heard_ns = max(self._heard_ns or 0, heard_ns)
        match datagram.name, datagram.value:
            case "base.odometry", Odometry() as odometry:
                self.base.append(Sample(datagram.name, stamp_ns, odometry))
                self.base.append(Sample("base.twist", stamp_ns, odometry.twist))
            case "bumper.hit", BumperHit() as hit:
                self.hits.append(Sample(datagram.name, stamp_ns, hit))
                self.wake()
            case "stop.engaged", str(reason):
                self._stop(reason)
            case "chain.remark", str(remark):
                self._tell(remark)
            case "chain.reset", (int(token), str() | None as why):
                self._answer_with(token, why)
            case _:
                self.remote.receive(datagram, stamp_ns)

    def _answer_with(self, token: int, why: str | None) -> None:
        with self._answer:
            if token != self._asked:
                return  # it comes too late: the operator has been told that there was no answer
            if why is None and self._dead is None:
                self.stopped, self._announced = None, False
            self._answered = token, why
            self._answer.notify_all()

    def _watch(self, looked_ns: int) -> None:
        """Stop everything if the chain has been silent for too long."""
        if self._closing or self._dead is not None or self._heard_ns is None:
            return
        if looked_ns - self._heard_ns > CHAIN_SILENT_NS:
            self._dead = self.child.fault or SILENT
            self._stop(self._dead)

    def _stop(self, reason: str) -> None:
        """Stop all parts at once, because the wheels are stopped; called once until a reset."""
        if self.stopped is None:
            self.stopped = reason
        if self.remote.stops is not None and not self._announced:
            self._announced = True
            self.remote.stops(reason)


class ChainBase:
    """The part `base`; its `GuardedBase` commands its chain, once per tick."""

    signals: tuple[str, ...] = ("base.odometry", "base.twist")

    def __init__(self, link: ChainLink, now: Now) -> None:
        self.chain = link.remote
        self._link, self._now = link, now

    @property
    def mode(self) -> DriveMode:
        """How the wheels are driven."""
        return self.chain.status.mode

    def use(self, mode: DriveMode) -> None:
        """Change the drive mode; see `Base`.

        Raises:
            ValueError: the robot has no such mode.
        """
        if mode not in self._link.modes:
            raise ValueError(f"base: mode '{mode}' is not one of {', '.join(self._link.modes)}")
        self.chain.mode_wanted = mode

    def drive(self, command: Twist2) -> None:
        """Command a velocity, stamped now; see `Base`."""
        self.chain.command(Twist2.checked(command.vx, command.vy, command.wz), self._now())

    def stop(self) -> None:
        """Slow down to standstill; see `Base`."""
        self.chain.command(STILL, None)

    def samples(self, now_ns: int) -> list[Sample]:
        """Odometry and twist since the last call."""
        return up_to(self._link.base, now_ns)

    def close(self) -> None:
        """Do not stop the other parts from now on: they are being closed as well."""
        self.chain.stops = None


class ChainBumper:
    """The part `bumper`; a touch stops the wheels in the chain, and is reported here."""

    signals: tuple[str, ...] = ("bumper.hit",)

    def __init__(self, link: ChainLink) -> None:
        self._link = link

    @property
    def wake(self) -> Callable[[], None]:
        """Called when a touch was reported."""
        return self._link.wake

    @wake.setter
    def wake(self, wake: Callable[[], None]) -> None:
        self._link.wake = wake

    def samples(self, now_ns: int) -> list[Sample]:
        """Touches since the last call."""
        return up_to(self._link.hits, now_ns)


class ChainStopLine:
    """The part `stop_line`: the latch of the chain."""

    signals: tuple[str, ...] = ("stop.engaged",)

    def __init__(self, link: ChainLink) -> None:
        self._link = link
        self._reported: str | None = "nothing yet"

    @property
    def child(self) -> Child:
        """The process of the chain."""
        return self._link.child

    def pull(self, reason: str) -> None:
        """Stop until the reset; see `StopLine`."""
        self._link.pull(reason)

    @property
    def why(self) -> str | None:
        """Why the last reset was refused; None if it was not."""
        return self._link.why

    def reset(self) -> bool:
        """Let the robot move again; see `StopLine`."""
        return self._link.reset()

    def samples(self, now_ns: int) -> list[Sample]:
        """The reason, on change."""
        reason = self._link.stopped
        if reason == self._reported:
            return []
        self._reported = reason
        return [Sample("stop.engaged", now_ns, reason)]


def _nobody() -> None:
    """No loop waits for samples."""
