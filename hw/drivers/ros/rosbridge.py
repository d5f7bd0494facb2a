"""One websocket to a rosbridge server (protocol 2), by `roslibpy`.

A connection is opened once and never reopens itself: the caller makes a new one. So nothing that
was to be sent before a loss is sent after it. Messages sent while it is not open are dropped, as
are those in its buffers when it is closed.

A server reports a failed subscription (unknown topic or type) only where asked for its warnings,
and not each does: `unheard` names the topics that have not sent anything, `said` is its last word.

`roslibpy` and what it stands on log tracebacks of each message that they do not understand, and of
a server that dies; here each becomes a sentence, told once.

`roslibpy` handles all its messages in one thread of this process, which cannot be restarted once
ended; so it is left to end with the process.
"""

from __future__ import annotations

import importlib
import logging
import socket
import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Literal

from hw.extras import missing
from hw.geometry import Pose3
from hw.se3 import unit_quaternion

Version = Literal[1, 2]
Receive = Callable[[Mapping[str, Any]], None]
CONNECTING_S = 3.0
"""Time limit for a connection, s."""
FIRST_S = 2.0
"""Time limit for the first message of a topic, s: otherwise the subscription failed, or nothing
is published."""


CLOSING_S = 0.5
MOST_TOLD = 20
"""Sentences of the library that are told; more are left out."""


class RosbridgeClient:
    """A websocket to a rosbridge server; `up` while it is open, `lost` once it was closed.

    `said` is the newest warning or error of the server, empty if there was none.
    """

    def __init__(self, host: str, port: int, tell: Callable[[str], None]) -> None:
        """Begin to open it; what the library does not understand is told, in its thread.

        Raises:
            OSError: roslibpy is missing.
        """
        self._lib, factory = _library(tell)
        factory.set_max_retries(0)
        self.said = ""
        self.unheard: set[str] = set()
        self.lost = False
        self.opened_ns: int | None = None
        self._open, self._gone = threading.Event(), threading.Event()
        self._protocol: Any = None
        self._ros = self._lib.Ros(host, port)
        self._ros.factory.on_ready(self._opened)
        self._ros.on("close", self._closed)
        self._ros.factory.manager.run()

    @property
    def up(self) -> bool:
        """True while it is open."""
        return self._open.is_set() and not self.lost

    def wait(self, timeout_s: float = CONNECTING_S) -> bool:
        """Wait until it is open; False if it is not within timeout_s."""
        return self._open.wait(timeout_s) and not self.lost

    def subscribe(self, topic: str, kind: str, take: Receive) -> None:
        """Receive the messages of a topic in a thread of the library; the server queues one."""
        self.unheard.add(topic)

        def heard(message: Mapping[str, Any]) -> None:
            self.unheard.discard(topic)
            take(message)

        receiver = self._lib.Topic(self._ros, topic, kind, queue_length=1, reconnect_on_close=False)
        receiver.subscribe(heard)

    def publisher(self, topic: str, kind: str) -> Receive:
        """A function that sends a message, or drops it while the bridge is not up."""
        sender = self._lib.Topic(self._ros, topic, kind, queue_size=1, reconnect_on_close=False)

        def send(message: Mapping[str, Any]) -> None:
            if self.up:
                sender.publish(message)

        return send

    def close(self, in_order: bool = False) -> None:
        """Close it at once, or `in_order` after what was sent."""
        protocol, over = self._protocol, self.lost
        self.lost = True
        if protocol is None:
            self._ros.call_later(0, self._give_up)
        elif not over and in_order:
            self._ros.call_later(0, protocol.sendClose)
            self._gone.wait(CLOSING_S)
        elif not over:
            self._ros.call_later(0, partial(protocol.dropConnection, abort=True))

    def _give_up(self) -> None:
        connector = self._ros.factory.connector
        if connector is not None:
            connector.disconnect()

    def _opened(self, protocol: Any) -> None:
        protocol.transport.setTcpNoDelay(True)
        handlers = getattr(protocol, "_message_handlers", {})
        handlers["status"] = self._on_message  # it has none of its own, and lets none be registered
        protocol.send_ros_message({"op": "set_level", "level": "warning"})
        self._protocol, self.opened_ns = protocol, time.monotonic_ns()
        self._open.set()

    def _on_message(self, message: Mapping[str, Any]) -> None:
        self.said = " ".join(str(message.get("msg", "")).split())[:200]

    def _closed(self, _: Any) -> None:
        self.lost = True
        self._gone.set()


def reachable(host: str, port: int) -> None:
    """Check that a server listens there.

    Raises:
        OSError: none does, with the cause.
    """
    try:
        socket.create_connection((host, port), CONNECTING_S).close()
    except OSError as error:
        raise OSError(f"rosbridge at {host}:{port}: {error}") from None


def kind_of(name: str, version: Version) -> str:
    """A type such as `geometry_msgs/Twist` in the notation of this version of ROS."""
    package, _, message = name.partition("/")
    return name if version == 1 else f"{package}/msg/{message}"


def topic_of(namespace: str, name: str) -> str:
    """The full name of a topic; a name with a leading `/` is already full."""
    return name if name.startswith("/") else "/" + "/".join(filter(None, (namespace, name)))


def stamp_of(message: Mapping[str, Any]) -> int:
    """The stamp of a message's header, ns, by the robot's clock, for either version of ROS.

    Raises:
        KeyError, TypeError: there is none.
    """
    stamp = message["header"]["stamp"]
    if "sec" in stamp:
        return int(stamp["sec"]) * 1_000_000_000 + int(stamp["nanosec"])
    return int(stamp["secs"]) * 1_000_000_000 + int(stamp["nsecs"])


def yaw_of(orientation: Mapping[str, Any]) -> float:
    """The yaw of a quaternion, rad.

    Raises:
        KeyError, TypeError, ValueError: invalid; NaN arrives as null.
    """
    turned = unit_quaternion(*(float(orientation[key]) for key in "xyzw"))
    return Pose3(0.0, 0.0, 0.0, *turned).yaw


def _nobody(_: str) -> None:
    """Nobody listens yet."""


class _Sentences(logging.Handler):
    """Makes a sentence of each record with an error, and tells it, if it is a new one."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.tell: Callable[[str], None] = _nobody
        self.begun = False
        self._told: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Tell a record."""
        error = record.exc_info[1] if record.exc_info else None
        *_, last = record.getMessage().strip().splitlines() or [""]  # of a traceback, too
        told = f"{type(error).__name__}: {error}" if error else last
        line = f"rosbridge: {' '.join(told.split())[:200]}"
        if line not in self._told and len(self._told) < MOST_TOLD:
            self._told.add(line)
            self.tell(line)


_SENTENCES = _Sentences()


def _library(tell: Callable[[str], None]) -> tuple[Any, Any]:
    """`roslibpy`, and its connection factory.

    Raises:
        OSError: it is missing.
    """
    _SENTENCES.tell = tell
    for name in ("twisted", "roslibpy"):
        logger = logging.getLogger(name)
        logger.setLevel(logging.ERROR)  # twisted warns of each closed connection
        logger.handlers, logger.propagate = [_SENTENCES], False
    try:
        library = importlib.import_module("roslibpy")
        if not _SENTENCES.begun:  # until then twisted itself writes errors to stderr
            _SENTENCES.begun = True
            beginner = importlib.import_module("twisted.logger").globalLogBeginner
            beginner.beginLoggingTo([], discardBuffer=True, redirectStandardIO=False)
        return library, importlib.import_module("roslibpy.comm").RosBridgeClientFactory
    except ImportError as error:
        raise OSError(f"rosbridge {missing(error) or error}") from None
