"""Limits on a base's speed and acceleration, and its brakes.

Speed and acceleration are limited as the norm of the planar vector (R50), so that no direction is
favoured; a command beyond a limit is scaled as a whole and keeps its direction. Wheel rates are
limited too: a Mecanum base turns its wheels faster sideways and in rotation than straight ahead.

Simulated wheels and the chain of real ones compute the next velocity here and pass it to the safety
chain; what that cuts is braked away.
"""

from __future__ import annotations

import math

import numpy as np

from hw.geometry import Twist2
from hw.interfaces import DriveMode
from hw.jit import Struct, Structs, compiled, example, record_type
from hw.model import BaseModel, MotionLimits
from hw.safety.separation import Velocity

TURN_SHARE = math.sqrt(0.5)
"""Share of the acceleration that a differential base may spend on curves (centripetal)."""

PlanarState = tuple[float, float, float, Velocity]
"""Displacement dx, dy over the floor (m), rotation (rad), and the velocity at the end: vx, vy (m/s)
along fixed axes of the floor, those of the yaw, and wz (rad/s)."""
STANDSTILL: Velocity = (0.0, 0.0, 0.0)
SIDEWAYS = 1e-6
"""Sideways velocities up to this, m/s, are rounding."""


RAMPS = record_type(
    ("max_speed", "f8"), ("max_rate", "f8"), ("wheel_speed", "f8"), ("lever", "f8"),
    ("gentle", "f8", (2,)), ("hard", "f8", (2,)),
)  # fmt: skip
"""Limits of speed, m/s, yaw rate, rad/s, and the wheels' rim, m/s, with its lever, m; accelerations
of ramps and of brakes, m/s2 and rad/s2."""


def require_rolling(command: Twist2) -> None:
    """Refuse a command (base frame) that a differential base cannot follow.

    Raises:
        ValueError: it goes sideways.
    """
    if abs(command.vy) > SIDEWAYS:
        raise ValueError(
            f"base: {command.vy:.3g} m/s sideways; in the mode differential it drives along its "
            "heading only: turn first, or take a robot whose base.modes has omni"
        )


class Ramps:
    """The limits of a body and of a profile; `figures` are those as (1,) of `RAMPS`."""

    def __init__(self, model: BaseModel, limits: MotionLimits) -> None:
        self.figures: Structs = np.zeros(1, RAMPS)
        ramps = self.figures[0]
        ramps.max_speed = min(model.max_speed, limits.base_speed)
        ramps.max_rate = min(model.max_yaw_rate, limits.base_yaw_rate)
        ramps.wheel_speed = model.rim_speed
        ramps.lever = lever = model.lever
        acceleration, yaw_acceleration = limits.base_acceleration, limits.base_yaw_acceleration
        brakes = model.brake_deceleration
        ramps.gentle = acceleration, yaw_acceleration
        ramps.hard = max(acceleration, brakes), max(yaw_acceleration, brakes / lever)

    def limited(self, command: Twist2, mode: DriveMode) -> Twist2:
        """A command (base frame) scaled to what the limits and the wheels allow; see `limited`."""
        vx, vy, wz = float(command.vx), float(command.vy), float(command.wz)
        cut, *found = _limited(self.figures, vx, vy, wz, mode == "omni")
        return Twist2(*found) if cut else command

    def toward(
        self, yaw: float, now: Velocity, target: Twist2, h: float, mode: DriveMode, braked: bool
    ) -> PlanarState:
        """The motion of h s towards a velocity (base frame), within the ramps or the brakes."""
        wanted = float(target.vx), float(target.vy), float(target.wz)
        found: PlanarState = _toward(self.figures, yaw, now, wanted, h, mode == "omni", braked)
        return found


def twist_after(yaw: float, motion: PlanarState, mode: DriveMode) -> Twist2:
    """The velocity, base frame, at the end of a motion that began with this yaw."""
    return Twist2(*velocity_after(yaw, motion, mode == "omni"))


@compiled
def limited(ramps: Struct, command: Velocity, omni: bool) -> Velocity:
    """A command (base frame) scaled to what the limits and the wheels allow.

    The rim speed of the fastest Mecanum wheel is |vx| + |vy| + lever |wz|
    (`hw.drivers.can.mecanum`).
    """
    vx, vy, wz = command
    vy = vy if omni else 0.0
    speed, wheels = math.hypot(vx, vy), abs(vx) + abs(vy) + ramps.lever * abs(wz)
    scale = 1.0
    if speed > ramps.max_speed:
        scale = ramps.max_speed / speed
    if abs(wz) * scale > ramps.max_rate:
        scale = ramps.max_rate / abs(wz)
    if wheels * scale > ramps.wheel_speed:
        scale = ramps.wheel_speed / wheels
    return scale * vx, scale * vy, scale * wz


@compiled
def toward(
    ramps: Struct, yaw: float, now: Velocity, target: Velocity, h: float, omni: bool, braked: bool
) -> PlanarState:
    """The motion of h s towards a velocity (base frame), within the ramps or the brakes."""
    a, b = ramps.hard if braked else ramps.gentle
    return _slide(yaw, now, target, h, a, b) if omni else _roll(yaw, now, target, h, a, b)


@compiled
def velocity_after(yaw: float, motion: PlanarState, omni: bool) -> Velocity:
    """The velocity, base frame, at the end of a motion that began with this yaw."""
    _, _, turn, (vx, vy, wz) = motion
    c, s = math.cos(yaw + turn), math.sin(yaw + turn)
    return c * vx + s * vy, c * vy - s * vx if omni else 0.0, wz


@compiled
def _slide(
    yaw: float, now: Velocity, target: Velocity, h: float, a: float, b: float
) -> PlanarState:
    """The motion of an omni base: the target is taken along its axes at mid-step.

    The velocity changes evenly by d over the time `ramp` and then stays, which adds
    d (h - ramp / 2) to the way.
    """
    vx, vy, rate = now
    turn, wz = _ramp(rate, target[2], b, h)
    middle = yaw + 0.5 * turn
    c, s = math.cos(middle), math.sin(middle)
    dx = c * target[0] - s * target[1] - vx
    dy = s * target[0] + c * target[1] - vy
    missing = math.hypot(dx, dy)
    ramp = h
    if missing > a * h:
        dx, dy = dx * a * h / missing, dy * a * h / missing
    else:
        ramp = missing / a
    rest = h - 0.5 * ramp
    return vx * h + dx * rest, vy * h + dy * rest, turn, (vx + dx, vy + dy, wz)


@compiled
def _roll(yaw: float, now: Velocity, target: Velocity, h: float, a: float, b: float) -> PlanarState:
    """The motion of a differential base, within |acceleration| <= a.

    The wanted turn rate w is limited to a centripetal acceleration |v w| <= TURN_SHARE a; along
    the heading sqrt(a^2 - (v w)^2) is left.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    speed = c * now[0] + s * now[1]
    bound = TURN_SHARE * a
    rate = min(abs(target[2]), bound / max(abs(speed), 1e-9))
    turn, wz = _ramp(now[2], math.copysign(rate, target[2]), b, h)
    curve = (abs(speed) + a * h) * max(abs(now[2]), abs(wz))
    along = math.sqrt(max(0.0, a * a - curve * curve))
    way, speed = _ramp(speed, target[0], along, h)
    after, middle = yaw + turn, yaw + 0.5 * turn
    velocity = (speed * math.cos(after), speed * math.sin(after), wz)
    return way * math.cos(middle), way * math.sin(middle), turn, velocity


@compiled
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


@compiled
def _limited(
    figures: Structs, vx: float, vy: float, wz: float, omni: bool
) -> tuple[bool, float, float, float]:
    x, y, z = limited(figures[0], (vx, vy, wz), omni)
    return x != vx or y != vy or z != wz, x, y, z


@compiled
def _toward(
    figures: Structs, yaw: float, now: Velocity, target: Velocity, h: float, omni: bool,
    braked: bool,
) -> PlanarState:  # fmt: skip
    return toward(figures[0], yaw, now, target, h, omni, braked)


@example
def _example() -> None:
    figures: Structs = np.ones(1, RAMPS)
    _limited(figures, 0.0, 0.0, 0.0, True)
    motion = _toward(figures, 0.0, STANDSTILL, STANDSTILL, 0.01, True, False)
    velocity_after(0.0, motion, True)
