"""Four Mecanum wheels: their rates and the motion of the base, either way; how far it has come.

Wheels are front left, front right, rear left, rear right; rad/s, positive is ahead. Their rollers
touch the floor along the diagonals of the base, so that with r the radius and L half the wheelbase
and half the track

    r w = vx - vy - L wz,  vx + vy + L wz,  vx + vy - L wz,  vx - vy + L wz

(Taheri, Qiao, Ghaeminezhad 2015). Four rates stand for three velocities: what is left over, front
pair less rear pair, is 0 for a base whose wheels roll; it tells of slip, and of a wheel that lies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from hw.geometry import Pose2, Twist2, wrap
from hw.robot import BaseModel
from hw.samples import Odometry

Rates = tuple[float, float, float, float]
MEMORY_S = 0.5
"""Slip is remembered so long, s."""
_STRAIGHT = 1e-4
"""Turns below this, rad, are summed by the first terms of their series."""


@dataclass(frozen=True, slots=True)
class Mecanum:
    """The geometry: m and rad/s."""

    radius: float
    lever: float
    max_rate: float

    @classmethod
    def of(cls, model: BaseModel) -> Mecanum:
        """That of a robot."""
        lever = model.half_wheelbase + model.half_track
        return cls(model.wheel_radius, lever, model.max_wheel_rate)

    def rates(self, velocity: Twist2) -> Rates:
        """The wheels for a velocity of the base, by one share slower if they cannot follow."""
        vx, vy, turn = velocity.vx, velocity.vy, self.lever * velocity.wz
        rims = (vx - vy - turn, vx + vy + turn, vx + vy - turn, vx - vy + turn)
        fastest = max(map(abs, rims)) / self.radius
        share = min(1.0, self.max_rate / fastest) if fastest > 0.0 else 1.0
        a, b, c, d = (share * rim / self.radius for rim in rims)
        return a, b, c, d

    def velocity(self, rates: Rates) -> Twist2:
        """The base's velocity that fits the rates best."""
        a, b, c, d = rates
        quarter = 0.25 * self.radius
        return Twist2(
            quarter * (a + b + c + d),
            quarter * (b + c - a - d),
            quarter * (b + d - a - c) / self.lever,
        )

    def slip(self, rates: Rates) -> float:
        """What no motion of the base explains, m/s at the rims: as uncertain as one wheel is."""
        a, b, c, d = rates
        return 0.5 * self.radius * (a + b - c - d)

    def brakes(self, deceleration: float) -> float:
        """The wheels' ramp, rad/s2, with which the base brakes no weaker in any direction.

        On the diagonal two wheels do all, and turn faster than straight ahead by the root of 2.
        """
        return math.sqrt(2.0) * deceleration / self.radius


class Reckoning:
    """Where the wheels have taken the base, odom_from_base, and how sure their velocity is."""

    def __init__(self, wheels: Mecanum, quantum: float) -> None:
        """`quantum` is the least step of a measured rate, rad/s."""
        self._wheels = wheels
        self._least = (quantum * wheels.radius) ** 2 / 12.0
        self._slip = 0.0
        self._pose = Pose2(0.0, 0.0)
        self._velocity = Twist2(0.0)

    def move(self, rates: Rates, span_s: float) -> Odometry:
        """The wheels have these rates, span_s after they had the last ones."""
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
    """The rates with one that is unknown taken from the other three; None: more are unknown."""
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
    """Where a constant velocity of the base takes it: along an arc."""
    turn = velocity.wz * span_s
    if abs(turn) < _STRAIGHT:
        ahead, aside = 1.0 - turn * turn / 6.0, 0.5 * turn
    else:
        ahead, aside = math.sin(turn) / turn, (1.0 - math.cos(turn)) / turn
    x, y = velocity.vx * span_s, velocity.vy * span_s
    x, y = pose.transform(ahead * x - aside * y, aside * x + ahead * y)
    return Pose2(x, y, wrap(pose.yaw + turn))
