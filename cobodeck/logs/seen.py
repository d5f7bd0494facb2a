"""The scans of a log as points, each scan reduced to one stamp, with the odometry at that stamp."""

from __future__ import annotations

from bisect import bisect_left
from typing import Any, NamedTuple

from cobodeck.logs.formats import SensorLog
from hw import STILL, Odometry, Pose2, Scan, Twist2
from states.localization.matching import cloud_of, span_ns
from states.localization.wheels import displacement_of, velocity_of

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
        wheels = [one for one in log.samples if isinstance(one.value, Odometry)]
        self._stamps = [one.stamp_ns for one in wheels]
        self._poses = [one.value.pose for one in wheels if isinstance(one.value, Odometry)]

    def at(self, stamp_ns: int) -> Pose2 | None:
        """odom_from_base at a stamp, ns; constant before the first sample and after the last."""
        if not self._stamps:
            return None
        after = bisect_left(self._stamps, stamp_ns)
        if after == 0 or after == len(self._stamps):
            return self._poses[min(after, len(self._poses) - 1)]
        before, since = self._poses[after - 1], stamp_ns - self._stamps[after - 1]
        share = since / (self._stamps[after] - self._stamps[after - 1])
        return before @ displacement_of(
            velocity_of(before.inverse() @ self._poses[after], 1.0), share
        )

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
