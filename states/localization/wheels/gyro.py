"""The mean rate of turn between two wheel samples, measured by the gyroscope."""

from __future__ import annotations

import math

SETTLE = 1.0
"""Time constant with which the bias follows the reading of a standing base, s."""
OLDEST = 0.1
"""Greatest age of readings that are used, s."""
STARTS_AT = 0.1
"""Largest rate that may be bias, rad/s; above it the base is being turned."""


class Gyro:
    """Mean rates less a bias that is estimated while the wheels stand."""

    def __init__(self) -> None:
        self._sum = 0.0
        self._count = 0
        self._stamp_ns: int | None = None
        self.bias = 0.0

    def add_reading(self, stamp_ns: int, rate: float, standing: bool) -> None:
        """Take a rate of turn about the vertical, rad/s."""
        if self._stamp_ns is not None and stamp_ns <= self._stamp_ns:
            return
        if standing and self._stamp_ns is not None and abs(rate) < STARTS_AT:
            elapsed = (stamp_ns - self._stamp_ns) * 1e-9
            self.bias += (1.0 - math.exp(-elapsed / SETTLE)) * (rate - self.bias)
        self._stamp_ns = stamp_ns
        self._sum += rate
        self._count += 1

    def pop_mean_rate(self, stamp_ns: int) -> float | None:
        """The mean rate since the last call, less the bias, rad/s; None without a fresh reading."""
        total, count = self._sum, self._count
        self._sum, self._count = 0.0, 0
        if not count or self._stamp_ns is None or stamp_ns - self._stamp_ns > OLDEST * 1e9:
            return None
        return total / count - self.bias
