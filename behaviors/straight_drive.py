"""The velocity that drives straight to a place, as rollouts do, and from which braking is safe."""

from __future__ import annotations

import math

import numpy as np

from behaviors.person import STEP_S
from behaviors.situation import Situation
from hw import STILL, USER_RADIUS, Twist2, compiled, example, wrapped
from hw.safety import nearness
from hw.scene import Point
from states import SubsystemName
from states.environment import Environment
from states.navigation.exact import Array, Triple

Rates = tuple[float, float, float, float, float, float, float]
"""Greatest speed, acceleration and deceleration; a period, and the time until a command of the next
tick acts; length and width of the footprint."""


def command_towards(
    now: Situation, goal: Point, name: SubsystemName, keeps: SubsystemName | None = None
) -> Twist2:
    """The command (base frame) that drives like a rollout, at the speed of a subsystem.

    Standstill instead, if braking straight ahead from the next tick on would end too near to a
    wall, because the drive may be aborted then. `keeps` names the subsystem whose distances from
    walls count, if it is another.
    """
    environment, pose, twist, body = now.environment, now.pose, now.twist, now.user.body
    wanted, ends = _drive_towards(
        (pose.x, pose.y, pose.yaw),
        (twist.vx, twist.vy, twist.wz),
        (body.x, body.y),
        (goal[0], goal[1]),
        _rates(environment, name),
    )
    if len(ends) == 0 or not now.planners[keeps or name].allows_each((pose.x, pose.y), ends):
        return STILL
    return Twist2(*wanted)


def _rates(environment: Environment, name: SubsystemName) -> Rates:
    limits, base, footprint = (
        environment.limits,
        environment.robot.base,
        environment.robot.footprint,
    )
    return (
        float(environment.navigation.named(name).max_speed),
        float(limits.base_acceleration),
        float(base.brake_deceleration),
        float(environment.period),
        float(environment.period + environment.latency),
        float(footprint.length),
        float(footprint.width),
    )


@compiled
def _drive_towards(
    pose: Triple, twist: Triple, user: Point, goal: Point, rates: Rates
) -> tuple[Point, Array]:
    """The command (base frame), and where the robot stands that brakes a tick later, (n, 2).

    There are up to 8 places: wheels that slow down may change their direction as fast as they can
    brake, and the safety chain may brake away the part of a velocity that leads to the user; the
    rest turns away from them, maybe to a wall. None at the goal.
    """
    (x, y, yaw), max_speed, acceleration = pose, rates[0], rates[1]
    dx, dy = goal[0] - x, goal[1] - y
    left = math.hypot(dx, dy)
    if left < 1e-6:
        return (0.0, 0.0), np.empty((0, 2))
    speed = min(max_speed, math.sqrt(2.0 * acceleration * left))
    pace = min(speed / left, 1.0 / STEP_S)
    wanted, motion = (pace * dx, pace * dy), _turned((twist[0], twist[1]), yaw)
    away, ends, count = _to_user(pose, user, rates), np.empty((8, 2)), 0
    for target in (wanted, _held_back(wanted, away)):
        for rate in (acceleration, rates[2]):
            plain = _changed(motion, target, 2.0 * rate * rates[3])
            for vx, vy in (plain, _held_back(plain, away)):
                # times it: the way until braking begins, and braking, v^2 / (2 a)
                braking = rates[4] + math.hypot(vx, vy) / (2.0 * acceleration)
                ends[count, 0], ends[count, 1] = x + braking * vx, y + braking * vy
                count += 1
    return _turned(wanted, -yaw), ends


@compiled
def _turned(velocity: Point, yaw: float) -> Point:
    c, s = math.cos(yaw), math.sin(yaw)
    return c * velocity[0] - s * velocity[1], s * velocity[0] + c * velocity[1]


@compiled
def _changed(velocity: Point, target: Point, by: float) -> Point:
    """A velocity after a change towards a target by so much at most, m/s."""
    ax, ay = target[0] - velocity[0], target[1] - velocity[1]
    share = min(1.0, by / max(1e-9, math.hypot(ax, ay)))
    return velocity[0] + share * ax, velocity[1] + share * ay


@compiled
def _to_user(pose: Triple, user: Point, rates: Rates) -> Point:
    """Unit vector from the nearest point of the footprint to the user, in the axes of the map."""
    x, y, yaw = pose
    c, s = math.cos(yaw), math.sin(yaw)
    ax, ay, back = -c * x - s * y, s * x - c * y, wrapped(-yaw)
    c, s = math.cos(back), math.sin(back)
    ux, uy = ax + c * user[0] - s * user[1], ay + s * user[0] + c * user[1]
    near = nearness(0.5 * rates[5], 0.5 * rates[6], ux, uy, USER_RADIUS)
    return _turned((near.nx, near.ny), yaw)


@compiled
def _held_back(velocity: Point, away: Point) -> Point:
    """What the safety chain leaves of a velocity that closes in on the user."""
    toward = away[0] * velocity[0] + away[1] * velocity[1]
    if toward <= 0.0:
        return velocity
    return velocity[0] - toward * away[0], velocity[1] - toward * away[1]


@example
def _example() -> None:
    at = (0.0, 0.0, 0.0)
    _drive_towards(at, at, at[:2], (1.0, 0.0), (1.0, 1.0, 1.0, 0.1, 0.1, 1.0, 1.0))
