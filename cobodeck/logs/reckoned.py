"""Dead reckoning for logs without scans: wheels and an inertial sensor.

Both correct one 3D filter: the wheels measure the velocity in the base's plane, and zero along its
z; the inertial sensor measures angular rates and, if it gives the attitude, also that and the
accelerations.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from cobodeck.logs.formats import IMU, ODOMETRY, SensorLog
from engine.files import mistake
from hw import ImuReading, Odometry, Pose3
from states.localization.filter import (
    FilterConfig,
    Measurement,
    MeasurementSource,
    ProcessNoise,
    SpatialFilter,
    without_gravity,
)

_WHEELS, _TURNS, _ATTITUDE = "wheels", "turns", "attitude"
_SOURCES = (
    MeasurementSource(_WHEELS, ("vx", "vy", "vz", "wz"), gate=None),
    MeasurementSource(_TURNS, ("wx", "wy", "wz"), gate=None),
    MeasurementSource(_ATTITUDE, ("roll", "pitch", "yaw", "ax", "ay", "az"), gate=None),
)
_NOISE = (0.03, 0.03, 0.04, 0.03, 0.03, 0.06, 0.025, 0.025, 0.05, 0.02, 0.02, 0.04, 0.1, 0.1, 0.1)
"""Process noise: variances per second, SI units, in the order of the filter's axes."""
_WHEELS_OFF = (1e-3, 1e-3, 1e-3, 1e-2)
_TURNS_OFF = (1e-4, 1e-4, 1e-4)
_ATTITUDE_OFF = (1e-4, 1e-4, 1e-4, 0.1, 0.1, 0.1)
"""Variances of usual wheels and inertial sensors, in the order of the values measured above:
velocities (m/s)2, rates (rad/s)2, angles rad2, accelerations (m/s2)2."""


def reckon(log: SensorLog) -> SpatialFilter:
    """The filter after the whole log; its pose starts at the origin.

    Raises:
        FileError: the log has no odometry.
    """
    if log.count(ODOMETRY) == 0:
        hint = "at least one of both is needed"
        raise mistake(log.path, "has neither scans nor odometry", hint=hint)
    known = FilterConfig(_SOURCES, ProcessNoise(_NOISE, (0.0,) * 15, (0.0,) * 15), (1e-4,) * 15)
    found = SpatialFilter(known)
    for sample in log.samples:
        if isinstance(sample.value, Odometry):
            twist = sample.value.twist
            values = (twist.vx, twist.vy, 0.0, twist.wz)
            found.correct(Measurement(sample.stamp_ns, _WHEELS, values, _WHEELS_OFF))
        elif isinstance(sample.value, ImuReading):
            _turn(found, sample.stamp_ns, sample.value)
    return found


def _turn(found: SpatialFilter, stamp_ns: int, reading: ImuReading) -> None:
    found.correct(Measurement(stamp_ns, _TURNS, reading.rates, _TURNS_OFF))
    if reading.attitude is None:
        return
    angles = Pose3(0.0, 0.0, 0.0, *reading.attitude).roll_pitch_yaw
    free = without_gravity(reading.accelerations, *angles[:2])
    found.correct(Measurement(stamp_ns, _ATTITUDE, (*angles, *free), _ATTITUDE_OFF))


def reckoning_figures(log: SensorLog, found: SpatialFilter) -> dict[str, Any]:
    """The figures for programs; m, rad, s."""
    pose: Pose3 = found.pose
    names = (name for name in (ODOMETRY, IMU) if log.count(name))
    poses = [sample.value.pose for sample in log.samples if isinstance(sample.value, Odometry)]
    return {
        "log": str(log.path),
        "form": log.form,
        "duration_s": log.duration,
        "remarks": list(log.remarks),
        "samples": {name: log.count(name) for name in names},
        "way_m": sum(before.distance_to(after) for before, after in pairwise(poses)),
        "final_position_m": [pose.x, pose.y, pose.z],
        "final_yaw_rad": pose.yaw,
    }
