"""The velocity that drives straight to a place, as rollouts do, and from which braking is safe."""

from __future__ import annotations

import math

from behaviors.prediction import STEP_S
from behaviors.situation import Situation
from hw import STILL, USER_RADIUS, Twist2
from hw.safety import Nearness, nearness
from hw.scene import Point
from states import SubsystemName


def command_towards(
    now: Situation, goal: Point, name: SubsystemName, keeps: SubsystemName | None = None
) -> Twist2:
    """The command (base frame) that drives like a rollout, at the speed of a subsystem.

    Standstill instead, if braking straight ahead from the next tick on would end too near to a
    wall, because the drive may be aborted then. `keeps` names the subsystem whose distances from
    walls count, if it is another.
    """
    planner = now.planners[keeps or name]
    environment, pose, twist = now.environment, now.pose, now.twist
    acceleration = environment.limits.base_acceleration
    dx, dy = goal[0] - pose.x, goal[1] - pose.y
    left = math.hypot(dx, dy)
    if left < 1e-6:
        return STILL
    speed = min(environment.navigation.named(name).max_speed, math.sqrt(2.0 * acceleration * left))
    pace = min(speed / left, 1.0 / STEP_S)
    wanted = Twist2(pace * dx, pace * dy)
    motion, here, near = twist.rotated(pose.yaw), (pose.x, pose.y), _nearness(now)
    # wheels that slow down may change their direction as fast as they can brake
    rates = (acceleration, environment.robot.base.brake_deceleration)
    velocities = {
        (velocity.vx, velocity.vy)
        for target in _and_held_back(wanted, near)
        for rate in rates
        for velocity in _and_held_back(
            _changed(motion, target, 2.0 * rate * environment.period), near
        )
    }
    late = environment.period + environment.latency
    for vx, vy in velocities:
        # times it: the way until braking begins, a tick later, and braking, v^2 / (2 a)
        braking = late + math.hypot(vx, vy) / (2.0 * acceleration)
        if not planner.allows(here, (pose.x + braking * vx, pose.y + braking * vy)):
            return STILL
    return wanted.rotated(-pose.yaw)


def _changed(velocity: Twist2, target: Twist2, by: float) -> Twist2:
    """A velocity after a change towards a target by so much at most, m/s."""
    ax, ay = target.vx - velocity.vx, target.vy - velocity.vy
    share = min(1.0, by / max(1e-9, math.hypot(ax, ay)))
    return Twist2(velocity.vx + share * ax, velocity.vy + share * ay)


def _nearness(now: Situation) -> Nearness:
    """The user's nearness to the footprint, in the axes of the map."""
    pose, footprint = now.pose, now.environment.robot.footprint
    user = pose.inverse().transform(now.user.body.x, now.user.body.y)
    near = nearness(footprint.half_length, footprint.half_width, *user, USER_RADIUS)
    towards = Twist2(near.nx, near.ny).rotated(pose.yaw)
    return near._replace(nx=towards.vx, ny=towards.vy)


def _and_held_back(velocity: Twist2, near: Nearness) -> tuple[Twist2, ...]:
    """A velocity and, if it closes in on the user, what the safety chain may leave of it.

    The chain may brake away the part to the user; the rest turns away from them, maybe to a wall.
    """
    left = near.held_back(velocity, 0.0)
    return (velocity,) if left is velocity else (velocity, left)
