"""The gap between robot and user, the separation they need, and the closing speed of a velocity.

Gaps are from the footprint to the user's cylinder; m, s, m/s. The needed separation is that of
ISO/TS 15066, 5.5.4, for a constant deceleration. The robot needs a reaction time T and then brakes
from its closing speed v with the deceleration a, so it covers v T + v^2 / 2a within T + v / a.
Meanwhile the user, last seen `age` ago, comes closer at speed v_h. With a margin C that gives

    S_p = v_h (age + T + v / a) + v T + v^2 / 2a + C

C covers the user's reach and the position errors of both; the part of the base's position error
beyond the share in C is added to S_p.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from hw.geometry import Twist2
from hw.jit import compiled

Velocity = tuple[float, float, float]
"""vx, vy, m/s, and wz, rad/s."""
PlanarPose = tuple[float, float, float]
"""x, y in the map, m, and the yaw, rad."""
Braking = tuple[float, float, float]
"""The braking of a robot: a in m/s2, T in s, C in m (see the module)."""
_TOUCH = 1e-9
"""Below this distance, m, the normal of the nearest side replaces the direction to the user."""
_NOTHING = 1e-12
"""Less distance than this counts as none, m."""
_STILL = 1e-6
"""A closing speed below this is rounding, m/s."""
POSE_ERROR_M = 0.075
"""Three standard deviations of the base's position that C covers, m: half of its 0.15 m."""


class Nearness(NamedTuple):
    """The user relative to the footprint, in the base frame.

    `gap`: free distance, m, below 0 in a touch. `nx`, `ny`: unit vector from the nearest point of
    the footprint to the user. `lever`: m; a rotation of w rad/s closes the gap by w * lever m/s.
    """

    gap: float
    nx: float
    ny: float
    lever: float

    def closing(self, twist: Twist2) -> float:
        """Closing speed of this velocity (base frame), m/s; see `closing_speed`."""
        return closing_speed(self, (twist.vx, twist.vy, twist.wz))

    def held_back(self, twist: Twist2, allowed: float, holonomic: bool = True) -> Twist2:
        """The velocity with its closing parts scaled down; the same object if it need not be."""
        if self.closing(twist) <= allowed:
            return twist
        return Twist2(*held_back(self, (twist.vx, twist.vy, twist.wz), allowed, holonomic))


@compiled
def nearness(half_length: float, half_width: float, x: float, y: float, radius: float) -> Nearness:
    """The nearness of a cylinder about (x, y), base frame, to the rectangle about the origin.

    The nearest point q of the footprint moves with (vx - wz qy, vy + wz qx) as the base moves.
    Its component along the normal n is nx vx + ny vy + wz (qx ny - qy nx): that is the rate at
    which the gap shrinks, and qx ny - qy nx the lever. With the cylinder's centre inside the
    rectangle, q lies on the nearest side.
    """
    qx = x if abs(x) < half_length else math.copysign(half_length, x)
    qy = y if abs(y) < half_width else math.copysign(half_width, y)
    dx, dy = x - qx, y - qy
    distance = math.hypot(dx, dy)
    if distance > _TOUCH:
        nx, ny = dx / distance, dy / distance
    elif half_width - abs(y) <= half_length - abs(x):
        nx, ny = 0.0, math.copysign(1.0, y)
        qy, distance = ny * half_width, abs(y) - half_width
    else:
        nx, ny = math.copysign(1.0, x), 0.0
        qx, distance = nx * half_length, abs(x) - half_length
    return Nearness(distance - radius, nx, ny, qx * ny - qy * nx)


@compiled
def closing_speed(near: Nearness, twist: Velocity) -> float:
    """Closing speed of this velocity (base frame), m/s; parts that open the gap count as 0."""
    vx, vy, wz = twist
    toward = near.nx * vx + near.ny * vy
    turning = near.lever * wz
    return (toward if toward > 0.0 else 0.0) + (turning if turning > 0.0 else 0.0)


@compiled
def held_back(near: Nearness, twist: Velocity, allowed: float, holonomic: bool) -> Velocity:
    """The velocity with its closing parts scaled down to this closing speed, m/s.

    The component towards the user and a closing rotation are scaled by one share; a base that is
    not holonomic keeps its heading and slows.
    """
    closing = closing_speed(near, twist)
    if closing <= allowed:
        return twist
    left = allowed / closing
    vx, vy, wz = twist
    toward = near.nx * vx + near.ny * vy
    if near.lever * wz > 0.0:
        wz *= left
    if toward <= 0.0:
        return vx, vy, wz
    if not holonomic:
        return left * vx, left * vy, wz
    taken = (1.0 - left) * toward
    return vx - taken * near.nx, vy - taken * near.ny, wz


@compiled
def needed_separation(closing: float, user_speed: float, age: float, braking: Braking) -> float:
    """The separation S_p needed at a closing speed, m; 0 if the robot comes no closer."""
    if closing <= _STILL:
        return 0.0
    deceleration, reaction, clearance = braking
    stop = closing / deceleration
    return user_speed * (age + reaction + stop) + closing * (reaction + 0.5 * stop) + clearance


@compiled
def allowed_speed(gap: float, user_speed: float, age: float, braking: Braking) -> float:
    """The closing speed that a gap allows, m/s: the largest v with `needed_separation` <= gap.

    S_p is quadratic in v: v (T + v_h / a) + v^2 / 2a = gap - C - v_h (age + T), where v_h / a is
    how long the user walks per unit of v while the robot brakes. With v_h and C as 0 it is the
    speed that stops at a gap of 0.
    """
    deceleration, reaction, clearance = braking
    room, lag = (
        gap - clearance - user_speed * (age + reaction),
        reaction + user_speed / deceleration,
    )
    if room <= _NOTHING:
        return 0.0
    # a form without cancellation for small rooms
    return 2.0 * room / (lag + math.sqrt(lag * lag + 2.0 * room / deceleration))


@compiled
def pose_error(sigma: float) -> float:
    """What the base's position uncertainty (one standard deviation, m) adds to S_p, m."""
    return max(0.0, 3.0 * sigma - POSE_ERROR_M)
