"""Placements as 4x4 matrices, and back."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hw.model.prop import Placement

Matrix = NDArray[np.float64]


def matrix(placement: Placement) -> Matrix:
    """A placement as a 4x4 matrix: R = Rz(yaw) Ry(pitch) Rx(roll), as in URDF."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(placement.rpy), np.cos(placement.rpy)
    pose = np.eye(4)
    pose[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    pose[:3, 3] = placement.xyz
    return pose


def placement(pose: Matrix) -> Placement:
    """A 4x4 pose as xyz and rpy."""
    (x, y, z), r = pose[:3, 3], pose[:3, :3]
    level = math.hypot(r[0, 0], r[1, 0])
    pitch = math.atan2(-r[2, 0], level)
    if level > 1e-9:
        roll, yaw = math.atan2(r[2, 1], r[2, 2]), math.atan2(r[1, 0], r[0, 0])
    else:  # pitch of +-90 degrees: roll and yaw turn about one axis, and yaw is set to 0
        roll, yaw = math.atan2(-r[1, 2], r[1, 1]), 0.0
    return Placement((float(x), float(y), float(z)), (roll, pitch, yaw))


def inverted(pose: Matrix) -> Matrix:
    """The inverse of rigid poses (..., 4, 4): R^T and -R^T p."""
    found = np.zeros_like(pose)
    turn = np.swapaxes(pose[..., :3, :3], -1, -2)
    found[..., :3, :3] = turn
    found[..., :3, 3] = -(turn @ pose[..., :3, 3, None])[..., 0]
    found[..., 3, 3] = 1.0
    return found
