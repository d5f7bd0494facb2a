"""The process with the websocket of the scanners (`hw.drivers.ros.lidar`).

It starts only if each topic sends something within 2 s, because a server does not report a failed
subscription. Later silence does not end it; a lost connection is reopened.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from functools import partial
from typing import Any

from hw.drivers.clocks import StampedClock, set_by
from hw.drivers.ros.rosbridge import FIRST_S, RosbridgeClient, kind_of, reachable, stamp_of
from hw.links.datagrams import Outlet
from hw.links.processes import Parent, Ready, serve
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
        self._clock, self._set = StampedClock(), False
        self._delay_ns = round(settings["delay"] * 1e9)

    def open(self) -> RosbridgeClient:
        """Open a new connection and subscribe.

        Raises:
            OSError: there is no server.
        """
        settings = self._settings
        reachable(settings["host"], settings["port"])
        self.bridge = RosbridgeClient(settings["host"], settings["port"], self._tell)
        kind = kind_of(KIND, settings["ros"])
        for name, entry in settings["scanners"].items():
            side = -1.0 if entry.get("upside_down", False) else 1.0
            self.bridge.subscribe(entry["topic"], kind, partial(self._take, name, side))
        return self.bridge

    def close(self) -> None:
        """Close it."""
        if self.bridge is not None:
            self.bridge.close()
        self._outlet.close()

    def _take(self, name: str, side: float, message: Mapping[str, Any]) -> None:
        received_ns = time.monotonic_ns()
        try:
            stamp, scan = stamp_of(message), scan_of(name, message, side)
        except (KeyError, TypeError, ValueError):
            return  # invalid: it shows as silence
        at_ns = self._clock.instant(stamp, received_ns, name)
        self._look_at_clock()
        if at_ns is not None:
            sweep_ns = round((len(scan.ranges) - 1) * scan.beam_time * 1e9)
            self._outlet.send("base.scan", at_ns - sweep_ns - self._delay_ns, scan)

    def _look_at_clock(self) -> None:
        """Tell once that the robot's clock was set."""
        step_ns = self._clock.set_by_ns
        if step_ns is not None and not self._set:
            self._tell(f"the clock of {self._settings['host']} {set_by(step_ns)}")
        self._set = step_ns is not None

    def _tell(self, remark: str) -> None:
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
        _await_first(scanners.open(), parent)
        ready({})
        while parent.lives(LOOK_S):
            if scanners.bridge is None or scanners.bridge.lost:
                _again(scanners, parent)
    finally:
        scanners.close()


def _await_first(bridge: RosbridgeClient, parent: Parent) -> None:
    bridge.wait()
    until = time.monotonic() + FIRST_S
    while bridge.unheard and time.monotonic() < until and parent.lives(LOOK_S):
        pass
    if not bridge.up:
        raise OSError("rosbridge does not answer")
    if bridge.unheard:
        silent = ", ".join(sorted(bridge.unheard))
        told = f"rosbridge says: {bridge.said}" if bridge.said else "is its name right, its type?"
        raise OSError(f"nothing on {silent} within {FIRST_S:g} s: {told}")


def _again(scanners: Scanners, parent: Parent) -> None:
    parent.lives(AGAIN_S)
    try:
        scanners.open().wait()
    except OSError:
        return


if __name__ == "__main__":
    serve(main)
