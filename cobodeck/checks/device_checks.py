"""The devices of a connection: who they are, and whether ports, buses and lines can be used.

Nothing of a driver is opened. Addresses are tried directly, with a time-out of our own, because
that of a client library may be long. Values of an entry are found by their keys, at any depth:
`host` (or `address`) and `port`, `device`, `interface` and `channel`.
"""

from __future__ import annotations

import errno
from collections.abc import Container, Iterator, Mapping
from contextlib import closing
from inspect import signature
from typing import TYPE_CHECKING, Any, NamedTuple

from cobodeck.checks.connection_checks import class_of
from cobodeck.checks.observer_checks import ANYWHERE
from cobodeck.fitness import BAD, FIT, MISSING, NOTE, CheckResult
from hw.drivers import Listening, can_hindrance, serial_hindrance

if TYPE_CHECKING:
    from hw.connection import Connection

TIMEOUT_S = 1.0
"""Time limit for connecting to a device, s."""
GROUP = ("239.74.163.2", 43113)
"""The multicast group of python-can's `udp_multicast`."""


class Endpoint(NamedTuple):
    """An address that a driver connects to; if `own`, one of this machine that it serves at."""

    host: str
    port: int
    own: bool = False


def identities(connection: Connection, packages: Container[str]) -> Iterator[CheckResult]:
    """Ask each device who it is whose driver knows how."""
    for entry, driver, arguments in _reached(connection, packages):
        if hasattr(driver, "probe"):
            try:
                yield CheckResult(entry, FIT, driver.probe(**arguments))
            except OSError as error:
                yield CheckResult(entry, BAD, str(error))
            except TypeError as error:  # it lacks an argument
                yield CheckResult(entry, BAD, f"{driver.__name__}: {error}")


def ports(connection: Connection, packages: Container[str]) -> Iterator[CheckResult]:
    """The ports of this machine: are they free, and who is believed at those others reach."""
    from hw.ipc import is_loopback

    for entry, driver, arguments in _reached(connection, packages):
        for one in _listening(driver, arguments):
            yield _free(entry, one)
            if not is_loopback(one.host):
                yield _reachable(entry, one)


def addresses(connection: Connection, packages: Container[str]) -> Iterator[CheckResult]:
    """The devices that drivers connect to."""
    for entry, driver, arguments in _reached(connection, packages):
        ours = {(one.host, one.port) for one in _listening(driver, arguments)}
        for address in addresses_in(arguments):
            if not address.own and (address.host, address.port) not in ours:
                yield _answers(entry, address)


def serial(connection: Connection, packages: Container[str]) -> Iterator[CheckResult]:
    """The serial devices."""
    for entry, _, arguments in _reached(connection, packages):
        for device in _values(arguments, "device"):
            wrong = serial_hindrance(device["device"])
            about = f"{device['device']}: {wrong or 'can be opened'}"
            yield CheckResult(entry, FIT if wrong is None else BAD, about)


def buses(connection: Connection) -> Iterator[CheckResult]:
    """The CAN buses: mappings with `interface`, as for python-can; those of fakes, too."""
    for entry, served in connection.entries:
        for bus in _values(served.arguments, "interface"):
            yield _bus(entry, bus)


def addresses_in(value: Any, host: str = ANYWHERE[0]) -> Iterator[Endpoint]:
    """The addresses in the values of an entry, at any depth.

    `host` is the driver's default, if the entry has none.
    """
    if not isinstance(value, Mapping):
        return
    named = next((value[key] for key in ("host", "address") if key in value), None)
    port = value.get("port")
    if isinstance(port, int):
        own = not isinstance(named, str) or named in ANYWHERE
        yield Endpoint(host if named is None else str(named), port, own)
    for inner in value.values():
        yield from addresses_in(inner)


def _reached(
    connection: Connection, packages: Container[str]
) -> Iterator[tuple[str, Any, Mapping[str, Any]]]:
    """Entries with class and arguments; none if there are fakes, which start with the run."""
    if connection.peers:
        return
    for entry, served in connection.entries:
        driver = class_of(f"{served.module}:{served.driver}", packages)
        yield entry, driver, served.arguments


def _values(value: Any, key: str) -> Iterator[Mapping[str, Any]]:
    """The mappings in a value, at any depth, that have a text at this key."""
    if not isinstance(value, Mapping):
        return
    if isinstance(value.get(key), str):
        yield value
    for inner in value.values():
        yield from _values(inner, key)


def _listening(driver: Any, arguments: Mapping[str, Any]) -> list[Listening]:
    """The ports that a driver opens, as it says, or else as its arguments look like."""
    try:
        found: list[Listening] = driver.listens(**arguments)
    except Exception:  # noqa: BLE001  it says nothing, or `drivers` says what is wrong with it
        served = addresses_in(arguments, _serves_at(driver))
        return [Listening("tcp", one.host, one.port) for one in served if one.own]
    return found


def _serves_at(driver: Any) -> str:
    """The host at which a driver serves by default."""
    try:
        default = signature(driver).parameters["host"].default
    except (TypeError, ValueError, KeyError):
        return ANYWHERE[0]
    return default if isinstance(default, str) else ANYWHERE[0]


def _reachable(entry: str, one: Listening) -> CheckResult:
    """Say who is believed at a port that other machines reach."""
    believes = one.believes or "its driver does not say whom it believes"
    where = "at all addresses of this machine" if one.host in ANYWHERE else f"at {one.host}"
    told = f"{one.kind.upper()} port {one.port} of {entry} can be reached {where}: {believes}"
    return CheckResult("open port", MISSING if one.open else NOTE, told)


def _answers(entry: str, address: Endpoint) -> CheckResult:
    """Try a TCP connection."""
    import socket

    where = f"{address.host}:{address.port}"
    try:
        socket.create_connection((address.host, address.port), TIMEOUT_S).close()
    except ConnectionRefusedError:
        return CheckResult(entry, BAD, f"{where} is a machine that takes no connection there")
    except OSError as error:
        why = error.strerror or f"{TIMEOUT_S:g} s"
        return CheckResult(entry, BAD, f"{where} is out of reach: {why}")
    return CheckResult(entry, FIT, f"{where} takes a connection; who it is was not asked")


def _free(entry: str, address: Listening) -> CheckResult:
    """Check that a port of this machine is free, by binding it."""
    import socket

    datagrams = address.kind == "udp"
    kind = socket.SOCK_DGRAM if datagrams else socket.SOCK_STREAM
    what = f"port {address.port}{' of UDP' if datagrams else ''}"
    with closing(socket.socket(socket.AF_INET, kind)) as found:
        try:
            found.bind((address.host, address.port))
        except OSError as error:
            return CheckResult(entry, BAD, f"{what} cannot be taken: {error.strerror}")
    return CheckResult(entry, FIT, f"{what} is free")


def _bus(entry: str, bus: Mapping[str, Any]) -> CheckResult:
    """Check that python-can's back-end for a bus can work on this machine."""
    kind, channel = bus["interface"], str(bus.get("channel", ""))
    what = f"CAN by {kind} {channel}".rstrip()
    if kind == "udp_multicast":
        return _multicast(entry, what)
    wrong = None
    if kind == "socketcan":
        wrong = can_hindrance(channel, bus.get("bitrate", "…"))
    elif kind == "slcan" and channel.startswith("/"):
        wrong = serial_hindrance(channel)
    return (
        CheckResult(entry, FIT, what)
        if wrong is None
        else CheckResult(entry, BAD, f"{what}: {wrong}")
    )


def _multicast(entry: str, what: str) -> CheckResult:
    import socket

    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as sender:
        try:
            sender.connect(GROUP)
        except OSError as error:
            if error.errno != errno.ENETUNREACH:
                return CheckResult(entry, BAD, f"{what}: {error.strerror}")
            remedy = "`ip route add 224.0.0.0/4 dev …`"
            return CheckResult(entry, BAD, f"{what}: multicast has no route", remedy)
    return CheckResult(entry, FIT, f"{what}: whoever reaches this network can send on this bus")
