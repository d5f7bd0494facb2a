"""The Escape trigger, the Escape poses, and the choice among them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behaviors import escape
from behaviors.profile import Profile
from behaviors.situation import Situation
from hw.geometry import Pose2, Twist2, wrap
from hw.room import Room
from hw.samples import UserPose
from states.environment import Environment

WALKING = Twist2(0.5)
STANDING = Twist2(0.0)
HALF_VIEW = math.pi / 5
HERE = Pose2(10.0, 10.0, 0.0)


def user_seeing(bearing: float, distance: float, body_yaw: float = 1.0) -> UserPose:
    """A user who sees the robot at HERE at this bearing from the line of sight."""
    yaw = wrap(math.pi - bearing)
    return UserPose(Pose2(HERE.x + distance, HERE.y, body_yaw), yaw)


TABLE = [
    (0.0, 2.49, True), (0.0, 2.51, False),
    (HALF_VIEW - 0.01, 2.49, True), (-HALF_VIEW + 0.01, 2.49, True),
    (HALF_VIEW + 0.01, 2.49, False), (-HALF_VIEW - 0.01, 2.49, False),
    (HALF_VIEW + 0.01, 1.49, True), (-HALF_VIEW - 0.01, 1.49, True),
    (HALF_VIEW + 0.01, 1.51, False),
    (math.pi, 1.49, True), (math.pi, 1.51, False),
    (math.pi / 2, 1.49, True), (math.pi / 2, 2.0, False),
]  # fmt: skip


@pytest.mark.requirement(104)
@pytest.mark.parametrize(("bearing", "distance", "expected"), TABLE)
def test_the_zones_reach_farther_in_the_direction_of_view(
    paper: Profile,
    environment_of: Callable[..., Environment],
    bearing: float,
    distance: float,
    expected: bool,
) -> None:
    user = user_seeing(bearing, distance)

    found = escape.is_required(environment_of(paper), paper.settings, user, HERE, WALKING)

    assert found is expected


@pytest.mark.requirement(104)
def test_the_view_is_that_of_the_head_not_of_the_body(
    paper: Profile, environment_of: Callable[..., Environment]
) -> None:
    environment, ahead = environment_of(paper), user_seeing(0.0, 2.0)

    for body_yaw in (0.0, 1.5, math.pi):
        turned = replace(ahead, body=replace(ahead.body, yaw=body_yaw))
        assert escape.is_required(environment, paper.settings, turned, HERE, WALKING)


@pytest.mark.requirement(104)
def test_a_user_who_stands_raises_nothing_unless_the_literal_rule_is_chosen(
    profile: Profile, environment_of: Callable[..., Environment]
) -> None:
    user, environment = user_seeing(0.0, 1.85), environment_of(profile)
    literal = replace(profile.settings, escape=replace(profile.settings.escape, moving=0.0))

    assert not escape.is_required(environment, profile.settings, user, HERE, STANDING)
    assert not escape.is_required(environment, profile.settings, user, HERE, Twist2(0.19))
    assert escape.is_required(environment, profile.settings, user, HERE, Twist2(0.0, 0.21))
    assert escape.is_required(environment, literal, user, HERE, STANDING)


@pytest.mark.requirement(112)
@pytest.mark.parametrize(
    ("bearing", "distance", "safe"),
    [(0.0, 2.69, False), (0.0, 2.71, True), (2.0, 1.69, False), (2.0, 1.71, True)],
)
def test_safe_is_farther_than_the_zones_by_the_hysteresis(
    profile: Profile,
    environment_of: Callable[..., Environment],
    bearing: float,
    distance: float,
    safe: bool,
) -> None:
    user = user_seeing(bearing, distance)

    assert escape.is_safe(environment_of(profile), profile.settings, user, HERE, STANDING) is safe


@pytest.mark.requirement(112)
@given(
    bearing=st.floats(-math.pi, math.pi),
    distance=st.floats(0.1, 6.0),
    vx=st.floats(-2.0, 2.0),
    vy=st.floats(-2.0, 2.0),
)
@settings(deadline=None, max_examples=200)
def test_nothing_is_required_and_safe_at_once(
    profile: Profile,
    environment_of: Callable[..., Environment],
    bearing: float,
    distance: float,
    vx: float,
    vy: float,
) -> None:
    user, velocity, environment = (
        user_seeing(bearing, distance),
        Twist2(vx, vy),
        environment_of(profile),
    )

    required = escape.is_required(environment, profile.settings, user, HERE, velocity)

    assert not (required and escape.is_safe(environment, profile.settings, user, HERE, velocity))


@pytest.mark.requirement(104)
def test_tuned_sees_a_walker_coming_who_is_in_no_zone_yet(
    paper: Profile, tuned: Profile, environment_of: Callable[..., Environment]
) -> None:
    user, towards_the_robot = user_seeing(2.0, 2.6), Twist2(-1.5)

    assert escape.is_required(environment_of(tuned), tuned.settings, user, HERE, towards_the_robot)
    assert not escape.is_required(
        environment_of(paper), paper.settings, user, HERE, towards_the_robot
    )
    away = Twist2(1.5)
    assert not escape.is_required(environment_of(tuned), tuned.settings, user, HERE, away)
    past = Twist2(0.0, 1.5)
    assert not escape.is_required(environment_of(tuned), tuned.settings, user, HERE, past)


@pytest.mark.requirement(104)
@pytest.mark.parametrize("reaction", [0.0, 0.2, 0.5])
def test_a_walker_counts_as_soon_as_reaction_and_stepping_aside_would_take_as_long(
    tuned: Profile, environment_of: Callable[..., Environment], reaction: float
) -> None:
    environment = environment_of(tuned)
    rules = replace(tuned.settings.escape, reaction=reaction)
    aside = math.sqrt(2.0 * rules.contact / environment.limits.base_acceleration)
    due = rules.contact + 1.0 * (aside + reaction)

    for distance, expected in ((due - 0.01, True), (due + 0.01, False)):
        user = Pose2(HERE.x + distance, HERE.y)
        found = escape.will_be_reached(environment, rules, user, HERE, Twist2(-1.0))
        assert found is expected


@pytest.mark.requirement(106, 125)
def test_there_are_twelve_poses_in_the_order_of_the_profile(profile: Profile) -> None:
    found = list(escape.all_poses(profile.settings.escape, user_seeing(0.0, 2.0), HERE))

    distances = [round(HERE.distance_to(pose), 9) for pose in found]
    assert len(found) == 12
    assert distances == sorted(distances)
    assert len(set(distances)) == 3


@pytest.mark.requirement(107, 110)
@given(
    x=st.floats(-5.0, 5.0), y=st.floats(-5.0, 5.0), yaw=st.floats(-3.1, 3.1),
    away=st.floats(0.3, 4.0), bearing=st.floats(-math.pi, math.pi),
)  # fmt: skip
@settings(deadline=None, max_examples=100)
def test_every_escape_pose_is_farther_from_the_user_and_keeps_the_yaw(
    profile: Profile, x: float, y: float, yaw: float, away: float, bearing: float
) -> None:
    base = Pose2(x, y, yaw)
    user = Pose2(x + away * math.cos(bearing), y + away * math.sin(bearing), 0.0)

    for pose in escape.all_poses(profile.settings.escape, UserPose(user, 0.0), base):
        assert pose.distance_to(user) > base.distance_to(user)
        assert pose.yaw == yaw


@pytest.mark.requirement(108, 120)
def test_poses_in_the_inflation_of_a_wall_are_left_out(
    profile: Profile, environment_of: Callable[..., Environment]
) -> None:
    environment, user = environment_of(profile), UserPose(Pose2(5.0, 10.0), math.pi)
    base = Pose2(3.0, 10.0)

    found = escape.poses(profile.settings, environment.static_planners["escape"], user, base)

    every = list(escape.all_poses(profile.settings.escape, user, base))
    assert 0 < len(found) < len(every)
    assert [pose for pose in every if pose in found] == list(found)
    assert all((pose.x >= 0.77 - 1e-6) == (pose in found) for pose in every)


class Base:
    def __init__(self) -> None:
        self.command: Twist2 | None = None

    def drive(self, command: Twist2, source: str) -> None:
        assert source == "escape"
        self.command = command

    def release(self, source: str) -> None:
        assert source == "escape"
        self.command = None


def flee_from(now: Situation, context: Any, base: Base, safe: bool = False) -> Any:
    poses = escape.poses(now.settings, now.planners["escape"], now.user, now.pose)
    values = {
        "environment": now.environment, "settings": now.settings, "base.pose": now.pose,
        "base.twist": now.twist, "user.pose": now.user, "user.velocity": now.velocity,
        "escape.poses": poses, "escape.safe": safe,
    }  # fmt: skip
    ctx = context(values, {"base": base})
    return ctx, escape.Flee().run(ctx)


@pytest.mark.requirement(109, 110, 111)
def test_fleeing_drives_away_from_the_user_without_turning(
    profile: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    base, user = Base(), UserPose(Pose2(12.0, 10.0, math.pi), math.pi)
    now = situation_of(profile, replace(HERE, yaw=0.7), user, Twist2(-1.0))

    _, run = flee_from(now, context, base)
    next(run)

    command = base.command
    assert command is not None
    assert command.wz == 0.0
    assert command.rotated(0.7).vx < 0.0
    assert 0.0 < command.speed <= 2.5


@pytest.mark.requirement(113)
def test_without_a_free_pose_escape_fails_and_the_base_is_stopped(
    profile: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    cell = Room(outer=((0.0, 0.0), (1.8, 0.0), (1.8, 1.8), (0.0, 1.8)))
    user = UserPose(Pose2(1.7, 1.7, 0.0), 0.0)
    now = situation_of(profile, Pose2(0.9, 0.9), user, WALKING, room=cell)

    _, run = flee_from(now, context, Base())

    with pytest.raises(StopIteration) as ended:
        next(run)
    assert ended.value.value == "no_pose"


@pytest.mark.requirement(113)
def test_tuned_warns_at_once_when_a_touch_cannot_be_avoided_any_more(
    tuned: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    user = UserPose(Pose2(11.3, 10.0, math.pi), math.pi)
    now = situation_of(tuned, replace(HERE, yaw=math.pi / 2), user, Twist2(-1.5))

    _, run = flee_from(now, context, Base())

    with pytest.raises(StopIteration) as ended:
        next(run)
    assert ended.value.value == "no_way"


@pytest.mark.requirement(112)
def test_a_reached_pose_counts_only_once_both_zones_are_clear(
    paper: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    user, base = UserPose(Pose2(12.0, 10.0, math.pi), math.pi), Base()
    now = situation_of(paper, HERE, user, Twist2(-0.3))
    ctx, run = flee_from(now, context, base)
    next(run)
    ctx.values["base.pose"] = ctx.values["escape.poses"][0]

    next(run)
    assert base.command is not None
    ctx.values["base.pose"] = ctx.values["escape.poses"][0]
    ctx.values["escape.safe"] = True

    with pytest.raises(StopIteration) as ended:
        next(run)
    assert ended.value.value == "safe"
    assert base.command is None


@pytest.mark.requirement(112)
def test_an_escape_because_chase_failed_is_not_over_before_a_pose_is_reached(
    tuned: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    user = UserPose(Pose2(15.0, 10.0, 0.0), 0.0)
    now = situation_of(tuned, HERE, user)
    ctx, _ = flee_from(now, context, Base(), safe=True)
    run = escape.SafeOnTheWay().run(ctx)

    waiting = next(run)

    assert waiting.ns > 10**15
