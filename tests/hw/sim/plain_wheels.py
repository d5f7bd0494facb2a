"""Ramps and cycles of simulated wheels in plain Python, by which the compiled ones are judged.

Nothing is shared with `hw.safety` and `hw.sim` but the models; floats are computed in one order.
"""

from __future__ import annotations

import math
from typing import Any

from hw.geometry import Pose2, Twist2, wrap
from hw.model.robot import MotionLimits, RobotModel
from hw.safety.cycle_record import SafetyRecord
from tests.hw.safety.plain_rule import PlainRule

Velocity = tuple[float, float, float]
PlanarState = tuple[float, float, float, Velocity]


class PlainRamps:
    def __init__(self, model: Any, limits: MotionLimits) -> None:
        self._max_speed = min(model.max_speed, limits.base_speed)
        self._max_rate = min(model.max_yaw_rate, limits.base_yaw_rate)
        self._wheel_speed = model.max_wheel_rate * model.wheel_radius
        self._lever = model.half_wheelbase + model.half_track
        acceleration, yaw_acceleration = limits.base_acceleration, limits.base_yaw_acceleration
        brakes = model.brake_deceleration
        self._gentle = acceleration, yaw_acceleration
        self._hard = max(acceleration, brakes), max(yaw_acceleration, brakes / self._lever)

    def limited(self, command: Twist2, mode: str) -> Twist2:
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
        self, yaw: float, now: Velocity, target: Twist2, h: float, mode: str, braked: bool
    ) -> PlanarState:
        slopes = self._hard if braked else self._gentle
        if mode == "omni":
            return _slide(yaw, now, target, h, *slopes)
        return _roll(yaw, now, target, h, *slopes)


def twist_after(yaw: float, motion: PlanarState, mode: str) -> Twist2:
    _, _, turn, (vx, vy, wz) = motion
    c, s = math.cos(yaw + turn), math.sin(yaw + turn)
    return Twist2(c * vx + s * vy, c * vy - s * vx if mode == "omni" else 0.0, wz)


def _slide(yaw: float, now: Velocity, target: Twist2, h: float, a: float, b: float) -> PlanarState:
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
    c, s = math.cos(yaw), math.sin(yaw)
    speed = c * now[0] + s * now[1]
    bound = math.sqrt(0.5) * a
    rate = min(abs(target.wz), bound / max(abs(speed), 1e-9))
    turn, wz = _ramp(now[2], math.copysign(rate, target.wz), b, h)
    curve = (abs(speed) + a * h) * max(abs(now[2]), abs(wz))
    along = math.sqrt(max(0.0, a * a - curve * curve))
    way, speed = _ramp(speed, target.vx, along, h)
    after, middle = yaw + turn, yaw + 0.5 * turn
    velocity = (speed * math.cos(after), speed * math.sin(after), wz)
    return way * math.cos(middle), way * math.sin(middle), turn, velocity


def _ramp(value: float, target: float, slope: float, h: float) -> tuple[float, float]:
    missing = target - value
    if abs(missing) > slope * h:
        reached = value + math.copysign(slope * h, missing)
        return 0.5 * (value + reached) * h, reached
    if missing == 0.0:
        return value * h, value
    ramp = abs(missing) / slope
    return 0.5 * (value + target) * ramp + target * (h - ramp), target


class PlainWheels:
    """The loop of a `SimBase` that drives."""

    def __init__(
        self, robot: RobotModel, limits: MotionLimits, start: Pose2, rule: PlainRule
    ) -> None:
        base, outline = robot.base, robot.footprint
        self.rule, self.mode, self.wanted_mode, self.braked = rule, "omni", "omni", False
        self.pose, self.twist = start, Twist2(0.0, 0.0, 0.0)
        self.velocity = (0.0, 0.0, 0.0)
        self._records: list[SafetyRecord] = []
        self.distance = self.energy = self.kinetic = 0.0
        self._ramps, self._mass = PlainRamps(base, limits), robot.mass
        self._rolling = base.rolling_resistance * robot.mass * 9.81
        self._inertia = robot.mass * (outline.length**2 + outline.width**2) / 12.0

    def taken(self) -> list[SafetyRecord]:
        """The records since the last call."""
        found, self._records = self._records, []
        return found

    def advance(self, command: Twist2, since: int, until: int, stamp: int) -> None:
        """Drive towards a velocity that was commanded at this stamp."""
        target = Twist2(0.0) if self.braked else self._ramps.limited(command, self.wanted_mode)
        if self.velocity == (0.0, 0.0, 0.0):
            self.mode = self.wanted_mode
            if target == Twist2(0.0):
                self.twist = Twist2(0.0)
                self.rule.rest(since)
                return
        elif self.mode != self.wanted_mode:
            target = Twist2(0.0)
        self._move(target, since, until, stamp)

    def _move(self, target: Twist2, since: int, until: int, stamp: int) -> None:
        span, rule = until - since, self.rule
        turning = max(abs(self.velocity[2]), abs(target.wz)) * (span * 1e-9)
        cycles = max(1, math.ceil(turning / 0.01), -(-span // 10_000_000))
        h = span * 1e-9 / cycles
        for k in range(cycles):
            now, yaw = since + span * k // cycles, self.pose.yaw
            motion = self._toward(target, h, self.braked)
            command = twist_after(yaw, motion, self.mode)
            rule.holonomic = self.mode == "omni"
            record = rule.admit(now, command, stamp, self.pose, self.twist)
            self._records.append(record)
            admitted = record.admitted
            if admitted is not command:
                slower = self._ramps.limited(admitted, self.wanted_mode)
                motion = self._toward(slower, h, True)
                command = twist_after(yaw, motion, self.mode)
            self._step(motion)
            self.twist = command

    def _toward(self, target: Twist2, h: float, braked: bool) -> PlanarState:
        return self._ramps.toward(self.pose.yaw, self.velocity, target, h, self.mode, braked)

    def _step(self, motion: PlanarState) -> None:
        dx, dy, turn, (vx, vy, wz) = motion
        way, pose = math.hypot(dx, dy), self.pose
        self.pose = Pose2(pose.x + dx, pose.y + dy, wrap(pose.yaw + turn))
        self.velocity = vx, vy, wz
        self.distance += way
        kinetic = 0.5 * (self._mass * (vx * vx + vy * vy) + self._inertia * wz * wz)
        self.energy += abs(kinetic - self.kinetic) + self._rolling * way
        self.kinetic = kinetic
