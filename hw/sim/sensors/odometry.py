"""Wheel odometry: the motion of the wheels, whether the body followed or slipped."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hw.geometry import Pose2, Twist2, wrap
from hw.jit import compiled, example
from hw.model import OdometryErrors, OdometryModel
from hw.samples import Odometry, Sample
from hw.sim.sensors.streams import Normals, Rhythm
from hw.sim.sensors.track import PastPoses, Track, TrackPose, held

Floats = NDArray[np.float64]


class SimOdometry:
    """Encoders: odom_from_base, and the mean velocity since the sample before."""

    signals: tuple[str, ...] = ("base.odometry",)

    def __init__(
        self, model: OdometryModel, wheels: Track, errors: OdometryErrors, seed: int
    ) -> None:
        self._wheels = wheels
        self._period_ns = round(1e9 / model.rate)
        self._rhythm = Rhythm(model.rate, seed, "base.odometry", round(errors.delay * 1e9))
        self._noise = Normals(seed, "base.odometry", 3)
        self._sigma = np.array([errors.noise, errors.noise, errors.turn_noise])
        x, y, yaw = wheels.held(0)
        start = Pose2(x, y, yaw).inverse()
        self._odom_from_map = start.x, start.y, start.yaw

    def samples(self, now_ns: int) -> list[Sample]:
        """Samples that have arrived since the last call."""
        if now_ns < self._rhythm.next_ns:
            return []
        due = self._rhythm.due(now_ns)
        return [Sample("base.odometry", stamp, self._reading(n, stamp)) for n, stamp in due]

    def _reading(self, number: int, stamp_ns: int) -> Odometry:
        noise, start = self._noise.row(number), self._odom_from_map
        x, y, yaw, vx, vy, wz = reading(
            self._wheels.past, stamp_ns, self._period_ns, start, self._sigma, noise
        )
        return Odometry(Pose2(x, y, wrap(yaw)), Twist2(vx, vy, wz))


@compiled
def reading(
    past: PastPoses,
    stamp_ns: int,
    period_ns: int,
    odom_from_map: TrackPose,
    sigma: Floats,
    noise: Floats,
) -> tuple[float, float, float, float, float, float]:
    """The pose of wheels by their track (`Track`), its yaw not wrapped, and their velocity.

    Args:
        past: of the track.
        stamp_ns: of the reading.
        period_ns: since the reading before.
        odom_from_map: x, y, m, and yaw, rad.
        sigma: (3,) standard deviations of vx, vy, m/s, and wz, rad/s.
        noise: (3,) standard normal.

    Returns:
        x, y, m, and yaw, rad, in the frame odom; then the mean velocity of a uniform motion since
        the reading before, vx, vy, m/s, and wz, rad/s, in the base frame at half of it.
    """
    now, before = held(past, stamp_ns), held(past, stamp_ns - period_ns)
    x, y, yaw = odom_from_map
    cos, sin = math.cos(yaw), math.sin(yaw)
    at_x, at_y = x + cos * now[0] - sin * now[1], y + sin * now[0] + cos * now[1]
    if before == now:  # wheels that stand have no noise
        return at_x, at_y, now[2] + yaw, 0.0, 0.0, 0.0
    turn, span = now[2] - before[2], period_ns * 1e-9
    dx, dy, half = now[0] - before[0], now[1] - before[1], before[2] + 0.5 * turn
    c, s = math.cos(half), math.sin(half)
    return (
        at_x,
        at_y,
        now[2] + yaw,
        (c * dx + s * dy) / span + sigma[0] * noise[0],
        (c * dy - s * dx) / span + sigma[1] * noise[1],
        turn / span + sigma[2] * noise[2],
    )


@example
def _example() -> None:
    three = np.zeros(3)
    reading((np.zeros((1, 4)), 0, 1), 0, 1, (0.0, 0.0, 0.0), three, three)
