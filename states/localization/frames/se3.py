"""Arithmetic of rigid motions as plain tuples (x, y, z, qx, qy, qz, qw).

The same as `Pose3`'s, but without intermediate objects: a lookup over five edges creates just one.
"""

from __future__ import annotations

import math

from hw import Pose3, unit_quaternion

RigidMotion = tuple[float, float, float, float, float, float, float]
IDENTITY: RigidMotion = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)

_CLOSE = 1.0 - 1e-10  # cosine of half the angle above which slerp equals linear interpolation


def checked(parent: str, child: str, pose: Pose3) -> RigidMotion:
    """The pose of a child in its parent, with its quaternion normalised.

    Raises:
        ValueError: a value is not finite, no unit quaternion, or a frame is its own parent.
    """
    where = f"{child} in {parent}"
    if parent == child:
        raise ValueError(f"{where}: a frame cannot be its own parent")
    edge = (pose.x, pose.y, pose.z, pose.qx, pose.qy, pose.qz, pose.qw)
    if not math.isfinite(sum(edge)):
        raise ValueError(f"{where}: {pose} is not finite")
    try:
        return (pose.x, pose.y, pose.z, *unit_quaternion(*edge[3:]))
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def between(a: RigidMotion, b: RigidMotion, share: float) -> RigidMotion:
    """From a (share 0) to b (1): position linear, orientation by slerp the shorter way."""
    ax, ay, az, ai, aj, ak, aw = a
    bx, by, bz, bi, bj, bk, bw = b
    cosine = ai * bi + aj * bj + ak * bk + aw * bw
    rest = 1.0 - share
    u, v = rest, share
    if abs(cosine) < _CLOSE:
        half = math.acos(abs(cosine))
        scale = 1.0 / math.sin(half)
        u, v = math.sin(rest * half) * scale, math.sin(share * half) * scale
    if cosine < 0.0:
        v = -v
    qx, qy, qz, qw = u * ai + v * bi, u * aj + v * bj, u * ak + v * bk, u * aw + v * bw
    scale = 1.0 / math.sqrt(qx * qx + qy * qy + qz * qz + qw * qw)
    x, y, z = rest * ax + share * bx, rest * ay + share * by, rest * az + share * bz
    return (x, y, z, qx * scale, qy * scale, qz * scale, qw * scale)


def product(a: RigidMotion, b: RigidMotion) -> RigidMotion:
    """The motion a @ b."""
    ax, ay, az, ai, aj, ak, aw = a
    x, y, z, bi, bj, bk, bw = b
    tx = 2.0 * (aj * z - ak * y)
    ty = 2.0 * (ak * x - ai * z)
    tz = 2.0 * (ai * y - aj * x)
    qx = aw * bi + ai * bw + aj * bk - ak * bj
    qy = aw * bj - ai * bk + aj * bw + ak * bi
    qz = aw * bk + ai * bj - aj * bi + ak * bw
    qw = aw * bw - ai * bi - aj * bj - ak * bk
    scale = 1.0 / math.sqrt(qx * qx + qy * qy + qz * qz + qw * qw)
    return (
        ax + x + aw * tx + aj * tz - ak * ty,
        ay + y + aw * ty + ak * tx - ai * tz,
        az + z + aw * tz + ai * ty - aj * tx,
        qx * scale,
        qy * scale,
        qz * scale,
        qw * scale,
    )


def inverse(a: RigidMotion) -> RigidMotion:
    """The inverse motion."""
    x, y, z, i, j, k, w = a
    turned = (0.0, 0.0, 0.0, -i, -j, -k, w)
    back = product(turned, (-x, -y, -z, 0.0, 0.0, 0.0, 1.0))
    return (back[0], back[1], back[2], -i, -j, -k, w)
