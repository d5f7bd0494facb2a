"""Trajectories: a path with its timing (R45)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from states.arm.kinematics import Array
from states.arm.motion.joint_path import JointPath


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
