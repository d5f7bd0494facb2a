"""Wheel odometry: the motion of the wheels, whether the body followed or slipped."""

from __future__ import annotations

import math

from hw.geometry import Pose2, Twist2, wrap
from hw.model import OdometryErrors, OdometryModel
from hw.samples import Odometry, Sample
from hw.sim.sensors.streams import Normals, Rhythm
from hw.sim.sensors.track import Track, TrackPose


class SimOdometry:
    """Encoders: odom_from_base, and the mean velocity since the sample before."""

    signals: tuple[str, ...] = ("base.odometry",)

    def __init__(
        self, model: OdometryModel, wheels: Track, errors: OdometryErrors, seed: int
    ) -> None:
        self._wheels, self._errors = wheels, errors
        self._period_ns = round(1e9 / model.rate)
        self._rhythm = Rhythm(model.rate, seed, "base.odometry", round(errors.delay * 1e9))
        self._noise = Normals(seed, "base.odometry", 3)
        x, y, yaw = wheels.held(0)
        self._odom_from_map = Pose2(x, y, yaw).inverse()

    def samples(self, now_ns: int) -> list[Sample]:
        """Samples that have arrived since the last call."""
        due = self._rhythm.due(now_ns, self._wheels.oldest_ns)
        return [Sample("base.odometry", stamp, self._reading(n, stamp)) for n, stamp in due]

    def _reading(self, number: int, stamp_ns: int) -> Odometry:
        before, now = self._wheels.held(stamp_ns - self._period_ns), self._wheels.held(stamp_ns)
        x, y = self._odom_from_map.transform(now[0], now[1])
        pose = Pose2(x, y, wrap(now[2] + self._odom_from_map.yaw))
        if before == now:
            return Odometry(pose, Twist2(0.0))  # wheels that stand have no noise
        vx, vy, wz = _mean_velocity(before, now, self._period_ns * 1e-9)
        a, b, c = self._noise.row(number)
        sigma = self._errors.noise
        return Odometry(
            pose, Twist2(vx + sigma * a, vy + sigma * b, wz + self._errors.turn_noise * c)
        )


def _mean_velocity(before: TrackPose, now: TrackPose, span: float) -> tuple[float, float, float]:
    """Mean velocity of a uniform motion, in the base frame at half of it."""
    turn = now[2] - before[2]
    yaw = before[2] + 0.5 * turn
    dx, dy = now[0] - before[0], now[1] - before[1]
    c, s = math.cos(yaw), math.sin(yaw)
    return (c * dx + s * dy) / span, (c * dy - s * dx) / span, turn / span
