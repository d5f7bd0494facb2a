"""Forward kinematics, Jacobian, and deviations between poses (R26).

Poses are 4x4 matrices (m), joints (6,) or (n, 6) arrays in rad. Everything is in the rover frame of
`states.arm.kinematics.model`. One compiled implementation serves one pose and many, so that a joint
set gives the same bits alone and in a batch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hw import Pose3
from hw.model import FLANGE, Placement
from states.arm.kinematics.kernels import (
    Array,
    Integers,
    greatest_speeds,
    place_links,
    place_tcp,
    slopes,
)
from states.arm.kinematics.model import Manipulator


@dataclass(frozen=True, slots=True, eq=False)
class KinematicChain:
    """An arm as arrays, all read-only.

    `base` is rover_from_base and `tip` flange_from_tcp, both (4, 4); `origins` (6, 4, 4) place
    each joint in the link before it; `dh` holds d1, a2, a3, d4, d5, d6 of the nominal chain;
    `lower`, `upper` and `max_speed` are (6,). `nominal` is true where `origins` follow `dh`.
    `points` (k, 3) of the moving `links` (k,), in their frames, are those whose speed is limited:
    first the tcp, then both ends of every capsule's axis.
    """

    base: Array
    origins: Array
    tip: Array
    dh: Array
    lower: Array
    upper: Array
    max_speed: Array
    nominal: bool
    links: Integers
    points: Array

    @classmethod
    def of(cls, model: Manipulator) -> KinematicChain:
        """The chain of a model; calibrated where the model is."""
        dh = model.dh
        links, points = _fast_points(model)
        return cls(
            base=_fixed(matrix(model.mount)),
            origins=_fixed([matrix(p) for p in model.placements or dh.placements()]),
            tip=_fixed(matrix(model.tool.tcp)),
            dh=_fixed([dh.d1, dh.a2, dh.a3, dh.d4, dh.d5, dh.d6]),
            lower=_fixed(model.lower),
            upper=_fixed(model.upper),
            max_speed=_fixed(model.max_speed),
            nominal=model.placements is None,
            links=links,
            points=points,
        )


def forward(chain: KinematicChain, joints: ArrayLike) -> Array:
    """rover_from_tcp of joints (6,) or (n, 6): (4, 4) or (n, 4, 4)."""
    q, single = _rows(joints)
    poses = np.zeros((len(q), 4, 4))
    place_tcp(chain.base, chain.origins, chain.tip, q, poses)
    return poses[0] if single else poses


def link_frames(chain: KinematicChain, joints: ArrayLike) -> Array:
    """rover_from_link of the base and links 1 to 6 at one joint set, (7, 4, 4)."""
    q, _ = _rows(joints)
    frames = np.zeros((7, 4, 4))
    place_links(chain.base, chain.origins, q[0], frames)
    frames[:, 3, 3] = 1.0
    return frames


def jacobian(chain: KinematicChain, joints: ArrayLike) -> Array:
    """Velocity of the tcp per joint velocity, in the rover frame: (6, 6) or (n, 6, 6).

    Rows 0 to 2 give the linear velocity of the tcp's origin, m per rad; rows 3 to 5 the angular
    velocity, rad per rad.
    """
    q, single = _rows(joints)
    found = np.empty((len(q), 6, 6))
    slopes(chain.base, chain.origins, chain.tip, q, found)
    return found[0] if single else found


def fastest_point(chain: KinematicChain, joints: Array, slope: Array) -> Array:
    """Speed of the fastest of the chain's `points` at joints (n, 6) per unit of dq/dx (n, 6)."""
    found = np.empty(len(joints))
    greatest_speeds(chain.base, chain.origins, chain.links, chain.points, joints, slope, found)
    return found


def tcp_speed(chain: KinematicChain, joints: Array, slope: Array) -> Array:
    """Speed of the tcp at joints (n, 6) per unit of dq/dx (n, 6)."""
    found, tcp = np.empty(len(joints)), slice(0, 1)
    greatest_speeds(
        chain.base, chain.origins, chain.links[tcp], chain.points[tcp], joints, slope, found
    )
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


def matrix(placement: Placement) -> Array:
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


def pose_matrix(pose: Pose3) -> Array:
    """A pose as a 4x4 matrix."""
    found = np.eye(4)
    origin = found[:3, 3] = pose.x, pose.y, pose.z
    for i, axis in enumerate(((1, 0, 0), (0, 1, 0), (0, 0, 1))):
        found[:3, i] = np.subtract(pose.transform(*axis), origin)
    return found


def inverted(pose: Array) -> Array:
    """The inverse of rigid poses (..., 4, 4): R^T and -R^T p."""
    found = np.zeros_like(pose)
    turn = np.swapaxes(pose[..., :3, :3], -1, -2)
    found[..., :3, :3] = turn
    found[..., :3, 3] = -(turn @ pose[..., :3, 3, None])[..., 0]
    found[..., 3, 3] = 1.0
    return found


def _fast_points(model: Manipulator) -> tuple[Integers, Array]:
    found = {(FLANGE, model.tool.tcp.xyz): None}
    for capsule in (*model.capsules, *model.tool.capsules):
        if capsule.link > 0:
            found |= {(capsule.link, capsule.start): None, (capsule.link, capsule.end): None}
    links = np.array([link for link, _ in found], dtype=np.int64)
    return links, _fixed([point for _, point in found])


def _fixed(values: ArrayLike) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def _rows(joints: ArrayLike) -> tuple[Array, bool]:
    q = np.ascontiguousarray(joints, dtype=np.float64)
    if q.shape[-1:] != (6,) or q.ndim > 2:
        raise ValueError(f"joints have shape {q.shape}; (6,) or (n, 6) is needed")
    return q.reshape(-1, 6), q.ndim == 1
