"""Named, stamped values as datagrams between the processes of one machine: the newest counts.

Nobody waits for anybody: a datagram that cannot be sent or read is lost, and shows as silence.
Stamps are those of CLOCK_MONOTONIC, ns, which all processes of one machine share. A value is
written as JSON: numbers, texts, None, tuples, and the classes in `KINDS` by their names, so that
nothing but plain data can come in.
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
"""No datagram is longer, bytes."""
BUFFER = 1 << 20
KINDS: Mapping[str, Any] = {
    kind.__name__: kind
    for kind in (
        Pose2, Pose3, Twist2, ArmState, BumperHit, ChainStatus, ClockState, Contact, GripperState,
        ImuReading, Odometry, PoseSigma, RobotView, SafetyRecord, Scan, TrackerPose, Truth,
        UserPose, WrenchReading,
    )
}  # fmt: skip
"""The classes that a value may hold."""


class Datagram(NamedTuple):
    """One datagram; `source` says who sent it, `number` counts their datagrams from 1 on."""

    source: str
    number: int
    name: str
    stamp_ns: int
    value: Any


class Hearer(Protocol):
    """Who takes datagrams."""

    @property
    def address(self) -> Address:
        """Where."""
        ...


class Outlet:
    """Sends to some addresses. Never waits; `lost` counts what could not be sent."""

    def __init__(self, source: str, addresses: Iterable[Address] = ()) -> None:
        self.addresses = [tuple(address) for address in addresses]
        self.lost = 0
        self._source, self._number = source, 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def send(self, name: str, stamp_ns: int, value: Any = None) -> None:
        """Send a value under a name.

        Raises:
            TypeError: it is no plain value and of none of `KINDS`.
        """
        self._number += 1
        data = json.dumps(
            [self._source, self._number, name, stamp_ns, plain(value)], separators=(",", ":")
        ).encode()
        for address in self.addresses:
            try:
                self._socket.sendto(data, address)
            except OSError:  # nobody there, or the buffer is full: they see our silence
                self.lost += 1

    def close(self) -> None:
        """Send no more."""
        self._socket.close()


class Intake:
    """Receives at an address; `strange` counts datagrams that were none of ours.

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
        """What has arrived since the last call, oldest first, `most` at once; waits for nothing."""
        found: list[Datagram] = []
        while len(found) < most:
            try:
                data = self._socket.recv(LONGEST)
            except BlockingIOError:
                break
            except OSError:  # an answer to one of ours that found nobody; or closed
                if self.fileno() < 0:
                    break
                continue
            told = _parsed(data)
            if told is None:
                self.strange += 1
            else:
                found.append(told)
        return found

    def close(self) -> None:
        """Receive no more."""
        self._socket.close()


def plain(value: Any) -> Any:
    """A value as `json` takes it.

    Raises:
        TypeError: it cannot be told.
    """
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if type(value) is tuple:
        return [plain(item) for item in value]
    name = type(value).__name__
    if KINDS.get(name) is not type(value):
        raise TypeError(f"a {name} cannot be told in a datagram; see hw.links.datagrams.KINDS")
    if isinstance(value, tuple):
        return {name: [plain(item) for item in value]}
    return {name: [plain(getattr(value, field.name)) for field in dataclasses.fields(value)]}


def told(found: Any) -> Any:
    """The value that parsed JSON stands for; the other way round of `plain`.

    Raises:
        ValueError, TypeError, KeyError: it stands for none.
    """
    if isinstance(found, list):
        return tuple([told(item) for item in found])
    if isinstance(found, dict):
        [(name, content)] = found.items()
        return KINDS[name](*[told(item) for item in content])
    return found


def _parsed(data: bytes) -> Datagram | None:
    try:
        source, number, name, stamp, value = json.loads(data)
        if not (isinstance(source, str) and isinstance(name, str)):
            return None
        if type(number) is not int or type(stamp) is not int:
            return None
        return Datagram(source, number, name, stamp, told(value))
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
