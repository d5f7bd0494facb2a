"""Named, stamped values as datagrams between the processes of one machine; the newest counts.

    intake = Intake(("arm", "engine"))      # who may send to it
    door = intake.door("arm")               # given to the arm, by a pipe, and to nobody else
    Outlet([door]).send("arm.link", time.monotonic_ns(), None)
    intake.poll()                           # [Datagram("arm", 1, "arm.link", …, None)]

An intake believes whoever has the key of a source, and takes them for this source; a datagram does
not name its sender. It carries a code (BLAKE2) over all of it under that key, and a number that
rises, so that what was recorded cannot be sent again. Each outlet has a session of its own: a new
one for the same source, after a restart, counts from 1 again. Keys live as long as the intake.

No call waits: a datagram that cannot be sent or read is lost, and shows as silence. Stamps are
those of CLOCK_MONOTONIC, ns, which all processes of a machine share. Values: `hw.ipc.plain`.
"""

from __future__ import annotations

import hmac
import ipaddress
import json
import secrets
import socket
import threading
from collections.abc import Iterable, Iterator
from hashlib import blake2b
from typing import Any, NamedTuple, Protocol

from hw.ipc.plain import GREATEST, parsed, text

Address = tuple[str, int]
LOOPBACK = "127.0.0.1"
LONGEST = 60_000
"""Longest datagram, bytes."""
BUFFER = 1 << 20
CODE, SESSION, NUMBER = 16, 8, 8
"""Bytes of the code, the session and the number at the beginning of a datagram."""


class Datagram(NamedTuple):
    """One datagram; `source` is its sender, `number` counts the sender's datagrams from 1."""

    source: str
    number: int
    name: str
    stamp_ns: int
    value: Any


class Door(NamedTuple):
    """Where one source may send to: the address of an intake, and its key there, in hex."""

    host: str
    port: int
    key: str

    @classmethod
    def of(cls, address: Address, secret: bytes, source: str) -> Door:
        """The door of a source into an intake with a secret."""
        return cls(*address, key_of(secret, source).hex())


class Hearer(Protocol):
    """A receiver of datagrams."""

    def door(self, source: str) -> Door:
        """Where this source may send to.

        Raises:
            KeyError: it takes nothing from such a source.
        """
        ...


def key_of(secret: bytes, source: str) -> bytes:
    """The key of a source, made of a secret of the receiver."""
    return blake2b(source.encode(), key=secret, digest_size=CODE).digest()


class Seal:
    """Makes datagrams of one sender, each with the next number."""

    def __init__(self) -> None:
        self._session, self._number = secrets.token_bytes(SESSION), 0

    def body(self, name: str, stamp_ns: int, value: Any = None) -> bytes:
        """The next datagram, without its code.

        Raises:
            TypeError: neither a plain value nor one of `KINDS`.
        """
        told = text((name, stamp_ns, value)).encode()
        self._number += 1
        return self._session + self._number.to_bytes(NUMBER, "big") + told


class Outlet:
    """Sends to several doors without waiting, from any thread; `lost` counts what failed."""

    def __init__(self, doors: Iterable[Door] = ()) -> None:
        self.doors = list(doors)
        self.lost = 0
        self._seal, self._mutex = Seal(), threading.Lock()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind((LOOPBACK, 0))  # else the system binds it to all addresses

    def send(self, name: str, stamp_ns: int, value: Any = None) -> None:
        """Send a value under a name.

        Raises:
            TypeError: neither a plain value nor one of `KINDS`.
        """
        with self._mutex:  # in the order of their numbers
            body = self._seal.body(name, stamp_ns, value)
            for host, port, key in self.doors:
                try:
                    self._socket.sendto(coded(body, bytes.fromhex(key)), (host, port))
                except OSError:  # no receiver, or a full buffer: it shows as silence
                    self.lost += 1

    def close(self) -> None:
        """Close the socket; nothing is sent any more."""
        self._socket.close()


class Reader:
    """Opens datagrams: tells by their codes who sent them, and refuses repeated ones."""

    def __init__(self, keys: Iterable[tuple[str, bytes]]) -> None:
        self._keys = tuple(keys)
        self._sessions: dict[bytes, tuple[tuple[str, bytes], int]] = {}

    def read(self, data: bytes) -> Datagram | None:
        """The datagram, or None if it is no new one of a known source."""
        code, body = data[:CODE], data[CODE:]
        session, number = body[:SESSION], int.from_bytes(body[SESSION : SESSION + NUMBER], "big")
        known = self._sessions.get(session)
        for source, key in self._keys if known is None else (known[0],):
            if hmac.compare_digest(code, _code(body, key)):
                if known is not None and number <= known[1]:
                    return None
                self._sessions[session] = (source, key), number
                return _parsed(source, number, body[SESSION + NUMBER :])
        return None


class Intake:
    """Receives from some sources at an address; `strange` counts all other datagrams.

    The keys of the sources are made of `secret`, by default a random one.

    Raises:
        OSError: the address is in use; ValueError: other machines reach it.
    """

    def __init__(
        self,
        sources: Iterable[str],
        host: str = LOOPBACK,
        port: int = 0,
        secret: bytes | None = None,
    ) -> None:
        if not is_loopback(host):
            raise ValueError(f"{host}: other machines reach it; an address as 127.0.0.1 is needed")
        made = secrets.token_bytes(CODE) if secret is None else secret
        self._keys = {source: key_of(made, source) for source in sources}
        self._reader = Reader(self._keys.items())
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        self._socket.setblocking(False)
        try:
            self._socket.bind((host, port))
        except OSError:
            self._socket.close()
            raise
        self.address: Address = self._socket.getsockname()
        self.strange = 0

    def door(self, source: str) -> Door:
        """See `Hearer`."""
        return Door(*self.address, self._keys[source].hex())

    def fileno(self) -> int:
        """For `select`."""
        return self._socket.fileno()

    def poll(self, most: int = 256) -> list[Datagram]:
        """Datagrams since the last call, oldest first, of at most `most`; does not wait."""
        found: list[Datagram] = []
        for data, _ in received(self._socket, LONGEST, most):
            one = self._reader.read(data)
            if one is None:
                self.strange += 1
            else:
                found.append(one)
        return found

    def close(self) -> None:
        """Close the socket; nothing is received any more."""
        self._socket.close()


def received(
    receiver: socket.socket, longest: int, most: int = 256
) -> Iterator[tuple[bytes, Address]]:
    """What has come to a socket that does not block, with its senders; `most` at a time."""
    for _ in range(most):
        try:
            found = receiver.recvfrom(longest)
        except BlockingIOError:
            return
        except OSError:  # an ICMP error for one of ours; or closed
            if receiver.fileno() < 0:
                return
            continue
        yield found


def is_loopback(host: str) -> bool:
    """True if only programs of this machine reach an address; False for a name that is unknown."""
    try:
        return ipaddress.ip_address(socket.gethostbyname(host or "0.0.0.0")).is_loopback
    except OSError:
        return False


def coded(body: bytes, key: bytes) -> bytes:
    """A datagram with its code."""
    return _code(body, key) + body


def _code(body: bytes, key: bytes) -> bytes:
    return blake2b(body, key=key, digest_size=CODE).digest()


def _parsed(source: str, number: int, told: bytes) -> Datagram | None:
    try:
        name, stamp, value = json.loads(told)
        if not isinstance(name, str) or type(stamp) is not int or abs(stamp) >= GREATEST:
            return None
        return Datagram(source, number, name, stamp, parsed(value))
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
