"""What localizes a log beside the localizer: a plain particle filter, plain correlative matching.

Both are started at the truth and are not tuned. They take the scans of a log as points, with the
odometry at each scan's stamp.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from cobodeck.bench.localization.log_variants import LogDrive
from cobodeck.logs import LocalizedScan, LogClock, SeenScan, localize, scans_of
from hw import Pose2
from states.localization.filter import UNKNOWN, sigma_of
from states.localization.matching import Amcl, AmclValues, log_likelihoods, weigh
from states.maps import Array, Field

PARTICLES = 2000
START = np.diag([0.1**2, 0.1**2, 0.05**2])
"""Spread of the particles at the start, m2 and rad2."""
STEP_M, STEP_RAD = 0.15, 0.03
"""Steps of the widest search of correlative matching; they must not jump over a wall's width."""
FINER = (1.0, 1.0 / 3.0, 1.0 / 9.0, 1.0 / 27.0)
"""The searches' steps as shares of the widest; the last ones are 6 mm and 1 mrad."""
CELL_M = 0.05
SPREAD_M, SPREAD_RAD = (0.03, 0.1), (0.02, 0.1)
"""Standard deviation of the odometry's motion: at rest, and per m or rad."""
YAW_PER_M = 0.05
"""The same of the yaw per m of way, rad."""

LogPeer = Callable[[LogDrive, Pose2, int, LogClock], list[LocalizedScan]]


def by_localizer(drive: LogDrive, start: Pose2, seed: int, clock: LogClock) -> list[LocalizedScan]:
    """The localizer that a robot uses."""
    return list(localize(drive.log, drive.ground, start, seed, clock).steps)


def by_particles(drive: LogDrive, start: Pose2, seed: int, clock: LogClock) -> list[LocalizedScan]:
    """A particle filter of constant size, without recovery (as ROS's amcl by default)."""
    values = AmclValues(
        min_particles=PARTICLES,
        max_particles=PARTICLES,
        recovery_alpha_slow=0.0,
        recovery_alpha_fast=0.0,
    )
    particles = Amcl(drive.ground.field, values, seed)
    particles.start(start, START)
    steps = []
    for seen in scans_of(drive.log):
        wheels, before = _wheels(seen), clock()
        particles.update(wheels, seen.points)
        found = particles.estimate(wheels)
        sigma = sigma_of(found.covariance)
        took = clock() - before
        steps.append(
            LocalizedScan(seen.stamp_ns, found.map_from_base, sigma, "tracking", None, took)
        )
    return steps


def by_correlation(
    drive: LogDrive, start: Pose2, _seed: int, clock: LogClock
) -> list[LocalizedScan]:
    """Each scan where it fits best about the pose that the wheels predict; without a sigma."""
    correlation, pose, wheels = Correlation(drive.ground.field), start, None
    steps = []
    for seen in scans_of(drive.log):
        now, before = _wheels(seen), clock()
        pose = correlation.match(pose, (wheels or now).inverse() @ now, seen.points)
        took, wheels = clock() - before, now
        steps.append(LocalizedScan(seen.stamp_ns, pose, UNKNOWN, "tracking", None, took))
    return steps


LOG_PEERS: dict[str, LogPeer] = {
    "cobodeck": by_localizer,
    "particles": by_particles,
    "correlative": by_correlation,
}


class Correlation:
    """Exhaustive search for the pose of a scan on grids, ever finer about the best place so far.

    Maximised is the log-likelihood of the beams, as of particles, less half the squared distance
    from the prediction in standard deviations. After Olson, Real-Time Correlative Scan Matching,
    ICRA 2009. `cell` is the size of the cells of its likelihood table, m.
    """

    def __init__(self, field: Field, cell: float = CELL_M) -> None:
        self._field, self._values, self._cell = field, AmclValues(), cell
        values = self._values
        self._likelihoods = log_likelihoods(
            field.table,
            cell,
            math.hypot(values.sigma_hit, field.sigma),
            values.laser_likelihood_max_dist,
            values.z_hit,
            values.z_rand / values.laser_max_range,
        )

    def match(self, before: Pose2, moved: Pose2, points: Array) -> Pose2:
        """The pose of a scan, points (n, 2) of the base frame, `moved` from `before`."""
        corner = self._field.map_from_corner
        near = corner.inverse() @ before @ moved
        way, turn = math.hypot(moved.x, moved.y), abs(moved.yaw)
        metres = SPREAD_M[0] + SPREAD_M[1] * way
        radians = SPREAD_RAD[0] + SPREAD_RAD[1] * turn + YAW_PER_M * math.sqrt(way)
        predicted = best = np.array([near.x, near.y, near.yaw])
        spread = np.array([metres, metres, radians])
        some = points[:: max(1, math.ceil(len(points) / self._values.laser_max_beams))]
        half, step = 3.0 * spread, np.array([STEP_M, STEP_M, STEP_RAD])
        for finer in FINER:
            grid = best + _grid(half, finer * step)
            fits = np.empty(len(grid))
            weigh(grid, some, self._likelihoods, self._cell, fits)
            off = (grid - predicted) / spread
            best = grid[np.argmax(self._values.likelihood_power * fits - 0.5 * (off**2).sum(1))]
            half = finer * step
        return corner @ Pose2.checked(*best.tolist())


def _grid(half: Array, step: Array) -> Array:
    """Displacements (n, 3) of x, y, yaw on a grid about 0, at least `half` to each side."""
    counts = np.ceil(half / step).astype(int)
    axes = [s * np.arange(-n, n + 1) for s, n in zip(step, counts, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _wheels(seen: SeenScan) -> Pose2:
    return seen.odom_from_base or Pose2(0.0, 0.0)
