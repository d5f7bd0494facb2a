"""Fake SICK S300 scanners behind serial-to-Ethernet servers; their scans come as datagrams.

A child process (`hw.ipc.processes`). Settings: `scanners`, the (host, port) of each by its name;
`host` of its own datagrams; `tells`, the address of a world, or None; `baud`; `beyond`, the bytes
of a telegram not counted by its size field: 4, 8 or 14, depending on the firmware. Ready:
`control`, the address for datagrams:

- `base.scan` (`Scan`, stamped at its first beam) becomes a telegram of the scanner of that name. It
  is sent when a real one would end: after the last beam and the transmission time.
- a fault (source `fault`, by its name) holds until the next: `drop` closes all lines, also new
  ones; `mute` keeps them and sends nothing; `freeze` repeats the newest telegram; `corrupt` flips
  one bit of each; `garbage` puts noise in front of them; `cut` truncates each to half; `standby`
  measures nothing; `lockout` has found a fault of its own; `beams` (value: a number) sends so many
  distances; an empty name clears it.
"""

from __future__ import annotations

import random
import select
import socket
import struct
import time
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from hw.fakes.subscription import Subscription, outlet_as
from hw.ipc import DEVICES, Intake, Parent, Ready, serve
from hw.samples import Scan

FAULTS = ("", "drop", "mute", "freeze", "corrupt", "garbage", "cut", "standby", "lockout", "beams")
LONGEST_S = 0.05
NO_RETURN_CM = 2996
STANDBY = 0x4004
_HEAD = struct.Struct(">IHHBBHHIHHH")
_HEAD_SIZE = 24


def telegram(
    ranges: tuple[float, ...], number: int, beyond: int = 4, standby: bool = False, status: int = 0
) -> bytes:
    """A telegram of these distances, m; inf is no return."""
    if standby:
        words = [STANDBY] * len(ranges)
    else:
        words = [min(NO_RETURN_CM, round(min(r, 81.0) * 100.0)) for r in ranges]
    total = _HEAD_SIZE + 2 * len(words) + 2
    head = _HEAD.pack(
        0, 0, (total - beyond) // 2, 0xFF, 7, 0x0301, status, number & 0xFFFF_FFFF, number & 0xFFFF,
        0xBBBB, 0x1111,
    )  # fmt: skip
    data = head + struct.pack(f"<{len(words)}H", *words)
    return data + struct.pack("<H", checksum(data[4:]))


def checksum(data: bytes) -> int:
    """CRC-16 with the polynomial 0x1021 from 0xFFFF on, most significant bit first."""
    crc = 0xFFFF
    for byte in data:
        crc = crc << 8 & 0xFF00 ^ _TABLE[crc >> 8 ^ byte]
    return crc


def _shifted(byte: int) -> int:
    crc = byte << 8
    for _ in range(8):
        crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


_TABLE = [_shifted(byte) for byte in range(256)]


@dataclass(slots=True)
class _Scanner:
    listener: socket.socket
    number: int = 0
    newest: bytes = b""
    lines: list[socket.socket] = field(default_factory=list)
    due: deque[tuple[int, bytes]] = field(default_factory=deque)
    """Telegrams and when they leave, ns."""

    def let_go(self) -> None:
        while self.lines:
            self.lines.pop().close()

    def send(self, data: bytes) -> None:
        for line in list(self.lines):
            try:
                line.send(data)
            except BlockingIOError:
                continue  # the receiver does not read: a serial line does not wait either
            except OSError:
                self.lines.remove(line)
                line.close()


class FakeS300:
    """The scanners of one robot."""

    def __init__(self, settings: Mapping[str, Any]) -> None:
        self.intake = Intake(("fault", "world"), settings["host"])
        self._scanners = {
            name: _Scanner(socket.create_server(tuple(address)))
            for name, address in settings["scanners"].items()
        }
        self._byte_ns = 10 * 1e9 / settings.get("baud", 500_000)
        self._beyond = settings.get("beyond", 4)
        self._world = outlet_as("scanners", settings.get("tells"))
        self._subscription = Subscription(self._world, self.intake.door("world"))
        self._fault, self._value = "", None
        self._chance = random.Random(1)

    def step(self, parent: Parent) -> None:
        """Wait a little for input, and send what is due."""
        every = self._scanners.values()
        watched: list[Any] = [self.intake, parent, *(one.listener for one in every)]
        watched += [line for one in every for line in one.lines]
        readable = select.select(watched, [], [], self._until_due())[0]
        self._subscription.renew(time.monotonic_ns())
        self._accept(readable)
        for datagram in self.intake.poll():
            if datagram.name in FAULTS:
                self._fault, self._value = datagram.name, datagram.value
            elif datagram.name == "base.scan" and isinstance(datagram.value, Scan):
                self._measure(datagram.value, datagram.stamp_ns)
        self._send_due()

    def close(self) -> None:
        """Close all sockets."""
        for one in self._scanners.values():
            one.let_go()
            one.listener.close()
        self.intake.close()
        self._world.close()

    def _until_due(self) -> float:
        due = [one.due[0][0] for one in self._scanners.values() if one.due]
        if not due:
            return LONGEST_S
        return min(LONGEST_S, max(0.0, 1e-9 * (min(due) - time.monotonic_ns())))

    def _accept(self, readable: list[Any]) -> None:
        for one in self._scanners.values():
            if one.listener in readable:
                line, _ = one.listener.accept()
                line.setblocking(False)
                line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                one.lines.append(line)
            for line in [line for line in one.lines if line in readable]:
                if _gone(line):
                    one.lines.remove(line)
                    line.close()
            if self._fault == "drop":
                one.let_go()

    def _measure(self, scan: Scan, stamp_ns: int) -> None:
        one = self._scanners.get(scan.sensor)
        if one is None:
            return
        if self._fault != "freeze" or not one.number:
            one.number += 1
            one.newest = self._telegram(scan.ranges, one.number)
        sweep_ns = (len(scan.ranges) - 1) * scan.beam_time * 1e9
        leaves = stamp_ns + round(sweep_ns + len(one.newest) * self._byte_ns)
        one.due.append((leaves, one.newest))

    def _telegram(self, ranges: tuple[float, ...], number: int) -> bytes:
        if self._fault == "beams":
            ranges = ranges[: int(str(self._value))]
        off = self._fault in ("standby", "lockout")
        return telegram(ranges, number, self._beyond, off, int(self._fault == "lockout"))

    def _send_due(self) -> None:
        for one in self._scanners.values():
            while one.due and one.due[0][0] <= time.monotonic_ns():
                _, data = one.due.popleft()
                one.send(self._damaged(data))

    def _damaged(self, data: bytes) -> bytes:
        if self._fault in ("mute", "drop"):
            return b""
        if self._fault == "corrupt":
            turned = bytearray(data)
            turned[self._chance.randrange(4, len(data))] ^= 1 << self._chance.randrange(8)
            return bytes(turned)
        if self._fault == "garbage":
            noise = self._chance.randbytes(self._chance.randrange(1, 200))
            return noise + bytes(self._chance.randrange(0, 12)) + data
        if self._fault == "cut":
            return data[: len(data) // 2]
        return data


def _gone(line: socket.socket) -> bool:
    with suppress(BlockingIOError):
        try:
            return not line.recv(256)
        except ConnectionError:
            return True
    return False


def main(settings: Mapping[str, Any], ready: Ready, parent: Parent) -> None:
    """Run until the parent has gone."""
    fake = FakeS300(settings)
    ready({"control": fake.intake.door("fault")})
    try:
        while parent.lives():
            fake.step(parent)
    finally:
        fake.close()


if __name__ == "__main__":
    serve(main, DEVICES)
