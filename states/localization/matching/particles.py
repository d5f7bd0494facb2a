"""Compiled steps of Monte Carlo localization: move, weigh, resample, count bins, find clusters.

Particles are (n, 3): x, y in m from the corner of the field's table, yaw in rad in [-pi, pi].
Weights are kept as logarithms: the product over 60 beams underflows.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hw import compiled
from states.maps import Array, Table, distance_at

Integers = NDArray[np.int64]

BIN_M, BIN_RAD = 0.5, math.radians(10.0)
"""Bin sizes for KLD sampling and clusters, as in amcl."""
_TURN = 2.0 * math.pi
_YAW_BINS = round(_TURN / BIN_RAD)
_ROW = 1 << 20


@compiled
def log_likelihoods(
    table: Table, cell: float, sigma: float, most: float, hit: float, floor: float
) -> Array:
    """Table of ln(hit exp(-d^2 / 2 sigma^2) + floor) at cell centres; d is capped at `most`, m.

    The likelihood field model of Thrun, Burgard and Fox, Probabilistic Robotics, 6.4.
    """
    rows = math.ceil(table.rows * table.cell / cell)
    columns = math.ceil(table.columns * table.cell / cell)
    found = np.empty((int(rows), int(columns)))
    for i in range(found.shape[0]):
        for j in range(found.shape[1]):
            d = min(distance_at((j + 0.5) * cell, (i + 0.5) * cell, table)[0], most)
            found[i, j] = math.log(hit * math.exp(-0.5 * (d / sigma) ** 2) + floor)
    return found


@compiled
def move(particles: Array, moved: Array, spread: Array, normals: Array) -> None:
    """Move particles in place by the odometry since the last update, each with its own error.

    moved: distance, bearing in the previous base frame, turn. spread: standard deviations along the
    path, across it and of the turn. normals (n, 3): standard normal numbers.
    """
    for i in range(len(particles)):
        bearing = particles[i, 2] + moved[1]
        along = moved[0] + spread[0] * normals[i, 0]
        across = spread[1] * normals[i, 1]
        c, s = math.cos(bearing), math.sin(bearing)
        particles[i, 0] += c * along - s * across
        particles[i, 1] += s * along + c * across
        particles[i, 2] = wrapped(particles[i, 2] + moved[2] + spread[2] * normals[i, 2])


@compiled
def weigh(particles: Array, points: Array, likelihoods: Array, cell: float, out: Array) -> None:
    """Write the sum of the log-likelihoods of all points (m, 2) for each particle."""
    rows, columns = likelihoods.shape
    nowhere = likelihoods.min()
    inverse = 1.0 / cell
    for i in range(len(particles)):
        x, y, yaw = particles[i, 0] * inverse, particles[i, 1] * inverse, particles[i, 2]
        c, s = math.cos(yaw) * inverse, math.sin(yaw) * inverse
        total = 0.0
        for k in range(len(points)):
            u = x + c * points[k, 0] - s * points[k, 1]
            v = y + s * points[k, 0] + c * points[k, 1]
            if 0.0 <= u < columns and 0.0 <= v < rows:
                total += likelihoods[int(v), int(u)]
            else:
                total += nowhere
        out[i] = total


@compiled
def normalise(logs: Array) -> tuple[Array, float]:
    """Weights with sum 1 from their logarithms, and the effective number of particles.

    The largest logarithm is subtracted first, so that at least one weight does not underflow.
    """
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    return weights, 1.0 / np.sum(weights * weights)


@compiled
def drawn(weights: Array, count: int, offset: float) -> Integers:
    """Systematic resampling: `count` indices, of each particle its share of them to within one.

    `offset`, in [0, 1), shifts the comb of count equally spaced quantiles.
    """
    chosen = np.empty(count, np.int64)
    total, i = weights[0], 0
    for k in range(count):
        at = (k + offset) / count
        while total < at and i < len(weights) - 1:
            i += 1
            total += weights[i]
        chosen[k] = i
    return chosen


@compiled
def bins(particles: Array) -> Integers:
    """The bin of each particle, encoded as one number."""
    found = np.empty(len(particles), np.int64)
    for i in range(len(particles)):
        column = math.floor(particles[i, 0] / BIN_M) + _ROW // 2
        row = math.floor(particles[i, 1] / BIN_M) + _ROW // 2
        turn = math.floor(particles[i, 2] / BIN_RAD) % _YAW_BINS
        found[i] = (row * _ROW + column) * _YAW_BINS + turn
    return found


@compiled
def bin_count(particles: Array, chosen: Integers) -> int:
    """Number of bins that hold chosen particles."""
    return len(np.unique(bins(particles)[np.unique(chosen)]))


def kld_count(bins_: int, error: float, quantile: float) -> float:
    """Particles needed to keep the Kullback-Leibler divergence from the true belief below `error`.

    With k occupied bins the likelihood ratio 2 n KL is chi-square distributed with k - 1 degrees of
    freedom, so n = chi2(k - 1) / (2 error); the chi-square quantile is approximated by Wilson and
    Hilferty, (k - 1)(1 - a + sqrt(a) z)^3 with a = 2 / (9 (k - 1)) (Fox 2003, eq. 7). z is the
    standard normal quantile: 2.33 for 99 %.
    """
    if bins_ < 2:
        return 0.0
    part = 2.0 / (9.0 * (bins_ - 1))
    return (bins_ - 1) / (2.0 * error) * (1.0 - part + math.sqrt(part) * quantile) ** 3


@compiled
def clusters(particles: Array) -> Integers:
    """Cluster number of each particle; bins that touch, also at corners, form one cluster."""
    own = bins(particles)
    kinds = np.unique(own)
    label = np.full(len(kinds), -1, np.int64)
    stack = np.empty(len(kinds), np.int64)
    count = 0
    for seed in range(len(kinds)):
        if label[seed] >= 0:
            continue
        label[seed], stack[0], depth = count, seed, 1
        while depth > 0:
            depth -= 1
            here = kinds[stack[depth]]
            turn, place = here % _YAW_BINS, here // _YAW_BINS
            for step in range(27):
                by_row, by_column, by_turn = step // 9 - 1, step // 3 % 3 - 1, step % 3 - 1
                beside = (place + by_row * _ROW + by_column) * _YAW_BINS
                beside += (turn + by_turn) % _YAW_BINS
                at = np.searchsorted(kinds, beside)
                if at < len(kinds) and kinds[at] == beside and label[at] < 0:
                    label[at], stack[depth] = count, at
                    depth += 1
        count += 1
    return label[np.searchsorted(kinds, own)]


@compiled
def moments(particles: Array, weights: Array, chosen: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Mean (3,) and covariance (3, 3) of the chosen particles, about the circular mean of yaw.

    The variance of yaw is -2 ln R, with R the length of the mean direction vector (that of a
    wrapped normal distribution); infinite where directions cancel.
    """
    total = cosine = sine = 0.0
    mean, covariance = np.zeros(3), np.zeros((3, 3))
    for i in range(len(particles)):
        if chosen[i]:
            w = weights[i]
            total += w
            mean[0] += w * particles[i, 0]
            mean[1] += w * particles[i, 1]
            cosine += w * math.cos(particles[i, 2])
            sine += w * math.sin(particles[i, 2])
    mean[0] /= total
    mean[1] /= total
    mean[2] = math.atan2(sine, cosine)
    off = np.empty(3)
    for i in range(len(particles)):
        if chosen[i]:
            off[0], off[1] = particles[i, 0] - mean[0], particles[i, 1] - mean[1]
            off[2] = wrapped(particles[i, 2] - mean[2])
            for j in range(3):
                for k in range(j, 3):
                    covariance[j, k] += weights[i] / total * off[j] * off[k]
                    covariance[k, j] = covariance[j, k]
    resultant = min(math.hypot(cosine, sine) / total, 1.0)
    covariance[2, 2] = -2.0 * math.log(resultant) if resultant > 1e-9 else math.inf
    return mean, covariance


@compiled
def wrapped(angle: float) -> float:
    """The angle in [-pi, pi]."""
    if abs(angle) <= math.pi:
        return angle
    return angle - _TURN * math.floor(angle / _TURN + 0.5)
