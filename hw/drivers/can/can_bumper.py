"""The bumper's board on the CAN bus, by `bumper.dbc`: it reports; its line does the stopping.

Its line runs into the safety relay and stops the robot independently of this driver. The messages
report where the foam was touched, and the state of board and line. Any doubt about them is a fault:
missing frames, a wrong counter or check sum, a failed self-test, a line that contradicts the
latched touch. No message closes the line again; that is done by hand at the relay.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import cantools

from hw.drivers.gates import BUMPER_SILENT_NS
from hw.geometry import wrap
from hw.samples import BumperHit

DBC = Path(__file__).with_name("bumper.dbc")
STATUS, RESET = "BumperStatus", "BumperReset"
MISSED = 3
"""A counter that advances by more than this many frames has jumped."""
DISAGREEING = 3
"""Frames in a row for which line and latch may differ: one is read after the other."""
GOOD = 5
"""Good frames in a row before a fault may end."""
ZONES = ("front", "front left", "left", "rear left", "rear", "rear right", "right", "front right")
POLYNOMIAL = 0x1D


class CanBumper:
    """The board: `cause` is the present fault, `fault` the one until it is acknowledged.

    While `forgetting`, the fault was acknowledged and is about to end.
    """

    def __init__(self, send: Callable[[int, bytes], None]) -> None:
        self.fault: str | None = None
        self.cause: str | None = "bumper: no frames yet"
        database: Any = cantools.database.load_file(DBC)
        self._status = database.get_message_by_name(STATUS)
        self._reset = database.get_message_by_name(RESET)
        self.frame = int(self._status.frame_id)
        self._send = send
        self._counter: int | None = None
        self._heard_ns: int | None = None
        self._zones = self._good = self._differ = self._resets = 0
        self._latched = self.forgetting = False
        self._hits: list[BumperHit] = []

    def hits(self) -> list[BumperHit]:
        """Touches since the last call."""
        found, self._hits = self._hits, []
        return found

    def on_frame(self, data: bytes, now_ns: int) -> None:
        """Take a status frame."""
        self._heard_ns = now_ns
        wrong = self._misread(data)
        if wrong is None:
            wrong = self._read(self._status.decode(data))
        if wrong is not None:
            self._trip(wrong)
            return
        self._good += 1
        if self._good >= GOOD:
            self.cause = None
        if self._latched and self.forgetting:
            self._forget()

    def poll(self, now_ns: int) -> None:
        """Check for missing frames, and whether the board has cleared its latch."""
        if self._heard_ns is None:
            self._heard_ns = now_ns
        if now_ns - self._heard_ns > BUMPER_SILENT_NS:
            self._trip("no frames")
        elif self.forgetting and not self._latched:
            self.fault, self.forgetting = None, False
        elif self._latched and self.fault is None:
            self.fault = "bumper: the board has latched a touch"

    def acknowledge(self) -> bool:
        """End the fault once the board has cleared its latch; False while a cause persists."""
        if self.cause is not None:
            return False
        self.forgetting = True
        if self._latched:
            self._forget()
        return True

    def _misread(self, data: bytes) -> str | None:
        """A defect of the frame itself, or None."""
        if len(data) != 8 or crc8(data[:7]) != data[7]:
            return "wrong check sum"
        before, self._counter = self._counter, data[0] & 0x0F
        if before is None:
            return None
        ahead = (self._counter - before) % 16
        if ahead == 0:
            return "the counter stands still"
        return "the counter jumps" if ahead > MISSED else None

    def _read(self, found: Mapping[str, Any]) -> str | None:
        """Take the content of a good frame; why it forbids motion, or None."""
        zones, opened = int(found["Zones"]), bool(found["LineOpen"])
        self._latched = bool(found["Latched"])
        self._touch(zones)
        self._differ = self._differ + 1 if _disagree(zones, opened, self._latched) else 0
        if not found["SelfTest"]:
            return "the self-test has failed"
        if self._differ >= DISAGREEING:
            line = "open" if opened else "closed"
            return f"line and message disagree: {zones_text(zones)}, and the line is {line}"
        if zones:
            return zones_text(zones)
        return "its line is open; close it by hand at the relay" if opened else None

    def _touch(self, zones: int) -> None:
        new = zones & ~self._zones
        self._zones = zones
        for number in range(len(ZONES)):
            if new >> number & 1:
                self._hits.append(BumperHit(wrap(number * 2.0 * math.pi / len(ZONES))))

    def _trip(self, why: str) -> None:
        self.cause = f"bumper: {why}"
        self.fault = self.fault or self.cause
        self._good, self.forgetting = 0, False

    def _forget(self) -> None:
        self._resets = (self._resets + 1) % 16
        values = {"ResetCounter": self._resets, "ResetCheck": crc8(bytes((self._resets,)))}
        self._send(int(self._reset.frame_id), self._reset.encode(values))


def _disagree(zones: int, opened: bool, latched: bool) -> bool:
    """True if line and touch contradict each other: only a touch opens the line."""
    return (zones != 0 and not opened) or (opened and not latched)


def zones_text(zones: int) -> str:
    """The pressed zones as text."""
    names = [name for number, name in enumerate(ZONES) if zones >> number & 1]
    return f"touched at {', '.join(names)}" if names else "not touched"


def crc8(data: bytes) -> int:
    """CRC-8 of SAE J1850."""
    crc = 0xFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ POLYNOMIAL if crc & 0x80 else crc << 1) & 0xFF
    return crc ^ 0xFF
