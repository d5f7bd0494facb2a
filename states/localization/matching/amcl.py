"""Adaptive Monte Carlo localization: the pose in a map, without a start pose.

Parameters have the names and meanings of ROS's amcl, except where that has bugs: `kld_z` is given
as the quantile that the formula needs; weights are products, summed as logarithms; the motion model
is the one called omni-corrected. Particles are relative to the corner of the field, so that
precision does not depend on where the map lies.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from engine.files import Angle, Length
from engine.files.declared import Fault, Range
from hw import Pose2, wrap
from states.localization.matching.particles import (
    Integers,
    bin_count,
    clusters,
    drawn,
    kld_count,
    log_likelihoods,
    moments,
    move,
    normalise,
    weigh,
)
from states.maps import Array, Field

_Share = Annotated[float, Range(0.0, 1.0)]
_Alpha = Annotated[float, Range(0.0, 10.0)]
_Count = Annotated[int, Range(1, 1_000_000)]
STREAM = 7
"""Distinguishes the particles' random numbers from those of other sources of one seed."""


@dataclass(frozen=True, slots=True)
class AmclValues:
    """The parameters of amcl.

    `kld_z` is a standard normal quantile, 2.33 for 99 %. `odom_alpha1` to 5 are variances of the
    motion model: of the turn per rad^2 turned (1) and per m^2 travelled (2), along the path per m^2
    (3), across it per m^2 (5), and of both per rad^2 (4). `resolution` is that of the likelihood
    table, m. `likelihood_power`: 1 treats beams as independent; less allows for errors that
    correlate.
    """

    min_particles: _Count = 100
    max_particles: _Count = 5000
    kld_err: Annotated[float, Range(1e-4, 1.0)] = 0.05
    kld_z: Annotated[float, Range(0.0, 10.0)] = 2.33
    laser_max_beams: _Count = 60
    laser_max_range: Annotated[Length, Range(0.1, 1000.0)] = 30.0
    laser_likelihood_max_dist: Annotated[Length, Range(0.01, 100.0)] = 2.0
    z_hit: _Share = 0.95
    z_rand: Annotated[float, Range(0.0, 1.0, above=True)] = 0.05
    sigma_hit: Annotated[Length, Range(0.001, 10.0)] = 0.1
    odom_alpha1: _Alpha = 0.05
    odom_alpha2: _Alpha = 0.02
    odom_alpha3: _Alpha = 0.05
    odom_alpha4: _Alpha = 0.02
    odom_alpha5: _Alpha = 0.05
    update_min_d: Annotated[Length, Range(0.0, 10.0)] = 0.1
    update_min_a: Annotated[Angle, Range(0.0, math.pi)] = 0.1
    resample_interval: _Count = 1
    selective_resampling: bool = True
    recovery_alpha_slow: _Share = 0.001
    recovery_alpha_fast: _Share = 0.1
    resolution: Annotated[Length, Range(0.005, 1.0)] = 0.05
    likelihood_power: Annotated[float, Range(0.0, 1.0, above=True)] = 0.3

    def faults(self) -> Iterator[Fault]:
        """Values that contradict each other, by key."""
        if self.min_particles > self.max_particles:
            yield "min_particles", f"must not be above max_particles, {self.max_particles}"
        if self.z_hit + self.z_rand > 1.0 + 1e-9:
            yield (
                "z_hit",
                f"and z_rand are {self.z_hit + self.z_rand:g} in sum; at most 1 is allowed",
            )
        if 0.0 < self.recovery_alpha_fast <= self.recovery_alpha_slow:
            yield (
                "recovery_alpha_fast",
                f"must be above recovery_alpha_slow, {self.recovery_alpha_slow:g}",
            )


@dataclass(frozen=True, slots=True, eq=False)
class ParticleEstimate:
    """The heaviest cluster of particles: mean, covariance (3, 3) in the map, and weight."""

    map_from_base: Pose2
    covariance: Array
    weight: float


class Amcl:
    """A set of particles, moved and weighed by `update`.

    Raises:
        ValueError: values that contradict each other.
    """

    def __init__(self, field: Field, values: AmclValues | None = None, seed: int = 0) -> None:
        self.values = values = values or AmclValues()
        for key, why in values.faults():
            raise ValueError(f"{key} {why}")
        self._field, self._seed = field, seed
        self._likelihoods = log_likelihoods(
            field.table,
            values.resolution,
            math.hypot(values.sigma_hit, field.sigma),
            values.laser_likelihood_max_dist,
            values.z_hit,
            values.z_rand / values.laser_max_range,
        )
        self._draws = self._updates = 0
        self._slow = self._fast = 0.0
        self._odom_from_base: Pose2 | None = None
        self._set_particles(np.zeros((1, 3)))

    @property
    def particles(self) -> Array:
        """All particles (n, 3) in the map: x, y in m, yaw in rad."""
        corner = self._field.map_from_corner
        c, s = math.cos(corner.yaw), math.sin(corner.yaw)
        x, y, yaw = self._particles.T
        turned = np.mod(yaw + corner.yaw + math.pi, 2.0 * math.pi) - math.pi
        return np.stack([corner.x + c * x - s * y, corner.y + s * x + c * y, turned], axis=1)

    @property
    def effective(self) -> float:
        """Effective number of particles, 1 / sum of squared weights."""
        return float(normalise(self._logs)[1])

    def start(self, map_from_base: Pose2, covariance: Array, count: int | None = None) -> None:
        """Spread particles about a pose; covariance (3, 3) in the map, m2 and rad2."""
        rng = self._rng()
        number = count or self.values.max_particles
        corner = self._field.map_from_corner
        pose = corner.inverse() @ map_from_base
        c, s = math.cos(-corner.yaw), math.sin(-corner.yaw)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        # eigenvectors instead of a Cholesky factor: the covariance may be singular
        values, vectors = np.linalg.eigh(turn @ covariance @ turn.T)
        spread = vectors * np.sqrt(np.maximum(values, 0.0))
        self._set_particles(
            np.array([pose.x, pose.y, pose.yaw]) + rng.standard_normal((number, 3)) @ spread.T
        )

    def start_anywhere(self, count: int | None = None) -> None:
        """Spread particles evenly over the floor and over all headings."""
        self._set_particles(self._anywhere(count or self.values.max_particles, self._rng()))

    def update(self, odom_from_base: Pose2, points: Array, force: bool = False) -> bool:
        """Take a scan, points (n, 2) in the base frame, m, with the odometry at its instant.

        Does nothing and returns False until the base has moved by `update_min_d` or `update_min_a`,
        unless forced. Without points the particles only move.
        """
        before = self._odom_from_base or odom_from_base
        moved = before.inverse() @ odom_from_base
        values = self.values
        distance, turn = math.hypot(moved.x, moved.y), abs(moved.yaw)
        small = distance < values.update_min_d and turn < values.update_min_a
        if small and not force and self._odom_from_base is not None:
            return False
        self._odom_from_base = odom_from_base
        rng = self._rng()
        self._move(moved, rng)
        if len(points) == 0:
            return True
        fit = self._weigh(points)
        self._updates += 1
        if self._updates % values.resample_interval == 0:
            self._resample(self._share_of_new(fit), rng)
        return True

    def fits(self, points: Array) -> Array:
        """Log-likelihood of a scan, points (n, 2) in the base frame, of each particle."""
        some = points[:: max(1, math.ceil(len(points) / self.values.laser_max_beams))]
        found = np.empty(len(self._particles))
        weigh(self._particles, some, self._likelihoods, self.values.resolution, found)
        return found

    def estimate(self, odom_from_base: Pose2 | None = None) -> ParticleEstimate:
        """The heaviest cluster, moved on to the given odometry."""
        weights, _ = normalise(self._logs)
        labels = clusters(self._particles)
        shares = np.bincount(labels, weights)
        heaviest = int(shares.argmax())
        mean, covariance = moments(self._particles, weights, labels == heaviest)
        corner = self._field.map_from_corner
        pose = corner @ Pose2(float(mean[0]), float(mean[1]), float(mean[2]))
        if odom_from_base is not None and self._odom_from_base is not None:
            pose = pose @ (self._odom_from_base.inverse() @ odom_from_base)
        c, s = math.cos(corner.yaw), math.sin(corner.yaw)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        if math.isfinite(covariance[2, 2]):
            covariance = turn @ covariance @ turn.T
        return ParticleEstimate(pose, covariance, float(shares[heaviest]))

    def _set_particles(self, particles: Array) -> None:
        particles[:, 2] = [wrap(yaw) for yaw in particles[:, 2].tolist()]
        self._particles = np.ascontiguousarray(particles)
        self._logs = np.zeros(len(particles))
        self._odom_from_base = None
        self._slow = self._fast = 0.0

    def _rng(self) -> np.random.Generator:
        """A new generator for each start and update, by seed and number of the call."""
        self._draws += 1
        return np.random.default_rng((self._seed, STREAM, self._draws))

    def _anywhere(self, count: int, rng: np.random.Generator) -> Array:
        free = self._field.free
        if len(free) == 0:
            raise ValueError("the map has no free cell; particles have no place to be")
        found = np.empty((count, 3))
        cell = self._field.table.cell
        found[:, :2] = free[rng.integers(len(free), size=count)]
        found[:, :2] += rng.uniform(-0.5 * cell, 0.5 * cell, (count, 2))
        found[:, 2] = rng.uniform(-math.pi, math.pi, count)
        return found

    def _move(self, moved: Pose2, rng: np.random.Generator) -> None:
        """Move the particles by the odometry (base frame), with the noise of `AmclValues`."""
        v, length, turn = self.values, math.hypot(moved.x, moved.y), moved.yaw
        along = math.sqrt(v.odom_alpha3 * length**2 + v.odom_alpha4 * turn**2)
        across = math.sqrt(v.odom_alpha4 * turn**2 + v.odom_alpha5 * length**2)
        spin = math.sqrt(v.odom_alpha1 * turn**2 + v.odom_alpha2 * length**2)
        gone = np.array([length, math.atan2(moved.y, moved.x), turn])
        normals = rng.standard_normal((len(self._particles), 3))
        move(self._particles, gone, np.array([along, across, spin]), normals)

    def _weigh(self, points: Array) -> float:
        """Add the scan to the weights; returns the mean likelihood of a beam."""
        fits = self.fits(points)
        weights, _ = normalise(self._logs)
        self._logs += self.values.likelihood_power * fits
        self._logs -= self._logs.max()
        # per beam, so that scans of more or fewer beams can be compared
        return float(weights @ np.exp(fits / min(len(points), self.values.laser_max_beams)))

    def _share_of_new(self, fit: float) -> float:
        """Share of random particles to add: 1 - w_fast / w_slow (augmented MCL, Thrun, Table 8.3).

        Both are exponential means of the fit; the fast one falls first when scans stop fitting.
        """
        slow, fast = self.values.recovery_alpha_slow, self.values.recovery_alpha_fast
        if fast == 0.0:
            return 0.0
        if self._slow == 0.0:
            self._slow = self._fast = fit
        self._slow += slow * (fit - self._slow)
        self._fast += fast * (fit - self._fast)
        return max(0.0, 1.0 - self._fast / self._slow)

    def _resample(self, new: float, rng: np.random.Generator) -> None:
        weights, effective = normalise(self._logs)
        if self.values.selective_resampling and new == 0.0 and 2.0 * effective > len(weights):
            return
        offset = rng.random()
        kept: Integers = drawn(weights, len(weights), offset)
        count = self._wanted(bin_count(self._particles, kept))
        particles = self._particles[drawn(weights, count, offset)]
        fresh = rng.random(count) < new
        particles[fresh] = self._anywhere(int(np.count_nonzero(fresh)), rng)
        self._particles, self._logs = particles, np.zeros(count)

    def _wanted(self, bins_: int) -> int:
        count = math.ceil(kld_count(bins_, self.values.kld_err, self.values.kld_z))
        return min(max(count, self.values.min_particles), self.values.max_particles)
