"""Inverse kinematics of any arm, by damped least squares from many seeds, within joint limits.

An arm without a closed form is solved from those of `SEEDS` joint sets whose tools are nearest to
the pose. With the error e (m and rad) and the Jacobian J of the joints that are free to move, a
step is

    dq = h + J^T (J J^T + l I)^-1 (e - J h)

where l is proportional to |e|^2, so that it fades and the last steps converge quadratically. A step
that increases |e|^2 is dropped and l raised (Levenberg-Marquardt). A joint at its limit is held
there while the step would leave it; others are stopped at theirs.

A seventh joint leaves a self-motion. In the first steps h draws the joints towards the middle of
their ranges, which the task overrides; from then on a step is the shortest, so that what is found
is near its seed. Solutions less than `ALIKE` apart count once, so that up to `BRANCHES` of them
sample the self-motion; a planner takes the nearest that is free.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hw import compiled
from hw.model import ArmShape
from states.arm.kinematics.kernels import Array, missed, place_tcp, slopes, solved
from states.arm.kinematics.model import Manipulator

BRANCHES = 8
"""Most solutions that are looked for."""
TRIES = 40
"""Seeds from which each pose is tried."""
FRUITLESS = 14
"""Seeds in a row that find nothing new, after which one solution at least will do."""
STEPS = 60
ALONG_STEPS = 15
"""From one knot of a tool line to the next, 1 cm."""
CENTRED_STEPS, CENTRED = 8, 0.1
"""Steps in which h counts, and the share of the way to the middle that it asks for."""
ALIKE_SEVEN, ALIKE_SIX = 0.15, 1e-4
"""Solutions nearer than this at every joint are one, rad, by the number of joints."""
TURN_WEIGHT = 0.3
"""A turned tool counts as so many metres per radian when seeds are ranked."""
SLOWER = 100
"""How many times as long as the closed form of a UR arm it takes, about; see DECISIONS.md."""

_DONE, _MET = 1e-26, 1e-18


class Limited(NamedTuple):
    """An arm with its limits: base (4, 4), origins (j, 4, 4), tip (4, 4), lower and upper (j,)."""

    base: Array
    origins: Array
    tip: Array
    lower: Array
    upper: Array


def slowness(arm: ArmShape) -> str:
    """What users of an arm without a closed form are told."""
    return (
        f"the inverse kinematics of {arm.name} are numeric: about {SLOWER} times as slow as those "
        "of a UR arm, and a sample of its solutions"
    )


def searched(arm: Manipulator, poses: Array, *, near: bool = False) -> tuple[Array, Array]:
    """Joints (n, 8, j) for poses (n, 4, 4), and by how much they miss, root of m^2 + rad^2, (n, 8).

    That is infinite where there is no more. `near`: also joints that only come near.
    """
    joints = np.zeros((len(poses), BRANCHES, arm.count))
    worth = np.full((len(poses), BRANCHES), np.inf)
    alike = ALIKE_SEVEN if arm.count > 6 else ALIKE_SIX
    seeds, there = arm.seeds
    _search(
        _limited(arm), np.ascontiguousarray(poses), seeds, there, alike, near, joints, worth,
    )  # fmt: skip
    return joints, np.sqrt(worth)


def followed(
    arm: Manipulator, starts: Array, poses: Array, steps: int = STEPS
) -> tuple[Array, Array]:
    """Joints (n, j) moved from starts to poses (n, 4, 4) the shortest way; |e|^2 there, (n,)."""
    q, worth = np.array(starts, dtype=np.float64, order="C"), np.empty(len(starts))
    _follow(_limited(arm), np.ascontiguousarray(poses), steps, q, worth)
    return q, worth


def _limited(arm: Manipulator) -> Limited:
    return Limited(arm.base, arm.origins, arm.tip, arm.lower, arm.upper)


@compiled
def _follow(
    arm: Limited,
    targets: Array,
    steps: int,
    q: Array,
    worth: Array,
) -> None:
    for n in range(len(q)):
        worth[n] = _settle(arm, targets[n], steps, 0, True, q[n])


@compiled
def _search(  # noqa: PLR0913 - an arm, a problem and its answer
    arm: Limited,
    targets: Array,
    seeds: Array,
    there: Array,
    alike: float,
    near: bool,
    joints: Array,
    worth: Array,
) -> None:
    """Solves all targets: writes different joints, best first if `near`, and |e|^2."""
    away, q = np.empty(len(seeds)), np.empty(len(arm.origins))
    centred = CENTRED_STEPS if len(arm.origins) > 6 else 0
    for n in range(len(targets)):
        for k in range(len(seeds)):
            away[k] = _apart(there[k], targets[n])
        order, found, fruitless = np.argsort(away), 0, 0
        for k in range(min(TRIES, len(seeds))):
            for i in range(len(q)):
                q[i] = seeds[order[k], i]
            missing = _settle(arm, targets[n], STEPS, centred, near, q)
            fruitless += 1
            if (missing <= _MET or near) and _is_new(q, joints[n], found, alike):
                place = found
                if found == BRANCHES:
                    place = int(np.argmax(worth[n]))
                    if worth[n, place] <= missing:
                        continue
                else:
                    found += 1
                fruitless = 0
                worth[n, place] = missing
                for i in range(len(q)):
                    joints[n, place, i] = q[i]
            if (found == BRANCHES and not near) or (found > 0 and fruitless >= FRUITLESS):
                break


@compiled
def _apart(a: Array, b: Array) -> float:
    square = 0.0
    for i in range(3):
        square += (a[i, 3] - b[i, 3]) ** 2
        for j in range(3):
            square += 0.5 * TURN_WEIGHT**2 * (a[i, j] - b[i, j]) ** 2
    return square


@compiled
def _is_new(q: Array, joints: Array, found: int, alike: float) -> bool:
    for k in range(found):
        most = 0.0
        for i in range(len(q)):
            off = abs(q[i] - joints[k, i])
            most = max(most, abs(off - 2.0 * math.pi * round(off / (2.0 * math.pi))))
        if most <= alike:
            return False
    return True


@compiled
def _settle(  # noqa: C901 - an arm, a problem and its answer
    arm: Limited,
    target: Array,
    steps: int,
    centred: int,
    patient: bool,
    q: Array,
) -> float:
    """Moves joints (j,) towards a target within their limits; returns |e|^2.

    Gives up where eight steps do not halve it, unless `patient`.
    """
    count = len(q)
    pose, jac = np.zeros((1, 4, 4)), np.empty((1, 6, count))
    here, trial, step = np.empty((1, count)), np.empty((1, count)), np.empty(count)
    miss, new_miss = np.empty(6), np.empty(6)
    for i in range(count):
        here[0, i] = min(max(q[i], arm.lower[i]), arm.upper[i])
    place_tcp(arm.base, arm.origins, arm.tip, here, pose)
    worth = missed(pose[0], target, miss)
    damping, before = 0.1, worth
    for n in range(steps):
        if worth <= _DONE:
            break
        slopes(arm.base, arm.origins, arm.tip, here, jac)
        drawn = CENTRED if n < centred else 0.0
        _step(jac[0], miss, 1e-15 + damping * worth, here[0], arm, drawn, step)
        for i in range(count):
            trial[0, i] = min(max(here[0, i] + step[i], arm.lower[i]), arm.upper[i])
        place_tcp(arm.base, arm.origins, arm.tip, trial, pose)
        new_worth = missed(pose[0], target, new_miss)
        if new_worth < worth or (n < centred and worth > _MET):
            worth = new_worth
            for i in range(count):
                here[0, i] = trial[0, i]
            for i in range(6):
                miss[i] = new_miss[i]
            damping *= 0.2
        else:
            damping *= 5.0
        if n % 8 == 7:
            if not patient and worth > 0.5 * before:
                break
            before = worth
    for i in range(count):
        q[i] = here[0, i]
    return worth


@compiled
def _step(  # noqa: C901 - unrolled for the compiler
    jac: Array,
    miss: Array,
    damping: float,
    q: Array,
    arm: Limited,
    drawn: float,
    step: Array,
) -> None:
    """Writes the step of the module's formula; joints at a limit that it would leave are held."""
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
        for f in range(e + 1):
            square = 0.0
            for i in range(count):
                square += jac[e, i] * jac[f, i]
            normal[e, f] = normal[f, e] = square
        normal[e, e] += damping
    solved(normal, values)
    for i in range(count):
        for e in range(6):
            step[i] += jac[e, i] * values[e]
