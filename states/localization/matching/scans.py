"""Scans as points in the base frame at one instant, corrected for motion during the scan.

A scanner measures its beams one after another while the base moves: at 1.5 m/s and 60 ms per scan
first and last beam are 9 cm apart. Points are relative to the base in the middle of the scan, so
that a wrong velocity shifts the first beams against the last, not all of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hw import STILL, Pose2, Scan, Twist2, compiled
from hw.model import Sensing
from states.maps import Array

FARTHEST = 1000.0
"""Largest range of a scanner that the robot file does not name, m."""


@dataclass(frozen=True, slots=True)
class Cloud:
    """End points of beams, (n, 2), in the base frame at `stamp_ns`, m."""

    stamp_ns: int
    points: Array


def span_ns(scan: Scan) -> int:
    """Time from the first beam of a scan to the last, ns."""
    return round(max(0, len(scan.array) - 1) * scan.beam_time * 1e9)


def middle_ns(scan: Scan, stamp_ns: int) -> int:
    """The instant in the middle of a scan whose first beam was taken at `stamp_ns`."""
    return stamp_ns + span_ns(scan) // 2


def cloud_of(
    scan: Scan, stamp_ns: int, sensing: Sensing, beams: int, motion: Twist2 = STILL
) -> Cloud:
    """Points of at most `beams` beams, evenly spread over the scan.

    Beams without a hit are left out: NaN, infinite, or not strictly between the scanner's least and
    greatest range. `motion` is the velocity of the base in its own frame, constant over the scan.

    Raises:
        ValueError: `beams` is below 1.
    """
    if beams < 1:
        raise ValueError(f"{beams} beams of a scan; at least 1 is needed")
    every = max(1, math.ceil(len(scan.array) / beams))
    ranges = np.ascontiguousarray(scan.array[::every])
    lidar = sensing.lidars.get(scan.sensor)
    least, most = (0.0, FARTHEST) if lidar is None else (lidar.min_range, lidar.max_range)
    span = span_ns(scan)
    points = points_of(
        ranges,
        (scan.start, every * scan.step),
        (least, most),
        _values(sensing.mount(scan.sensor)),
        (motion.vx, motion.vy, motion.wz),
        (-0.5e-9 * span, every * scan.beam_time),
    )
    return Cloud(stamp_ns + span // 2, points)


def _values(pose: Pose2) -> tuple[float, float, float]:
    return pose.x, pose.y, pose.yaw


@compiled
def points_of(
    ranges: Array,
    angles: tuple[float, float],
    limits: tuple[float, float],
    base_from_sensor: tuple[float, float, float],
    motion: tuple[float, float, float],
    times: tuple[float, float],
) -> Array:
    """End points (n, 2) of beams in the base frame at time 0.

    `angles`, rad in the sensor's frame, and `times`, s, are start and step from beam to beam. At
    time t the base has turned by wz t and moved by t (vx, vy) turned by half of that: the chord of
    its arc, up to third order in wz t.
    """
    points = np.empty((len(ranges), 2))
    count = 0
    for i in range(len(ranges)):
        if not limits[0] < ranges[i] < limits[1]:
            continue
        time = times[0] + i * times[1]
        angle = angles[0] + i * angles[1] + base_from_sensor[2]
        x = base_from_sensor[0] + ranges[i] * math.cos(angle)
        y = base_from_sensor[1] + ranges[i] * math.sin(angle)
        turn = motion[2] * time
        c, s = math.cos(turn), math.sin(turn)
        ch, sh = math.cos(0.5 * turn), math.sin(0.5 * turn)
        points[count, 0] = c * x - s * y + time * (ch * motion[0] - sh * motion[1])
        points[count, 1] = s * x + c * y + time * (sh * motion[0] + ch * motion[1])
        count += 1
    return points[:count].copy()
