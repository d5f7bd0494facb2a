"""Compiled passes over a grid of a path, as derived in `timing.py`: x = (ds/dt)^2, u = d2s/dt2.

All are in one file because numba's cache watches only the file of a function.
"""

from __future__ import annotations

import math

import numpy as np

from hw import compiled
from states.arm.kinematics import Array

_TINY = 1e-12


@compiled
def line_times(most: Array, gain: Array, found: Array) -> None:
    """Writes the times of lines from share 0 to 1 whose squared rate is bounded by most (k, n).

    Forward and backward passes bound the squared rate by 2 gain per share, as x' = 2 u.
    """
    for k in range(len(most)):
        n = most.shape[1]
        gained = 2.0 * gain[k] / (n - 1)
        most[k, 0] = most[k, n - 1] = 0.0
        for i in range(1, n):
            most[k, i] = min(most[k, i], most[k, i - 1] + gained)
        for i in range(n - 2, -1, -1):
            most[k, i] = min(most[k, i], most[k, i + 1] + gained)
        found[k] = 0.0
        for i in range(1, n):
            found[k] += 2.0 / (n - 1) / (math.sqrt(most[k, i - 1]) + math.sqrt(most[k, i]))


@compiled
def passes(
    steps: Array, slope: Array, bend: Array, limit: Array, most: Array, squares: Array
) -> None:
    """Writes x = (ds/dt)^2 at the grid points into squares (n + 1,): the two passes of the module.

    `most` (n + 1,) bounds x by the velocity limits, `limit` (j,) the joint accelerations; slope and
    bend are (n, 2, j), at both ends of each interval.
    """
    n = len(steps)
    reach = np.empty(n + 1)
    reach[n] = most[n]
    for k in range(n - 1, -1, -1):
        reach[k] = _largest(slope[k], bend[k], limit, steps[k], most[k], reach[k + 1])
    squares[0] = 0.0
    for k in range(n):
        _, _, up, _ = _window(slope[k], bend[k], limit, steps[k], squares[k], reach[k + 1])
        squares[k + 1] = min(max(squares[k] + 2.0 * steps[k] * up, 0.0), reach[k + 1])


@compiled
def _largest(
    slope: Array, bend: Array, limit: Array, step: float, most: float, after: float
) -> float:
    """The largest x <= `most` from which some u leads to x <= `after` at the end of the interval.

    Joints with zero slope do not see u and bound x alone. Otherwise the range [low, up] of u, both
    piecewise linear in x, must not be empty: Newton's method on low - up.
    """
    x = most
    for i in range(len(limit)):
        if abs(slope[0, i]) <= _TINY and bend[0, i] != 0.0:
            x = min(x, limit[i] / abs(bend[0, i]))
        if abs(slope[1, i] + 2.0 * step * bend[1, i]) <= _TINY and bend[1, i] != 0.0:
            x = min(x, limit[i] / abs(bend[1, i]))
    for _ in range(50):
        low, low_slope, up, up_slope = _window(slope, bend, limit, step, x, after)
        gap, gain = low - up, low_slope - up_slope
        if gap <= 1e-12 * (1.0 + abs(up)) or gain <= 0.0:
            break
        # low - up is convex in x, so that Newton's method converges from above
        x = max(x - gap / gain, 0.0)
    return x


@compiled
def _window(
    slope: Array, bend: Array, limit: Array, step: float, x: float, after: float
) -> tuple[float, float, float, float]:
    """The range of u allowed at x: low, d low / dx, high, d high / dx.

    At the end of the interval x becomes x + 2 step u, within [0, after]. The joint limits |p u + r
    x| <= a hold at both ends, with p = slope there + 2 step bend at the far end (e = 1), r = bend.
    """
    fall = -0.5 / step
    low, low_slope = fall * x, fall
    up, up_slope = 0.5 * after / step + fall * x, fall
    for e in range(2):
        for i in range(len(limit)):
            p, r = slope[e, i] + 2.0 * step * e * bend[e, i], bend[e, i]
            if abs(p) <= _TINY:
                continue
            middle, half = -r * x / p, limit[i] / abs(p)
            if middle + half < up:
                up, up_slope = middle + half, -r / p
            if middle - half > low:
                low, low_slope = middle - half, -r / p
    return low, low_slope, up, up_slope
