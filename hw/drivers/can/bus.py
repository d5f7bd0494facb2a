"""A CAN bus from its configuration: it is polled, never waited for; its faults are texts.

Single error frames are warnings. They stop once they are many (`gates.CAN_ERRORS`), or once the
controller says that they were: error-passive, bus-off.

`interface` and `channel` say where it is, all other keys are passed to python-can. The interface
`local` connects processes of this machine: by IPv4 multicast where there is a route for it, else by
slcan over TCP to a hub at the address `channel`; group and port follow from that address.
"""

from __future__ import annotations

import select
import socket
import time
import zlib
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, NamedTuple

import can

from hw.drivers.access import can_advice, serial_advice
from hw.drivers.gates import CAN_ERRORS, CAN_ERRORS_NS
from hw.ipc import keep_near

BITRATE = 500_000
REMEMBERED = 256
"""Sent frames remembered, to tell their echoes from frames of others."""
LOST_ARBITRATION, CONTROLLER, BUS_OFF = 0x02, 0x04, 0x40
"""Classes of error frames, as Linux numbers them; losing an arbitration is none."""
PASSIVE = 0x30
"""Bits of the second byte of the class CONTROLLER: error-passive in receiving, in sending."""
CLASSES = {
    0x01: "time-out of a transmission", CONTROLLER: "the controller counts errors",
    0x08: "damaged frame", 0x10: "transceiver", 0x20: "nobody acknowledges", 0x80: "bus error",
    0x100: "the controller was restarted",
}  # fmt: skip
WIRING = "look at plugs, bit rate and the two terminating resistors"
HINTS = {
    "socketcan": "is the interface up (ip link set can0 up type can bitrate 500000)? A kernel "
    "without CAN has none: then pcan, slcan or udp_multicast",
    "pcan": "PEAK's library libpcanbasic.so and its driver have to be installed",
    "slcan": "channel is a serial device such as /dev/ttyACM0, or socket://host:port",
    "udp_multicast": "a multicast route has to be there (ip route add 239.0.0.0/8 dev lo); "
    "slcan over TCP needs none",
    "local": "channel is an address of this machine, 127.x.y.z, where the fakes listen",
}


class CanFrame(NamedTuple):
    """A data frame with its 11 bit identifier."""

    id: int
    data: bytes


class CanBus:
    """An open bus; `fault` says what went wrong between the last two polls, or None.

    `warning` is the first error frame after a while without any, or None.

    Some back-ends (multicast) echo one's own frames; these are removed.

    Raises:
        OSError: it cannot be opened, with the cause and a suggestion.
    """

    def __init__(self, settings: Mapping[str, Any]) -> None:
        chosen = _chosen(settings)
        self.name = f"CAN bus {settings.get('interface')} {settings.get('channel')}"
        self.fault: str | None = None
        self.warning: str | None = None
        self._trouble: str | None = None
        self._settings, self._errors = settings, deque[int](maxlen=CAN_ERRORS + 1)
        self._bus = _opened(self.name, chosen, settings)
        self._echoes = chosen["interface"] == "udp_multicast"
        if self._echoes and settings["interface"] == "local":
            keep_near(self._bus.fileno(), str(chosen["channel"]))
        self._sent: deque[CanFrame] = deque(maxlen=REMEMBERED)
        self._waitable = _file(self._bus) is not None
        if chosen["interface"] == "slcan":
            _hurry(self._bus)

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame; if it cannot be sent it is lost, and `fault` says so after `poll`."""
        frame = CanFrame(identifier, bytes(data))
        message = can.Message(
            arbitration_id=frame.id, data=frame.data, is_extended_id=False, check=False
        )
        if self._echoes:
            self._sent.append(frame)
        try:
            self._bus.send(message, timeout=0)
        except (can.CanError, OSError, ValueError) as error:
            self._trouble = self._error_text(error)

    def poll(self, now_ns: int, most: int = 1000) -> list[CanFrame]:
        """The data frames received, oldest first; other kinds are dropped."""
        found: list[CanFrame] = []
        self.warning = None
        try:
            for _ in range(most):
                if self._waitable and not self.readable(0.0):
                    break
                message = self._bus.recv(0)
                if message is not None:
                    self._on_message(message, found, now_ns)
                elif not self._waitable:
                    break
        except (can.CanError, OSError, ValueError) as error:
            self._trouble = self._error_text(error)
        if len(self._errors) > CAN_ERRORS and now_ns - self._errors[0] <= CAN_ERRORS_NS:
            span = 1e-9 * CAN_ERRORS_NS
            self._trouble = (
                self._trouble
                or f"{self.name}: more than {CAN_ERRORS} error frames in {span:g} s; {WIRING}"
            )
        self.fault, self._trouble = self._trouble, None
        return found

    def readable(self, timeout_s: float) -> bool:
        """True once there is something to poll, within timeout_s."""
        file = _file(self._bus)
        if file is None:  # a bus that cannot be waited for: the virtual one
            time.sleep(min(timeout_s, 0.001))
            return True
        return bool(select.select([file], [], [], timeout_s)[0])

    def close(self) -> None:
        """Close the bus."""
        with suppress(can.CanError, OSError):
            self._bus.shutdown()

    def _on_message(self, message: can.Message, found: list[CanFrame], now_ns: int) -> None:
        if message.is_error_frame:
            self._on_error_frame(message, now_ns)
            return
        if message.is_remote_frame or message.is_extended_id:
            return
        frame = CanFrame(message.arbitration_id, bytes(message.data))
        if frame in self._sent:
            while self._sent.popleft() != frame:  # the echoes of earlier ones were lost
                pass
            return
        found.append(frame)

    def _on_error_frame(self, message: can.Message, now_ns: int) -> None:
        kind, data = message.arbitration_id, bytes(message.data)
        if kind == LOST_ARBITRATION:
            return
        told = ", ".join(text for bit, text in CLASSES.items() if kind & bit)
        if kind & BUS_OFF:
            self._trouble = f"{self.name}: bus-off: it has shut itself off; {WIRING}"
        elif kind & CONTROLLER and len(data) > 1 and data[1] & PASSIVE:
            self._trouble = f"{self.name}: error-passive: too many damaged frames; {WIRING}"
        elif not self._errors or now_ns - self._errors[-1] > CAN_ERRORS_NS:
            self.warning = f"{self.name}: error frame ({told or hex(kind)}); {WIRING}"
        self._errors.append(now_ns)

    def _error_text(self, error: Exception) -> str:
        """What went wrong, and what would be right."""
        advice = _advice(error, self._settings)
        return f"{self.name}: {error}" + (f"; {advice}" if advice else "")


def local_address(host: str) -> tuple[str, int]:
    """Multicast group and port of the bus at an address of this machine."""
    number = zlib.crc32(host.encode())
    return f"239.193.{number >> 8 & 255}.{number & 255}", 20_000 + (number >> 16) % 12_000


def _chosen(settings: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments for python-can."""
    for key in ("interface", "channel"):
        if not settings.get(key):
            raise OSError(
                f"a CAN bus needs {key!r}, such as {{interface: socketcan, channel: can0}}"
            )
    chosen = {"bitrate": BITRATE, **settings}
    if chosen["interface"] == "local":
        chosen = _local(str(chosen["channel"]))
    if chosen["interface"] == "slcan" and "://" in str(chosen["channel"]):
        chosen.setdefault("sleep_after_open", 0.0)  # no board resets itself behind a socket
    return chosen


def _local(host: str) -> dict[str, Any]:
    group, port = local_address(host)
    if _has_route(group, port):
        return {"interface": "udp_multicast", "channel": group, "port": port, "hop_limit": 0}
    return {"interface": "slcan", "channel": f"socket://{host}:{port}"}


def _has_route(group: str, port: int) -> bool:
    """True if there is a route for multicast; sends nothing."""
    everybody = socket.inet_aton(group) + socket.inet_aton("0.0.0.0")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tried:
        try:
            tried.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, everybody)
            tried.connect((group, port))
        except OSError:
            return False
    return True


def _opened(name: str, chosen: Mapping[str, Any], settings: Mapping[str, Any]) -> can.BusABC:
    there = f"interfaces: {', '.join(sorted(can.VALID_INTERFACES))}, local"
    try:
        return can.Bus(ignore_config=True, **chosen)
    except Exception as error:  # back-ends raise what they like
        told = str(error) or type(error).__name__
        hint = _advice(error, settings) or HINTS.get(str(settings.get("interface")), there)
        raise OSError(f"{name} does not open: {told}; {hint}") from error


def _advice(error: Exception, settings: Mapping[str, Any]) -> str | None:
    channel = str(settings.get("channel"))
    if settings.get("interface") == "socketcan":
        return can_advice(error, channel, settings.get("bitrate", BITRATE))
    return serial_advice(error, channel) if channel.startswith("/dev/") else None


def _file(bus: can.BusABC) -> int | None:
    try:
        file = bus.fileno()
    except (NotImplementedError, can.CanError, OSError):
        return None
    return file if file >= 0 else None


def _hurry(bus: Any) -> None:
    """Disable Nagle's algorithm, which would hold short frames back until an acknowledgement."""
    wire = getattr(bus.serialPortOrig, "_socket", None)
    if wire is not None:
        wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
