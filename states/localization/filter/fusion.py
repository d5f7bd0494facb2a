"""The Kalman filter of the base with its sources: wheels, matched scans, trackers."""

from __future__ import annotations

import math

import numpy as np

from hw import Pose2, PoseSigma, Twist2, compiled
from states.localization.filter.measurement_sources import (
    Measurement,
    MeasurementSource,
    ProcessNoise,
    Verdict,
)
from states.localization.filter.planar import SLIPPING, PlanarFilter, planar_config
from states.maps import Array

GYRO_NOISE = ProcessNoise(
    SLIPPING.per_second,
    (*SLIPPING.per_metre[:2], 1e-5, *SLIPPING.per_metre[3:]),
    (*SLIPPING.per_radian[:2], 1e-4, *SLIPPING.per_radian[3:]),
)
"""Process noise by slip where a gyroscope measures the turn."""
STANDING, MOVING = (1e-3, 1e-3), (5e-3, 1e-2)
"""Standard deviations of wheel velocities, m/s and rad/s; slip is process noise."""
TURNING = 5e-3
"""Standard deviation of the gyroscope's rate, rad/s."""
NOWHERE = 1e-2
"""Information added so that a match without any can be inverted, 1/m2 and 1/rad2."""
MATCHES_ALIKE = 0.3
"""Correlation time of match errors on a scanned map, s: its walls are half a cell off."""
TRACKERS_ALIKE = 5.0
"""Correlation time of tracker errors, s: each acquisition has an offset of its own."""
UNKNOWN = PoseSigma(math.inf, math.inf)
"""Standard deviations while the pose is unknown."""
_STANDING, _MOVING, _TURNING = (
    np.diag([speed**2, speed**2, turn**2])
    for speed, turn in (STANDING, MOVING, (MOVING[0], TURNING))
)
_NOWHERE = NOWHERE * np.eye(3)
POSE = ("x", "y", "yaw")
SCANS = ("scan", "leaping scan")
"""Matches near their prediction, and those that leap away from it: gated at first."""


class Fusion:
    """The filter of one base; `rough_map`: walls are known to half a cell only."""

    def __init__(self, *, gyro: bool, rough_map: bool) -> None:
        alike = MATCHES_ALIKE if rough_map else 0.0
        self._filter = PlanarFilter(
            planar_config(
                MeasurementSource("start", POSE, gate=None),
                MeasurementSource("wheels", ("vx", "vy", "wz"), gate=None),
                MeasurementSource("scan", POSE, gate=None, correlation=alike),
                MeasurementSource(
                    "leaping scan", POSE, reacquire_after=3, correlation=alike, yields_to=SCANS[:1]
                ),
                MeasurementSource("trackers", POSE, yields_to=SCANS, correlation=TRACKERS_ALIKE),
                noise=GYRO_NOISE if gyro else SLIPPING,
            )
        )
        self.begun = False

    @property
    def velocity(self) -> Twist2:
        """The newest velocity, in the base frame."""
        return self._filter.twist

    def begin(
        self, stamp_ns: int, map_from_base: Pose2, covariance: Array, moving: Twist2 | None
    ) -> None:
        """Restart with this pose; the velocity is unknown if None."""
        self._filter.reset()
        self._correct(stamp_ns, "start", map_from_base, covariance)
        if moving is not None:
            self.wheels(stamp_ns, moving, standing=False)
        self.begun = True

    def wheels(
        self,
        stamp_ns: int,
        velocity: Twist2,
        *,
        standing: bool,
        rate: float | None = None,
    ) -> None:
        """Correct by the velocity in the base frame; a gyroscope's `rate`, rad/s, replaces wz."""
        wz, covariance = velocity.wz, _STANDING if standing else _MOVING
        if rate is not None and not standing:
            wz, covariance = rate, _TURNING
        values = velocity.vx, velocity.vy, wz
        self._filter.correct(Measurement(stamp_ns, "wheels", values, covariance))

    def scan(
        self, stamp_ns: int, map_from_base: Pose2, information: Array, *, gated: bool
    ) -> Verdict:
        """Correct by a match and its information (3, 3); beyond the gate it must be repeated."""
        covariance = inverse(information + _NOWHERE)
        return self._correct(stamp_ns, SCANS[gated], map_from_base, covariance)

    def trackers(self, stamp_ns: int, map_from_base: Pose2, sigma: PoseSigma) -> Verdict:
        """Correct by a pose from trackers."""
        return self._correct(stamp_ns, "trackers", map_from_base, covariance_of(sigma))

    def at(self, stamp_ns: int) -> tuple[Pose2, Array] | None:
        """map_from_base and its covariance (3, 3) at a stamp; None before the history."""
        known = self._filter.at(stamp_ns)
        if known is None:
            return None
        mean, covariance = known
        return Pose2(float(mean[0]), float(mean[1]), float(mean[2])), covariance[:3, :3]

    def _correct(self, stamp_ns: int, source: str, pose: Pose2, covariance: Array) -> Verdict:
        values = (pose.x, pose.y, pose.yaw)
        return self._filter.correct(Measurement(stamp_ns, source, values, covariance))


def covariance_of(sigma: PoseSigma) -> Array:
    """Covariance (3, 3) of x, y and yaw, equal in all directions of the plane."""
    place, yaw = sigma.position**2, sigma.yaw**2
    return np.array([[place, 0.0, 0.0], [0.0, place, 0.0], [0.0, 0.0, yaw]])


def sigma_of(covariance: Array) -> PoseSigma:
    """Standard deviations of a pose (3, 3): in the worst direction of the plane, and of the yaw.

    The worst variance is the larger eigenvalue of the 2x2 block of x and y.
    """
    return PoseSigma(*_deviations(covariance))


@compiled
def _deviations(covariance: Array) -> tuple[float, float]:
    xx, xy, yy, yaw = covariance[0, 0], covariance[0, 1], covariance[1, 1], covariance[2, 2]
    worst = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)
    return math.sqrt(worst if worst > 0.0 else 0.0), math.sqrt(yaw if yaw > 0.0 else 0.0)


def inverse(matrix: Array) -> Array:
    """Inverse of a covariance, or of a regular information matrix."""
    return np.asarray(np.linalg.inv(matrix), np.float64)
