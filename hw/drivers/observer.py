"""The observer's program, and its port at the safety chain: a heartbeat while a person watches.

    observer = ObserverLink(("192.168.0.10", 7401), key)
    observer.here()                # every PERIOD_S, from the loop of the observer's user interface
    observer.receive()             # when it is readable
    observer.pull("observer")      # the software stop

It is not a safety device: the observer has the hardware's own stop at hand.

Both ends have the same key, for years; three messages make one heartbeat of it:

    observer: ask, with random bytes
    chain:    answer to these bytes, with the random bytes of its own start, and its time
    observer: `observer.here`, stamped with that time

Codes under keys made of the shared one are in all of them. The last, and a `pull`, are datagrams
(`hw.ipc.datagrams`) under a key that is made of the shared one and the chain's start, so that no
message is of use for another start. The chain counts the age of a heartbeat from its own time in
it: one that was held up is old, whatever the clocks of both machines say.

A stop may get lost in a network. So for a while after it the observer gives no heartbeat, but the
stop again: whatever gets lost, the chain hears of the stop, or nothing, and stops.
"""

from __future__ import annotations

import hmac
import secrets
import socket
import time
from collections import deque

from hw.drivers.gates import OBSERVER_HEARD_NS, OBSERVER_STOPS_NS
from hw.ipc import Address, Datagram, Reader, Seal, coded, key_of, received

PERIOD_S = 0.05
"""Period of the heartbeat, s."""
TIMES = 3
"""Copies sent of a stop: datagrams from another machine may get lost."""
OPEN = 20
"""The newest questions, which may still be answered: that may take longer than PERIOD_S."""
SOURCE = "observer"
SHARED = 16
"""Length of random bytes, and of codes."""
LONGEST = 512
"""Longest message of an observer, bytes; longer ones are none."""


class ObserverLink:
    """Sends to the chain at an address; single-threaded.

    Raises:
        OSError: the address cannot be reached from this machine.
    """

    def __init__(self, chain: Address, key: bytes) -> None:
        self._key = key
        self._asked: deque[bytes] = deque(maxlen=OPEN)
        self._start = b""
        self._stop, self._stop_ns = "", -1 - OBSERVER_STOPS_NS
        self._session: tuple[Seal, bytes] | None = None
        self._stamp_ns, self._heard_ns = 0, -OBSERVER_HEARD_NS
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.connect(chain)  # nobody else's messages are received
        except OSError:
            self._socket.close()
            raise

    @property
    def heard(self) -> bool:
        """True while the chain answers, so that a stop reaches it."""
        return time.monotonic_ns() - self._heard_ns <= OBSERVER_HEARD_NS

    @property
    def stopping(self) -> bool:
        """True for a while after a stop, which is said again instead of a heartbeat."""
        return time.monotonic_ns() - self._stop_ns <= OBSERVER_STOPS_NS

    def fileno(self) -> int:
        """For `select`."""
        return self._socket.fileno()

    def here(self) -> None:
        """Begin a heartbeat; `receive` ends it."""
        self.receive()
        asked = secrets.token_bytes(SHARED)
        self._asked.append(asked)
        self._send(coded(asked, key_of(self._key, "ask")))

    def receive(self) -> None:
        """Take the chain's answers, and tell it that the observer is here, or has stopped it."""
        for data, _ in received(self._socket, LONGEST):
            if not self._is_answer(data):
                continue
            self._heard_ns = time.monotonic_ns()
            if self.stopping:
                self._send_sealed("pull", self._stop)
            else:
                self._send_sealed("observer.here", True)

    def pull(self, reason: str = "observer") -> None:
        """Stop the robot until the operator's reset; in vain while the chain is not `heard`."""
        self._stop, self._stop_ns = reason, time.monotonic_ns()
        for _ in range(TIMES):
            self._send_sealed("pull", reason)

    def close(self) -> None:
        """Close the socket; the chain treats the silence as a stop, too."""
        self._socket.close()

    def _is_answer(self, data: bytes) -> bool:
        """Whether it answers an open question; then its contents are kept.

        That question and those before it are not open any more.
        """
        asked = next((one for one in self._asked if self._answers(data, one)), None)
        if asked is None:
            return False
        while self._asked.popleft() != asked:
            continue
        body = data[SHARED:]
        start, self._stamp_ns = body[:SHARED], int.from_bytes(body[SHARED:], "big")
        if start != self._start:
            self._start, self._session = start, (Seal(), session_key(self._key, start))
        return True

    def _answers(self, data: bytes, asked: bytes) -> bool:
        key = key_of(self._key, f"answer {asked.hex()}")
        return hmac.compare_digest(data, coded(data[SHARED:], key))

    def _send_sealed(self, name: str, value: bool | str) -> None:
        if self._session is not None:
            seal, key = self._session
            self._send(coded(seal.body(name, self._stamp_ns, value), key))

    def _send(self, data: bytes) -> None:
        try:
            self._socket.send(data)
        except OSError:  # no network, or nobody there: it shows as silence
            return


class ObserverPort:
    """The chain's end, used like an `Intake`: answers who has the key, and takes what they say.

    Raises:
        OSError: the address is in use.
    """

    def __init__(self, address: Address, key: bytes) -> None:
        self.strange = 0
        self._key, self._start = key, secrets.token_bytes(SHARED)
        self._ask = key_of(key, "ask")
        self._reader = Reader([(SOURCE, session_key(key, self._start))])
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind(address)
        except OSError:
            self._socket.close()
            raise

    def fileno(self) -> int:
        """For `select`."""
        return self._socket.fileno()

    def poll(self, most: int = 64) -> list[Datagram]:
        """Datagrams since the last call, oldest first, of at most `most` messages."""
        found: list[Datagram] = []
        for data, sender in received(self._socket, LONGEST, most):
            if self._answered(data, sender):
                continue
            one = self._reader.read(data)
            if one is None:
                self.strange += 1
            else:
                found.append(one)
        return found

    def close(self) -> None:
        """Close the socket; nothing is received any more."""
        self._socket.close()

    def _answered(self, data: bytes, sender: Address) -> bool:
        """Whether somebody with the key has asked; they are told the start, and our time."""
        asked = data[SHARED:]
        if len(asked) != SHARED or not hmac.compare_digest(data, coded(asked, self._ask)):
            return False
        body = self._start + time.monotonic_ns().to_bytes(8, "big")
        try:
            self._socket.sendto(coded(body, key_of(self._key, f"answer {asked.hex()}")), sender)
        except OSError:  # no way to them: they will ask again
            return True
        return True


def session_key(key: bytes, start: bytes) -> bytes:
    """The key of the observer's datagrams to a chain, made of its random bytes."""
    return key_of(key, f"{SOURCE} {start.hex()}")
