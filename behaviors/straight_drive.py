"""The velocity that drives straight to a place, as rollouts do, and from which braking is safe."""

from __future__ import annotations

import math

from behaviors.rollout import STEP_S
from behaviors.situation import Situation
from hw.geometry import STILL, Twist2
from hw.people.person import RADIUS
from hw.room import Point
from hw.safety.separation import Nearness, nearness
from states.subsystems import SubsystemName


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
    late = environment.period + environment.latency
    for target in _and_held_back(wanted, near):
        # wheels that slow down may change their direction as fast as they can brake
        ax, ay = target.vx - motion.vx, target.vy - motion.vy
        for rate in (acceleration, environment.robot.base.brake_deceleration):
            share = min(1.0, 2.0 * rate * environment.period / max(1e-9, math.hypot(ax, ay)))
            soon = Twist2(motion.vx + share * ax, motion.vy + share * ay)
            for velocity in _and_held_back(soon, near):
                # times it: the way until braking begins, a tick later, and braking, v^2 / (2 a)
                braking = late + velocity.speed / (2.0 * acceleration)
                rest = (pose.x + braking * velocity.vx, pose.y + braking * velocity.vy)
                if not planner.allows(here, rest):
                    return STILL
    return wanted.rotated(-pose.yaw)


def _nearness(now: Situation) -> Nearness:
    """The user's nearness to the footprint, in the axes of the map."""
    pose, footprint = now.pose, now.environment.robot.footprint
    user = pose.inverse().transform(now.user.body.x, now.user.body.y)
    near = nearness(footprint.half_length, footprint.half_width, *user, RADIUS)
    towards = Twist2(near.nx, near.ny).rotated(pose.yaw)
    return near._replace(nx=towards.vx, ny=towards.vy)


def _and_held_back(velocity: Twist2, near: Nearness) -> tuple[Twist2, ...]:
    """A velocity and, if it closes in on the user, what the safety chain may leave of it.

    The chain may brake away the part to the user; the rest turns away from them, maybe to a wall.
    """
    left = near.held_back(velocity, 0.0)
    return (velocity,) if left is velocity else (velocity, left)
