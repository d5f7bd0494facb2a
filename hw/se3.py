"""Arithmetic of rigid motions in space, as plain tuples (x, y, z, qx, qy, qz, qw).

Metres and unit quaternions. `hw.geometry.Pose3` is the object over it; where many motions are
multiplied, tuples save the objects in between.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

Point3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
RigidMotion = tuple[float, float, float, float, float, float, float]
IDENTITY: RigidMotion = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)

_UNIT_OFF = 0.01
"""Accepted difference of a quaternion's length from 1: of rounding, or of few digits."""
_CLOSE = 1.0 - 1e-10  # cosine of half the angle above which slerp equals linear interpolation


def act(a: RigidMotion, x: float, y: float, z: float) -> Point3:
    """A point moved by a motion, m."""
    ax, ay, az, i, j, k, w = a
    tx = 2.0 * (j * z - k * y)
    ty = 2.0 * (k * x - i * z)
    tz = 2.0 * (i * y - j * x)
    return (
        ax + x + w * tx + j * tz - k * ty,
        ay + y + w * ty + k * tx - i * tz,
        az + z + w * tz + i * ty - j * tx,
    )


def product(a: RigidMotion, b: RigidMotion) -> RigidMotion:
    """The motion a @ b."""
    _, _, _, ai, aj, ak, aw = a
    x, y, z, bi, bj, bk, bw = b
    x, y, z = act(a, x, y, z)
    qx = aw * bi + ai * bw + aj * bk - ak * bj
    qy = aw * bj - ai * bk + aj * bw + ak * bi
    qz = aw * bk + ai * bj - aj * bi + ak * bw
    qw = aw * bw - ai * bi - aj * bj - ak * bk
    # products of many unit quaternions drift by rounding: normalise each time
    scale = 1.0 / math.sqrt(qx * qx + qy * qy + qz * qz + qw * qw)
    return x, y, z, qx * scale, qy * scale, qz * scale, qw * scale


def inverse(a: RigidMotion) -> RigidMotion:
    """The inverse motion."""
    x, y, z, i, j, k, w = a
    turned = (0.0, 0.0, 0.0, -i, -j, -k, w)
    return *act(turned, -x, -y, -z), -i, -j, -k, w


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


def unit_quaternion(qx: float, qy: float, qz: float, qw: float) -> Quaternion:
    """A quaternion from outside data, normalised; one of length 1 within 1e-12 as it is.

    Raises:
        ValueError: it is no unit quaternion within 1 %, or a value is NaN or infinite.
    """
    length = math.sqrt(qx * qx + qy * qy + qz * qz + qw * qw)
    if abs(length - 1.0) <= 1e-12:
        return qx, qy, qz, qw
    if not abs(length - 1.0) <= _UNIT_OFF:  # also NaN
        raise ValueError(f"the quaternion has length {length:.3g}; that of a rotation has length 1")
    return qx / length, qy / length, qz / length, qw / length


def quaternion_of(rows: Sequence[Sequence[float]]) -> Quaternion:
    """The unit quaternion of a rotation matrix, the first three columns of `rows` (Shepperd 1978).

    4 qw^2 - 1 = trace and 4 qx^2 - 1 = 2 m00 - trace, ...: the largest of trace, m00, m11, m22
    tells the largest component. q is the quaternion times 4 of it, so its length is at least 2.
    """
    m, trace = rows, rows[0][0] + rows[1][1] + rows[2][2]
    squares = [trace, m[0][0], m[1][1], m[2][2]]
    largest = squares.index(max(squares))
    if largest == 0:
        q = (m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], 1.0 + trace)
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        axis = [0.0, 0.0, 0.0]
        axis[i] = 1.0 + m[i][i] - m[j][j] - m[k][k]
        axis[j] = m[j][i] + m[i][j]
        axis[k] = m[k][i] + m[i][k]
        q = (axis[0], axis[1], axis[2], m[k][j] - m[j][k])
    x, y, z, w = q
    length = (x * x + y * y + z * z + w * w) ** 0.5
    return x / length, y / length, z / length, w / length
