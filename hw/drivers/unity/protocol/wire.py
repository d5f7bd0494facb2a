"""Frames of the ROS-TCP-Connector, version 0.7: parsing and writing, without sockets.

A frame is `uint32 n, n bytes of destination, uint32 m, m bytes of body`, little-endian. One with
n = m = 0 is a keep-alive. A destination that starts with `__` is a command whose body is JSON; any
other is a topic or a service, and the body a message. A ROS 2 build of Unity terminates its strings
with NUL; these are removed. Bodies that are longer than any that is read here are passed over.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from typing import Any, NamedTuple

LONGEST_NAME = 512
"""Longer destinations, bytes, are treated as corruption."""
LONGEST_BODY, LONGEST_SKIPPED = 1 << 16, 1 << 26
"""Bodies up to the first are read, up to the second skipped, bytes (an uncompressed picture of
3840 x 2160 pixels has 33 MB); longer ones are treated as corruption."""
LONGEST_TEXT = 300
"""Of texts for people, characters."""
KEEPALIVE = bytes(8)
VERSION = "v0.7.0"
_SIZE = struct.Struct("<I")


class MalformedFrame(ValueError):
    """The bytes are no frame; the start of the next one is unknown."""


class UnityFrame(NamedTuple):
    """One frame; an empty destination is a keep-alive.

    `skipped`: length of a body that was too long to be read, so that `body` is empty. `ros2`: the
    destination ended with NUL.
    """

    destination: str
    body: bytes
    skipped: int = 0
    ros2: bool = False

    @property
    def is_command(self) -> bool:
        """True for a command of the link itself."""
        return self.destination.startswith("__")

    def fields(self) -> Mapping[str, Any]:
        """The JSON object of a command; empty without a body.

        Raises:
            MalformedFrame: not a JSON object, or skipped.
        """
        if self.skipped:
            raise MalformedFrame(too_long(self.skipped))
        text = self.body.rstrip(b"\0")
        try:
            found = json.loads(text) if text.strip() else {}
        except (ValueError, RecursionError) as error:
            raise MalformedFrame(f"{self.destination}: no JSON: {error}") from None
        if not isinstance(found, dict):
            raise MalformedFrame(f"{self.destination}: no JSON object")
        return found


class Parser:
    """Splits bytes into frames; buffers at most one incomplete frame of at most LONGEST_BODY."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._skip = 0

    @property
    def held(self) -> int:
        """Bytes of an incomplete frame."""
        return len(self._data)

    def feed(self, data: bytes) -> list[UnityFrame]:
        """Take bytes; returns the frames completed by them, and those now known to be skipped.

        Raises:
            MalformedFrame: the stream is lost; frames before the error are lost, too.
        """
        self._data += data
        frames, at = [], 0
        while True:
            passed = min(self._skip, len(self._data) - at)
            self._skip, at = self._skip - passed, at + passed
            found = None if self._skip else self._frame(at)
            if found is None:
                break
            frame, at = found
            self._skip = frame.skipped
            frames.append(frame)
        del self._data[:at]
        return frames

    def _frame(self, at: int) -> tuple[UnityFrame, int] | None:
        """The frame at an offset, and the offset after what was read of it."""
        size = self._size(at, LONGEST_NAME, "destination")
        at += _SIZE.size
        if size is None or len(self._data) < at + size:
            return None
        name, at = bytes(self._data[at : at + size]), at + size
        size = self._size(at, LONGEST_SKIPPED, "body")
        at += _SIZE.size
        if size is None:
            return None
        if not name and size:
            raise MalformedFrame(f"a body of {size} bytes without a destination")
        read = size if size <= LONGEST_BODY else 0
        if len(self._data) < at + read:
            return None
        try:
            destination = name.rstrip(b"\0").decode()
        except UnicodeDecodeError:
            raise MalformedFrame("the destination is no text") from None
        body = bytes(self._data[at : at + read])
        return UnityFrame(destination, body, size - read, name.endswith(b"\0")), at + read

    def _size(self, at: int, longest: int, what: str) -> int | None:
        if len(self._data) < at + _SIZE.size:
            return None
        size: int = _SIZE.unpack_from(self._data, at)[0]
        if size > longest:
            raise MalformedFrame(f"a {what} of {size} bytes; {longest} is most")
        return size


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


def text_in(fields: Mapping[str, Any], key: str) -> str:
    """A text of a command.

    Raises:
        MalformedFrame: there is none, or it is too long.
    """
    found = fields.get(key)
    if not isinstance(found, str):
        raise MalformedFrame(f"a command without {key!r}")
    if len(found) > LONGEST_NAME:
        raise MalformedFrame(f"a {key!r} of {len(found)} characters; {LONGEST_NAME} is most")
    return found.rstrip("\0")


def too_long(size: int) -> str:
    """Why a message of this size was skipped."""
    return f"a message of {size} bytes; {LONGEST_BODY} is most"


def legible(text: str) -> str:
    """A text for people, without what a client may have put into it: controls, endless names."""
    shown = "".join(letter if letter.isprintable() else "?" for letter in text[:LONGEST_TEXT])
    return shown if len(text) <= LONGEST_TEXT else f"{shown}…"
