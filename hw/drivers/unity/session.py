"""One client of the VR link: its socket, its registrations, and its send queue.

Only the newest message of each topic is queued, and the queue of a client that does not read is
bounded.
"""

from __future__ import annotations

import socket
from collections import deque
from contextlib import suppress

from hw.drivers.clocks import PeerClock
from hw.drivers.unity.wire import Parser, UnityFrame, command

RECEIVED = 1 << 16
SEND_BUFFER = 8192
"""Small, so that old data waits here, where the newest replaces it, not in the kernel."""
MOST_COMMANDS = 256
"""Length of the command queue beyond which a client counts as not reading."""
_QUICKACK = getattr(socket, "TCP_QUICKACK", None)


class Session:
    """See the module. `broken` says why it is to be closed, or None."""

    def __init__(self, connection: socket.socket, name: str, now_ns: int, clock: PeerClock) -> None:
        self.name, self.clock = name, clock
        self.heard_ns = now_ns
        self.broken: str | None = None
        self.subscribed: dict[str, str] = {}
        self.services: set[str] = set()
        self.asked: deque[tuple[str, int]] = deque(maxlen=32)
        self.awaited: tuple[str, int] | None = None
        self.warned: dict[str, int] = {}
        self._socket, self._parser = connection, Parser()
        self._commands: deque[bytes] = deque()
        self._newest: dict[str, bytes] = {}
        self._rest = memoryview(b"")
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        self._acknowledge_at_once()

    def fileno(self) -> int:
        """For `select`."""
        return self._socket.fileno()

    @property
    def waiting(self) -> bool:
        """True if there is anything to send."""
        return bool(self._rest or self._commands or self._newest)

    @property
    def held(self) -> int:
        """Bytes buffered for this client."""
        waiting = (*self._commands, *self._newest.values())
        return self._parser.held + len(self._rest) + sum(map(len, waiting))

    def read(self, now_ns: int) -> list[UnityFrame]:
        """The frames received; sets `broken` if the client has gone.

        Raises:
            MalformedFrame: the bytes are no frame.
        """
        try:
            data = self._socket.recv(RECEIVED)
        except BlockingIOError:
            return []
        except OSError as error:
            self.broken = str(error)
            return []
        if not data:
            self.broken = "it has closed the link"
            return []
        self._acknowledge_at_once()
        self.heard_ns = now_ns
        return self._parser.feed(data)

    def put(self, topic: str, data: bytes) -> None:
        """Queue a frame of a topic; it replaces one of the same topic."""
        self._newest[topic] = data

    def send(self, data: bytes) -> None:
        """Queue a frame that must not be replaced."""
        if len(self._commands) >= MOST_COMMANDS:
            self.broken = "it does not read"
            return
        self._commands.append(data)

    def warn(self, level: str, text: str) -> None:
        """Show a text on the client's console: `log`, `warn` or `error`."""
        self.send(command(level, text=text))

    def flush(self) -> None:
        """Send what can be sent without waiting."""
        while self.waiting and self.broken is None:
            if not self._rest:
                self._rest = memoryview(self._pick())
            try:
                sent = self._socket.send(self._rest)
            except BlockingIOError:
                return
            except OSError as error:
                self.broken = str(error)
                return
            self._rest = self._rest[sent:]

    def close(self) -> None:
        """Close the connection."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def _pick(self) -> bytes:
        """Commands first, then all topics at once: one packet instead of one each."""
        if self._commands:
            return self._commands.popleft()
        data = b"".join(self._newest.values())
        self._newest.clear()
        return data

    def _acknowledge_at_once(self) -> None:
        """Disable delayed ACKs: Unity writes each field separately, and would wait 40 ms for one.

        The kernel resets this option, so it is set again after each receipt.
        """
        if _QUICKACK is not None:
            with suppress(OSError):
                self._socket.setsockopt(socket.IPPROTO_TCP, _QUICKACK, 1)
