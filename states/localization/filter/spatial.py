"""The Kalman filter of a body in space, with the state and the model of robot_localization.

Fifteen entries: position (m), roll, pitch, yaw (rad) in the world; velocity (m/s), rates of turn
(rad/s) and acceleration (m/s2) in the body. Near a pitch of 90 degrees the angles are singular.
"""

from __future__ import annotations

import math

from hw import Pose3
from states.localization.filter.filter_kernels import spatial_step
from states.localization.filter.kalman import KalmanFilter
from states.localization.filter.measurement_sources import FilterConfig

AXES = (
    *("x", "y", "z", "roll", "pitch", "yaw"),
    *("vx", "vy", "vz", "wx", "wy", "wz"),
    *("ax", "ay", "az"),
)
GRAVITY = 9.80665
"""Standard gravity, m/s2."""


class SpatialFilter(KalmanFilter):
    """Pose, velocity and acceleration of a body; `covariance` is (15, 15) in the order of AXES."""

    def __init__(self, config: FilterConfig) -> None:
        super().__init__(config, AXES, spatial_step)

    @property
    def pose(self) -> Pose3:
        """world_from_body at the newest measurement."""
        x, y, z, roll, pitch, yaw = self._newest()[0, :6].tolist()
        return Pose3.from_angles(x, y, z, (roll, pitch, yaw))


def without_gravity(
    acceleration: tuple[float, float, float], roll: float, pitch: float
) -> tuple[float, float, float]:
    """A reading without gravity, m/s2, in the body frame: R^T (0, 0, g) subtracted."""
    ax, ay, az = acceleration
    level = math.cos(pitch)
    return (
        ax + GRAVITY * math.sin(pitch),
        ay - GRAVITY * level * math.sin(roll),
        az - GRAVITY * level * math.cos(roll),
    )
