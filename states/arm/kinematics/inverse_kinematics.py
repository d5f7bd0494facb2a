"""Inverse kinematics in closed form: every branch, exact at singularities (R43).

A UR arm has up to eight branches: shoulder left or right, wrist up or down, elbow up or down. The
closed form stays exact because nothing is divided by a sine: angles are atan2 of products, and the
elbow's radicand is factorised. Where the wrist is singular (one angle is free) that angle is moved
just as far as the elbow needs to reach. A calibrated chain is solved by Newton steps that start
from the nominal branches (`newton.py`).

With base_from_flange = (R, p), z the last column of R, and si, ci the sine and cosine of joint i,
the branches of `_solve_one` are found in this order:

1. Wrist centre w = p - d6 z - d1 e_z lies d4 beside the plane of joints 2 to 4, whose normal is
   (s1, -c1, 0): s1 wx - c1 wy = d4. Two solutions: q1 = atan2(wy, wx) + atan2(d4, +-sqrt(r^2 -
   d4^2)) with r = |(wx, wy)|; none if r < d4.
2. That normal, seen from the flange, is m = R^T (s1, -c1, 0) = (c6 s5, -s6 s5, c5). So q5 =
   +-atan2(|(mx, my)|, mz), and q6 = atan2(-+my, +-mx). At s5 = 0 any q6 will do; atan2(0, 0) = 0.
3. n = (c5 c6, -c5 s6, -s5), turned by R, is the direction cos(q234) x1 + sin(q234) e_z in the arm's
   plane, x1 = (c1, s1, 0). That gives q234 = q2 + q3 + q4.
4. Less d5 along the wrist, what is left is a planar arm of lengths a2, a3 (`_elbow`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hw import compiled
from hw.model import inverted
from states.arm.kinematics.kernels import Array
from states.arm.kinematics.kinematics import (
    deviation,
    forward,
)
from states.arm.kinematics.model import Manipulator
from states.arm.kinematics.newton import MORE_STEPS, STEPS, polish, self_motion, settled
from states.arm.kinematics.numeric import searched

BRANCHES = 8
"""Most solutions of a UR arm."""
SEED_REACH = 0.05
"""Branches that the nominal chain misses by less, m, may be ones of a calibrated chain."""
SEED_BENT = 0.15
"""Sine of joint 5 below which the wrist counts as nearly singular."""
SEED_SHIFT = 0.02
"""By how much poses are moved for further seeds of a calibrated chain, m."""

NO_ROTATION = 1e-3
"""Largest error of an element of R R^T of what counts as a rotation; float32 has some 1e-7."""

EXACT = 1e-9
"""Largest error of a solution, m and rad."""

ROUNDED = 5e-7
"""By how much the elbow may miss, m, or a wrist that is nearly straight turn the tool, rad.

That is for poses which only rounding has put out of reach: single precision moves a point 2 m away
by 1e-7 m and turns a frame by 1e-7 rad. Both together leave 1e-6 at most.
"""

_SLACK = 5e-10
_SAME = 1e-6
_TURN = 2.0 * math.pi


@dataclass(frozen=True, slots=True, eq=False)
class Solutions:
    """Branches of n poses: joints (n, b, j) in rad, and which of them exist, (n, b).

    A UR arm has eight at most, others have room for more.
    """

    joints: Array
    valid: NDArray[np.bool_]

    def branches(self, pose: int = 0) -> Array:
        """The branches of one pose, (k, j) with k from 0 to 8."""
        return np.asarray(self.joints[pose][self.valid[pose]])


@dataclass(frozen=True, slots=True, eq=False)
class NearSolutions:
    """As near as each branch gets: joints (n, b, j) in rad, errors (n, b) in m and in rad."""

    joints: Array
    position_error: Array
    rotation_error: Array

    def within(self, position: float, rotation: float) -> Solutions:
        """The branches whose error stays within a tolerance in m and rad (R44)."""
        valid = (self.position_error <= position) & (self.rotation_error <= rotation)
        return Solutions(self.joints, valid)


def inverse(arm: Manipulator, targets: ArrayLike) -> Solutions:
    """All joints that bring the tcp to the targets, rover_from_tcp (4, 4) or (n, 4, 4).

    They meet it within EXACT; where none does, some do that `ROUNDED` allows. Angles lie in
    (-pi, pi]. Branches that no whole turns bring within the joint limits are left out. At a
    singular wrist, where joint 6 is free, two of its angles represent all. No branch comes twice.
    Those of a calibrated chain have no fixed order; with joint 5 within some milliradians of 0 or
    pi it may have more than eight, of which eight are returned.

    Of an arm that is no UR arm they are a sample, see `numeric`.

    Raises:
        ValueError: a target is not a rigid pose.
    """
    poses = _poses(targets)
    if arm.is_numeric:
        joints, off = searched(arm, _rigid(poses))
        return Solutions(joints, off <= EXACT)
    if arm.placements is None:
        joints, valid = _closed_form(arm, poses, 0.0)
    else:
        joints, valid = _calibrated(arm, poses)
    return Solutions(joints, valid & _has_copy(arm, joints))


def inverse_near(arm: Manipulator, targets: ArrayLike) -> NearSolutions:
    """Like `inverse`, but a pose out of reach gives the joints near it, with their errors.

    Each branch points its shoulder at the pose and stretches (or folds) as far as it can: a few
    percent farther from it than the optimum. The orientation is kept exactly (nominal chain), the
    position gives way. Branches outside the joint limits have an infinite error.
    """
    poses = _poses(targets)
    if arm.is_numeric:
        joints, _ = searched(arm, _rigid(poses), near=True)
        distance, angle = deviation(forward_all(arm, joints), poses[:, None])
        return NearSolutions(joints, distance, angle)
    joints, _ = _closed_form(arm, poses, math.inf)
    if arm.placements is not None:
        joints = polish(arm, joints, poses)
    distance, angle = deviation(forward_all(arm, joints), poses[:, None])
    free = _has_copy(arm, joints)
    return NearSolutions(joints, np.where(free, distance, np.inf), np.where(free, angle, np.inf))


def nearest_copies(arm: Manipulator, joints: Array, near: ArrayLike) -> Array:
    """Joints (..., j) shifted by whole turns, as near to `near` (j,), rad, as the limits allow.

    Each must have at least one copy inside the limits, as those of `inverse` do.
    """
    turns = np.round((np.asarray(near) - joints) / _TURN)
    low = np.ceil((arm.lower - joints) / _TURN - 1e-12)
    high = np.floor((arm.upper - joints) / _TURN + 1e-12)
    shifted = joints + _TURN * np.clip(turns, low, high)
    return np.asarray(np.clip(shifted, arm.lower, arm.upper))


def forward_all(arm: Manipulator, joints: Array) -> Array:
    """`forward` for joints of any leading shape: (..., j) to (..., 4, 4)."""
    poses = forward(arm, joints.reshape(-1, arm.count))
    return np.asarray(poses.reshape(*joints.shape[:-1], 4, 4))


def _poses(targets: ArrayLike) -> Array:
    poses = np.ascontiguousarray(targets, dtype=np.float64)
    if poses.shape[-2:] != (4, 4) or poses.ndim > 3:
        raise ValueError(f"targets have shape {poses.shape}; (4, 4) or (n, 4, 4) is needed")
    return poses.reshape(-1, 4, 4)


def _refused(poses: Array, i: int) -> ValueError:
    turn, (x, y, z) = poses[i, :3, :3], poses[i, :3, 3].tolist()
    off = np.abs(turn @ turn.T - np.eye(3)).max()
    what = f"|R R^T - I| is {off:.3g}" if not off <= NO_ROTATION else "a mirror image, or infinite"
    return ValueError(
        f"targets[{i}] at ({x:g}, {y:g}, {z:g}) is no rigid pose: {what}; finite numbers and a "
        f"rotation within {NO_ROTATION:g} are needed"
    )


def _rigid(poses: Array) -> Array:
    """The poses, with what rounding has left of their rotations taken off.

    Raises:
        ValueError: one is no rigid pose.
    """
    found, turn = poses.copy(), np.empty((3, 3))
    for n, pose in enumerate(poses):
        off = _orthonormal(pose, turn)
        if not (off <= NO_ROTATION and np.linalg.det(turn) > 0.0 and np.isfinite(pose).all()):
            raise _refused(poses, n)
        found[n, :3, :3] = turn
    return found


def _closed_form(arm: Manipulator, poses: Array, reach: float) -> tuple[Array, NDArray[np.bool_]]:
    with np.errstate(invalid="ignore"):  # what is not finite is refused below
        flange = np.ascontiguousarray(inverted(arm.base) @ poses @ inverted(arm.tip))
    joints = np.zeros((len(poses), BRANCHES, 6))
    valid = np.zeros((len(poses), BRANCHES), dtype=np.bool_)
    wrong = _solve(arm.dh, flange, max(reach, _SLACK), joints, valid)
    if wrong >= 0:
        raise _refused(poses, wrong)
    return joints, valid


def _calibrated(arm: Manipulator, poses: Array) -> tuple[Array, NDArray[np.bool_]]:
    """The distinct branches of a calibrated chain, by Newton steps from those of the nominal one.

    Where the nominal chain has, within SEED_REACH, more branches than were found, or its wrist is
    nearly singular, there are more seeds: branches of poses moved across the folds of the nominal
    chain, and joints turned along the wrist's self-motion.
    """
    seeds, near = _closed_form(arm, poses, SEED_REACH)
    joints, off = _settled(arm, seeds, poses, STEPS)
    joints, valid = _distinct(joints, off <= EXACT)
    bent = np.abs(np.sin(seeds[..., 4])).min(axis=1) < SEED_BENT
    few = np.flatnonzero((valid.sum(axis=1) < near.sum(axis=1)) | bent)
    if not len(few):
        return joints, valid
    moved, _ = _closed_form(arm, _moved(arm, poses[few]).reshape(-1, 4, 4), math.inf)
    turned = self_motion(seeds[few]).reshape(len(few), -1, 6)
    more = np.concatenate([moved.reshape(len(few), -1, 6), turned], axis=1)
    found, off_too = _settled(arm, more, poses[few], MORE_STEPS)
    off = np.concatenate([off[few], off_too], axis=1)
    exact = off <= EXACT
    meets = exact | ((off <= ROUNDED) & ~exact.any(axis=1, keepdims=True))
    joints[few], valid[few] = _distinct(np.concatenate([joints[few], found], axis=1), meets)
    return joints, valid


def _settled(arm: Manipulator, seeds: Array, poses: Array, steps: int) -> tuple[Array, Array]:
    """Joints (n, k, 6) from seeds, and by how much they miss their pose, m or rad, (n, k)."""
    joints, _ = settled(arm, seeds, poses, steps)
    distance, angle = deviation(forward_all(arm, joints), poses[:, None])
    return joints, np.maximum(distance, angle)


def _moved(arm: Manipulator, poses: Array) -> Array:
    """Poses (n, 3, 4, 4) with the wrist centre nearer to the shoulder, farther, and farther out.

    The first two cross the fold of a stretched and of a folded elbow, the third that of a wrist
    centre at d4 from the shoulder's axis; by SEED_SHIFT, m.
    """
    flange = inverted(arm.base) @ poses @ inverted(arm.tip)
    wrist = flange[:, :3, 3] - arm.dh[5] * flange[:, :3, 2]
    ahead = wrist - (0.0, 0.0, arm.dh[0])
    out = wrist * (1.0, 1.0, 0.0)
    steps = np.stack([-_unit(ahead), _unit(ahead), _unit(out)], axis=1)
    found = np.repeat(poses[:, None], 3, axis=1)
    found[..., :3, 3] += SEED_SHIFT * steps @ arm.base[:3, :3].T
    return found


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12))


def _distinct(joints: Array, valid: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
    """The first eight different ones of the valid joints (n, k, 6); what is equal counts once."""
    kept = valid.copy()
    for k in range(1, joints.shape[1]):
        away = joints[:, :k] - joints[:, k, None]
        away -= _TURN * np.round(away / _TURN)
        same = (np.abs(away).max(axis=2) <= _SAME) & kept[:, :k]
        kept[:, k] &= ~same.any(axis=1)
    order = np.argsort(~kept, axis=1, kind="stable")[:, :BRANCHES]
    rows = np.arange(len(joints))[:, None]
    if joints.shape[1] == BRANCHES:
        return joints, kept
    return joints[rows, order], kept[rows, order]


def _has_copy(arm: Manipulator, joints: Array) -> NDArray[np.bool_]:
    low = np.ceil((arm.lower - joints) / _TURN - 1e-12)
    high = np.floor((arm.upper - joints) / _TURN + 1e-12)
    return np.asarray(np.all(low <= high, axis=-1))


@compiled
def _solve(dh: Array, flange: Array, reach: float, joints: Array, valid: NDArray[np.bool_]) -> int:
    """Solves all poses; returns the index of one that is no rigid pose, -1 if all are."""
    turn = np.empty((3, 3))
    for n in range(len(flange)):
        off = _orthonormal(flange[n], turn)
        upright = (
            turn[0, 0] * (turn[1, 1] * turn[2, 2] - turn[1, 2] * turn[2, 1])
            - turn[0, 1] * (turn[1, 0] * turn[2, 2] - turn[1, 2] * turn[2, 0])
            + turn[0, 2] * (turn[1, 0] * turn[2, 1] - turn[1, 1] * turn[2, 0])
        )
        far = abs(flange[n, 0, 3]) + abs(flange[n, 1, 3]) + abs(flange[n, 2, 3])
        if not (off <= NO_ROTATION and upright > 0.0 and far < np.inf):
            return n
        _solve_one(dh, turn, flange[n, :3, 3], reach, joints[n], valid[n])
        if reach < ROUNDED and not valid[n].any():
            _solve_one(dh, turn, flange[n, :3, 3], ROUNDED, joints[n], valid[n])
            _drop_twins(joints[n], valid[n])
    return -1


@compiled
def _drop_twins(joints: Array, valid: NDArray[np.bool_]) -> None:
    """Leaves out branches (8, 6) that equal one before: a straight wrist has no two sides."""
    for k in range(1, BRANCHES):
        for other in range(k):
            away = 0.0
            for i in range(6):
                away = max(away, abs(_wrap(joints[k, i] - joints[other, i])))
            if valid[other] and away <= _SAME:
                valid[k] = False


@compiled
def _orthonormal(pose: Array, turn: Array) -> float:
    """One Newton step towards the nearest rotation, R (3 I - R^T R) / 2; the largest |R^T R - I|.

    Undoes rounding to float32; what is a rotation to float64 stays one.
    """
    off = 0.0
    for i in range(3):
        for j in range(3):
            turn[i, j] = 1.5 * pose[i, j]
            for k in range(3):
                dot = pose[0, j] * pose[0, k] + pose[1, j] * pose[1, k] + pose[2, j] * pose[2, k]
                turn[i, j] -= 0.5 * pose[i, k] * dot
                error = abs(dot - 1.0) if j == k else abs(dot)
                if not error <= off:  # NaN too
                    off = error
    return off


@compiled
def _solve_one(
    dh: Array,
    turn: Array,
    p: Array,
    reach: float,
    joints: Array,
    valid: NDArray[np.bool_],
) -> None:
    """Writes the 8 branches of one pose (see the module); `reach` is how far one may miss, m."""
    d1, d4, d6 = dh[0], dh[3], dh[5]
    wx, wy = p[0] - d6 * turn[0, 2], p[1] - d6 * turn[1, 2]
    wz = p[2] - d6 * turn[2, 2] - d1
    r = math.hypot(wx, wy)
    side = math.sqrt(max((r - d4) * (r + d4), 0.0))
    shoulder_miss = max(d4 - r, 0.0)
    for branch in range(8):
        q1 = math.atan2(wy, wx) + math.atan2(d4, side if branch < 4 else -side)
        c1, s1 = math.cos(q1), math.sin(q1)
        # the axis of joints 2 to 4, seen from the flange: (c6 s5, -s6 s5, c5)
        mx = s1 * turn[0, 0] - c1 * turn[1, 0]
        my = s1 * turn[0, 1] - c1 * turn[1, 1]
        mz = s1 * turn[0, 2] - c1 * turn[1, 2]
        up = 1.0 if branch % 4 < 2 else -1.0
        s5 = math.hypot(mx, my)
        q5 = up * math.atan2(s5, mz)
        q6 = math.atan2(-up * my, up * mx)
        c5, c6, s6 = math.cos(q5), math.cos(q6), math.sin(q6)
        nx, ny, nz = c5 * c6, -c5 * s6, -math.sin(q5)
        ex = turn[0, 0] * nx + turn[0, 1] * ny + turn[0, 2] * nz
        ey = turn[1, 0] * nx + turn[1, 1] * ny + turn[1, 2] * nz
        ez = turn[2, 0] * nx + turn[2, 1] * ny + turn[2, 2] * nz
        q234 = math.atan2(ez, c1 * ex + s1 * ey)
        wrist_x = c1 * wx + s1 * wy
        shift = _self_motion(dh, wrist_x, wz, q234, s5, min(reach, ROUNDED))
        q234 += shift
        q6 -= shift if c5 > 0.0 else -shift
        joints[branch, 0] = _wrap(q1)
        joints[branch, 4] = q5
        joints[branch, 5] = _wrap(q6)
        elbow = 1.0 if branch % 2 == 0 else -1.0
        miss = _elbow(dh, wrist_x, wz, q234, elbow, joints[branch])
        valid[branch] = math.hypot(miss, shoulder_miss) <= reach


@compiled
def _elbow(dh: Array, wx: float, wz: float, q234: float, up: float, q: Array) -> float:
    """Writes q2, q3, q4 of the planar arm; returns how far the wrist is out of its reach, m.

    (x, y) is the end of the forearm at distance D. By the law of cosines cos q3 = (D^2 - a2^2 -
    a3^2) / (2 a2 a3). The radicand of sin q3 is factorised, (far^2 - D^2)(D^2 - near^2), which
    keeps all digits near a stretched (D = far) and a folded elbow (D = near).
    """
    a2, a3, d5 = dh[1], dh[2], dh[4]
    x, y = wx - d5 * math.sin(q234), wz + d5 * math.cos(q234)
    distance = math.hypot(x, y)
    far, near = abs(a2 + a3), abs(a2 - a3)
    beyond, inside = far - distance, distance - near
    square = beyond * (far + distance) * inside * (distance + near)
    q3 = math.atan2(up * math.sqrt(max(square, 0.0)), distance * distance - a2 * a2 - a3 * a3)
    if beyond < 0.0:
        q3 = 0.0
    elif inside < 0.0:
        q3 = up * math.pi
    q2 = math.atan2(y, x) - math.atan2(a3 * math.sin(q3), a2 + a3 * math.cos(q3))
    q[1], q[2], q[3] = _wrap(q2), q3, _wrap(q234 - q2 - q3)
    miss: float = max(-beyond, -inside, 0.0)
    return miss


@compiled
def _self_motion(dh: Array, wx: float, wz: float, q234: float, s5: float, slack: float) -> float:
    """The least change of q234 that brings the elbow into reach, where the wrist allows it; else 0.

    With s5 near 0 joints 4 and 6 turn about one axis: turning one against the other by t turns the
    tool by 2 s5 sin(t / 2) only, and is done where that stays below the slack. The forearm's end
    lies at D^2 = c^2 + d5^2 - 2 c d5 sin(q234 - h), with (c, h) the wrist in polar coordinates; D =
    bound gives two angles, of which the nearer is taken.
    """
    far, near, d5 = abs(dh[1] + dh[2]), abs(dh[1] - dh[2]), dh[4]
    x, y = wx - d5 * math.sin(q234), wz + d5 * math.cos(q234)
    distance = math.hypot(x, y)
    if near <= distance <= far or (slack < ROUNDED and s5 * math.pi > 1e-6):
        return 0.0
    bound = far if distance > far else near
    centre = math.hypot(wx, wz)
    scale = 2.0 * d5 * centre
    if scale <= 0.0:
        return 0.0
    k = (centre * centre + d5 * d5 - bound * bound) / scale
    if abs(k) > 1.0:
        k = math.copysign(1.0, k)
    heading = math.atan2(wz, wx)
    first = _wrap(heading + math.asin(k) - q234)
    second = _wrap(heading + math.pi - math.asin(k) - q234)
    shift = first if abs(first) <= abs(second) else second
    return shift if 2.0 * s5 * abs(math.sin(0.5 * shift)) <= slack else 0.0


@compiled
def _wrap(angle: float) -> float:
    return angle - _TURN * round(angle / _TURN)
