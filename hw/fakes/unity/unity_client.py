"""The client side of the ROS-TCP-Connector, written from its description, for ROS 1 messages.

Like Unity's it writes each field of a message separately, on a socket with Nagle's algorithm on,
registers everything after each connection, sends a keep-alive after a second of silence, and tries
again a second after a link was lost. It never waits: `poll` has to be called often enough.
"""

from __future__ import annotations

import json
import select
import socket
import struct
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

RETRY_S, IDLE_S = 1.0, 1.0
POSE, FLAG, TIME = "geometry_msgs/PoseStamped", "std_msgs/Bool", "sensor_msgs/TimeReference"
ODOMETRY, JOINTS = "nav_msgs/Odometry", "sensor_msgs/JointState"
_U4, _F8 = struct.Struct("<I"), struct.Struct("<d")
Fields = list[bytes]
"""A message as the pieces in which it is written."""


class ShownRobot(NamedTuple):
    """A robot from an Odometry: stamp, ns, frame, pose, and velocity vx, vy, wz."""

    stamp_ns: int
    frame: str
    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    velocity: tuple[float, float, float]


@dataclass(slots=True)
class Client:
    """One client; `published` and `subscribed` are topic names with their messages."""

    host: str
    port: int
    published: dict[str, str]
    subscribed: dict[str, str]
    by_fields: bool = True
    connections: int = 0
    told: list[tuple[str, Any]] = field(default_factory=list)
    _socket: socket.socket | None = None
    _lost: list[socket.socket] = field(default_factory=list)
    _data: bytearray = field(default_factory=bytearray)
    _tried: float = 0.0
    _wrote: float = 0.0
    _sequence: int = 0

    @property
    def connected(self) -> bool:
        """True while connected."""
        return self._socket is not None

    def fileno(self) -> int:
        """For `select`, while connected."""
        assert self._socket is not None
        return self._socket.fileno()

    def poll(self) -> list[tuple[str, bytes]]:
        """The messages received, by topic; connects if there is no link."""
        if self._socket is None and not self._connect():
            return []
        if time.monotonic() - self._wrote > IDLE_S:
            self._write([bytes(8)])
        alive = self._receive()
        found = self._messages()
        if not alive:
            self.close()
        return found

    def send(self, topic: str, message: Fields) -> None:
        """Publish a message, if there is a link."""
        name, size = topic.encode(), sum(map(len, message))
        self._write([_U4.pack(len(name)), name, _U4.pack(size), *message])

    def command(self, name: str, **fields: Any) -> None:
        """Send a command of the link."""
        self.send(f"__{name}", [json.dumps(fields).encode()])

    def header(self, stamp_ns: int, frame: str) -> Fields:
        """The header of a message, with the next sequence number."""
        self._sequence += 1
        return [_U4.pack(self._sequence), *moment(stamp_ns), *text(frame)]

    def close(self) -> None:
        """Close the link, and those that were lost; `poll` reconnects after RETRY_S."""
        for link in (*self._lost, *([] if self._socket is None else [self._socket])):
            link.close()
        self._lost.clear()
        self._socket = None
        self._data.clear()
        self._tried = time.monotonic()

    def lose(self) -> None:
        """Lose the link as by radio: the other side hears nothing of it, and `poll` reconnects."""
        if self._socket is not None:
            self._lost.append(self._socket)
        self._socket = None
        self._data.clear()

    def _connect(self) -> bool:
        if time.monotonic() - self._tried < RETRY_S:
            return False
        self._tried = time.monotonic()
        try:
            link = socket.create_connection((self.host, self.port), timeout=1.0)
        except OSError:
            return False
        link.settimeout(0.2)  # a game may stall for that long
        self._socket = link
        self.connections += 1
        self._write([bytes(8)])
        for topic, kind in self.published.items():
            self.command("publish", topic=topic, message_name=kind, queue_size=10, latch=False)
        for topic, kind in self.subscribed.items():
            self.command("subscribe", topic=topic, message_name=kind)
        self.command("topic_list")
        return True

    def _write(self, pieces: Sequence[bytes]) -> None:
        if self._socket is None:
            return
        try:
            for piece in pieces if self.by_fields else [b"".join(pieces)]:
                self._socket.sendall(piece)
        except OSError:
            self.close()
        self._wrote = time.monotonic()

    def _receive(self) -> bool:
        """Receive; False if the link is lost."""
        while self._socket is not None and select.select([self._socket], [], [], 0.0)[0]:
            try:
                data = self._socket.recv(1 << 16)
            except OSError:
                return False
            if not data:
                return False
            self._data += data
        return self._socket is not None

    def _messages(self) -> list[tuple[str, bytes]]:
        found, data = [], self._data
        while len(data) >= 4:
            name_end = 4 + _U4.unpack_from(data)[0]
            if len(data) < name_end + 4:
                break
            end = name_end + 4 + _U4.unpack_from(data, name_end)[0]
            if len(data) < end:
                break
            name, body = data[4:name_end].decode(), bytes(data[name_end + 4 : end])
            del data[:end]
            if name.startswith("__"):
                self.told.append((name, json.loads(body)))
            elif name:
                found.append((name, body))
        return found


def moment(stamp_ns: int) -> Fields:
    """A time of ROS 1."""
    return [_U4.pack(stamp_ns // 10**9), _U4.pack(stamp_ns % 10**9)]


def text(content: str) -> Fields:
    """A text of ROS 1."""
    data = content.encode()
    return [_U4.pack(len(data)), data]


def pose(position: Sequence[float], quaternion: Sequence[float]) -> Fields:
    """A `geometry_msgs/Pose`."""
    return [_F8.pack(value) for value in (*position, *quaternion)]


def flag(value: bool) -> Fields:
    """A `std_msgs/Bool`."""
    return [bytes([value])]


def read_odometry(body: bytes) -> ShownRobot:
    """A `nav_msgs/Odometry`."""
    _, seconds, rest = struct.unpack_from("<III", body)
    frame, at = _text(body, 12)
    _, at = _text(body, at)
    numbers = struct.unpack_from("<7d", body, at)
    speeds = struct.unpack_from("<6d", body, at + (7 + 36) * 8)
    velocity = (speeds[0], speeds[1], speeds[5])
    return ShownRobot(seconds * 10**9 + rest, frame, numbers[:3], numbers[3:], velocity)


def read_joints(body: bytes) -> tuple[float, ...]:
    """The positions of a `sensor_msgs/JointState`."""
    _, at = _text(body, 12)
    [count] = _U4.unpack_from(body, at)
    at += 4
    for _ in range(count):
        _, at = _text(body, at)
    [count] = _U4.unpack_from(body, at)
    return struct.unpack_from(f"<{count}d", body, at + 4)


def read_time(body: bytes) -> tuple[int, str]:
    """The stamp of a `sensor_msgs/TimeReference`, ns, and its source."""
    _, seconds, rest = struct.unpack_from("<III", body)
    _, at = _text(body, 12)
    source, _ = _text(body, at + 8)
    return seconds * 10**9 + rest, source


def _text(body: bytes, at: int) -> tuple[str, int]:
    [size] = _U4.unpack_from(body, at)
    return body[at + 4 : at + 4 + size].decode(), at + 4 + size
