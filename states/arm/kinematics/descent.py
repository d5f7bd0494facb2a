"""Damped least squares within joint limits, compiled: one descent from a seed to a pose.

With the error e (m and rad) and the Jacobian J of the joints that are free to move, a step is

    dq = h + J^T (J J^T + l I)^-1 (e - J h)

where l is proportional to |e|^2, so that it fades and the last steps converge quadratically. A step
that increases |e|^2 is dropped and l raised (Levenberg-Marquardt). A joint at its limit is held
there while the step would leave it; others are stopped at theirs. Frames that were computed to
judge a step serve the next one's Jacobian.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hw import compiled
from states.arm.kinematics.kernels import Array, missed, place_links

MET = 1e-18
"""|e|^2 up to which a pose is met."""
CENTRED = 0.1
"""The share of the way to the middle of its range that h asks of each joint."""
PATIENCE = 6
"""Steps that must halve |e|^2."""
_DONE, _LEAST = 1e-26, 1e-30


class Limited(NamedTuple):
    """An arm with its limits: base (4, 4), origins (j, 4, 4), tip (4, 4), lower and upper (j,)."""

    base: Array
    origins: Array
    tip: Array
    lower: Array
    upper: Array


@compiled
def settle(
    arm: Limited,
    target: Array,
    steps: int,
    centred: int,
    patient: bool,
    q: Array,
) -> float:
    """Moves joints (j,) towards a target within their limits; returns |e|^2.

    In the first `centred` steps h draws towards the middle of the ranges. Gives up where `PATIENCE`
    steps do not halve |e|^2, unless `patient`.
    """
    count = len(q)
    frames, tried = np.zeros((count + 2, 4, 4)), np.zeros((count + 2, 4, 4))
    now, then, step = np.empty(count), np.empty(count), np.zeros(count)
    miss, new_miss, jac = np.empty(6), np.empty(6), np.empty((6, count))
    _step_to(arm, q, step, now)
    _place(arm, now, frames)
    worth = missed(frames[count + 1], target, miss)
    damping, before = 0.1, worth
    for n in range(steps):
        if worth <= _DONE:
            break
        drawn = CENTRED if n < centred else 0.0
        _columns(frames, jac)
        _step(jac, miss, 1e-15 + damping * worth, now, arm, drawn, step)
        _step_to(arm, now, step, then)
        _place(arm, then, tried)
        new_worth = missed(tried[count + 1], target, new_miss)
        if new_worth < worth or (n < centred and worth > MET):
            worth, damping = new_worth, damping * 0.2
            frames, tried = tried, frames
            now, then = then, now
            miss, new_miss = new_miss, miss
        else:
            damping *= 5.0
        if n % PATIENCE == PATIENCE - 1:
            if not patient and worth > 0.5 * before:
                break
            before = worth
    q[:] = now
    return worth


@compiled
def along(arm: Limited, q: Array, step: Array) -> float:
    """Writes a direction in which joints (j,) move while the tool rests, its largest element 1.

    Returns how much of one joint's own motion that is, 0 to 1: near 0 there is no such direction.
    """
    count, size = len(q), 0.0
    frames, jac = np.zeros((count + 2, 4, 4)), np.empty((6, count))
    normal, values, found = np.empty((6, 6)), np.empty(6), np.empty(count)
    _place(arm, q, frames)
    _columns(frames, jac)
    for k in range(count):  # each joint's own direction, less what moves the tool
        for e in range(6):
            values[e] = -jac[e, k]
        _normal(jac, 1e-15, normal)
        _solve(normal, values)
        for i in range(count):
            found[i] = 1.0 if i == k else 0.0
            for e in range(6):
                found[i] += jac[e, i] * values[e]
        if found[k] > size:  # the square of its length
            size = found[k]
            step[:] = found
    most = np.abs(step).max()
    for i in range(count):
        step[i] /= max(most, _LEAST)
    return size


@compiled
def _place(arm: Limited, q: Array, frames: Array) -> None:
    """Writes rover_from_link of base and links, and rover_from_tcp after them, (j + 2, 4, 4)."""
    place_links(arm.base, arm.origins, q, frames)
    flange, tcp, tip = frames[len(q)], frames[len(q) + 1], arm.tip
    for i in range(3):
        a, b, c = flange[i, 0], flange[i, 1], flange[i, 2]
        for k in range(4):
            tcp[i, k] = a * tip[0, k] + b * tip[1, k] + c * tip[2, k]
        tcp[i, 3] += flange[i, 3]


@compiled
def _columns(frames: Array, jac: Array) -> None:
    """Writes the geometric Jacobian (6, j) from these frames, as `kernels.slopes`."""
    tcp = frames[len(frames) - 1]
    for k in range(jac.shape[1]):
        frame = frames[k + 1]
        zx, zy, zz = frame[0, 2], frame[1, 2], frame[2, 2]
        x, y, z = tcp[0, 3] - frame[0, 3], tcp[1, 3] - frame[1, 3], tcp[2, 3] - frame[2, 3]
        jac[0, k], jac[1, k], jac[2, k] = zy * z - zz * y, zz * x - zx * z, zx * y - zy * x
        jac[3, k], jac[4, k], jac[5, k] = zx, zy, zz


@compiled
def _step_to(arm: Limited, q: Array, step: Array, found: Array) -> None:
    for i in range(len(q)):
        found[i] = min(max(q[i] + step[i], arm.lower[i]), arm.upper[i])


@compiled
def _step(
    jac: Array,
    miss: Array,
    damping: float,
    q: Array,
    arm: Limited,
    drawn: float,
    step: Array,
) -> None:
    """Writes the step of the module's formula; columns of joints that are held become 0."""
    count = len(q)
    normal, values = np.empty((6, 6)), np.empty(6)
    for i in range(count):
        pull = 0.0
        for e in range(6):
            pull += jac[e, i] * miss[e]
        if (q[i] <= arm.lower[i] and pull < 0.0) or (q[i] >= arm.upper[i] and pull > 0.0):
            for e in range(6):
                jac[e, i] = 0.0
        step[i] = drawn * (0.5 * (arm.lower[i] + arm.upper[i]) - q[i])
    for e in range(6):
        values[e] = miss[e]
        for i in range(count):
            values[e] -= jac[e, i] * step[i]
    _normal(jac, damping, normal)
    _solve(normal, values)
    for i in range(count):
        for e in range(6):
            step[i] += jac[e, i] * values[e]


@compiled
def _normal(jac: Array, damping: float, normal: Array) -> None:
    """Writes the lower half of J J^T + l I."""
    for e in range(6):
        for f in range(e + 1):
            square = 0.0
            for i in range(jac.shape[1]):
                square += jac[e, i] * jac[f, i]
            normal[e, f] = square
        normal[e, e] += damping


@compiled
def _solve(normal: Array, values: Array) -> None:
    """Replaces values (6,) by the solution of a positive matrix, spoilt by it: L D L^T."""
    for k in range(6):
        pivot = max(normal[k, k], _LEAST)
        for i in range(k + 1, 6):
            share = normal[i, k] / pivot
            for j in range(k + 1, i + 1):
                normal[i, j] -= share * normal[j, k]
            values[i] -= share * values[k]
    for k in range(5, -1, -1):
        value = values[k]
        for j in range(k + 1, 6):
            value -= normal[j, k] * values[j]
        values[k] = value / max(normal[k, k], _LEAST)
