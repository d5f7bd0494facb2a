"""The wire of the nodes: a bus of python-can, or a hub for slcan over TCP.

`interface: local, channel: HOST` is multicast where there is a route for it, else the hub at HOST;
group and port follow from the CRC-32 of HOST, as the other side must compute them too.
"""

from __future__ import annotations

import select
import socket
import zlib
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import can

from hw.ipc import keep_near

QUICK_ACK = getattr(socket, "TCP_QUICKACK", None)
LONGEST = 32
"""Longest line of slcan for classic CAN, bytes."""


class Hub:
    """Serves adapters that speak slcan over TCP; each frame goes to all others and to us.

    Raises:
        OSError: the address is in use.
    """

    def __init__(self, host: str, port: int) -> None:
        self._server = socket.create_server((host, port))
        self._server.setblocking(False)
        self._clients: dict[socket.socket, bytes] = {}

    def files(self) -> list[Any]:
        """For `select`."""
        return [self._server, *self._clients]

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame to all adapters."""
        del timeout
        self._spread(f"t{msg.arbitration_id:03X}{msg.dlc:d}{msg.data.hex().upper()}\r".encode())

    def poll(self) -> list[tuple[int, bytes]]:
        """Frames that have come."""
        with suppress(BlockingIOError):
            client, _ = self._server.accept()
            client.setblocking(False)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._clients[client] = b""
        found: list[tuple[int, bytes]] = []
        for client in list(self._clients):
            found.extend(self._lines(client))
        return found

    def close(self) -> None:
        """Close all connections."""
        for client in self._clients:
            client.close()
        self._server.close()

    def _lines(self, client: socket.socket) -> list[tuple[int, bytes]]:
        try:
            data = client.recv(65_536)
        except BlockingIOError:
            return []
        except OSError:
            data = b""
        if not data:
            self._drop(client)
            return []
        if QUICK_ACK is not None:  # otherwise the other side holds short lines back for 40 ms
            client.setsockopt(socket.IPPROTO_TCP, QUICK_ACK, 1)
        *lines, rest = (self._clients[client] + data).split(b"\r")
        self._clients[client] = rest[-LONGEST:]
        frames = []
        for line in lines:
            frame = _frame(line)
            if frame is not None:
                frames.append(frame)
                self._spread(line + b"\r", client)
        return frames

    def _spread(self, line: bytes, sender: socket.socket | None = None) -> None:
        for client in list(self._clients):
            if client is sender:
                continue
            try:
                client.sendall(line)
            except OSError:
                self._drop(client)

    def _drop(self, client: socket.socket) -> None:
        self._clients.pop(client, None)
        client.close()


class Bus:
    """A bus of python-can."""

    def __init__(self, settings: Mapping[str, Any], near: bool = False) -> None:
        """With `near` other machines do not reach a multicast group."""
        self._bus = can.Bus(ignore_config=True, **settings)
        if near:
            keep_near(self._bus.fileno(), str(settings["channel"]))

    def files(self) -> list[Any]:
        """For `select`."""
        return [self._bus.fileno()]

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame."""
        with suppress(can.CanError, OSError):
            self._bus.send(msg, timeout=timeout)

    def poll(self) -> list[tuple[int, bytes]]:
        """Frames that have come."""
        found: list[tuple[int, bytes]] = []
        while (message := self._bus.recv(0)) is not None:
            found.append((message.arbitration_id, bytes(message.data)))
        return found

    def close(self) -> None:
        """Close it."""
        self._bus.shutdown()


def _frame(line: bytes) -> tuple[int, bytes] | None:
    """A data frame with its 11 bit identifier; None for adapter commands and garbage."""
    try:
        if line[:1] != b"t" or len(line) != 5 + 2 * int(line[4:5]):
            return None
        return int(line[1:4], 16), bytes.fromhex(line[5:].decode())
    except ValueError:
        return None


def open_wire(settings: Mapping[str, Any]) -> Bus | Hub:
    """The bus of a connection file.

    Raises:
        OSError: it cannot be opened.
    """
    near = settings["interface"] == "local"
    if near:
        host = str(settings["channel"])
        group, port = meeting_point(host)
        if not has_route(group, port):
            return Hub(host, port)
        settings = {
            "interface": "udp_multicast", "channel": group, "port": port, "hop_limit": 0,
        }  # fmt: skip
    elif settings["interface"] == "hub":
        return Hub(str(settings["channel"]), int(settings["port"]))
    try:
        return Bus(settings, near)
    except can.CanError as error:
        raise OSError(f"fake CAN nodes: {error}") from error


def meeting_point(host: str) -> tuple[str, int]:
    """Multicast group and port for an address of this machine."""
    number = zlib.crc32(host.encode())
    return f"239.193.{number >> 8 & 255}.{number & 255}", 20_000 + (number >> 16) % 12_000


def has_route(group: str, port: int) -> bool:
    """True if there is a route for multicast; sends nothing."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tried:
        try:
            joined = socket.inet_aton(group) + socket.inet_aton("0.0.0.0")
            tried.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, joined)
            tried.connect((group, port))
        except OSError:
            return False
    return True


def wait(files: list[Any], timeout_s: float) -> None:
    """Wait until one is readable, or for timeout_s."""
    select.select(files, [], [], timeout_s)
