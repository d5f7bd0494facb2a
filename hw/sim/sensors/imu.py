"""An inertial measurement unit in base_link: angular rates and specific forces of the body."""

from __future__ import annotations

import math

from hw.model import ImuErrors, ImuModel
from hw.samples import ImuReading, Sample
from hw.sim.sensors.streams import Normals, Rhythm
from hw.sim.sensors.track import Track

GRAVITY = 9.81
"""Specific force of an upright unit at rest, m/s2."""
_SMOOTH_NS = 20_000_000
"""Half the window of the unit's own averaging filter, ns."""


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
        self._walk = Normals(seed, "base.imu/walk", 3)
        biases = Normals(seed, "base.imu/bias", 6).row(0)
        self._rate_bias = [errors.rate_bias * b for b in biases[:3]]
        self._bias = [errors.bias * b for b in biases[3:]]
        self._walked, self._wandered = 0, [0.0, 0.0, 0.0]

    def samples(self, now_ns: int) -> list[Sample]:
        """Samples that have arrived since the last call."""
        due = self._rhythm.due(now_ns, self._body.oldest_ns)
        return [Sample("base.imu", stamp, self._reading(n, stamp)) for n, stamp in due]

    def _reading(self, number: int, stamp_ns: int) -> ImuReading:
        past = self._body
        a, b = past.held(stamp_ns - 2 * _SMOOTH_NS), past.held(stamp_ns - _SMOOTH_NS)
        c = past.held(stamp_ns)
        h = _SMOOTH_NS * 1e-9
        ax, ay = ((a[k] - 2.0 * b[k] + c[k]) / (h * h) for k in (0, 1))
        cos, sin = math.cos(b[2]), math.sin(b[2])
        exact = (0.0, 0.0, (c[2] - b[2]) / h, cos * ax + sin * ay, cos * ay - sin * ax, GRAVITY)
        errors, noise = self._errors, self._noise.row(number)
        bias = [*self._rate_bias_at(number), *self._bias]
        sigma = [errors.rate_noise] * 3 + [errors.noise] * 3
        values = [e + o + s * n for e, o, s, n in zip(exact, bias, sigma, noise, strict=True)]
        return ImuReading((values[0], values[1], values[2]), (values[3], values[4], values[5]))

    def _rate_bias_at(self, number: int) -> list[float]:
        """Bias of the rates, rad/s: a random walk of one step per sample, whether read or not."""
        step = self._errors.rate_walk * math.sqrt(self._period)
        for n in range(self._walked, number):
            row = self._walk.row(n)
            self._wandered = [w + step * r for w, r in zip(self._wandered, row, strict=True)]
        self._walked = number
        return [b + w for b, w in zip(self._rate_bias, self._wandered, strict=True)]
