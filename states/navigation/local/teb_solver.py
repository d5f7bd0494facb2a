"""Optimises a timed elastic band: Levenberg-Marquardt on a banded system, resizing in between.

As published: a few inner iterations per outer one, the obstacles' weight multiplied by
`weight_adapt_factor` after each outer iteration, poses inserted and removed so that every dt stays
within dt_ref +- dt_hysteresis. Each residual depends on at most three consecutive poses of four
variables, so twelve evaluations give all derivatives, and the normal equations have eleven lower
diagonals.
"""

from __future__ import annotations

import math

import numpy as np

from hw import compiled
from states.navigation.exact import Array, turn_between
from states.navigation.local.teb import (
    NEAR,
    ROWS,
    Integers,
    TebScene,
    TebValues,
    distance_to,
    residuals,
)

WIDTH = 12
_STEP = 1e-6
_LEAST_DT = 1e-3


@compiled
def resized(band: Array, v: TebValues) -> Array:
    """The band with poses inserted and removed, until each dt is near dt_ref."""
    for _ in range(100):
        changed = False
        new = np.empty((2 * len(band) + 2, 4))
        count = i = 0
        while i < len(band):
            new[count] = band[i]
            count += 1
            if i == len(band) - 1:
                break
            dt = band[i, 3]
            if dt > v.dt_ref + v.dt_hysteresis and len(band) + 1 <= v.max_samples and not changed:
                new[count - 1, 3] = new[count, 3] = 0.5 * dt
                new[count, :2] = 0.5 * (band[i, :2] + band[i + 1, :2])
                turn = turn_between(band[i, 2], band[i + 1, 2])
                new[count, 2] = turn_between(0.0, band[i, 2] + 0.5 * turn)
                count += 1
                changed = True
            elif (
                dt < v.dt_ref - v.dt_hysteresis
                and len(band) > v.min_samples
                and i + 2 < len(band)
                and not changed
            ):
                new[count - 1, 3] = dt + band[i + 1, 3]
                i += 1  # the next pose is left out
                changed = True
            i += 1
        band = new[:count].copy()
        if not changed:
            break
    return band


@compiled
def nearest_obstacles(band: Array, obstacles: Array) -> tuple[Integers, Array]:
    """The NEAR nearest obstacles of each pose, and when each pose is reached, s."""
    near = np.full((len(band), NEAR), -1, np.int64)
    times = np.zeros(len(band))
    for i in range(len(band)):
        if i > 0:
            times[i] = times[i - 1] + band[i - 1, 3]
        away = np.empty(len(obstacles))
        for k in range(len(obstacles)):
            away[k] = distance_to(obstacles[k], band[i, 0], band[i, 1], times[i])
        order = np.argsort(away)
        for k in range(min(NEAR, len(obstacles))):
            near[i, k] = order[k]
    return near, times


@compiled
def derivatives(band: Array, rows: Array, v: TebValues, scene: TebScene) -> Array:
    """D row / d variable, (n, ROWS, 12): variables of the row's pose and the two after it.

    Forward differences. Poses three apart share no residual, so one evaluation moves the same
    variable of every third pose (a colouring of the Jacobian). First and last pose are fixed.
    """
    count = len(band)
    slopes = np.zeros((count, ROWS, WIDTH))
    for colour in range(WIDTH):
        phase, component = colour // 4, colour % 4
        moved = band.copy()
        for block in range(phase, count, 3):
            if component == 3 or 0 < block < count - 1:
                moved[block, component] += _STEP
        changed = residuals(moved, v, scene)
        for i in range(count):
            block = i + (phase - i) % 3
            if block >= count:
                continue
            for row in range(ROWS):
                slope = (changed[i, row] - rows[i, row]) / _STEP
                slopes[i, row, 4 * (block - i) + component] = slope
    return slopes


@compiled
def normal_equations(rows: Array, slopes: Array) -> tuple[Array, Array]:
    """J'J as lower diagonals, (4 n, 12), and -J'r, (4 n,)."""
    count = len(rows)
    diagonals, right = np.zeros((4 * count, WIDTH)), np.zeros(4 * count)
    for i in range(count):
        for row in range(ROWS):
            if not slopes[i, row].any():
                continue
            for a in range(min(WIDTH, 4 * (count - i))):
                slope = slopes[i, row, a]
                right[4 * i + a] -= slope * rows[i, row]
                for b in range(a + 1):
                    diagonals[4 * i + a, a - b] += slope * slopes[i, row, b]
    return diagonals, right


@compiled
def solved(diagonals: Array, right: Array, damping: float) -> Array:
    """Solution of (A + damping) x = right by a banded Cholesky decomposition."""
    size = len(right)
    lower = diagonals.copy()
    x = right.copy()
    for i in range(size):
        lower[i, 0] += damping + 1e-12
        for k in range(min(i, WIDTH - 1), -1, -1):
            j = i - k
            total = lower[i, k]
            for m in range(1, WIDTH - k):
                if j - m < 0:
                    break
                total -= lower[i, k + m] * lower[j, m]
            lower[i, k] = math.sqrt(max(total, 1e-12)) if k == 0 else total / lower[j, 0]
    for i in range(size):
        for k in range(1, min(i, WIDTH - 1) + 1):
            x[i] -= lower[i, k] * x[i - k]
        x[i] /= lower[i, 0]
    for i in range(size - 1, -1, -1):
        for k in range(1, min(size - 1 - i, WIDTH - 1) + 1):
            x[i] -= lower[i + k, k] * x[i + k]
        x[i] /= lower[i, 0]
    return x


@compiled
def iterated(band: Array, v: TebValues, scene: TebScene, iterations: int) -> Array:
    """The band after some steps of Levenberg-Marquardt with Nielsen's rule for the damping."""
    rows = residuals(band, v, scene)
    cost = np.sum(rows * rows)
    damping, grow = -1.0, 2.0
    for _ in range(iterations):
        slopes = derivatives(band, rows, v, scene)
        diagonals, right = normal_equations(rows, slopes)
        if damping < 0.0:
            damping = 1e-5 * max(1e-6, diagonals[:, 0].max())
        for _ in range(10):
            step = solved(diagonals, right, damping).reshape(-1, 4)
            new = band + step
            new[:, 3] = np.maximum(new[:, 3], _LEAST_DT)
            new_rows = residuals(new, v, scene)
            new_cost = np.sum(new_rows * new_rows)
            gain = (cost - new_cost) / (
                np.sum(step.ravel() * (damping * step.ravel() + right)) + 1e-30
            )
            if new_cost < cost and math.isfinite(new_cost):
                band, rows, cost = new, new_rows, new_cost
                damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
                grow = 2.0
                break
            damping *= grow
            grow *= 2.0
    for i in range(len(band)):
        band[i, 2] = turn_between(0.0, band[i, 2])
    return band


@compiled
def optimized(
    band: Array, ends: Array, obstacles: Array, via: Array, holonomic: bool, v: TebValues
) -> Array:
    """The band after all outer iterations.

    Args:
        band: (n, 4), n at least 2; its first and last pose stay.
        ends: velocities at start and goal in the robot's frame, (2, 3).
        obstacles: (m, 7), see `teb`.
        via: points to pass, (k, 2); each draws the pose nearest to it.
        holonomic: omni or differential.
        v: parameters.
    """
    factor = 1.0
    for _ in range(v.no_outer_iterations):
        band = resized(band, v)
        near, times = nearest_obstacles(band, obstacles)
        drawn = np.full((len(band), 2), math.nan)
        for k in range(len(via)):
            away = np.hypot(band[:, 0] - via[k, 0], band[:, 1] - via[k, 1])
            drawn[np.argmin(away)] = via[k]
        scene = TebScene(ends, obstacles, near, times, drawn, factor, holonomic)
        band = iterated(band, v, scene, v.no_inner_iterations)
        factor *= v.weight_adapt_factor
    return band
