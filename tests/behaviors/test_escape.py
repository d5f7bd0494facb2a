"""When the user is about to walk into the robot, and the Escape poses."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from behaviors.escape import danger, escape_poses, pursuit
from behaviors.escape.zones import in_zone
from behaviors.person.margin import Clearing
from behaviors.profile.profile import Profile, load_profile
from behaviors.profile.settings import Settings
from behaviors.situation.present_situation import Situation
from hw.geometry import Pose2, Twist2, wrap
from hw.samples import UserPose
from hw.scene.room import Point
from states.environment.environment import Environment
from tests.behaviors.conftest import is_required, is_safe
from tests.repeats import examples

STANDING = Twist2(0.0)
HERE = Pose2(10.0, 10.0, 0.0)


def user_seeing(bearing: float, distance: float, body_yaw: float = 1.0) -> UserPose:
    """A user who sees the robot at HERE at this bearing from the line of sight."""
    yaw = wrap(math.pi - bearing)
    return UserPose(Pose2(HERE.x + distance, HERE.y, body_yaw), yaw)


@pytest.mark.requirement(104, 112)
@pytest.mark.parametrize("bearing", [0.0, math.pi])
def test_by_contact_a_zone_alone_is_no_danger(
    tuned: Profile, environment_of: Callable[..., Environment], bearing: float
) -> None:
    """A user 1.4 m away in whose zone the robot is, who walks off sideways or stands."""
    environment, user = environment_of(tuned), user_seeing(bearing, 1.4)
    assert in_zone(tuned.settings.escape, user, HERE)

    for velocity in (STANDING, Twist2(0.5, 0.5), Twist2(0.0, 1.5)):
        args = (user, HERE, velocity, STANDING)
        assert not is_required(environment, tuned.settings, *args)
        assert is_safe(environment, tuned.settings, *args)


@pytest.mark.requirement(104)
def test_the_robot_s_own_motion_counts_towards_a_contact(
    tuned: Profile, environment_of: Callable[..., Environment]
) -> None:
    """It drives into the way of somebody who walks slowly, outside the zones; at any yaw."""
    environment, slowly, rules = environment_of(tuned), Twist2(-0.3), tuned.settings
    user = user_seeing(0.0, 2.6)
    for yaw in (0.0, 1.0, -2.5):
        robot = replace(HERE, yaw=yaw)
        towards = Twist2(1.2 * math.cos(yaw), -1.2 * math.sin(yaw))  # +x in the map
        away = Twist2(-towards.vx, -towards.vy)
        assert is_required(environment, rules, user, robot, slowly, towards)
        assert not is_required(environment, rules, user, robot, slowly, away)


@pytest.mark.requirement(112)
@pytest.mark.parametrize("speed", [1.0, 1.5])
def test_a_predicted_contact_is_over_by_more_than_it_began(
    tuned: Profile, environment_of: Callable[..., Environment], speed: float
) -> None:
    """Over 0.2 m and more of the way neither holds, so that no Escape flickers."""
    environment, rules = environment_of(tuned), tuned.settings
    seen = []
    for centimetres in range(271, 500):
        args = (user_seeing(0.0, 0.01 * centimetres), HERE, Twist2(-speed), STANDING)
        required = is_required(environment, rules, *args)
        seen.append("r" if required else "s" if is_safe(environment, rules, *args) else "-")

    danger, _, after = "".join(seen).partition("-")
    assert danger == "r" * len(danger)
    assert after.index("s") > 20
    assert after.strip("-") == "s" * after.count("s")


@pytest.mark.requirement(112)
@given(
    bearing=st.floats(-math.pi, math.pi),
    distance=st.floats(0.1, 6.0),
    v=st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)),
    own=st.tuples(st.floats(-2.5, 2.5), st.floats(-2.5, 2.5)),
    yaw=st.floats(-3.1, 3.1),
)
@settings(deadline=None, max_examples=examples(200))
def test_nothing_is_required_and_safe_at_once(
    profile: Profile,
    environment_of: Callable[..., Environment],
    bearing: float,
    distance: float,
    v: tuple[float, float],
    own: tuple[float, float],
    yaw: float,
) -> None:
    environment, chosen = environment_of(profile), profile.settings
    args = (user_seeing(bearing, distance), replace(HERE, yaw=yaw), Twist2(*v), Twist2(*own))

    required = is_required(environment, chosen, *args)

    assert not (required and is_safe(environment, chosen, *args))


@pytest.mark.requirement(104)
def test_a_walker_is_seen_coming_who_is_in_no_zone_yet(
    tuned: Profile, environment_of: Callable[..., Environment]
) -> None:
    user, environment = user_seeing(2.0, 2.6), environment_of(tuned)
    assert not in_zone(tuned.settings.escape, user, HERE)

    def required(velocity: Twist2) -> bool:
        return is_required(environment, tuned.settings, user, HERE, velocity, STANDING)

    assert required(Twist2(-1.5))
    assert not required(Twist2(1.5))  # away
    assert not required(Twist2(0.0, 1.5))  # past


@pytest.mark.requirement(104)
@pytest.mark.parametrize("reaction", [0.0, 0.2, 0.5])
def test_a_walker_counts_as_soon_as_reaction_and_stepping_aside_would_take_as_long(
    tuned: Profile, environment_of: Callable[..., Environment], reaction: float
) -> None:
    environment = environment_of(tuned)
    rules = Clearing.of(environment, tuned.settings)._replace(reaction=reaction)
    aside = math.sqrt(2.0 * rules.contact / environment.limits.base_acceleration)
    due = rules.contact + 1.0 * (aside + reaction)

    for distance, expected in ((due - 0.01, True), (due + 0.01, False)):
        user = Pose2(HERE.x + distance, HERE.y)
        found = danger.will_be_reached(rules, user, HERE, Twist2(-1.0))
        assert found is expected


def least_distance_braking(
    apart: Point, velocity: Point, motion: Point, reaction: float, braking: float
) -> float:
    """From the user to a robot that brakes after `reaction`, s, until it stands, step by step."""
    (x, y), (vx, vy), step, at = apart, motion, 0.001, 0.0
    least = math.hypot(x, y)
    while (speed := math.hypot(vx, vy)) > 1e-9:
        if at >= reaction:
            left = max(0.0, 1.0 - braking * step / speed)
            vx, vy = left * vx, left * vy
        x, y = x + step * (vx - velocity[0]), y + step * (vy - velocity[1])
        least, at = min(least, math.hypot(x, y)), at + step
    return least


@given(
    st.floats(-math.pi, math.pi),
    st.floats(1.3, 2.8),
    st.floats(0.5, 1.6),
    st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)),
)
@settings(max_examples=examples(300))
def test_beside_a_walker_it_is_a_danger_once_braking_after_the_reaction_ends_too_near(
    tuned: Profile,
    environment_of: Callable[..., Environment],
    bearing: float,
    distance: float,
    pace: float,
    motion: Point,
) -> None:
    assume(abs(bearing) > math.pi / 2 + 0.01 or motion[0] > pace + 0.01)  # not one who runs into it
    environment = environment_of(tuned)
    rules = Clearing.of(environment, tuned.settings)
    apart = (distance * math.cos(bearing), distance * math.sin(bearing))
    base = Pose2(HERE.x + apart[0], HERE.y + apart[1], 0.0)
    braking = environment.limits.base_acceleration
    least = least_distance_braking(apart, (pace, 0.0), motion, rules.reaction, braking)
    assume(abs(least - rules.contact) > 0.02)
    instants = np.arange(0.0, rules.lookahead, 0.001)
    going_on = np.hypot(
        apart[0] + (motion[0] - pace) * instants, apart[1] + motion[1] * instants
    ).min()
    assume(abs(going_on - rules.contact) > 0.02)

    found = danger.will_be_reached(rules, HERE, base, Twist2(pace), Twist2(*motion))

    assert found is bool(max(least, going_on) < rules.contact)


def test_a_robot_that_keeps_pace_along_a_wall_brakes_before_the_walker_beside_it_is_there(
    tuned: Profile, environment_of: Callable[..., Environment]
) -> None:
    """A walker's line closes in on a wall and on the robot beside it, no longer in their front."""
    environment, heading = environment_of(tuned), math.radians(22.0)
    user = UserPose(Pose2(5.2, 11.6, heading), heading)
    walk = Twist2(1.39 * math.cos(heading), 1.39 * math.sin(heading))
    base, far = Pose2(4.65, 12.82, 0.0), Pose2(4.65, 13.3, 0.0)

    for at, speed, expected in ((base, 1.2, True), (base, 0.4, False), (far, 1.2, False)):
        found = is_required(environment, tuned.settings, user, at, walk, Twist2(speed))
        assert found is expected
        assert not (found and is_safe(environment, tuned.settings, user, at, walk, Twist2(speed)))


@pytest.mark.requirement(106, 125)
def test_the_poses_come_in_the_order_of_the_profile(profile: Profile) -> None:
    rules = profile.settings.escape
    found = list(escape_poses.all_poses(rules, user_seeing(0.0, 2.0), HERE))

    distances = [HERE.distance_to(pose) for pose in found]
    each = [distance for distance in rules.distances for _ in rules.angles]
    assert distances == [pytest.approx(distance) for distance in each]
    assert each == sorted(each, reverse=profile.name == "paper")
    assert len(found) == (12 if profile.name == "paper" else len({*found}))


@pytest.mark.requirement(107, 110)
@given(
    x=st.floats(-5.0, 5.0), y=st.floats(-5.0, 5.0), yaw=st.floats(-3.1, 3.1),
    away=st.floats(0.3, 4.0), bearing=st.floats(-math.pi, math.pi),
    angle=st.floats(-1.0, 1.0), distance=st.floats(0.05, 5.0),
)  # fmt: skip
@settings(deadline=None, max_examples=examples(100))
def test_an_escape_pose_keeps_the_yaw_and_leads_away_from_the_user_or_past_them(
    profile: Profile,
    x: float,
    y: float,
    yaw: float,
    away: float,
    bearing: float,
    angle: float,
    distance: float,
) -> None:
    """Up to a right angle off the way straight away it is farther from the user all along.

    Beyond that the drive passes them, never nearer than the sine of the angle admits.
    """
    base = Pose2(x, y, yaw)
    user = Pose2(x + away * math.cos(bearing), y + away * math.sin(bearing), 0.0)
    widest = max(abs(angle) for angle in profile.settings.escape.angles)
    rules = replace(profile.settings.escape, distances=(distance,), angles=(angle * widest,))

    [pose] = escape_poses.all_poses(rules, UserPose(user, 0.0), base)

    assert pose.yaw == yaw
    least = away if abs(angle * widest) <= 0.5 * math.pi else away * math.sin(abs(angle * widest))
    for share in (0.2, 0.5, 1.0):
        passed = Pose2(x + share * (pose.x - x), y + share * (pose.y - y))
        assert passed.distance_to(user) >= least - 1e-9


@pytest.mark.requirement(107)
def test_every_pose_of_the_paper_is_farther_from_the_user(paper: Profile) -> None:
    user = user_seeing(0.0, 0.4)

    for pose in escape_poses.all_poses(paper.settings.escape, user, HERE):
        assert pose.distance_to(user.body) > HERE.distance_to(user.body)


@pytest.mark.requirement(108, 120)
def test_poses_in_the_inflation_of_a_wall_are_left_out(
    profile: Profile, environment_of: Callable[..., Environment]
) -> None:
    environment, user = environment_of(profile), UserPose(Pose2(5.0, 10.0), math.pi)
    base = Pose2(3.0, 10.0)

    found = escape_poses.poses(profile.settings, environment.static_planners["escape"], user, base)

    every = list(escape_poses.all_poses(profile.settings.escape, user, base))
    assert 0 < len(found) < len(every)
    assert [pose for pose in every if pose in found] == list(found)
    assert all((pose.x >= 0.77 - 1e-6) == (pose in found) for pose in every)


@given(
    st.floats(-math.pi, math.pi), st.floats(0.5, 4.0), st.floats(-math.pi, math.pi),
    st.floats(0.1, 2.0), st.floats(-3.0, 3.0), st.floats(0.1, 0.8),
)  # fmt: skip
@settings(max_examples=examples(200))
def test_who_walks_at_the_robot_is_whose_bend_points_at_it_in_time(
    around: float, away: float, heading: float, speed: float, rate: float, within: float
) -> None:
    """The same by turning their heading bit by bit; a bend away from it counts for nothing."""
    user = UserPose(Pose2(away * math.cos(around), away * math.sin(around), 0.0), 0.0)
    walk = Twist2(speed * math.cos(heading), speed * math.sin(heading), rate)
    now = Situation(cast(Environment, None), load_profile("tuned").settings, Pose2(0.0, 0.0, 0.0),
                    STANDING, user, walk, {})  # fmt: skip
    turns = 0.5 * max(-1.2, min(1.2, rate)) * np.linspace(0.0, 1.0, 401)
    off = [abs(wrap(around + math.pi - heading - turn)) for turn in turns.tolist()]
    assume(all(abs(o - within) > 0.01 for o in off) or min(off) < within - 0.01)
    assume(off[-1] < 3.1 and off[0] < 3.1)

    found = pursuit.walks_at_it(now, within)

    assert found == (min(off) < within)


@pytest.mark.requirement(104, 117)
@pytest.mark.parametrize(("rate", "expected"), [(0.6, True), (0.0, False), (-0.6, False)])
def test_who_bends_towards_a_robot_that_cannot_get_away_is_a_danger(
    tuned: Profile, environment_of: Callable[..., Environment], rate: float, expected: bool
) -> None:
    """They walk past a robot in a corner, unless their bend goes on."""
    here, user = Pose2(1.2, 1.2, 0.0), UserPose(Pose2(3.0, 3.0, 0.0), 0.0)
    heading = math.radians(225.0 - 35.0)
    walk = Twist2(1.2 * math.cos(heading), 1.2 * math.sin(heading), rate)

    found = is_required(environment_of(tuned), tuned.settings, user, here, walk, STANDING)

    assert found is expected


@pytest.mark.requirement(112)
def test_a_danger_is_over_a_tenth_of_a_second_after_it_would_begin(
    tuned: Profile, environment_of: Callable[..., Environment]
) -> None:
    """Somebody comes at 1 m/s: 0.1 s of their walk lie between, where distances have no slack."""
    environment = environment_of(tuned)
    chosen = replace(tuned.settings, escape=replace(tuned.settings.escape, hysteresis=0.0))
    ways = [(user_seeing(0.0, 0.005 * n), HERE, Twist2(-1.0), STANDING) for n in range(400, 900)]

    required = [is_required(environment, chosen, *way) for way in ways]
    safe = [is_safe(environment, chosen, *way) for way in ways]

    assert required == sorted(required, reverse=True)
    assert safe == sorted(safe)
    assert 0.005 * (safe.index(True) - required.index(False)) == pytest.approx(0.1, abs=0.006)


@pytest.mark.requirement(112)
@pytest.mark.parametrize(
    ("off", "required", "safe"), [(18, True, False), (38, False, False), (42, False, True)]
)
def test_who_walks_at_a_robot_in_a_corner_is_no_danger_once_they_turn_well_away(
    tuned: Profile,
    environment_of: Callable[..., Environment],
    off: float,
    required: bool,
    safe: bool,
) -> None:
    here, user = Pose2(1.2, 1.2, 0.0), UserPose(Pose2(3.0, 3.0, 0.0), 0.0)
    heading = math.radians(225.0 - off)
    walk = Twist2(1.2 * math.cos(heading), 1.2 * math.sin(heading))
    seen = environment_of(tuned), tuned.settings, user, here, walk, STANDING

    assert (is_required(*seen), is_safe(*seen)) == (required, safe)


@pytest.mark.parametrize("x", [-2.0, 2.0])
def test_who_stands_walks_at_nothing(x: float) -> None:
    now = Situation(cast(Environment, None), cast(Settings, None), Pose2(x, 0.0), STANDING,
                    UserPose(Pose2(0.0, 0.0, 0.0), 0.0), Twist2(0.0, 0.0, 1.0), {})  # fmt: skip

    assert not pursuit.walks_at_it(now, math.pi)
