"""A multicast group of one machine's processes, which no other machine's datagrams reach.

Libraries bind a socket of a group to all addresses, so that whoever reaches its port can write to
the group. Here the socket sends through loopback, and drops what was not sent from there.
"""

from __future__ import annotations

import ctypes
import os
import socket
import struct
import sys

from hw.ipc.datagrams import LOOPBACK

SO_ATTACH_FILTER = 26
"""Of Linux; `socket` does not name it."""
FROM_LOOPBACK = (
    (0x20, 0, 0, 0xFFF0_000C),  # load the source address, 12 bytes into the IP header
    (0x54, 0, 0, 0xFF00_0000),  # its first byte
    (0x15, 0, 1, 0x7F00_0000),  # 127, go on; else to the last line
    (0x06, 0, 0, 0xFFFF_FFFF),  # take all of it
    (0x06, 0, 0, 0),  # drop it
)
"""A filter program (BPF): datagrams from 127.0.0.0/8, which no network delivers from outside."""


def keep_near(fileno: int, group: str) -> None:
    """Let a bound IPv4 socket take part in a group on this machine alone; on Linux only.

    Raises:
        OSError: the system does not permit it.
    """
    if sys.platform != "linux":
        return
    text = b"".join(struct.pack("=HBBI", *line) for line in FROM_LOOPBACK)
    program = ctypes.create_string_buffer(text)
    filtered = struct.pack("@HP", len(FROM_LOOPBACK), ctypes.addressof(program))
    loopback = socket.inet_aton(LOOPBACK)
    with socket.socket(fileno=os.dup(fileno)) as same:
        same.setsockopt(socket.SOL_SOCKET, SO_ATTACH_FILTER, filtered)
        same.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, loopback)
        joined = socket.inet_aton(group) + loopback
        same.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, joined)
