"""The Kalman filter of a base on the floor: pose in the world, velocity in the body.

Six entries: x, y in m, yaw in rad, vx, vy in m/s, wz in rad/s. The velocity is part of the state,
so wheels and gyroscopes are sources like all others, each with its axes and its gate, and the pose
can be predicted between measurements. Slip is process noise of the pose, along the body's axes, per
metre and per radian: wheels measure their own velocity well while the body slides.
"""

from __future__ import annotations

from hw import Pose2, Twist2
from states.localization.filter.filter_kernels import Array, planar_step
from states.localization.filter.kalman import KalmanFilter
from states.localization.filter.measurement_sources import (
    FilterConfig,
    MeasurementSource,
    ProcessNoise,
)

AXES = ("x", "y", "yaw", "vx", "vy", "wz")

UNKNOWN = (1e6, 1e6, 1e3, 3.0, 3.0, 3.0)
"""Standard deviations before the first measurement: any pose, any velocity of a base."""

SLIPPING = ProcessNoise(
    # a base that stands keeps its velocity to 3 cm/s in 20 ms, one that drives at 1 m/s to 10 cm/s
    per_second=(1e-6, 1e-6, 1e-7, 0.05, 0.05, 0.05),
    # 3 cm and 1.3 degrees after one metre, 2 cm and 1.8 degrees after one radian
    per_metre=(1e-3, 1e-3, 5e-4, 0.5, 0.5, 0.5),
    per_radian=(5e-4, 5e-4, 1e-3, 0.1, 0.1, 1.0),
)
"""Mecanum wheels on a smooth floor, without a gyroscope."""


class PlanarFilter(KalmanFilter):
    """Pose and velocity of a base; `covariance` is (6, 6) in the order of AXES."""

    def __init__(self, config: FilterConfig) -> None:
        super().__init__(config, AXES, planar_step)

    @property
    def pose(self) -> Pose2:
        """map_from_base at the newest measurement."""
        return _pose(self._newest()[0])

    @property
    def twist(self) -> Twist2:
        """Velocity in the base frame at the newest measurement."""
        _, _, _, vx, vy, wz = self._newest()[0].tolist()
        return Twist2(vx, vy, wz)


def planar_config(
    *sources: MeasurementSource,
    noise: ProcessNoise = SLIPPING,
    initial: tuple[float, ...] = UNKNOWN,
    history: float = 1.0,
) -> FilterConfig:
    """A configuration of these sources, with the planar defaults."""
    return FilterConfig(sources, noise, initial, history)


def _pose(mean: Array) -> Pose2:
    x, y, yaw = mean[:3].tolist()
    return Pose2(x, y, yaw)
