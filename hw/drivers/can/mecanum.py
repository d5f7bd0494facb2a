"""Kinematics and odometry of four Mecanum wheels.

Wheels are front left, front right, rear left, rear right; rates in rad/s, positive drives ahead.
The rollers touch the floor at 45 degrees to the wheel's axis, so a wheel at (x, y) fixes only the
velocity component of the base along its rollers' axis. With the radius r, and L half the wheelbase
plus half the track, the rates w are

    r w = vx - vy - L wz,  vx + vy + L wz,  vx + vy - L wz,  vx - vy + L wz

(Taheri, Qiao, Ghaeminezhad 2015). Four rates overdetermine three velocities. Their columns are
orthogonal, so the least-squares inverse is a quarter of the transpose. The residual, front pair
less rear pair, is 0 while all wheels roll; it shows slip, and a wheel that reports wrongly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from hw.geometry import Pose2, Twist2, wrap
from hw.model import BaseModel
from hw.samples import Odometry

Rates = tuple[float, float, float, float]
MEMORY_S = 0.5
"""Time constant of the averaged residual, s."""
_STRAIGHT = 1e-4
"""Rotations below this, rad, use the first terms of their series."""


@dataclass(frozen=True, slots=True)
class Mecanum:
    """The geometry: m and rad/s.

    Four wheels without rollers are driven alike, with half the track as the lever; they do not go
    `sideways`, so that what their rates say of it is slip.
    """

    radius: float
    lever: float
    max_rate: float
    sideways: bool = True

    @classmethod
    def of(cls, model: BaseModel) -> Mecanum:
        """The geometry of a robot.

        Raises:
            ValueError: its file does not say how fast the wheels turn.
        """
        if model.max_wheel_rate is None:
            raise ValueError("the robot file has no base.max_wheel_rate, which the drives need")
        return cls(model.wheel_radius, model.lever, model.max_wheel_rate, model.sideways)

    def rates(self, velocity: Twist2) -> Rates:
        """Wheel rates for a velocity of the base, scaled down together to the fastest rate."""
        vx, vy, turn = velocity.vx, velocity.vy, self.lever * velocity.wz
        rims = (vx - vy - turn, vx + vy + turn, vx + vy - turn, vx - vy + turn)
        fastest = max(map(abs, rims)) / self.radius
        share = min(1.0, self.max_rate / fastest) if fastest > 0.0 else 1.0
        a, b, c, d = (share * rim / self.radius for rim in rims)
        return a, b, c, d

    def velocity(self, rates: Rates) -> Twist2:
        """The velocity of the base that fits the rates best (least squares)."""
        a, b, c, d = rates
        quarter = 0.25 * self.radius
        return Twist2(
            quarter * (a + b + c + d),
            quarter * (b + c - a - d) if self.sideways else 0.0,
            quarter * (b + d - a - c) / self.lever,
        )

    def slip(self, rates: Rates) -> float:
        """The residual of the rates, m/s at the rims.

        Independent errors of the four rims with standard deviation s give it the same s.
        """
        a, b, c, d = rates
        return 0.5 * self.radius * (a + b - c - d)

    def brakes(self, deceleration: float) -> float:
        """The wheels' ramp, rad/s2, that brakes the base at least this hard in any direction.

        On the diagonal vx = vy = v / sqrt(2) only two wheels turn, with r w = sqrt(2) v.
        """
        return math.sqrt(2.0) * deceleration / self.radius


class Reckoning:
    """Odometry: odom_from_base, and the uncertainty of the velocity."""

    def __init__(self, wheels: Mecanum, quantum: float) -> None:
        """`quantum` is the resolution of a measured rate, rad/s."""
        self._wheels = wheels
        self._least = (quantum * wheels.radius) ** 2 / 12.0
        self._slip = 0.0
        self._pose = Pose2(0.0, 0.0)
        self._velocity = Twist2(0.0)

    def move(self, rates: Rates, span_s: float) -> Odometry:
        """Take the rates at span_s after the last ones.

        The variance of a rim's speed is that of the quantization, q^2 / 12, plus the averaged
        square of the residual; the mean of four wheels has half their standard deviation.
        """
        before, self._velocity = self._velocity, self._wheels.velocity(rates)
        mean = Twist2(
            0.5 * (before.vx + self._velocity.vx),
            0.5 * (before.vy + self._velocity.vy),
            0.5 * (before.wz + self._velocity.wz),
        )
        self._pose = along(self._pose, mean, span_s)
        share = min(1.0, span_s / MEMORY_S)
        self._slip += share * (self._wheels.slip(rates) ** 2 - self._slip)
        half = 0.5 * math.sqrt(self._least + self._slip)
        return Odometry(self._pose, self._velocity, (half, half, half / self._wheels.lever))


def filled(rates: Sequence[float | None]) -> Rates | None:
    """The rates with an unknown one from the other three (residual 0); None if more are."""
    if sum(rate is None for rate in rates) > 1:
        return None
    known = [0.0 if rate is None else rate for rate in rates]
    if None in rates:
        place = list(rates).index(None)
        sides = [1.0, 1.0, -1.0, -1.0]
        rest = sum(side * rate for side, rate in zip(sides, known, strict=True))
        known[place] = -rest * sides[place]
    a, b, c, d = known
    return a, b, c, d


def along(pose: Pose2, velocity: Twist2, span_s: float) -> Pose2:
    """The pose after span_s at constant velocity: along an arc.

    Integrating the velocity over the rotation a gives the factors sin(a) / a along and
    (1 - cos(a)) / a across.
    """
    turn = velocity.wz * span_s
    if abs(turn) < _STRAIGHT:
        ahead, aside = 1.0 - turn * turn / 6.0, 0.5 * turn
    else:
        ahead, aside = math.sin(turn) / turn, (1.0 - math.cos(turn)) / turn
    x, y = velocity.vx * span_s, velocity.vy * span_s
    x, y = pose.transform(ahead * x - aside * y, aside * x + ahead * y)
    return Pose2(x, y, wrap(pose.yaw + turn))
