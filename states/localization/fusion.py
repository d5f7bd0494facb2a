"""The Kalman filter of the base with its sources: wheels, matched scans, trackers."""

from __future__ import annotations

import math

import numpy as np

from hw.geometry import Pose2, Twist2
from hw.samples import PoseSigma
from states.localization.planar import SLIPPING, PlanarFilter, planar_config
from states.localization.sources import Measurement, MeasurementSource, ProcessNoise, Verdict
from states.maps.distance import Array

GYRO_NOISE = ProcessNoise(
    SLIPPING.per_second,
    (*SLIPPING.per_metre[:2], 1e-5, *SLIPPING.per_metre[3:]),
    (*SLIPPING.per_radian[:2], 1e-4, *SLIPPING.per_radian[3:]),
)
"""Slip where a gyroscope knows the turn."""
STANDING, MOVING = (1e-3, 1e-3), (5e-3, 1e-2)
"""What wheels tell wrongly, m/s and rad/s; of slip the process noise knows."""
TURNING = 5e-3
"""What a gyroscope tells wrongly, rad/s."""
NOWHERE = 1e-2
"""Information that stands for none, 1/m2 and 1/rad2."""
MATCHES_ALIKE = 0.3
"""Correlation time of match errors on a scanned map, s: its walls are half a cell off."""
TRACKERS_ALIKE = 5.0
"""For so long the errors of trackers stay alike, s: each acquisition has an offset of its own."""
UNKNOWN = PoseSigma(math.inf, math.inf)
"""Standard deviations while the pose is unknown."""
POSE = ("x", "y", "yaw")
SCANS = ("scan", "leaping scan")
"""Matches; those that leap away from the prediction are refused at first."""


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
        """The newest, in the base frame."""
        return self._filter.twist

    def begin(
        self, stamp_ns: int, map_from_base: Pose2, covariance: Array, moving: Twist2 | None
    ) -> None:
        """Forget all, and begin with this pose; with any velocity if that is not known."""
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
        """The velocity in the base frame; `rate` is the gyroscope's, which knows turns better."""
        speed, turn = STANDING if standing else MOVING
        wz = velocity.wz
        if rate is not None and not standing:
            wz, turn = rate, TURNING
        values, variances = (velocity.vx, velocity.vy, wz), (speed**2, speed**2, turn**2)
        self._filter.correct(Measurement(stamp_ns, "wheels", values, variances))

    def scan(
        self, stamp_ns: int, map_from_base: Pose2, information: Array, *, gated: bool
    ) -> Verdict:
        """A match and its information (3, 3); is it to repeat itself before it is believed?"""
        covariance = inverse(information + NOWHERE * np.eye(3))
        return self._correct(stamp_ns, SCANS[gated], map_from_base, covariance)

    def trackers(self, stamp_ns: int, map_from_base: Pose2, sigma: PoseSigma) -> Verdict:
        """A pose by trackers."""
        return self._correct(stamp_ns, "trackers", map_from_base, covariance_of(sigma))

    def at(self, stamp_ns: int) -> tuple[Pose2, Array] | None:
        """map_from_base and its covariance (3, 3) at a stamp; None before all that is known."""
        known = self._filter.at(stamp_ns)
        if known is None:
            return None
        x, y, yaw = known[0][:3].tolist()
        return Pose2(x, y, yaw), known[1][:3, :3]

    def _correct(self, stamp_ns: int, source: str, pose: Pose2, covariance: Array) -> Verdict:
        values = (pose.x, pose.y, pose.yaw)
        return self._filter.correct(Measurement(stamp_ns, source, values, covariance))


def covariance_of(sigma: PoseSigma) -> Array:
    """Of x, y and yaw (3, 3), with no direction preferred."""
    place, yaw = sigma.position**2, sigma.yaw**2
    return np.array([[place, 0.0, 0.0], [0.0, place, 0.0], [0.0, 0.0, yaw]])


def sigma_of(covariance: Array) -> PoseSigma:
    """Standard deviations of a pose (3, 3): in the worst direction of the plane, and of the yaw.

    The worst variance is the larger eigenvalue of the 2x2 block of x and y.
    """
    (xx, xy, _), (_, yy, _), (_, _, yaw) = covariance.tolist()
    worst = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)
    return PoseSigma(math.sqrt(worst), math.sqrt(yaw))


def inverse(matrix: Array) -> Array:
    """Of a covariance, or of an information that is nowhere zero."""
    return np.asarray(np.linalg.inv(matrix), np.float64)
