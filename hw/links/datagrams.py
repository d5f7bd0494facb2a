"""Named, stamped values as datagrams between the processes of one machine; the newest counts.

No call waits: a datagram that cannot be sent or read is lost, and shows as silence. Stamps are
those of CLOCK_MONOTONIC, ns, which all processes of a machine share. A value is written as JSON:
numbers, strings, None, tuples, and the classes in `KINDS` by name, so that only plain data can be
received.
"""

from __future__ import annotations

import dataclasses
import json
import socket
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple, Protocol

from hw.geometry import Pose2, Pose3, Twist2
from hw.safety.record import ChainStatus, SafetyRecord
from hw.samples import (
    ArmState,
    BumperHit,
    ClockState,
    GripperState,
    ImuReading,
    Odometry,
    PoseSigma,
    RobotView,
    Scan,
    TrackerPose,
    UserPose,
    WrenchReading,
)
from hw.truth import Contact, Truth

Address = tuple[str, int]
LOOPBACK = "127.0.0.1"
LONGEST = 60_000
"""Longest datagram, bytes."""
BUFFER = 1 << 20
KINDS: Mapping[str, Any] = {
    kind.__name__: kind
    for kind in (
        Pose2, Pose3, Twist2, ArmState, BumperHit, ChainStatus, ClockState, Contact, GripperState,
        ImuReading, Odometry, PoseSigma, RobotView, SafetyRecord, Scan, TrackerPose, Truth,
        UserPose, WrenchReading,
    )
}  # fmt: skip
"""The classes that a value may contain."""


class Datagram(NamedTuple):
    """One datagram; `source` is its sender, `number` counts the sender's datagrams from 1."""

    source: str
    number: int
    name: str
    stamp_ns: int
    value: Any


class Hearer(Protocol):
    """A receiver of datagrams."""

    @property
    def address(self) -> Address:
        """Its address."""
        ...


class Outlet:
    """Sends to several addresses without waiting; `lost` counts datagrams that failed."""

    def __init__(self, source: str, addresses: Iterable[Address] = ()) -> None:
        self.addresses = [tuple(address) for address in addresses]
        self.lost = 0
        self._source, self._number = source, 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def send(self, name: str, stamp_ns: int, value: Any = None) -> None:
        """Send a value under a name.

        Raises:
            TypeError: neither a plain value nor one of `KINDS`.
        """
        self._number += 1
        data = json.dumps(
            [self._source, self._number, name, stamp_ns, plain(value)], separators=(",", ":")
        ).encode()
        for address in self.addresses:
            try:
                self._socket.sendto(data, address)
            except OSError:  # no receiver, or a full buffer: it shows as silence
                self.lost += 1

    def close(self) -> None:
        """Close the socket; nothing is sent any more."""
        self._socket.close()


class Intake:
    """Receives at an address; `strange` counts datagrams of other formats.

    Raises:
        OSError: the address is in use.
    """

    def __init__(self, host: str = LOOPBACK, port: int = 0) -> None:
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

    def fileno(self) -> int:
        """For `select`."""
        return self._socket.fileno()

    def poll(self, most: int = 256) -> list[Datagram]:
        """Datagrams since the last call, oldest first, at most `most`; does not wait."""
        found: list[Datagram] = []
        while len(found) < most:
            try:
                data = self._socket.recv(LONGEST)
            except BlockingIOError:
                break
            except OSError:  # an ICMP error for one of ours; or closed
                if self.fileno() < 0:
                    break
                continue
            one = _parsed(data)
            if one is None:
                self.strange += 1
            else:
                found.append(one)
        return found

    def close(self) -> None:
        """Close the socket; nothing is received any more."""
        self._socket.close()


def plain(value: Any) -> Any:
    """A value in the form that `json` accepts.

    Raises:
        TypeError: it has no such form.
    """
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if type(value) is tuple:
        return [plain(item) for item in value]
    name = type(value).__name__
    if KINDS.get(name) is not type(value):
        raise TypeError(f"a {name} cannot be sent in a datagram; see hw.links.datagrams.KINDS")
    if isinstance(value, tuple):
        return {name: [plain(item) for item in value]}
    return {name: [plain(getattr(value, field.name)) for field in dataclasses.fields(value)]}


def parsed(found: Any) -> Any:
    """The value of parsed JSON; the inverse of `plain`.

    Raises:
        ValueError, TypeError, KeyError: it is invalid.
    """
    if isinstance(found, list):
        return tuple([parsed(item) for item in found])
    if isinstance(found, dict):
        [(name, content)] = found.items()
        return KINDS[name](*[parsed(item) for item in content])
    return found


def _parsed(data: bytes) -> Datagram | None:
    try:
        source, number, name, stamp, value = json.loads(data)
        if not (isinstance(source, str) and isinstance(name, str)):
            return None
        if type(number) is not int or type(stamp) is not int:
            return None
        return Datagram(source, number, name, stamp, parsed(value))
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
