"""One client of the VR link: its socket, its registrations, and its send queue.

Only the newest message of each topic is queued, and the queue of a client that does not read is
bounded, as is all that is kept of what it sends.
"""

from __future__ import annotations

import socket
from collections import deque
from contextlib import suppress

from hw.drivers import gates
from hw.drivers.clock_offsets import PeerClock
from hw.drivers.unity.protocol.wire import Parser, UnityFrame, command, legible

RECEIVED = 1 << 12
"""Bytes read at a time, so that a client that floods the link holds up the others by little."""
SEND_BUFFER = 8192
"""Small, so that old data waits here, where the newest replaces it, not in the kernel."""
MOST_COMMANDS = 256
"""Length of the command queue beyond which a client counts as not reading."""
MOST_TEXTS, TEXTS_NS = 64, 1_000 * gates.MS
"""So many texts within this time are shown to a client; more are left out."""
_QUICKACK = getattr(socket, "TCP_QUICKACK", None)


class Session:
    """See the module. `broken` says why it is to be closed, or None; `ended`: the link is gone.

    `subscribed` has the names given by the client, by those of our topics; `published` are the
    topics for which it is, or waits to become, the source.
    """

    def __init__(self, connection: socket.socket, name: str, now_ns: int, clock: PeerClock) -> None:
        self.name, self.clock = name, clock
        self.joined_ns = self.heard_ns = now_ns
        self.broken: str | None = None
        self.ended = False
        self.published: set[str] = set()
        self.subscribed: dict[str, str] = {}
        self.services: set[str] = set()
        self.asked: deque[tuple[str, int]] = deque(maxlen=32)
        self.ask_ns = 0
        self.awaited: tuple[str, int] | None = None
        self.warned: dict[str, int] = {}
        self._socket, self._parser = connection, Parser()
        self._commands: deque[bytes] = deque()
        self._newest: dict[str, bytes] = {}
        self._rest = memoryview(b"")
        self._texts, self._texts_ns = 0, now_ns
        self._dismissed = False
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        self._acknowledge_at_once()

    def fileno(self) -> int:
        """For `select`."""
        return self._socket.fileno()

    @property
    def host(self) -> str:
        """The client's address."""
        return self.name.rpartition(":")[0]

    @property
    def registered(self) -> bool:
        """True if it has registered anything."""
        return bool(self.published or self.subscribed or self.services)

    @property
    def waiting(self) -> bool:
        """True if there is anything to send."""
        return bool(self._rest or self._commands or self._newest)

    @property
    def held(self) -> int:
        """Bytes buffered for this client."""
        waiting = (*self._commands, *self._newest.values())
        return self._parser.held + len(self._rest) + sum(map(len, waiting))

    def is_quiet(self, now_ns: int) -> bool:
        """True if it has written nothing for longer than a living client ever does."""
        return now_ns - self.heard_ns > gates.CLIENT_QUIET_NS

    def succeeds(self, other: Session, now_ns: int) -> bool:
        """True if it was opened from the same address after the other one had fallen silent."""
        after = other.host == self.host and other.heard_ns < self.joined_ns
        return after and other.is_quiet(now_ns)

    def read(self, now_ns: int) -> list[UnityFrame]:
        """The frames received; sets `broken` and `ended` if the client has gone.

        Raises:
            MalformedFrame: the bytes are no frame.
        """
        try:
            data = self._socket.recv(RECEIVED)
        except BlockingIOError:
            return []
        except OSError as error:
            return self._end(str(error))
        if not data:
            return self._end("it has closed the link")
        self._acknowledge_at_once()
        self.heard_ns = now_ns
        return [] if self._dismissed else self._parser.feed(data)

    def send_latest(self, topic: str, data: bytes) -> None:
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
        if self.heard_ns - self._texts_ns >= TEXTS_NS:
            self._texts, self._texts_ns = 0, self.heard_ns
        self._texts += 1
        if self._texts <= MOST_TEXTS:
            self.send(command(level, text=legible(text)))

    def flush(self) -> None:
        """Send what can be sent without waiting; after the last words of a dismissal, close."""
        while self.waiting and not self.ended:
            if not self._rest:
                self._rest = memoryview(self._pick())
            try:
                sent = self._socket.send(self._rest)
            except BlockingIOError:
                return
            except OSError as error:
                self._end(str(error))
                return
            self._rest = self._rest[sent:]
        if self._dismissed and not self.ended:
            with suppress(OSError):
                self._socket.shutdown(socket.SHUT_WR)

    def dismiss(self, why: str) -> None:
        """Say why the link is closed, as the last that the client is told; `flush` sends it."""
        self._dismissed = True
        self._newest.clear()
        self._commands.append(command("error", text=legible(f"the robot closes the link: {why}")))

    def close(self) -> None:
        """Close the connection."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def _end(self, why: str) -> list[UnityFrame]:
        self.broken, self.ended = self.broken or why, True
        return []

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
