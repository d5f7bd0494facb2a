"""Poses and velocities in the plane as tuples, for compiled functions.

Each is computed by the operations of `Pose2`, `displacement_of` and `velocity_of` in their order,
so that both give the same bits.
"""

from __future__ import annotations

import math

from hw import Pose2, compiled, wrapped

Planar = tuple[float, float, float]
"""x, y, m, and yaw, rad; or a velocity vx, vy, m/s, and wz, rad/s."""


def place_of(pose: Pose2) -> Planar:
    """The same as a tuple of floats."""
    return float(pose.x), float(pose.y), float(pose.yaw)


@compiled
def composed(a: Planar, b: Planar) -> Planar:
    """Composition: `a @ b`."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], wrapped(a[2] + b[2])


@compiled
def step(a: Planar, b: Planar) -> Planar:
    """Pose b as seen from a: the inverse of a, times b."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return composed((-c * a[0] - s * a[1], s * a[0] - c * a[1], wrapped(-a[2])), b)


@compiled
def way(velocity: Planar, time: float) -> Planar:
    """Displacement by a constant velocity in the moving frame, over `time` s: an arc."""
    turn = velocity[2] * time
    along, across = 1.0, 0.5 * turn
    if abs(turn) >= 1e-9:
        sine = math.sin(0.5 * turn)
        along, across = math.sin(turn) / turn, 2.0 * (sine * sine) / turn
    x, y = velocity[0] * time, velocity[1] * time
    return along * x - across * y, across * x + along * y, wrapped(turn)


@compiled
def pace(moved: Planar, time: float) -> Planar:
    """The constant velocity in the moving frame that gives this displacement in `time` s."""
    half = 0.5 * moved[2]
    along = 1.0 - half * half / 3.0 if abs(half) < 1e-4 else half / math.tan(half)
    x, y = along * moved[0] + half * moved[1], along * moved[1] - half * moved[0]
    return x / time, y / time, moved[2] / time
