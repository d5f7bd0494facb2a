"""The scans of a log as points, each scan reduced to one stamp, with the odometry at that stamp."""

from __future__ import annotations

from typing import Any, NamedTuple

from cobodeck.logs.formats import SensorLog
from hw import STILL, Odometry, Pose2, Scan, Twist2, velocity_of
from hw.motion import PoseHistory, along_arc
from states.localization.matching import cloud_of, span_ns

ALL_BEAMS = 100_000


class SeenScan(NamedTuple):
    """A scan: points (n, 2), m, in the base frame at `stamp_ns`, the middle of the scan.

    `odom_from_base` is the odometry at the same stamp, None in a log without odometry.
    """

    sensor: str
    stamp_ns: int
    points: Any
    odom_from_base: Pose2 | None


class WheelPath:
    """The odometry of a whole log; between two samples the base moves on an arc."""

    def __init__(self, log: SensorLog) -> None:
        wheels = ((one.stamp_ns, one.value) for one in log.samples)
        known = ((stamp, told.pose) for stamp, told in wheels if isinstance(told, Odometry))
        self._poses = PoseHistory(along_arc, poses=known)

    def at(self, stamp_ns: int) -> Pose2 | None:
        """odom_from_base at a stamp, ns; constant before the first sample and after the last."""
        return None if self._poses.newest is None else self._poses.held(stamp_ns)

    def velocity(self, first_ns: int, last_ns: int) -> Twist2:
        """Mean velocity between two stamps, ns, in the base frame."""
        first, last = self.at(first_ns), self.at(last_ns)
        if first is None or last is None or last_ns <= first_ns:
            return STILL
        return velocity_of(first.inverse() @ last, (last_ns - first_ns) * 1e-9)


def scans_of(log: SensorLog) -> list[SeenScan]:
    """All scans of a log, with all their beams, in order."""
    wheels, found = WheelPath(log), []
    for sample in log.samples:
        scan = sample.value
        if isinstance(scan, Scan):
            motion = wheels.velocity(sample.stamp_ns, sample.stamp_ns + span_ns(scan))
            cloud = cloud_of(scan, sample.stamp_ns, log.sensing, ALL_BEAMS, motion)
            found.append(
                SeenScan(scan.sensor, cloud.stamp_ns, cloud.points, wheels.at(cloud.stamp_ns))
            )
    return found
