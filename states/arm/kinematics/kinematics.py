"""Forward kinematics, Jacobian, and deviations between poses (R26).

Poses are 4x4 matrices (m), joints (j,) or (n, j) arrays in rad. Everything is in the rover frame of
`states.arm.kinematics.model`. One compiled implementation serves one pose and many, so that a joint
set gives the same bits alone and in a batch.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hw import Pose3
from states.arm.kinematics.kernels import Array, greatest_speeds, place_links, place_tcp, slopes
from states.arm.kinematics.model import Manipulator


def forward(arm: Manipulator, joints: ArrayLike) -> Array:
    """rover_from_tcp of joints (j,) or (n, j): (4, 4) or (n, 4, 4)."""
    q, single = _rows(arm, joints)
    poses = np.zeros((len(q), 4, 4))
    place_tcp(arm.base, arm.origins, arm.tip, q, poses)
    return poses[0] if single else poses


def link_frames(arm: Manipulator, joints: ArrayLike) -> Array:
    """rover_from_link of the base and the j links at one joint set, (j + 1, 4, 4)."""
    q, _ = _rows(arm, joints)
    frames = np.zeros((arm.count + 1, 4, 4))
    place_links(arm.base, arm.origins, q[0], frames)
    frames[:, 3, 3] = 1.0
    return frames


def jacobian(arm: Manipulator, joints: ArrayLike) -> Array:
    """Velocity of the tcp per joint velocity, in the rover frame: (6, j) or (n, 6, j).

    Rows 0 to 2 give the linear velocity of the tcp's origin, m per rad; rows 3 to 5 the angular
    velocity, rad per rad.
    """
    q, single = _rows(arm, joints)
    found = np.empty((len(q), 6, arm.count))
    slopes(arm.base, arm.origins, arm.tip, q, found)
    return found[0] if single else found


def fastest_point(arm: Manipulator, joints: Array, slope: Array) -> Array:
    """Speed of the fastest of `arm.limited_points` at joints (n, j) per unit of dq/dx (n, j)."""
    found = np.empty(len(joints))
    greatest_speeds(arm.base, arm.origins, *arm.limited_points, joints, slope, found)
    return found


def tcp_speed(arm: Manipulator, joints: Array, slope: Array) -> Array:
    """Speed of the tcp at joints (n, j) per unit of dq/dx (n, j)."""
    found = np.empty(len(joints))
    links, points = arm.limited_points
    greatest_speeds(arm.base, arm.origins, links[:1], points[:1], joints, slope, found)
    return found


def deviation(a: Array, b: Array) -> tuple[Array, Array]:
    """Distance in m and angle in rad between poses (..., 4, 4), element by element."""
    distance = np.linalg.norm(a[..., :3, 3] - b[..., :3, 3], axis=-1)
    return distance, np.linalg.norm(rotation_vector(a, b), axis=-1)


def rotation_vector(a: Array, b: Array) -> Array:
    """Rotation vector from orientation a to b, in the frame in which both are given, (..., 3).

    With R = b a^T: the skew part of R holds axis * sin(angle), and (tr R - 1) / 2 is cos(angle).
    atan2 of both is exact for small angles too. At half a turn the axis is arbitrary, the angle is
    right.
    """
    turn = b[..., :3, :3] @ np.swapaxes(a[..., :3, :3], -1, -2)
    sine = 0.5 * np.stack(
        [
            turn[..., 2, 1] - turn[..., 1, 2],
            turn[..., 0, 2] - turn[..., 2, 0],
            turn[..., 1, 0] - turn[..., 0, 1],
        ],
        axis=-1,
    )
    length = np.linalg.norm(sine, axis=-1)
    angle = np.arctan2(length, 0.5 * (np.trace(turn, axis1=-2, axis2=-1) - 1.0))
    axis = np.divide(sine, length[..., None], out=np.zeros_like(sine), where=length[..., None] > 0)
    axis[..., 0] = np.where(length > 0.0, axis[..., 0], 1.0)
    return np.asarray(axis * angle[..., None])


def pose_matrix(pose: Pose3) -> Array:
    """A pose as a 4x4 matrix."""
    found = np.eye(4)
    origin = found[:3, 3] = pose.x, pose.y, pose.z
    for i, axis in enumerate(((1, 0, 0), (0, 1, 0), (0, 0, 1))):
        found[:3, i] = np.subtract(pose.transform(*axis), origin)
    return found


def _rows(arm: Manipulator, joints: ArrayLike) -> tuple[Array, bool]:
    q, count = np.ascontiguousarray(joints, dtype=np.float64), arm.count
    if q.shape[-1:] != (count,) or q.ndim > 2:
        raise ValueError(f"joints have shape {q.shape}; ({count},) or (n, {count}) is needed")
    return q.reshape(-1, count), q.ndim == 1
