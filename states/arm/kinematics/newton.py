"""Moves the branches of the nominal chain onto a calibrated one, by Levenberg-Marquardt.

Every real arm differs from the maker's drawing: Robotnik's UR10 by 3.7 mm (median). Seeds are the
branches of the closed form. A step dq solves (J^T J + l I) dq = J^T e for the error e (m and rad);
one that increases |e|^2 is dropped and l raised. l is proportional to |e|^2, so that it fades and
the last steps converge quadratically.
"""

from __future__ import annotations

import math

import numpy as np

from states.arm.kinematics.kernels import Array, descend
from states.arm.kinematics.model import Manipulator

STEPS = 50
MORE_STEPS = 100
"""For seeds along the self-motion, where convergence is slow."""
ALONG_STEPS = 10
"""From one knot of a tool line to the next, 1 cm; nine in ten need three, none more than eight."""
RESEED_RANGE = 5e-3
"""Poses missed by at most this (root of m^2 + rad^2) are retried along the wrist's self-motion."""

_DONE = 1e-26
_TURN = 2.0 * math.pi


def polish(arm: Manipulator, joints: Array, poses: Array) -> Array:
    """Joints (n, b, 6) of b branches, moved as close to the poses (n, 4, 4) as they get."""
    found, worth = settled(arm, joints, poses)
    best = worth.min(axis=1)
    again = np.flatnonzero((best > 1e-18) & (best <= RESEED_RANGE**2))
    if len(again):
        found[again] = _along_self_motion(arm, joints[again], poses[again])
    return found


def settled(
    arm: Manipulator, joints: Array, poses: Array, steps: int = STEPS
) -> tuple[Array, Array]:
    """As `polish`, from these seeds alone; also |e|^2 of each, (n, b)."""
    n, branches, _ = joints.shape
    targets = np.repeat(poses, branches, axis=0)
    found, worth = descended(arm, joints.reshape(-1, 6), targets, steps)
    turns = _TURN * np.round(found / _TURN)
    return (found - turns).reshape(joints.shape), worth.reshape(n, branches)


def self_motion(joints: Array) -> Array:
    """Joints (n, b, 6) with joint 4 turned against joint 6 in seven steps, (n, b, 7, 6).

    At a singular wrist these turn about one axis, and the nominal branch is an arbitrary seed.
    """
    turns = np.arange(1, 8) * (_TURN / 8.0)
    seeds = np.repeat(joints[:, :, None], len(turns), axis=2)
    seeds[..., 3] += turns
    seeds[..., 5] -= turns * np.where(np.cos(seeds[..., 4]) > 0.0, 1.0, -1.0)
    return seeds


def _along_self_motion(arm: Manipulator, joints: Array, poses: Array) -> Array:
    """The best result of the seeds along the self-motion."""
    n, branches, _ = joints.shape
    seeds = self_motion(joints)
    found, worth = settled(arm, seeds.reshape(n, -1, 6), poses, MORE_STEPS)
    best = worth.reshape(n, branches, -1).argmin(axis=2)
    picked = np.take_along_axis(found.reshape(seeds.shape), best[..., None, None], axis=2)
    return np.asarray(picked[:, :, 0])


def descended(
    arm: Manipulator, seeds: Array, targets: Array, steps: int = STEPS
) -> tuple[Array, Array]:
    """Joints (n, 6) moved from seeds towards targets (n, 4, 4), and |e|^2 there, (n,)."""
    q, worth = np.array(seeds, dtype=np.float64, order="C"), np.empty(len(seeds))
    descend(arm.base, arm.origins, arm.tip, np.ascontiguousarray(targets), steps, _DONE, q, worth)
    return q, worth
