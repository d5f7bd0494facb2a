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
from numba import njit
from numpy.typing import ArrayLike, NDArray

from states.arm.kernels import Array
from states.arm.kinematics import (
    KinematicChain,
    deviation,
    forward,
    inverted,
    jacobian,
    link_frames,
)
from states.arm.newton import polish

BRANCHES = 8
SEED_REACH = 0.05
"""Nominal branches that miss by no more than this, m, are tried as seeds of a calibrated chain."""

_EXACT = 1e-9
_SLACK = 5e-10
_TURN = 2.0 * math.pi


@dataclass(frozen=True, slots=True, eq=False)
class Solutions:
    """Branches of n poses: joints (n, 8, 6) in rad, and which of them exist, (n, 8)."""

    joints: Array
    valid: NDArray[np.bool_]

    def of(self, pose: int = 0) -> Array:
        """The branches of one pose, (k, 6) with k from 0 to 8."""
        return np.asarray(self.joints[pose][self.valid[pose]])


@dataclass(frozen=True, slots=True, eq=False)
class NearSolutions:
    """As near as each branch gets: joints (n, 8, 6) in rad, errors (n, 8) in m and in rad."""

    joints: Array
    position_error: Array
    rotation_error: Array

    def within(self, position: float, rotation: float) -> Solutions:
        """The branches whose error stays within a tolerance in m and rad (R44)."""
        valid = (self.position_error <= position) & (self.rotation_error <= rotation)
        return Solutions(self.joints, valid)


def inverse(chain: KinematicChain, targets: ArrayLike) -> Solutions:
    """All joints that bring the tcp to the targets, rover_from_tcp (4, 4) or (n, 4, 4).

    Angles lie in (-pi, pi]. Branches that no whole turns bring within the joint limits are left
    out. At a singular wrist, where joint 6 is free, two of its angles represent all.
    """
    poses = _poses(targets)
    joints, valid = _closed_form(chain, poses, 0.0 if chain.nominal else SEED_REACH)
    if not chain.nominal:
        joints = polish(chain, joints, poses)
        distance, angle = deviation(forward_all(chain, joints), poses[:, None])
        exact = (distance <= _EXACT) & (angle <= _EXACT)
        seeded = exact & valid
        # near a singular wrist the only seed that converges may be one that misses by more
        valid = np.where(seeded.any(axis=1, keepdims=True), seeded, exact)
    return Solutions(joints, valid & _has_copy(chain, joints))


def inverse_near(chain: KinematicChain, targets: ArrayLike) -> NearSolutions:
    """Like `inverse`, but a pose out of reach gives the joints near it, with their errors.

    Each branch points its shoulder at the pose and stretches (or folds) as far as it can: a few
    percent farther from it than the optimum. The orientation is kept exactly (nominal chain), the
    position gives way. Branches outside the joint limits have an infinite error.
    """
    poses = _poses(targets)
    joints, _ = _closed_form(chain, poses, math.inf)
    if not chain.nominal:
        joints = polish(chain, joints, poses)
    distance, angle = deviation(forward_all(chain, joints), poses[:, None])
    free = _has_copy(chain, joints)
    return NearSolutions(joints, np.where(free, distance, np.inf), np.where(free, angle, np.inf))


def nearest_copies(chain: KinematicChain, joints: Array, near: ArrayLike) -> Array:
    """Joints (..., 6) shifted by whole turns, as near to `near` (6,), rad, as the limits allow.

    Each must have at least one copy inside the limits, as those of `inverse` do.
    """
    turns = np.round((np.asarray(near) - joints) / _TURN)
    low = np.ceil((chain.lower - joints) / _TURN - 1e-12)
    high = np.floor((chain.upper - joints) / _TURN + 1e-12)
    shifted = joints + _TURN * np.clip(turns, low, high)
    return np.asarray(np.clip(shifted, chain.lower, chain.upper))


def forward_all(chain: KinematicChain, joints: Array) -> Array:
    """`forward` for joints of any leading shape: (..., 6) to (..., 4, 4)."""
    poses = forward(chain, joints.reshape(-1, 6))
    return np.asarray(poses.reshape(*joints.shape[:-1], 4, 4))


def warm_up(chain: KinematicChain) -> None:
    """Compile what this module and the kinematics need, so that no control tick does."""
    inverse(chain, forward(chain, np.zeros(6)))
    jacobian(chain, np.zeros(6))
    link_frames(chain, np.zeros(6))


def _poses(targets: ArrayLike) -> Array:
    poses = np.ascontiguousarray(targets, dtype=np.float64)
    if poses.shape[-2:] != (4, 4) or poses.ndim > 3:
        raise ValueError(f"targets have shape {poses.shape}; (4, 4) or (n, 4, 4) is needed")
    return poses.reshape(-1, 4, 4)


def _closed_form(
    chain: KinematicChain, poses: Array, reach: float
) -> tuple[Array, NDArray[np.bool_]]:
    flange = np.ascontiguousarray(inverted(chain.base) @ poses @ inverted(chain.tip))
    joints = np.zeros((len(poses), BRANCHES, 6))
    valid = np.zeros((len(poses), BRANCHES), dtype=np.bool_)
    _solve(chain.dh, flange, max(reach, _SLACK), joints, valid)
    return joints, valid


def _has_copy(chain: KinematicChain, joints: Array) -> NDArray[np.bool_]:
    low = np.ceil((chain.lower - joints) / _TURN - 1e-12)
    high = np.floor((chain.upper - joints) / _TURN + 1e-12)
    return np.asarray(np.all(low <= high, axis=-1))


@njit(cache=True)
def _solve(dh: Array, flange: Array, reach: float, joints: Array, valid: NDArray[np.bool_]) -> None:
    turn = np.empty((3, 3))
    for n in range(len(flange)):
        _orthonormal(flange[n], turn)
        _solve_one(dh, turn, flange[n, :3, 3], reach, joints[n], valid[n])


@njit(cache=True)
def _orthonormal(pose: Array, turn: Array) -> None:
    """One Newton step towards the nearest rotation, R (3 I - R^T R) / 2.

    Undoes rounding to float32; what is a rotation to float64 stays one.
    """
    for i in range(3):
        for j in range(3):
            turn[i, j] = 1.5 * pose[i, j]
            for k in range(3):
                dot = pose[0, j] * pose[0, k] + pose[1, j] * pose[1, k] + pose[2, j] * pose[2, k]
                turn[i, j] -= 0.5 * pose[i, k] * dot


@njit(cache=True)
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
        shift = _self_motion(dh, wrist_x, wz, q234, s5)
        q234 += shift
        q6 -= shift if c5 > 0.0 else -shift
        joints[branch, 0] = _wrap(q1)
        joints[branch, 4] = q5
        joints[branch, 5] = _wrap(q6)
        elbow = 1.0 if branch % 2 == 0 else -1.0
        miss = _elbow(dh, wrist_x, wz, q234, elbow, joints[branch])
        valid[branch] = math.hypot(miss, shoulder_miss) <= reach


@njit(cache=True)
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


@njit(cache=True)
def _self_motion(dh: Array, wx: float, wz: float, q234: float, s5: float) -> float:
    """The least change of q234 that brings the elbow into reach, where the wrist allows it; else 0.

    With s5 near 0 joints 4 and 6 turn about one axis: turning one against the other by t turns the
    tool by s5 t only, and is done where that stays below the slack. The forearm's end lies at D^2 =
    c^2 + d5^2 - 2 c d5 sin(q234 - h), with (c, h) the wrist in polar coordinates; D = bound gives
    two angles, of which the nearer is taken.
    """
    far, near, d5 = abs(dh[1] + dh[2]), abs(dh[1] - dh[2]), dh[4]
    x, y = wx - d5 * math.sin(q234), wz + d5 * math.cos(q234)
    distance = math.hypot(x, y)
    if near <= distance <= far or s5 * math.pi > 1e-6:
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
    return shift if s5 * abs(shift) <= _SLACK else 0.0


@njit(cache=True)
def _wrap(angle: float) -> float:
    return angle - _TURN * round(angle / _TURN)
