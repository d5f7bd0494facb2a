"""Limits on a base's speed and acceleration, and its brakes.

Speed and acceleration are limited as the norm of the planar vector (R50), so that no direction is
favoured; a command beyond a limit is scaled as a whole and keeps its direction. Wheel rates are
limited too: a Mecanum base turns its wheels faster sideways and in rotation than straight ahead.

Simulated wheels and the chain of real ones compute the next velocity here and pass it to the safety
chain; what that cuts is braked away.
"""

from __future__ import annotations

import math

from hw.geometry import Twist2
from hw.interfaces import DriveMode
from hw.model import BaseModel, MotionLimits

TURN_SHARE = math.sqrt(0.5)
"""Share of the acceleration that a differential base may spend on curves (centripetal)."""

Velocity = tuple[float, float, float]
"""vx, vy (m/s) along fixed axes of the floor, those of the yaw, and wz (rad/s)."""
PlanarState = tuple[float, float, float, Velocity]
"""Displacement dx, dy over the floor (m), rotation (rad), and the velocity at the end."""
STANDSTILL: Velocity = (0.0, 0.0, 0.0)


class Ramps:
    """The limits of a body and of a profile; stateless."""

    def __init__(self, model: BaseModel, limits: MotionLimits) -> None:
        self._max_speed = min(model.max_speed, limits.base_speed)
        self._max_rate = min(model.max_yaw_rate, limits.base_yaw_rate)
        self._wheel_speed = model.max_wheel_rate * model.wheel_radius
        self._lever = model.half_wheelbase + model.half_track
        acceleration, yaw_acceleration = limits.base_acceleration, limits.base_yaw_acceleration
        brakes = model.brake_deceleration
        self._gentle = acceleration, yaw_acceleration
        self._hard = max(acceleration, brakes), max(yaw_acceleration, brakes / self._lever)

    def limited(self, command: Twist2, mode: DriveMode) -> Twist2:
        """A command (base frame) scaled to what the limits and the wheels allow.

        The rim speed of the fastest Mecanum wheel is |vx| + |vy| + lever |wz|
        (`hw.drivers.can.mecanum`).
        """
        vx, wz = command.vx, command.wz
        vy = command.vy if mode == "omni" else 0.0
        speed, wheels = math.hypot(vx, vy), abs(vx) + abs(vy) + self._lever * abs(wz)
        scale = 1.0
        if speed > self._max_speed:
            scale = self._max_speed / speed
        if abs(wz) * scale > self._max_rate:
            scale = self._max_rate / abs(wz)
        if wheels * scale > self._wheel_speed:
            scale = self._wheel_speed / wheels
        if scale == 1.0 and vy == command.vy:
            return command
        return Twist2(scale * vx, scale * vy, scale * wz)

    def toward(
        self, yaw: float, now: Velocity, target: Twist2, h: float, mode: DriveMode, braked: bool
    ) -> PlanarState:
        """The motion of h s towards a velocity (base frame), within the ramps or the brakes."""
        slopes = self._hard if braked else self._gentle
        if mode == "omni":
            return _slide(yaw, now, target, h, *slopes)
        return _roll(yaw, now, target, h, *slopes)


def twist_after(yaw: float, motion: PlanarState, mode: DriveMode) -> Twist2:
    """The velocity, base frame, at the end of a motion that began with this yaw."""
    _, _, turn, (vx, vy, wz) = motion
    c, s = math.cos(yaw + turn), math.sin(yaw + turn)
    return Twist2(c * vx + s * vy, c * vy - s * vx if mode == "omni" else 0.0, wz)


def _slide(yaw: float, now: Velocity, target: Twist2, h: float, a: float, b: float) -> PlanarState:
    """The motion of an omni base: the target is taken along its axes at mid-step.

    The velocity changes evenly by d over the time `ramp` and then stays, which adds
    d (h - ramp / 2) to the way.
    """
    vx, vy, rate = now
    turn, wz = _ramp(rate, target.wz, b, h)
    middle = yaw + 0.5 * turn
    c, s = math.cos(middle), math.sin(middle)
    dx = c * target.vx - s * target.vy - vx
    dy = s * target.vx + c * target.vy - vy
    missing = math.hypot(dx, dy)
    ramp = h
    if missing > a * h:
        dx, dy = dx * a * h / missing, dy * a * h / missing
    else:
        ramp = missing / a
    rest = h - 0.5 * ramp
    return vx * h + dx * rest, vy * h + dy * rest, turn, (vx + dx, vy + dy, wz)


def _roll(yaw: float, now: Velocity, target: Twist2, h: float, a: float, b: float) -> PlanarState:
    """The motion of a differential base, within |acceleration| <= a.

    The wanted turn rate w is limited to a centripetal acceleration |v w| <= TURN_SHARE a; along
    the heading sqrt(a^2 - (v w)^2) is left.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    speed = c * now[0] + s * now[1]
    bound = TURN_SHARE * a
    rate = min(abs(target.wz), bound / max(abs(speed), 1e-9))
    turn, wz = _ramp(now[2], math.copysign(rate, target.wz), b, h)
    curve = (abs(speed) + a * h) * max(abs(now[2]), abs(wz))
    along = math.sqrt(max(0.0, a * a - curve * curve))
    way, speed = _ramp(speed, target.vx, along, h)
    after, middle = yaw + turn, yaw + 0.5 * turn
    velocity = (speed * math.cos(after), speed * math.sin(after), wz)
    return way * math.cos(middle), way * math.sin(middle), turn, velocity


def _ramp(value: float, target: float, slope: float, h: float) -> tuple[float, float]:
    """Integral of a value that goes to the target at this slope within h s, and its end value."""
    missing = target - value
    if abs(missing) > slope * h:
        reached = value + math.copysign(slope * h, missing)
        return 0.5 * (value + reached) * h, reached
    if missing == 0.0:
        return value * h, value
    ramp = abs(missing) / slope
    return 0.5 * (value + target) * ramp + target * (h - ramp), target
