"""Laser scanners of a robot through rosbridge, on a websocket of their own (R8).

parts:
  lidar:
    driver: RosLidar
    host: 192.168.0.200
    port: 9090
    ros: 1                 # or 2: how message types are named
    scanners:
      front_laser: {topic: /robot/front_laser/scan, upside_down: true}
      rear_laser: {topic: /robot/rear_laser/scan, upside_down: true}
    delay: 0.0             # s, from the last beam to receipt, if known

The connection is in a process of its own (`hw.drivers.ros.lidar_process`). A scan is stamped at its
first beam: the robot's stamp converted to our clock as if the fastest message had been received at
its last beam, less the time from the first beam to the last according to the message, less `delay`.
Null and NaN, as rosbridge writes values that JSON lacks, and ranges out of limits count as no
return. Angles of a scanner mounted upside down, as on an RB-KAIROS, are reversed.

A scanner without a valid scan for 0.4 s is a fault, which stops the robot until it scans again and
the operator resets the stop. A lost connection is retried every 0.5 s.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from hw.connection import RunInfo
from hw.drivers.feed import DatagramFeed, by_stamps
from hw.drivers.gates import LINK_SILENT_NS
from hw.ipc import Child, Datagram
from hw.samples import Sample, Scan

KEPT = 16
KEYS = {"topic", "upside_down"}


class RosLidar:
    """The scanners by their names in the robot file, each with its topic. Gives `base.scan`.

    Args:
        host: the computer of the robot.
        scanners: by name the `topic` of each, and `upside_down: true` where it is.
        now: the time of the run, ns.
        opening: of the run.
        port: of rosbridge.
        ros: 1 or 2: how message types are named.
        delay: from the last beam to receipt, s, if known.

    Raises:
        ValueError: a scanner that the robot file does not name.
    """

    signals: tuple[str, ...] = ("base.scan",)
    needs = ("roslibpy",)

    def __init__(
        self,
        host: str,
        scanners: Mapping[str, Mapping[str, Any]],
        now: Callable[[], int],
        opening: RunInfo,
        port: int = 9090,
        ros: int = 1,
        delay: float = 0.0,
    ) -> None:
        models = opening.body.sensing.lidars
        if strange := sorted(set(scanners) - set(models)):
            there = ", ".join(models) or "it has none"
            raise ValueError(f"{strange[0]!r} is no scanner of {opening.body.name}: {there}")
        for name, entry in scanners.items():
            if "topic" not in entry or set(entry) - KEYS:
                raise ValueError(f"{name}: write its topic, and upside_down: true where it is")
        self.wake: Callable[[], None] = _nobody
        self._tell = opening.tell
        self._arrived: deque[Sample] = deque(maxlen=KEPT * len(scanners))
        self._feed = DatagramFeed("lidar", now, self._on_datagram)
        self._fault: str | None = None
        self.child = Child(
            "hw.drivers.ros.lidar_process",
            {
                "host": host, "port": port, "ros": ros, "delay": delay, "tells": self._feed.door,
                "scanners": {name: dict(entry) for name, entry in scanners.items()},
            },
            "the scanners' process",
        )  # fmt: skip
        self._feed.start()

    def wait(self) -> None:
        """Wait until each scanner has sent a valid scan.

        Raises:
            OSError: the server is not there, or the named topic gives none.
        """
        self.child.wait()

    @property
    def pid(self) -> int:
        """Process id."""
        return self.child.pid

    @property
    def fault(self) -> str | None:
        """Which scanner gives nothing, and why, or that its process is silent; None if all give."""
        return self._fault or self._feed.silence(LINK_SILENT_NS, self.child.name)

    def samples(self, now_ns: int) -> list[Sample]:
        """Scans since the last call, by stamp."""
        return by_stamps(self._arrived, now_ns)

    def close(self) -> None:
        """Close the connection."""
        self.child.close()
        self._feed.close()

    def _on_datagram(self, datagram: Datagram, stamp_ns: int) -> None:
        if datagram.name == "base.scan" and isinstance(datagram.value, Scan):
            self._arrived.append(Sample("base.scan", stamp_ns, datagram.value))
            self.wake()
        elif datagram.name == "lidar.fault":
            self._fault = None if datagram.value is None else str(datagram.value)
        elif datagram.name == "remark":
            self._tell(str(datagram.value))


def _nobody() -> None:
    """No loop waits for a scan."""
