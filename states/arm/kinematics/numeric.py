"""Inverse kinematics of any arm, by damped least squares from many seeds, within joint limits.

An arm without a closed form is solved from those of `SEEDS` joint sets whose tools are nearest to
the pose (`descent.py` has the formula).

A seventh joint leaves a self-motion: an elbow that turns while the tool rests. In the first steps
of a descent the joints are drawn towards the middle of their ranges; from then on a step is the
shortest, so that what is found is near its seed. From each solution the self-motion is followed
both ways in steps of `STRIDE`, so that the solutions sample all of it that is within the limits:
where one elbow collides, another is at hand. Solutions less than `ALIKE` apart count once.
"""

from __future__ import annotations

import math

import numpy as np

from hw import compiled
from hw.model import ArmShape
from states.arm.kinematics.descent import MET, Limited, along, settle
from states.arm.kinematics.kernels import Array, Integers
from states.arm.kinematics.model import Manipulator

BRANCHES_SIX, BRANCHES_SEVEN = 16, 32
"""Most solutions that are looked for, by the number of joints; six have 16 at most."""
FOUND_SEVEN = 8
"""Solutions from seeds, before the self-motion is followed."""
TRIES, MORE_TRIES = 60, 120
"""Seeds from which each pose is tried, and where all of them miss it closely."""
FRUITLESS = 20
"""Seeds in a row that find nothing new, after which one solution at least will do."""
STEPS = 60
ALONG_STEPS = 15
"""From one knot of a tool line to the next, 1 cm, or from one elbow to the next."""
MORE_STEPS, CLOSE = 5000, 1e-8
"""For the closest miss where nothing was found, if |e|^2 is as small: singular poses are slow."""
CENTRED_STEPS = 4
"""Steps in which joints are drawn to the middle."""
STRIDE = 0.35
"""How far the joint that turns most goes from one elbow to the next, rad."""
ALIKE_SEVEN, ALIKE_SIX = 0.15, 1e-4
"""Solutions nearer than this at every joint are one, rad, by the number of joints."""
TURN_WEIGHT = 0.3
"""A turned tool counts as so many metres per radian when seeds are ranked."""
SLOWER = 60
"""How many times as long as the closed form of a UR arm it takes, about; see DECISIONS.md."""
_HARDLY = 1e-3
"""Below it a joint has no part in a self-motion."""


def slowness(arm: ArmShape) -> str:
    """What users of an arm without a closed form are told."""
    return (
        f"the inverse kinematics of {arm.name} are numeric: about {SLOWER} times as slow as those "
        "of a UR arm, and a sample of its solutions"
    )


def searched(arm: Manipulator, poses: Array, *, near: bool = False) -> tuple[Array, Array]:
    """Joints (n, b, j) for poses (n, 4, 4), and by how much they miss, root of m^2 + rad^2, (n, b).

    That is infinite where there is no more. `near`: also joints that only come near.
    """
    seven = arm.count > 6
    branches = BRANCHES_SEVEN if seven else BRANCHES_SIX
    joints = np.zeros((len(poses), branches, arm.count))
    worth = np.full((len(poses), branches), np.inf)
    seeds, there = arm.seeds
    alike, most = (ALIKE_SEVEN, FOUND_SEVEN) if seven else (ALIKE_SIX, branches)
    _search(
        _limited(arm), np.ascontiguousarray(poses), seeds, there, alike, most, near, joints, worth,
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
        worth[n] = settle(arm, targets[n], steps, 0, True, q[n])


@compiled
def _search(  # noqa: C901, PLR0913 - an arm, a problem and its answer
    arm: Limited,
    targets: Array,
    seeds: Array,
    there: Array,
    alike: float,
    most: int,
    near: bool,
    joints: Array,
    worth: Array,
) -> None:
    """Solves all targets: writes different joints, `most` from seeds, best if `near`; |e|^2."""
    order, q = np.empty(MORE_TRIES, dtype=np.int64), np.empty(len(arm.origins))
    closest = np.empty(len(q))
    centred = CENTRED_STEPS if len(arm.origins) > 6 else 0
    for n in range(len(targets)):
        tries, found, fruitless = _nearest(there, targets[n], order), 0, 0
        least = CLOSE
        for k in range(tries):
            if k >= TRIES and (found > 0 or least >= CLOSE):
                break
            q[:] = seeds[order[k]]
            missing = settle(arm, targets[n], STEPS, centred, near, q)
            fruitless += 1
            if found == 0 and missing < least:
                least = missing
                closest[:] = q
            if (missing <= MET or near) and _is_new(q, joints[n], found, alike):
                place = found
                if found == most:
                    place = int(np.argmax(worth[n, :most]))
                    if worth[n, place] <= missing:
                        continue
                else:
                    found += 1
                fruitless = 0
                worth[n, place] = missing
                joints[n, place] = q
            if (found == most and not near) or (found > 0 and fruitless >= FRUITLESS):
                break
        if found == 0 and least < CLOSE:
            least = settle(arm, targets[n], MORE_STEPS, 0, True, closest)
            if least <= MET:
                joints[n, 0] = closest
                worth[n, 0], found = least, 1
        if centred and not near:
            _spread(arm, targets[n], alike, found, joints[n], worth[n])


@compiled
def _spread(
    arm: Limited, target: Array, alike: float, found: int, joints: Array, worth: Array
) -> None:
    """Adds elbows on both sides of each solution, and of those added, while there is room."""
    q, step, k = np.empty(len(arm.origins)), np.zeros(len(arm.origins)), 0
    while k < found:
        free = along(arm, joints[k], step) > _HARDLY
        for side in (-STRIDE, STRIDE):
            if not free or found == len(joints):
                break
            q[:] = joints[k] + side * step
            missing = settle(arm, target, ALONG_STEPS, 0, False, q)
            if missing <= MET and _is_new(q, joints, found, alike):
                joints[found], worth[found] = q, missing
                found += 1
        k += 1


@compiled
def _nearest(there: Array, target: Array, order: Integers) -> int:
    """Writes which poses (m, 4, 4) are nearest to a target, nearest first; returns how many."""
    away, kept = np.empty(len(order)), 0
    for k in range(len(there)):
        bound = away[kept - 1] if kept == len(order) else np.inf
        far = _apart(there[k], target, bound)
        if far >= bound:
            continue
        place = kept if kept < len(order) else kept - 1
        kept = place + 1
        while place > 0 and away[place - 1] > far:
            away[place], order[place] = away[place - 1], order[place - 1]
            place -= 1
        away[place], order[place] = far, k
    return kept


@compiled
def _apart(a: Array, b: Array, bound: float) -> float:
    """The square of how far apart two poses are, m; that of their places where it exceeds bound."""
    square = 0.0
    for i in range(3):
        square += (a[i, 3] - b[i, 3]) ** 2
    if square >= bound:
        return square
    for i in range(3):
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
            if most > alike:
                break
        if most <= alike:
            return False
    return True
