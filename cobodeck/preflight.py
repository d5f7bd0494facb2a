"""Is all there that a connection needs, before any of its parts is opened? Nothing moves by it.

Addresses are looked at by themselves, with a time-out of our own, because a client's may be long.
"""

from __future__ import annotations

import ctypes
import errno
import importlib
import os
import socket
from collections.abc import Container, Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

from cobodeck.connected import LOOPBACK
from cobodeck.doctor import BAD, FIT, MISSING, Check
from cobodeck.project import is_there
from hw.connection import Connection

TIMEOUT_S = 1.0
"""A device that takes no connection within this time, s, is out of reach."""
NEEDS: Mapping[str, tuple[str, ...]] = {
    "hw.drivers.ur": ("rtde_control", "rtde_receive"),
    "hw.drivers.unity": ("rosbags",),
    "hw.drivers.can_base": ("can", "canopen", "cantools"),
    "hw.drivers.kairos": ("roslibpy",),
    "hw.drivers.ros_lidar": ("roslibpy",),
}
"""Modules of others that a driver imports once it is opened; a class may name its own, `needs`."""
WHEELS: Mapping[str, str] = {
    "rtde_control": "ur-rtde (wheels: Linux on x86-64, Python below 3.13)",
    "rtde_receive": "ur-rtde (wheels: Linux on x86-64, Python below 3.13)",
    "can": "python-can",
    "roslibpy": "cobodeck[ros]",
}
"""What brings a module, where it is called otherwise."""
PORTS: Mapping[str, tuple[int, ...]] = {"hw.drivers.ur": (30004, 29999)}
"""TCP ports that a driver connects to where its entry names a host alone: RTDE, dashboard."""
ANYWHERE = ("0.0.0.0", "::", "")
GROUP = ("239.74.163.2", 43113)
"""The multicast group of python-can's `udp_multicast`."""
UNSYNCHRONISED = 5
"""What adjtimex returns while nobody sets the clock."""
NEVER = (
    "never run on the real devices: its drivers were tried against stand-ins alone; the stop is a "
    "software stop, so keep a hand on the hardware's emergency stop"
)


class Address(NamedTuple):
    """Where a driver connects to; without a host: a port of this machine that it takes."""

    host: str | None
    port: int


def preflight(connection: Connection, packages: Container[str]) -> Iterator[Check]:
    """What was looked at, how it is, and what that means."""
    yield f"connection {connection.name}", FIT, connection.about
    for entry, _, driver in connection.drivers:
        yield from _driver(entry, driver, packages)
    fakes = bool(connection.peers)
    for entry, served in connection.entries:
        if not fakes:
            yield from _reached(entry, served.module, served.arguments)
        for bus in _buses(served.arguments):
            yield _bus(entry, bus)
    yield _realtime()
    yield _clock()
    yield from ((f"{connection.name}", MISSING, remark) for remark in connection.told)
    if connection.real:
        proven = connection.proven
        yield "proven", FIT if proven else MISSING, f"on {proven}" if proven else NEVER


def _driver(entry: str, driver: str, packages: Container[str]) -> Iterator[Check]:
    """Can it be imported, with all that it imports later? It is, if it is of a known package."""
    module, _, name = driver.partition(":")
    if module.partition(".")[0] not in packages:
        yield entry, BAD, f"{driver} is of no project; go to its folder"
        return
    try:
        found = getattr(importlib.import_module(module), name)
    except Exception as error:  # noqa: BLE001  a driver may raise anything
        yield entry, BAD, f"{driver}: {type(error).__name__}: {error}"
        return
    needs = getattr(found, "needs", NEEDS.get(module, ()))
    lacking = dict.fromkeys(WHEELS.get(need, need) for need in needs if not is_there(need))
    if lacking:
        yield entry, BAD, f"{driver} needs {', '.join(lacking)}; a simulation works without it"
    else:
        yield entry, FIT, driver


def addresses_in(module: str, value: Any) -> Iterator[Address]:
    """The addresses in the values of an entry, wherever they stand."""
    if not isinstance(value, Mapping):
        return
    host = next((value[key] for key in ("host", "address") if key in value), None)
    port = value.get("port")
    if isinstance(host, str) and host not in ANYWHERE:
        ports = (port,) if isinstance(port, int) else PORTS.get(module, ())
        yield from (Address(host, port) for port in ports)
    elif isinstance(port, int):
        yield Address(None, port)
    for inner in value.values():
        yield from addresses_in(module, inner)


def _reached(entry: str, module: str, arguments: Mapping[str, Any]) -> Iterator[Check]:
    for address in addresses_in(module, arguments):
        if address.host is None:
            yield _free(entry, address.port)
        elif address.host != LOOPBACK:
            yield _answers(entry, address.host, address.port)


def _answers(entry: str, host: str, port: int) -> Check:
    """Does somebody take TCP connections there?"""
    try:
        socket.create_connection((host, port), TIMEOUT_S).close()
    except ConnectionRefusedError:
        return entry, MISSING, f"{host}:{port} is a machine that takes no TCP connection there"
    except OSError as error:
        told = error.strerror or f"silent for {TIMEOUT_S:g} s"
        return entry, BAD, f"{host}:{port} is out of reach: {told}"
    return entry, FIT, f"{host}:{port} answers"


def _free(entry: str, port: int) -> Check:
    """Can this machine's port be taken, for TCP and for datagrams?"""
    for kind in (socket.SOCK_STREAM, socket.SOCK_DGRAM):
        with closing(socket.socket(socket.AF_INET, kind)) as found:
            try:
                found.bind(("", port))
            except OSError as error:
                return entry, BAD, f"port {port} cannot be taken: {error.strerror}"
    return entry, FIT, f"port {port} is free"


def _buses(value: Any) -> Iterator[Mapping[str, Any]]:
    """All that is said of CAN buses: mappings with `interface`, as python-can takes them."""
    if not isinstance(value, Mapping):
        return
    if isinstance(value.get("interface"), str):
        yield value
    for inner in value.values():
        yield from _buses(inner)


def _bus(entry: str, bus: Mapping[str, Any]) -> Check:
    """Can a back-end work on this machine?"""
    kind, channel = bus["interface"], str(bus.get("channel", ""))
    what = f"CAN by {kind} {channel}".rstrip()
    if kind == "socketcan" and not Path("/sys/class/net", channel).exists():
        return entry, BAD, f"{what}: there is no such network interface; `ip link` lists them"
    if kind == "udp_multicast":
        return entry, *_multicast(what)
    if kind == "slcan" and channel.startswith("/") and not Path(channel).exists():
        return entry, BAD, f"{what}: there is no such device"
    return entry, FIT, what


def _multicast(what: str) -> tuple[str, str]:
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as sender:
        try:
            sender.connect(GROUP)
        except OSError as error:
            if error.errno != errno.ENETUNREACH:
                return BAD, f"{what}: {error.strerror}"
            return BAD, f"{what}: multicast has no route; `ip route add 224.0.0.0/4 dev …`"
    return FIT, what


def _realtime() -> Check:
    """May the chain be given a fixed priority, so that other programs do not delay it?"""
    what = "real time"
    try:
        import resource

        priority, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
        locked, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    except (ImportError, AttributeError, OSError):
        return what, MISSING, "not known on this system"
    if os.geteuid() != 0 and priority == 0:
        return what, MISSING, "no right to SCHED_FIFO (rtprio 0): other programs may delay cycles"
    root = os.geteuid() == 0
    told = "SCHED_FIFO as root" if root else f"SCHED_FIFO up to {priority}"
    memory = "" if root or locked < 0 else f", {locked >> 20} MiB of memory can be locked"
    return what, FIT, f"{told}{memory}"


def _clock() -> Check:
    """Is this machine's clock set by somebody? Stamps of other machines are compared with it."""
    what = "clock"
    try:
        state = ctypes.CDLL(None, use_errno=True).adjtimex(ctypes.create_string_buffer(512))
    except (OSError, AttributeError):
        return what, MISSING, "not known on this system"
    if state < 0:
        return what, MISSING, f"not known: {os.strerror(ctypes.get_errno())}"
    if state == UNSYNCHRONISED:
        return what, MISSING, "not synchronised; chrony on all machines keeps their clocks alike"
    return what, FIT, "synchronised"
