"""Topics of a robot through rosbridge, by the table of topics of a project.

parts:
  ros: {driver: RosTopics, host: 192.168.0.200}

Each entry of the table with a `type` is carried: messages of what states hear become values of its
signal, stamped at receipt, and commands of its part are published. Nothing of it passes the safety
chain; wheels and arms need drivers of their own.

A topic without a message for its `within`, or whose last message was of another type, is a fault,
which stops the robot until it is heard again and the operator resets the stop. A lost connection is
a fault, too, and is retried every 0.5 s; what is published meanwhile is lost.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from hw.connection import HeardWire, RunInfo, SentWire
from hw.drivers.feed import up_to
from hw.drivers.ros.rosbridge import (
    CONNECTING_S,
    FIRST_S,
    RosbridgeClient,
    Version,
    kind_of,
    reachable,
)
from hw.samples import Sample

KEPT = 256
"""Messages of all topics that wait for the next tick; of more the oldest are lost."""
AGAIN_S = 0.5
LOOK_S = 0.01
_ZERO: Mapping[str, float] = {"x": 0.0, "y": 0.0, "z": 0.0}


class RosTopics:
    """What the project's table of topics gives a `type`; its signals and commands are named there.

    Args:
        host: the computer with the rosbridge server.
        now: the time of the run, ns.
        opening: of the run.
        port: of rosbridge.
        ros: 1 or 2: how message types are named.

    Raises:
        OSError: there is no server.
        ValueError: the table has no topic with a type, or one command for two topics.
    """

    needs = ("roslibpy",)

    def __init__(
        self,
        host: str,
        now: Callable[[], int],
        opening: RunInfo,
        port: int = 9090,
        ros: Version = 1,
    ) -> None:
        self._topics = opening.topics()
        if not any(self._topics):
            raise ValueError("no topic in the project's table has a type: `type: std_msgs/String`")
        self.signals = tuple(dict.fromkeys(heard.signal for heard in self._topics.hears))
        self.wake: Callable[[], None] = _nobody
        self._address, self._version, self._now = (host, port), ros, now
        self._tell = opening.tell
        self._arrived: deque[Sample] = deque(maxlen=KEPT)
        self._heard: dict[str, float] = {}
        self._wrong: dict[str, str] = {}
        self._said = ""
        for sent in self._topics.sends:
            if hasattr(self, sent.command):
                raise ValueError(f"the command {sent.command!r} is there already; name another")
            setattr(self, sent.command, partial(self._send, sent))
        reachable(*self._address)
        self._open()

    def wait(self) -> None:
        """Wait until it is open, and each topic with a `within` was heard.

        Raises:
            OSError: rosbridge does not answer, or nothing comes on such a topic.
        """
        self._bridge.wait(CONNECTING_S)
        until = time.monotonic() + FIRST_S
        while self.fault is not None and self._bridge.up and time.monotonic() < until:
            time.sleep(LOOK_S)
        if (fault := self.fault) is not None:
            self.close()
            raise OSError(f"{fault}; is its name right, its type?" if self._awaited else fault)

    @property
    def fault(self) -> str | None:
        """The first thing that does not work; None if all does."""
        host, port = self._address
        if not self._bridge.up:
            return f"rosbridge at {host}:{port}: no connection"
        faults = map(self._fault_of, self._topics.hears)
        return next(filter(None, faults), None)

    def samples(self, now_ns: int) -> list[Sample]:
        """Values since the last call, by stamp; a lost connection is opened again here."""
        if self._bridge.said not in ("", self._said):
            self._said = self._bridge.said
            self._tell(f"rosbridge says: {self._said}")
        over = self._bridge.lost or not (self._bridge.up or self._age(self._begun) < CONNECTING_S)
        if over and self._age(self._begun) > AGAIN_S:
            self._bridge.close()
            self._open()
        return up_to(self._arrived, now_ns)

    def stop(self) -> None:
        """Publish a zero velocity where one was published before."""
        for publish in self._moving.values():
            publish({"linear": _ZERO, "angular": _ZERO})

    def acknowledge(self) -> bool:
        """Whether nothing is wrong any more."""
        return self.fault is None

    def close(self) -> None:
        """Stop, and close the connection."""
        self.stop()
        self._bridge.close(in_order=True)

    @property
    def _awaited(self) -> bool:
        return self._bridge.up and bool(self._bridge.unheard)

    def _open(self) -> None:
        self._begun = time.monotonic()
        self._moving: dict[str, Callable[[Mapping[str, Any]], None]] = {}
        bridge = self._bridge = RosbridgeClient(*self._address, self._tell)
        for heard in self._topics.hears:
            kind = kind_of(heard.kind, self._version)
            bridge.subscribe(heard.topic, kind, partial(self._take, heard))
        self._publish = {
            sent.topic: bridge.publisher(sent.topic, kind_of(sent.kind, self._version))
            for sent in self._topics.sends
        }

    def _take(self, heard: HeardWire, message: Mapping[str, Any]) -> None:
        try:
            value = heard.value(message)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            self._wrong[heard.topic] = f"{type(error).__name__}: {error}"
            return
        self._wrong.pop(heard.topic, None)
        self._heard[heard.topic] = time.monotonic()
        self._arrived.append(Sample(heard.signal, self._now(), value))
        self.wake()

    def _send(self, sent: SentWire, *values: Any, **named: Any) -> None:
        publish = self._publish[sent.topic]
        publish(sent.message(*values, **named))
        if sent.kind == "geometry_msgs/Twist":
            self._moving[sent.topic] = publish

    def _fault_of(self, heard: HeardWire) -> str | None:
        if heard.topic in self._wrong:
            return f"{heard.topic}: what it sends is no {heard.kind}: {self._wrong[heard.topic]}"
        last = max(self._heard.get(heard.topic, 0.0), self._begun)
        if heard.within is None:
            return None
        if heard.topic in self._heard and self._age(last) <= heard.within:
            return None
        said = f"; rosbridge says: {self._bridge.said}" if self._bridge.said else ""
        return f"{heard.topic}: silent for more than {heard.within:g} s{said}"

    def _age(self, since: float) -> float:
        return time.monotonic() - since


def _nobody() -> None:
    """No loop waits for a value."""
