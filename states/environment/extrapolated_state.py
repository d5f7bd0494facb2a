"""Robot and user at the present instant, from poses of limited age (R149).

Poses are used as they are up to the age `LATE_S`; up to `OLD_S` they are extrapolated with the
measured velocity, while the admissible share of the speed falls to 0; older ones are not used. The
safety chain has the same two ages.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

from hw import LATE_S, OLD_S, STILL, Pose2, Twist2, UserPose, wrap
from states.environment.signal_names import (
    BASE_POSE,
    BASE_TWIST,
    USER_POSE,
    USER_VELOCITY,
    SignalReader,
)

READS: Mapping[str, float | None] = {
    BASE_POSE: OLD_S,
    BASE_TWIST: OLD_S,
    USER_POSE: OLD_S,
    USER_VELOCITY: OLD_S,
}
"""`reads` of a state that asks for robot and user."""


RobotNow = tuple[Pose2, Twist2, float]
"""The robot now: map_from_base, velocity in the base frame, admissible share of the speed."""
UserNow = tuple[UserPose, Twist2 | None, float]
"""The user now: pose, velocity in the map (None: unknown), admissible share of the speed."""


def robot(ctx: SignalReader) -> RobotNow | None:
    """The robot now; None while pose or velocity is unknown or too old."""
    pose, twist = ctx.value(BASE_POSE), ctx.value(BASE_TWIST)
    if pose is None or twist is None:
        return None
    age, late = ctx.age(BASE_POSE), ctx.age(BASE_TWIST)
    if age <= LATE_S and late <= LATE_S:
        return pose, twist, 1.0
    if age > LATE_S:
        pose = pose.moved(twist.rotated(pose.yaw), age)
    return pose, twist, share_at(max(age, late))


def user(ctx: SignalReader) -> UserNow | None:
    """The user now; None while their pose is unknown or too old."""
    pose, velocity = ctx.value(USER_POSE), ctx.value(USER_VELOCITY)
    if pose is None:
        return None
    age = ctx.age(USER_POSE)
    if age <= LATE_S:
        return pose, velocity, 1.0
    motion = velocity or STILL
    later = replace(
        pose,
        body=pose.body.moved(motion, age),
        head_yaw=wrap(pose.head_yaw + motion.wz * age),
    )
    return later, velocity, share_at(age)


class RobotAndUser(NamedTuple):
    """Robot and user now: what a local planner needs besides its goal.

    `user` is None if there is none; `walking` is their velocity in the map, m/s (0 if unknown);
    `share` is the admissible share of the speed.
    """

    pose: Pose2
    twist: Twist2
    user: UserPose | None
    walking: tuple[float, float]
    share: float


def around(ctx: SignalReader) -> RobotAndUser | None:
    """Robot and user now; None while one of them is lost. A user never tracked does not exist."""
    here, there = robot(ctx), user(ctx)
    if here is None:
        return None
    pose, twist, share = here
    if there is None:
        known = ctx.age(USER_POSE) < math.inf
        return None if known else RobotAndUser(pose, twist, None, (0.0, 0.0), share)
    person, velocity, admissible = there
    walk = velocity or STILL
    return RobotAndUser(pose, twist, person, (walk.vx, walk.vy), min(share, admissible))


def share_at(age: float) -> float:
    """Admissible share of the speed limit with poses of this age, s: 1 to LATE_S, 0 from OLD_S."""
    return min(1.0, max(0.0, (OLD_S - age) / (OLD_S - LATE_S)))
