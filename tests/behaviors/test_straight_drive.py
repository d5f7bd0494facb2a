"""The compiled command of a straight drive, compared with the plain rule over value objects."""

from __future__ import annotations

import math
from collections.abc import Callable

from hypothesis import HealthCheck, given, settings, strategies as st

from behaviors.profile import Profile
from behaviors.situation import Situation
from hw import STILL, USER_RADIUS, Pose2, Twist2, UserPose
from hw.safety import Nearness, nearness
from hw.scene import Point
from states import SubsystemName
from states.navigation.local.straight_planner import STEP_S
from tests.behaviors.straight import command_towards


def plain_command(now: Situation, goal: Point, name: SubsystemName) -> Twist2:
    planner, environment, pose = now.planners[name], now.environment, now.pose
    acceleration = environment.limits.base_acceleration
    dx, dy = goal[0] - pose.x, goal[1] - pose.y
    left = math.hypot(dx, dy)
    if left < 1e-6:
        return STILL
    speed = min(environment.navigation.named(name).max_speed, math.sqrt(2.0 * acceleration * left))
    pace = min(speed / left, 1.0 / STEP_S)
    wanted = Twist2(pace * dx, pace * dy)
    motion, here, near = now.twist.rotated(pose.yaw), (pose.x, pose.y), to_user(now)
    for target in (wanted, near.held_back(wanted, 0.0)):
        for rate in (acceleration, environment.robot.base.brake_deceleration):
            changed = after_a_change(motion, target, 2.0 * rate * environment.period)
            for velocity in (changed, near.held_back(changed, 0.0)):
                late = environment.period + environment.latency
                braking = late + velocity.speed / (2.0 * acceleration)
                end = pose.x + braking * velocity.vx, pose.y + braking * velocity.vy
                if not planner.allows(here, end):
                    return STILL
    return wanted.rotated(-pose.yaw)


def after_a_change(velocity: Twist2, target: Twist2, by: float) -> Twist2:
    ax, ay = target.vx - velocity.vx, target.vy - velocity.vy
    share = min(1.0, by / max(1e-9, math.hypot(ax, ay)))
    return Twist2(velocity.vx + share * ax, velocity.vy + share * ay)


def to_user(now: Situation) -> Nearness:
    footprint = now.environment.robot.footprint
    user = now.pose.inverse().transform(now.user.body.x, now.user.body.y)
    near = nearness(footprint.half_length, footprint.half_width, *user, USER_RADIUS)
    towards = Twist2(near.nx, near.ny).rotated(now.pose.yaw)
    return near._replace(nx=towards.vx, ny=towards.vy)


places = st.tuples(st.floats(0.8, 13.0), st.floats(0.8, 13.0))


@settings(
    deadline=None, max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    at=places, user=places, goal=places,
    yaw=st.floats(-math.pi, math.pi, exclude_min=True),
    twist=st.builds(Twist2, *3 * (st.floats(-1.5, 1.5),)),
)  # fmt: skip
def test_a_command_is_that_of_the_plain_rule_to_the_last_bit(
    tuned: Profile, situation_of: Callable[..., Situation],
    at: Point, user: Point, goal: Point, yaw: float, twist: Twist2,
) -> None:  # fmt: skip
    person = UserPose(Pose2(*user, 0.0), 0.0)
    now = situation_of(tuned, Pose2(*at, yaw), person, twist=twist)

    assert command_towards(now, goal, "chase") == plain_command(now, goal, "chase")
