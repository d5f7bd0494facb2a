"""Trajectories (a path with its timing) and the limits they keep (R45)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from states.arm.kinematics import Array
from states.arm.motion.joint_path import JointPath


@dataclass(frozen=True, slots=True)
class ArmLimits:
    """Limits per joint, rad/s, rad/s2, rad/s3, and of every point of the arm, m/s; inf means none.

    The points are those of `KinematicChain.points`.
    """

    speed: tuple[float, ...]
    acceleration: tuple[float, ...]
    tool_speed: float = math.inf
    jerk: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration", "jerk"):
            values = getattr(self, name)
            if values is not None and not (len(values) == 6 and all(v > 0.0 for v in values)):
                raise ValueError(f"arm limits: {name} is {values}; six values above 0 are needed")
        if not self.tool_speed > 0.0:
            raise ValueError(f"arm limits: tool_speed is {self.tool_speed}; it must be above 0")

    @classmethod
    def even(
        cls,
        speed: tuple[float, ...],
        acceleration: float,
        tool_speed: float = math.inf,
        jerk: float | None = None,
    ) -> ArmLimits:
        """The same acceleration and jerk for every joint."""
        return cls(speed, (acceleration,) * 6, tool_speed, None if jerk is None else (jerk,) * 6)


@dataclass(frozen=True, slots=True)
class SlowZone:
    """A ball in the rover frame, m, in which the tcp moves at `speed`, m/s, at most."""

    x: float
    y: float
    z: float
    radius: float
    speed: float

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """True for points (..., 3) inside."""
        away = np.linalg.norm(points - (self.x, self.y, self.z), axis=-1)
        return np.asarray(away <= self.radius)


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """A path with its timing: arc length, its rate and its acceleration at times[k], s.

    All are (n,); between two times the jerk of the arc length, (n - 1,), is constant.
    """

    path: JointPath
    times: Array
    places: Array
    rates: Array
    accelerations: Array
    jerks: Array

    @property
    def duration(self) -> float:
        """Time from first to last knot, s."""
        return float(self.times[-1] - self.times[0])

    def then(self, other: Trajectory) -> Trajectory:
        """This trajectory, then at once another that begins where it ends; both rest there."""
        if not len(self.path.pieces):
            return other
        if not len(other.path.pieces):
            return self
        return Trajectory(
            self.path.then(other.path),
            np.concatenate([self.times[:-1], self.times[-1] - other.times[0] + other.times]),
            np.concatenate([self.places[:-1], self.path.length + other.places]),
            np.concatenate([self.rates[:-1], other.rates]),
            np.concatenate([self.accelerations[:-1], other.accelerations]),
            np.concatenate([self.jerks, other.jerks]),
        )

    def along(self, t: Array) -> tuple[Array, Array, Array]:
        """Arc length, rate and acceleration at times t (n,); at rest outside the motion."""
        last = max(len(self.times) - 2, 0)
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, last)
        tau = np.clip(t, self.times[0], self.times[-1]) - self.times[k]
        jerk = self.jerks[k] if len(self.jerks) else np.zeros(len(t))
        a0, v0 = self.accelerations[k], self.rates[k]
        s = self.places[k] + tau * (v0 + tau * (a0 / 2.0 + tau * jerk / 6.0))
        v = np.maximum(v0 + tau * (a0 + tau * jerk / 2.0), 0.0)
        moving = (t > self.times[0]) & (t < self.times[-1])
        return s, np.where(moving, v, 0.0), np.where(moving, a0 + tau * jerk, 0.0)

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Joints, velocities and accelerations (n, 6) each at times t (n,)."""
        s, v, a = self.along(np.asarray(t, dtype=np.float64))
        q, slope, bend = self.path.at(s)
        return q, slope * v[:, None], slope * a[:, None] + bend * (v * v)[:, None]


def with_rates(path: JointPath, times: Array, places: Array, rates: Array) -> Trajectory:
    """A trajectory with constant acceleration along the path between knots, from its rates."""
    gains = np.diff(rates) / np.diff(times)
    accelerations = np.concatenate([gains, [0.0]])
    return Trajectory(path, times, places, rates, accelerations, np.zeros(len(gains)))
