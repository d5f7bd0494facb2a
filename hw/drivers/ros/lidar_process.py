"""The process with the websocket of the scanners (`hw.drivers.ros.ros_lidar`).

It starts only if each topic sends a valid scan within 2 s, because a server does not report a
failed subscription. Later silence does not end it; a lost connection is reopened. Every 50 ms it
reports by `lidar.fault` that it runs, and which scanner gives nothing, or None.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from functools import partial
from typing import Any

from hw.drivers.clock_offsets import StampedClock, set_by
from hw.drivers.gates import SCAN_SILENT_NS
from hw.drivers.ros.rosbridge import FIRST_S, RosbridgeClient, kind_of, reachable, stamp_of
from hw.ipc import SENSES, Outlet, Parent, Ready, serve
from hw.samples import Scan

KIND = "sensor_msgs/LaserScan"
AGAIN_S = 0.5
LOOK_S = 0.05
LONGEST_S = 1.0
"""Longest plausible sweep, s; longer ones in a message are ignored."""


class Scanners:
    """Converts messages of some topics to `base.scan`."""

    def __init__(self, settings: Mapping[str, Any]) -> None:
        self.bridge: RosbridgeClient | None = None
        self._settings = settings
        self._outlet = Outlet([settings["tells"]])
        self._scanned_ns: dict[str, int] = {}
        self._causes: dict[str, str] = {}
        self._clock = StampedClock()
        self._delay_ns = round(settings["delay"] * 1e9)

    def open(self) -> RosbridgeClient:
        """Open a new connection and subscribe.

        Raises:
            OSError: there is no server.
        """
        settings = self._settings
        reachable(settings["host"], settings["port"])
        self.bridge = RosbridgeClient(settings["host"], settings["port"], self._send_remark)
        kind = kind_of(KIND, settings["ros"])
        for name, entry in settings["scanners"].items():
            side = -1.0 if entry.get("upside_down", False) else 1.0
            self.bridge.subscribe(entry["topic"], kind, partial(self._on_scan, name, side))
        return self.bridge

    @property
    def awaited(self) -> list[str]:
        """The scanners that have not sent a valid scan."""
        return [name for name in self._settings["scanners"] if name not in self._scanned_ns]

    def fault(self, name: str, now_ns: int) -> str | None:
        """Why a scanner has given nothing for SCAN_SILENT_NS; None if it has."""
        if now_ns - self._scanned_ns.get(name, 0) <= SCAN_SILENT_NS:
            return None
        gone = self.bridge is None or not self.bridge.up
        why = "no connection to rosbridge" if gone else self._causes.get(name, "silent")
        return f"{name}: {why}"

    def report(self, now_ns: int) -> None:
        """Report the first fault, or that there is none."""
        faults = [self.fault(name, now_ns) for name in self._settings["scanners"]]
        self._outlet.send("lidar.fault", now_ns, next(filter(None, faults), None))

    def close(self) -> None:
        """Close it."""
        if self.bridge is not None:
            self.bridge.close()
        self._outlet.close()

    def _on_scan(self, name: str, side: float, message: Mapping[str, Any]) -> None:
        received_ns = time.monotonic_ns()
        try:
            stamp, scan = stamp_of(message), scan_of(name, message, side)
        except (KeyError, TypeError, ValueError) as error:
            self._causes[name] = f"what it sends is no scan: {type(error).__name__}: {error}"
            return
        at_ns, step_ns = self._clock.instant(stamp, received_ns, name), self._clock.set_by_ns
        if step_ns is not None:
            self._causes[name] = f"the clock of {self._settings['host']} {set_by(step_ns)}"
        elif at_ns is None:
            self._causes[name] = "it repeats itself"  # as a hung node may
        if at_ns is not None:
            self._scanned_ns[name] = received_ns
            self._causes.pop(name, None)
            sweep_ns = round((len(scan.ranges) - 1) * scan.beam_time * 1e9)
            self._outlet.send("base.scan", at_ns - sweep_ns - self._delay_ns, scan)

    def _send_remark(self, remark: str) -> None:
        self._outlet.send("remark", time.monotonic_ns(), f"scanners: {remark}")


def scan_of(name: str, message: Mapping[str, Any], side: float = 1.0) -> Scan:
    """The Scan of a sensor_msgs/LaserScan in JSON; `side` is -1 for a scanner upside down.

    Raises:
        KeyError, TypeError, ValueError: it is invalid.
    """
    keys = ("angle_min", "angle_increment", "time_increment", "range_min", "range_max")
    start, step, beam_time, nearest, farthest = (float(message[key]) for key in keys)
    ranges = message["ranges"]
    if len(ranges) < 2 or not math.isfinite(start + step) or step == 0.0:
        raise ValueError("no scan")
    if not 0.0 <= beam_time * len(ranges) <= LONGEST_S:
        beam_time = 0.0
    return Scan(
        name,
        side * start,
        side * step,
        tuple([r if r is not None and nearest <= r < farthest else math.inf for r in ranges]),
        beam_time,
    )


def main(settings: Mapping[str, Any], ready: Ready, parent: Parent) -> None:
    """Pass scans on until the parent is gone."""
    scanners = Scanners(settings)
    try:
        _await_first(scanners, scanners.open(), parent)
        ready({})
        while parent.lives(LOOK_S):
            scanners.report(time.monotonic_ns())
            if scanners.bridge is None or scanners.bridge.lost:
                _again(scanners, parent)
    finally:
        scanners.close()


def _await_first(scanners: Scanners, bridge: RosbridgeClient, parent: Parent) -> None:
    bridge.wait()
    until = time.monotonic() + FIRST_S
    while scanners.awaited and time.monotonic() < until and parent.lives(LOOK_S):
        pass
    if not bridge.up:
        raise OSError("rosbridge does not answer")
    if bridge.unheard:
        silent = ", ".join(sorted(bridge.unheard))
        told = f"rosbridge says: {bridge.said}" if bridge.said else "is its name right, its type?"
        raise OSError(f"nothing on {silent} within {FIRST_S:g} s: {told}")
    if scanners.awaited:
        fault = scanners.fault(scanners.awaited[0], time.monotonic_ns())
        raise OSError(f"{fault}; no valid scan of it within {FIRST_S:g} s")


def _again(scanners: Scanners, parent: Parent) -> None:
    until = time.monotonic() + AGAIN_S
    while time.monotonic() < until:
        if not parent.lives(LOOK_S):
            return
        scanners.report(time.monotonic_ns())  # opening takes a while
    try:
        scanners.open().wait()
    except OSError:
        return


if __name__ == "__main__":
    serve(main, SENSES)
