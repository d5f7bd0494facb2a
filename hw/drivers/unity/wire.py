"""Frames of the ROS-TCP-Connector, version 0.7: parsing and writing, without sockets.

A frame is `uint32 n, n bytes of destination, uint32 m, m bytes of body`, little-endian. One with
n = m = 0 is a keep-alive. A destination that starts with `__` is a command whose body is JSON; any
other is a topic or a service, and the body a message. A ROS 2 build of Unity terminates its strings
with NUL; these are removed.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from typing import Any, NamedTuple

LONGEST_NAME = 512
LONGEST_BODY = 1 << 20
"""Longer destinations and bodies, bytes, are treated as corruption."""
KEEPALIVE = bytes(8)
VERSION = "v0.7.0"
_SIZE = struct.Struct("<I")


class MalformedFrame(ValueError):
    """The bytes are no frame; the start of the next one is unknown."""


class UnityFrame(NamedTuple):
    """One frame; an empty destination is a keep-alive."""

    destination: str
    body: bytes

    @property
    def is_command(self) -> bool:
        """True for a command of the link itself."""
        return self.destination.startswith("__")

    def fields(self) -> Mapping[str, Any]:
        """The JSON object of a command; empty without a body.

        Raises:
            MalformedFrame: not a JSON object.
        """
        text = self.body.rstrip(b"\0")
        try:
            found = json.loads(text) if text.strip() else {}
        except (ValueError, RecursionError) as error:
            raise MalformedFrame(f"{self.destination}: no JSON: {error}") from None
        if not isinstance(found, dict):
            raise MalformedFrame(f"{self.destination}: no JSON object")
        return found


class Parser:
    """Splits bytes into frames; buffers at most one incomplete frame."""

    def __init__(self) -> None:
        self._data = bytearray()

    @property
    def held(self) -> int:
        """Bytes of an incomplete frame."""
        return len(self._data)

    def feed(self, data: bytes) -> list[UnityFrame]:
        """Take bytes; returns the frames completed by them.

        Raises:
            MalformedFrame: the stream is lost; frames before the error are lost, too.
        """
        self._data += data
        frames, at = [], 0
        while (found := self._frame(at)) is not None:
            frame, at = found
            frames.append(frame)
        del self._data[:at]
        return frames

    def _frame(self, at: int) -> tuple[UnityFrame, int] | None:
        name = self._part(at, LONGEST_NAME, "destination")
        if name is None:
            return None
        destination, at = name
        content = self._part(at, LONGEST_BODY, "body")
        if content is None:
            return None
        body, at = content
        if not destination and body:
            raise MalformedFrame(f"a body of {len(body)} bytes without a destination")
        try:
            return UnityFrame(destination.rstrip(b"\0").decode(), body), at
        except UnicodeDecodeError:
            raise MalformedFrame("the destination is no text") from None

    def _part(self, at: int, longest: int, what: str) -> tuple[bytes, int] | None:
        data, begin = self._data, at + _SIZE.size
        if len(data) < begin:
            return None
        [size] = _SIZE.unpack_from(data, at)
        if size > longest:
            raise MalformedFrame(f"a {what} of {size} bytes; {longest} is most")
        end = begin + size
        return None if len(data) < end else (bytes(data[begin:end]), end)


def frame(destination: str, body: bytes | memoryview = b"") -> bytes:
    """A frame as bytes."""
    name = destination.encode()
    return b"".join((_SIZE.pack(len(name)), name, _SIZE.pack(len(body)), body))


def command(name: str, **fields: Any) -> bytes:
    """A command as bytes: `command("error", text="…")`."""
    return frame(f"__{name}", json.dumps(fields).encode())


def handshake(build: str) -> bytes:
    """The first message to a client; `build` is `ros1` or `ros2`, like the client's."""
    return command("handshake", version=VERSION, metadata=json.dumps({"protocol": build.upper()}))
