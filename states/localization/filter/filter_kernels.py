"""Compiled steps of the Kalman filters: predict by a motion model, correct by one measurement.

A state is an array (n + 1, n): the mean in row 0, below it the factors of the covariance
P = U D Uᵀ, with U unit upper triangular and D stored on its diagonal. So P is symmetric and has no
negative eigenvalue, whatever the rounding (Bierman, Factorization Methods for Discrete Sequential
Estimation, 1977: Thornton's time update, Bierman's measurement update). All are in one file because
numba's cache watches only the file of a function.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hw import compiled

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

LEAST_VARIANCE, GREATEST_VARIANCE = 1e-9, 1e9
"""Range to which variances of measurements are clamped (SI units squared)."""
GREATEST = 1e12
"""Values beyond this are ignored."""
UNUSED = 1e100
"""Variances beyond this mark an axis as not measured."""

_TURN = 2.0 * math.pi


class News(NamedTuple):
    """A measurement: value k is of the state's entry axes[k]; its covariance is (m, m) * `factor`.

    `gates`: largest squared distance accepted, by number of axes. Values that are not finite are
    left out. A `trusted` one passes every gate.
    """

    axes: Integers
    gates: Array
    values: Array
    covariance: Array
    factor: float
    trusted: bool


@compiled
def planar_step(state: Array, dt: float, noise: Array, news: News, out: Array) -> tuple[float, int]:
    """Predicts a planar state (7, 6) by dt and corrects it; writes `out`.

    State: x, y, yaw in the world, vx, vy, wz in the body. Returns what `_corrected` returns.
    """
    if dt > 0.0:
        transition, inputs, weights = np.eye(6), np.zeros((6, 6)), np.empty(6)
        planar_motion(state[0], dt, out[0], transition)
        planar_noise(state[0], dt, noise, inputs, weights)
        _propagated(state[1:], transition, inputs, weights, out[1:])
    else:
        out[:] = state
    return _corrected(out, news, 2, 3)


@compiled
def spatial_step(
    state: Array, dt: float, noise: Array, news: News, out: Array
) -> tuple[float, int]:
    """Predicts a state in space (16, 15) by dt and corrects it; writes `out`.

    State: position, then roll, pitch, yaw in the world; velocity, rates of turn and acceleration in
    the body. Returns what `_corrected` returns.
    """
    if dt > 0.0:
        transition, weights = np.eye(15), np.empty(15)
        spatial_motion(state[0], dt, out[0], transition)
        _weigh(noise, dt, _norm(state[0, 6:9]), _norm(state[0, 9:12]), weights)
        _propagated(state[1:], transition, np.eye(15), weights, out[1:])
    else:
        out[:] = state
    return _corrected(out, news, 3, 6)


@compiled
def write_covariance(state: Array, whole: Array) -> None:
    """Write P = U D Uᵀ (n, n) of a state, exactly symmetric."""
    n = state.shape[1]
    for i in range(n):
        for j in range(i, n):
            total = 0.0
            for k in range(j, n):
                left = 1.0 if k == i else state[1 + i, k]
                right = 1.0 if k == j else state[1 + j, k]
                total += left * state[1 + k, k] * right
            whole[i, j] = whole[j, i] = total


@compiled
def planar_motion(mean: Array, dt: float, moved: Array, transition: Array) -> None:
    """The exact arc of a steady body velocity, and its Jacobian F; `transition` starts as identity.

    The velocity turns with the body, so the displacement in the body frame at the start is the
    integral of R(wz s) (vx, vy) over s: dt (a -b; b a) (vx, vy), with a = sin(t)/t, b = (1 -
    cos(t))/t for the turn t = wz dt. Both, and their derivatives by t, are series below 1e-3 rad.
    """
    yaw, vx, vy, turn = mean[2], mean[3], mean[4], mean[5] * dt
    if abs(turn) < 1e-3:
        square = turn * turn
        a, a_slope = 1.0 - square / 6.0 + square * square / 120.0, turn * (square / 30.0 - 1 / 3.0)
        b, b_slope = turn * (0.5 - square / 24.0), 0.5 - square / 8.0
    else:
        a, b = math.sin(turn) / turn, 2.0 * math.sin(0.5 * turn) ** 2 / turn
        a_slope, b_slope = (math.cos(turn) - a) / turn, (math.sin(turn) - b) / turn
    ahead, aside = dt * (a * vx - b * vy), dt * (b * vx + a * vy)
    c, s = math.cos(yaw), math.sin(yaw)
    moved[:] = mean
    moved[0] += c * ahead - s * aside
    moved[1] += s * ahead + c * aside
    moved[2] = _wrapped(yaw + turn)
    transition[0, 2] = -s * ahead - c * aside
    transition[1, 2] = c * ahead - s * aside
    transition[0, 3] = transition[1, 4] = dt * (c * a - s * b)
    transition[1, 3] = dt * (s * a + c * b)
    transition[0, 4] = -transition[1, 3]
    ahead_slope = dt * dt * (a_slope * vx - b_slope * vy)
    aside_slope = dt * dt * (b_slope * vx + a_slope * vy)
    transition[0, 5] = c * ahead_slope - s * aside_slope
    transition[1, 5] = s * ahead_slope + c * aside_slope
    transition[2, 5] = dt


@compiled
def planar_noise(mean: Array, dt: float, noise: Array, inputs: Array, weights: Array) -> None:
    """Process noise G W Gᵀ: inputs G (6, 6), which start as zeros, and weights W (6,).

    Slip is noise of the pose in the directions of the body at mid-step. White acceleration with
    variance w of the velocity has the covariance w (dt²/3 dt/2; dt/2 1) of position and velocity
    (Bar-Shalom 6.2.2) = w (dt/2 1)ᵀ(dt/2 1) + (w dt²/12 0; 0 0): the inputs move the pose by dt/2
    per unit of velocity, and dt²/12 remains as noise of the pose alone.
    """
    speed = math.hypot(mean[3], mean[4])
    _weigh(noise, dt, speed, abs(mean[5]), weights)
    yaw = mean[2] + 0.5 * dt * mean[5]
    c, s = math.cos(yaw), math.sin(yaw)
    half = 0.5 * dt
    for i in range(6):
        inputs[i, i] = 1.0
    inputs[0, 0] = inputs[1, 1] = c
    inputs[1, 0] = s
    inputs[0, 1] = -s
    inputs[0, 3] = inputs[1, 4] = half * c
    inputs[1, 3] = half * s
    inputs[0, 4] = -half * s
    inputs[2, 5] = half
    for i in range(3):
        weights[i] += weights[3 + i] * dt * dt / 12.0


@compiled
def spatial_motion(mean: Array, dt: float, moved: Array, transition: Array) -> None:
    """One step of robot_localization's model, and its Jacobian; `transition` starts as identity.

    The position moves by velocity and acceleration; rates of turn and accelerations are constant.
    Roll, pitch and yaw are singular at a pitch of 90°, where the step is bounded but wrong.
    """
    roll, pitch, yaw = mean[3], mean[4], mean[5]
    sr, cr = math.sin(roll), math.cos(roll)
    sp, cp = math.sin(pitch), math.cos(pitch)
    sy, cy = math.sin(yaw), math.cos(yaw)
    moved[:] = mean
    moved_by = dt * (mean[6:9] + 0.5 * dt * mean[12:15])
    # world_from_body = Rz(yaw) Ry(pitch) Rx(roll)
    turned = np.array(
        (
            (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            (-sp, cp * sr, cp * cr),
        )
    )
    along_x, along_y, along_z = turned @ moved_by
    moved[0] += along_x
    moved[1] += along_y
    moved[2] += along_z
    for i in range(3):
        transition[i, 3] = turned[i, 2] * moved_by[1] - turned[i, 1] * moved_by[2]
        for j in range(3):
            transition[i, 6 + j] = dt * turned[i, j]
            transition[i, 12 + j] = 0.5 * dt * dt * turned[i, j]
    down = -sp * moved_by[0] + cp * sr * moved_by[1] + cp * cr * moved_by[2]
    transition[0, 4], transition[1, 4] = cy * down, sy * down
    transition[2, 4] = -cp * moved_by[0] - sp * sr * moved_by[1] - sp * cr * moved_by[2]
    transition[0, 5], transition[1, 5] = -along_y, along_x
    _turn_in_space(mean, dt, moved, transition)
    for i in range(3):
        moved[6 + i] += dt * mean[12 + i]
        transition[6 + i, 12 + i] = dt


@compiled
def _turn_in_space(mean: Array, dt: float, moved: Array, transition: Array) -> None:
    """Roll, pitch and yaw by rates of turn in the body (Euler angle kinematics)."""
    sr, cr = math.sin(mean[3]), math.cos(mean[3])
    sp, cp = math.sin(mean[4]), math.cos(mean[4])
    if abs(cp) < 1e-6:
        cp = math.copysign(1e-6, cp)
    tangent, secant = sp / cp, 1.0 / cp
    wx, wy, wz = mean[9], mean[10], mean[11]
    across, level = sr * wy + cr * wz, cr * wy - sr * wz
    moved[3] = _wrapped(mean[3] + dt * (wx + across * tangent))
    moved[4] = _wrapped(mean[4] + dt * level)
    moved[5] = _wrapped(mean[5] + dt * across * secant)
    transition[3, 3] += dt * level * tangent
    transition[3, 4] = dt * across * secant * secant
    transition[3, 9], transition[3, 10], transition[3, 11] = (
        dt,
        dt * sr * tangent,
        dt * cr * tangent,
    )
    transition[4, 3] = -dt * across
    transition[4, 10], transition[4, 11] = dt * cr, -dt * sr
    transition[5, 3] = dt * level * secant
    transition[5, 4] = dt * across * secant * tangent
    transition[5, 10], transition[5, 11] = dt * sr * secant, dt * cr * secant


@compiled
def _weigh(noise: Array, dt: float, speed: float, rate: float, weights: Array) -> None:
    """Variances (n,) of a step: noise (3, n) has them per second, per metre and per radian."""
    for i in range(len(weights)):
        weights[i] = dt * (noise[0, i] + speed * noise[1, i] + rate * noise[2, i])


@compiled
def _propagated(
    factors: Array, transition: Array, inputs: Array, weights: Array, out: Array
) -> None:
    """Factors of F P Fᵀ + G W Gᵀ (Thornton's time update).

    That sum is Y S Yᵀ with the rows Y = (F U, G) and the weights S = (D, W). Gram-Schmidt with the
    inner product by S, from the last row up, makes the rows orthogonal: their squared lengths are
    the new D, the coefficients the new U.
    """
    n, p = inputs.shape
    rows, spread = np.empty((n, n + p)), np.empty(n + p)
    for j in range(n):
        spread[j] = factors[j, j]
        for i in range(n):
            total = transition[i, j]
            for k in range(j):
                total += transition[i, k] * factors[k, j]
            rows[i, j] = total
    rows[:, n:] = inputs
    spread[n:] = weights
    for j in range(n - 1, -1, -1):
        total = 0.0
        for k in range(n + p):
            total += rows[j, k] * rows[j, k] * spread[k]
        out[j, j] = total
        for i in range(j):
            share = 0.0
            if total > 0.0:
                for k in range(n + p):
                    share += rows[i, k] * spread[k] * rows[j, k]
                share /= total
                for k in range(n + p):
                    rows[i, k] -= share * rows[j, k]
            out[i, j], out[j, i] = share, 0.0


@compiled
def _corrected(state: Array, news: News, first_angle: int, angles_end: int) -> tuple[float, int]:
    """Correct a state in place; returns squared Mahalanobis distance and number of axes used.

    A distance beyond gates[number of axes] leaves the state as it is. A trusted measurement has no
    gate; v vᵀ of the innovation v is added to the state's covariance before, so that it is believed
    whichever way the axes of the map point.
    Correlated axes are decorrelated and taken one by one; their squared distances add up.
    """
    used, missed, spread = _usable(state[0], news, first_angle, angles_end)
    m, n = len(used), state.shape[1]
    if m == 0:
        return 0.0, 0
    if news.trusted:
        innovation = np.zeros((n, 1))
        for k in range(m):
            innovation[used[k], 0] = missed[k]
        _propagated(state[1:].copy(), np.eye(n), innovation, np.ones(1), state[1:])
    trial, shift, row = state.copy(), np.zeros(n), np.empty(n)
    rows = _decorrelated(spread, missed)
    distance = 0.0
    for k in range(m):
        row[:] = 0.0
        for i in range(k + 1):
            row[used[i]] = rows[k, i]
        distance += _scalar_update(trial[1:], row, spread[k, k], missed[k], shift)
    if not news.trusted and not distance <= news.gates[m]:
        return distance, m
    for i in range(n):
        trial[0, i] += shift[i]
        if first_angle <= i < angles_end:
            trial[0, i] = _wrapped(trial[0, i])
    state[:] = trial
    return distance, m


@compiled
def _scalar_update(
    factors: Array, row: Array, variance: float, missed: float, shift: Array
) -> float:
    """Take one scalar measurement (Bierman); adds to `shift`, returns its squared distance.

    With f = Uᵀ h and g = D f the innovation variance grows entry by entry, s_j = s_(j-1) + f_j g_j
    from the measurement's own; D_j shrinks by s_(j-1) / s_j, U's column j by the gain so far. The
    gain is g / s. h = row, `missed` = innovation before the shift of earlier axes.
    """
    n = len(row)
    gain = np.empty(n)
    spread, rest = variance, missed
    for j in range(n):
        f = row[j]
        rest -= row[j] * shift[j]
        for i in range(j):
            f += factors[i, j] * row[i]
        g = factors[j, j] * f
        before, spread = spread, spread + f * g
        factors[j, j] *= before / spread
        for i in range(j):
            old = factors[i, j]
            factors[i, j] = old - f / before * gain[i]
            gain[i] += g * old
        gain[j] = g
    for i in range(n):
        shift[i] += gain[i] * (rest / spread)
    return rest * (rest / spread)


@compiled
def _usable(
    mean: Array, news: News, first_angle: int, angles_end: int
) -> tuple[Integers, Array, Array]:
    """The measured entries of the state, their innovations, and the covariance (lower half)."""
    values, covariance = news.values, news.covariance
    good = np.empty(len(news.axes), np.int64)
    m = 0
    for k in range(len(news.axes)):
        if abs(values[k]) <= GREATEST and 0.0 <= covariance[k, k] <= UNUSED:
            good[m] = k
            m += 1
    used, missed, spread = np.empty(m, np.int64), np.empty(m), np.empty((m, m))
    for k in range(m):
        at = news.axes[good[k]]
        used[k], missed[k] = at, values[good[k]] - mean[at]
        if first_angle <= at < angles_end:
            missed[k] = _wrapped(missed[k])
        for j in range(k):
            spread[k, j] = news.factor * covariance[good[k], good[j]]
        clamped = min(max(covariance[good[k], good[k]], LEAST_VARIANCE), GREATEST_VARIANCE)
        spread[k, k] = news.factor * clamped
    return used, missed, spread


@compiled
def _decorrelated(spread: Array, missed: Array) -> Array:
    """The rows of inv(L) for the covariance R = L D Lᵀ, of which the lower half is given.

    inv(L) z has the diagonal covariance D, so its entries can be taken one by one. Writes D onto
    the diagonal and inv(L) missed into `missed`. Of a covariance that is not positive definite, or
    not finite, only the diagonal is used.
    """
    m = len(spread)
    lower, pivots, rows = np.zeros((m, m)), np.empty(m), np.eye(m)
    for k in range(m):
        pivots[k] = spread[k, k]
        for j in range(k):
            total = spread[k, j]
            for i in range(j):
                total -= lower[k, i] * pivots[i] * lower[j, i]
            lower[k, j] = total / pivots[j]
            pivots[k] -= lower[k, j] * total
        if not pivots[k] > 1e-9 * spread[k, k]:
            return rows
    for k in range(m):
        spread[k, k] = pivots[k]
        for j in range(k):
            missed[k] -= lower[k, j] * missed[j]
            for i in range(j + 1):
                rows[k, i] -= lower[k, j] * rows[j, i]
    return rows


@compiled
def _norm(vector: Array) -> float:
    return math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@compiled
def _wrapped(angle: float) -> float:
    """The angle in [-pi, pi]; an angle already inside is returned unchanged."""
    if abs(angle) <= math.pi:
        return angle
    return angle - _TURN * math.floor(angle / _TURN + 0.5)
