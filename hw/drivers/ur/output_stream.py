"""The outputs that a UR controller streams (RTDE), for a client that only reads.

Reading needs no client library: the controller is asked for outputs by name, once, and sends a
package of them in each of its cycles from then on. Several clients may read at a time.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator, Mapping

from hw.drivers.ur.probe import RTDE, TIMEOUT_S

LOOK_S = 0.2
"""Longest wait for a package, s."""
KINDS = {1: "DOUBLE", 3: "VECTOR3D", 6: "VECTOR6D"}
"""What the controller calls an output of so many numbers."""
_HEADER = struct.Struct(">HB")


class OutputStream:
    """Outputs of the controller at `host`, by name, each of so many numbers (1, 3 or 6).

    Raises:
        OSError: it does not answer, does not speak RTDE, or has no such output.
    """

    def __init__(self, host: str, outputs: Mapping[str, int], hertz: float = 125.0) -> None:
        self._buffer = b""
        self._layout = struct.Struct(f">B{sum(outputs.values())}d")
        self._link = socket.create_connection((host, RTDE), TIMEOUT_S)
        try:
            self._begin(outputs, hertz)
        except OSError:
            self.close()
            raise
        self._link.settimeout(LOOK_S)

    def rows(self) -> list[tuple[float, ...]]:
        """The numbers of the packages that came, one after another; none within `LOOK_S`: empty.

        Raises:
            OSError: the link is lost, or what comes is no package of these outputs.
        """
        try:
            self._receive()
        except TimeoutError:
            return []
        found = []
        for kind, content in self._packages():
            if kind == "U":
                if len(content) != self._layout.size:
                    raise OSError("it sends other outputs than it was asked for")
                found.append(self._layout.unpack(content)[1:])
        return found

    def close(self) -> None:
        """Close the link."""
        self._link.close()

    def _begin(self, outputs: Mapping[str, int], hertz: float) -> None:
        if self._asked("V", struct.pack(">H", 2)) != b"\x01":
            raise OSError("it does not speak RTDE 2")
        wanted = struct.pack(">d", hertz) + ",".join(outputs).encode()
        kinds = self._asked("O", wanted)[1:].decode(errors="replace").split(",")
        given = dict(zip(outputs, kinds, strict=False))
        for name, count in outputs.items():
            if given.get(name) != KINDS[count]:
                raise OSError(f"it has no output {name}: {given.get(name, 'no answer')}")
        if self._asked("S", b"") != b"\x01":
            raise OSError("it does not begin to send")

    def _asked(self, kind: str, content: bytes) -> bytes:
        """The answer to a request; messages in between are dropped."""
        self._link.sendall(_HEADER.pack(_HEADER.size + len(content), ord(kind)) + content)
        while True:
            self._receive()
            for answered, answer in self._packages():
                if answered == kind:
                    return answer

    def _receive(self) -> None:
        data = self._link.recv(1 << 16)
        if not data:
            raise OSError("it closed the connection")
        self._buffer += data

    def _packages(self) -> Iterator[tuple[str, bytes]]:
        """The complete packages received, by kind; each is taken as it is given."""
        while len(self._buffer) >= _HEADER.size:
            size, kind = _HEADER.unpack_from(self._buffer)
            if size < _HEADER.size:
                raise OSError("what it sends is not RTDE")
            if len(self._buffer) < size:
                return
            content, self._buffer = self._buffer[_HEADER.size : size], self._buffer[size:]
            yield chr(kind), content
