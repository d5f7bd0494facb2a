"""Checks everything that a connection needs without opening any part; nothing moves.

Addresses are tried directly, with a time-out of our own, because that of a client library may be
long.
"""

from __future__ import annotations

import ctypes
import errno
import importlib
import os
import socket
from collections.abc import Container, Iterator, Mapping
from contextlib import closing
from inspect import signature
from typing import Any, NamedTuple

from cobodeck.fitness import BAD, FIT, MISSING, DoctorLine
from cobodeck.project import is_there
from cobodeck.real.open_connection import OWN_HOST, placed
from hw.connection import Connection, Listening
from hw.drivers import can_hindrance, key_in, serial_hindrance
from hw.drivers.chain import KEYLESS, observer_address
from hw.ipc import CHAIN, LOOPBACK as LOCAL, is_loopback, permitted

NOTE = "note"
"""The state of a check that is only a note to the operator."""
TIMEOUT_S = 1.0
"""Time limit for connecting to a device, s."""
NEEDS: Mapping[str, tuple[str, ...]] = {
    "hw.drivers.ur.ur_arm": ("rtde_control", "rtde_receive"),
    "hw.drivers.unity.unity_link": ("rosbags",),
    "hw.drivers.can.can_base": ("can", "canopen", "cantools"),
    "hw.drivers.kairos.kairos_base": ("roslibpy",),
    "hw.drivers.ros.ros_lidar": ("roslibpy",),
}
"""Third-party modules that a driver imports when opened, unless its class lists them as `needs`."""
WHEELS: Mapping[str, str] = {
    "rtde_control": "ur-rtde (wheels: Linux on x86-64, Python below 3.13)",
    "rtde_receive": "ur-rtde (wheels: Linux on x86-64, Python below 3.13)",
    "can": "python-can",
    "roslibpy": "cobodeck[ros]",
}
"""Names of packages that differ from the module they provide."""
PROBES: Mapping[str, str] = {"hw.drivers.ur.ur_arm": "hw.drivers.ur.probe"}
"""By driver module: a module whose `probe(host)` asks the device for its identity."""
ANYWHERE = ("0.0.0.0", "::", "")
GROUP = ("239.74.163.2", 43113)
"""The multicast group of python-can's `udp_multicast`."""
UNSYNCHRONISED = 5
"""The value that adjtimex returns for a clock that is not synchronised (TIME_ERROR)."""
NEVER = (
    "never run on the real devices: its drivers were tried against stand-ins alone; the stop is a "
    "software stop, so keep a hand on the hardware's emergency stop"
)


class Endpoint(NamedTuple):
    """An address that a driver connects to; if `own`, one of this machine that it serves at."""

    host: str
    port: int
    own: bool = False


def preflight(connection: Connection, packages: Container[str]) -> Iterator[DoctorLine]:
    """One line per check: what was checked, its state, an explanation."""
    yield f"connection {connection.name}", FIT, connection.about
    for entry, _, driver in connection.drivers:
        yield from _driver(entry, driver, packages)
    fakes = bool(connection.peers)
    for entry, served in connection.entries:
        if not fakes:
            yield from _reached(entry, f"{served.module}:{served.driver}", served.arguments)
            yield from _serial(entry, served.arguments)
        for bus in _buses(served.arguments):
            yield _bus(entry, bus)
    yield _realtime()
    yield _clock()
    for served in connection.links.values():
        yield from _observed(served.arguments)
    yield from ((connection.name, NOTE, remark) for remark in connection.told)
    if connection.real:
        proven = connection.proven
        yield "proven", FIT if proven else MISSING, f"on {proven}" if proven else NEVER


def _driver(entry: str, driver: str, packages: Container[str]) -> Iterator[DoctorLine]:
    """Import a driver of a known package, and check the modules that it needs when opened."""
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


def _reached(entry: str, driver: str, arguments: Mapping[str, Any]) -> Iterator[DoctorLine]:
    module, host = driver.partition(":")[0], arguments.get("host")
    if module in PROBES and isinstance(host, str):
        yield _probed(entry, PROBES[module], host)
    served = _listening(driver, arguments)
    for one in served:
        yield _free(entry, one)
        if not is_loopback(one.host):
            yield _reachable(entry, one)
    ours = {(one.host, one.port) for one in served}
    for address in addresses_in(arguments):
        if not address.own and (address.host, address.port) not in ours:
            yield _answers(entry, address)


def _listening(driver: str, arguments: Mapping[str, Any]) -> list[Listening]:
    """The ports that a driver opens, as it says, or else as its arguments look like."""
    module, _, name = driver.partition(":")
    try:
        found: list[Listening] = getattr(importlib.import_module(module), name).listens(**arguments)
    except Exception:  # noqa: BLE001  it says nothing, or its check reports what is wrong with it
        addresses = addresses_in(arguments, _serves_at(driver))
        return [Listening("tcp", one.host, one.port) for one in addresses if one.own]
    return found


def _reachable(entry: str, one: Listening) -> DoctorLine:
    """Say who is believed at a port that other machines reach."""
    believes = one.believes or "its driver does not say whom it believes"
    where = "at all addresses of this machine" if one.host in ANYWHERE else f"at {one.host}"
    told = f"{one.kind.upper()} port {one.port} of {entry} can be reached {where}: {believes}"
    return "open port", MISSING if one.open else NOTE, told


def _serves_at(driver: str) -> str:
    """The host at which a driver serves by default."""
    module, _, name = driver.partition(":")
    try:
        found = getattr(importlib.import_module(module), name)
        default = signature(found).parameters["host"].default
    except Exception:  # noqa: BLE001  the check of the driver itself reports what is wrong
        return ANYWHERE[0]
    return default if isinstance(default, str) else ANYWHERE[0]


def _probed(entry: str, module: str, host: str) -> DoctorLine:
    """Ask a device for its identity."""
    try:
        return entry, FIT, f"{host} says that it is {importlib.import_module(module).probe(host)}"
    except OSError as error:
        return entry, BAD, str(error)


def _answers(entry: str, address: Endpoint) -> DoctorLine:
    """Try a TCP connection."""
    where = f"{address.host}:{address.port}"
    try:
        socket.create_connection((address.host, address.port), TIMEOUT_S).close()
    except ConnectionRefusedError:
        return entry, BAD, f"{where} is a machine that takes no connection there"
    except OSError as error:
        return entry, BAD, f"{where} is out of reach: {error.strerror or f'{TIMEOUT_S:g} s'}"
    return entry, FIT, f"{where} takes a connection; who it is was not asked"


def _free(entry: str, address: Listening) -> DoctorLine:
    """Check that a port of this machine is free, by binding it."""
    datagrams = address.kind == "udp"
    kind = socket.SOCK_DGRAM if datagrams else socket.SOCK_STREAM
    what = f"port {address.port}{' of UDP' if datagrams else ''}"
    with closing(socket.socket(socket.AF_INET, kind)) as found:
        try:
            found.bind((address.host, address.port))
        except OSError as error:
            return entry, BAD, f"{what} cannot be taken: {error.strerror}"
    return entry, FIT, f"{what} is free"


def observers(connection: Connection) -> Iterator[str]:
    """The command of the observer of a run in this process, if the safety chain requires one."""
    for served in connection.links.values():
        yield from (told for _, state, told in _observed(placed(served.arguments)) if state == NOTE)


def _observed(chain: Mapping[str, Any]) -> Iterator[DoctorLine]:
    """The command of a chain's observer, and whether the key that it needs is there."""
    wanted, what = chain.get("observer"), "observer"
    if not isinstance(wanted, Mapping):
        return
    host, port = observer_address(wanted, (str(chain.get("host", LOCAL)), int(chain["port"])))
    given = " --key FILE" if "key" in wanted else ""
    where, there = host, ""
    if host in ANYWHERE:
        where, there = "HOST", "; HOST is an address of this machine"
    if host == OWN_HOST:
        where, there = "HOST", "; HOST is another one in each run, which tells it"
    yield what, NOTE, f"somebody has to watch: cobodeck observe {where}:{port}{given}{there}"
    if "key" not in wanted:
        if host != OWN_HOST and not is_loopback(host):
            yield what, BAD, KEYLESS.format(host=host)
        return
    try:
        key_in(wanted["key"])
    except (OSError, ValueError) as error:
        yield what, BAD, str(error)


def _buses(value: Any) -> Iterator[Mapping[str, Any]]:
    """The CAN buses in a value: mappings with `interface`, as for python-can."""
    if not isinstance(value, Mapping):
        return
    if isinstance(value.get("interface"), str):
        yield value
    for inner in value.values():
        yield from _buses(inner)


def _bus(entry: str, bus: Mapping[str, Any]) -> DoctorLine:
    """Check that python-can's back-end for a bus can work on this machine."""
    kind, channel = bus["interface"], str(bus.get("channel", ""))
    what = f"CAN by {kind} {channel}".rstrip()
    if kind == "udp_multicast":
        return entry, *_multicast(what)
    wrong = None
    if kind == "socketcan":
        wrong = can_hindrance(channel, bus.get("bitrate", "…"))
    elif kind == "slcan" and channel.startswith("/"):
        wrong = serial_hindrance(channel)
    return (entry, FIT, what) if wrong is None else (entry, BAD, f"{what}: {wrong}")


def _serial(entry: str, value: Any) -> Iterator[DoctorLine]:
    """Check the serial devices in a value: the texts of its keys `device`, at any depth."""
    if not isinstance(value, Mapping):
        return
    if isinstance(device := value.get("device"), str):
        wrong = serial_hindrance(device)
        yield entry, FIT if wrong is None else BAD, f"{device}: {wrong or 'can be opened'}"
    for inner in value.values():
        yield from _serial(entry, inner)


def _multicast(what: str) -> tuple[str, str]:
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as sender:
        try:
            sender.connect(GROUP)
        except OSError as error:
            if error.errno != errno.ENETUNREACH:
                return BAD, f"{what}: {error.strerror}"
            return BAD, f"{what}: multicast has no route; `ip route add 224.0.0.0/4 dev …`"
    return FIT, f"{what}: whoever reaches this network can send on this bus"


def hindered() -> str | None:
    """Why other programs may delay this robot's cycles, and what ends that; None if they cannot."""
    if permitted():
        return None
    try:
        import pwd
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
        user = pwd.getpwuid(os.getuid()).pw_name
    except (ImportError, AttributeError, KeyError):
        return "this system gives no real-time priorities: other programs may delay cycles"
    denied = "no right to real-time priorities, so that other programs may delay cycles: "
    if os.geteuid() == 0 or limit >= CHAIN:
        return (
            f"{denied}this container or group of processes has none; it is to be started with "
            f"CAP_SYS_NICE (`docker run --cap-add SYS_NICE`), its cgroup with cpu.rt_runtime_us"
        )
    return (
        f"{denied}rtprio is {limit}, {CHAIN} is needed; write the lines '{user} - rtprio {CHAIN}' "
        f"and '{user} - memlock unlimited' into /etc/security/limits.d/cobodeck.conf and log in "
        f"again (a systemd unit: LimitRTPRIO={CHAIN} and LimitMEMLOCK=infinity)"
    )


def _realtime() -> DoctorLine:
    """Check for the right to real-time priorities, which keep cycles from being delayed."""
    slow = hindered()
    return "real time", FIT if slow is None else MISSING, slow or "real-time priorities are allowed"


def _clock() -> DoctorLine:
    """Check that the clock is synchronised: other machines' stamps are compared with it."""
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
