"""An inertial measurement unit in base_link: angular rates and specific forces of the body."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hw.jit import compiled, example
from hw.model import ImuErrors, ImuModel
from hw.samples import ImuReading, Sample
from hw.sim.sensors.streams import Normals, Rhythm
from hw.sim.sensors.track import PastPoses, Track, held

GRAVITY = 9.81
"""Specific force of an upright unit at rest, m/s2."""
_SMOOTH_NS = 20_000_000
"""Half the window of the unit's own averaging filter, ns."""
Floats = NDArray[np.float64]


class SimImu:
    """Mean angular rate over the last 20 ms, and acceleration over the last 40 ms.

    An upright unit measures specific force, so at rest it reads 9.81 m/s2 upwards. With poses
    a, b, c at 2h, h and 0 before the stamp, the acceleration is (a - 2b + c) / h^2.
    """

    signals: tuple[str, ...] = ("base.imu",)

    def __init__(self, model: ImuModel, body: Track, errors: ImuErrors, seed: int) -> None:
        self._body, self._errors, self._period = body, errors, 1.0 / model.rate
        self._rhythm = Rhythm(model.rate, seed, "base.imu", round(errors.delay * 1e9))
        self._noise = Normals(seed, "base.imu", 6)
        self._walk, self._walked = Normals(seed, "base.imu/walk", 3), 0
        self._step = errors.rate_walk * math.sqrt(self._period)
        drawn = Normals(seed, "base.imu/bias", 6).row(0)
        self._bias = np.array([errors.rate_bias] * 3 + [errors.bias] * 3) * drawn
        self._wandered = np.zeros(3)
        self._sigma = np.array([errors.rate_noise] * 3 + [errors.noise] * 3)

    def samples(self, now_ns: int) -> list[Sample]:
        """Samples that have arrived since the last call."""
        if now_ns < self._rhythm.next_ns:
            return []
        due = self._rhythm.due(now_ns)
        return [Sample("base.imu", stamp, self._reading(n, stamp)) for n, stamp in due]

    def _reading(self, number: int, stamp_ns: int) -> ImuReading:
        for n in range(self._walked, number):  # one step per sample, whether read or not
            self._wandered += self._step * self._walk.row(n)
        self._walked = number
        noise, wandered = self._noise.row(number), self._wandered
        rx, ry, rz, ax, ay, az = reading(
            self._body.past, stamp_ns, self._bias, wandered, self._sigma, noise
        )
        return ImuReading((rx, ry, rz), (ax, ay, az))


@compiled
def reading(
    past: PastPoses, stamp_ns: int, bias: Floats, wandered: Floats, sigma: Floats, noise: Floats
) -> tuple[float, float, float, float, float, float]:
    """Rates, rad/s, and accelerations, m/s2, from a track (`Track`).

    Args:
        past: of the track.
        stamp_ns: of the reading.
        bias: (6,) of the rates and accelerations.
        wandered: (3,) how far the rates' bias has wandered, rad/s.
        sigma: (6,) standard deviations.
        noise: (6,) standard normal.
    """
    a = held(past, stamp_ns - 2 * _SMOOTH_NS)
    b = held(past, stamp_ns - _SMOOTH_NS)
    c = held(past, stamp_ns)
    h = _SMOOTH_NS * 1e-9
    ax, ay = (a[0] - 2.0 * b[0] + c[0]) / (h * h), (a[1] - 2.0 * b[1] + c[1]) / (h * h)
    cos, sin = math.cos(b[2]), math.sin(b[2])
    return (
        0.0 + (bias[0] + wandered[0]) + sigma[0] * noise[0],
        0.0 + (bias[1] + wandered[1]) + sigma[1] * noise[1],
        (c[2] - b[2]) / h + (bias[2] + wandered[2]) + sigma[2] * noise[2],
        cos * ax + sin * ay + bias[3] + sigma[3] * noise[3],
        cos * ay - sin * ax + bias[4] + sigma[4] * noise[4],
        GRAVITY + bias[5] + sigma[5] * noise[5],
    )


@example
def _example() -> None:
    six = np.zeros(6)
    reading((np.zeros((1, 4)), 0, 1), 0, six, np.zeros(3), six, six)
