"""The Escape trigger, the Escape poses, and the choice among them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from behaviors import danger, dodge, escape, escape_poses
from behaviors.person.margin import Clearing
from behaviors.profile.profile import Profile, load_profile
from behaviors.profile.settings import Settings
from behaviors.situation.present_situation import Situation
from hw.geometry import Pose2, Twist2, wrap
from hw.samples import UserPose
from hw.scene.room import Point, Room
from states.environment.environment import Environment
from tests.behaviors.conftest import Base, Vr, is_required, is_safe
from tests.repeats import examples

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

    found = is_required(environment_of(paper), paper.settings, user, HERE, WALKING, STANDING)

    assert found is expected


@pytest.mark.requirement(104)
def test_the_view_is_that_of_the_head_not_of_the_body(
    paper: Profile, environment_of: Callable[..., Environment]
) -> None:
    environment, ahead = environment_of(paper), user_seeing(0.0, 2.0)

    for body_yaw in (0.0, 1.5, math.pi):
        turned = replace(ahead, body=replace(ahead.body, yaw=body_yaw))
        assert is_required(environment, paper.settings, turned, HERE, WALKING, STANDING)


def by_zones(profile: Profile, **others: Any) -> Settings:
    """The profile's settings with the zones as the trigger."""
    return replace(
        profile.settings, escape=replace(profile.settings.escape, trigger="zones", **others)
    )


@pytest.mark.requirement(104)
def test_a_user_who_stands_raises_nothing_unless_the_literal_rule_is_chosen(
    profile: Profile, environment_of: Callable[..., Environment]
) -> None:
    user, environment = user_seeing(0.0, 1.85), environment_of(profile)
    zones, literal = by_zones(profile), by_zones(profile, moving=0.0)

    def required(settings: Settings, velocity: Twist2) -> bool:
        return is_required(environment, settings, user, HERE, velocity, STANDING)

    assert not required(zones, STANDING)
    assert not required(zones, Twist2(0.19))
    assert required(zones, Twist2(0.0, 0.21))
    assert required(literal, STANDING)


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
    user, environment = user_seeing(bearing, distance), environment_of(profile)

    found = is_safe(environment, by_zones(profile), user, HERE, STANDING, STANDING)

    assert found is safe


@pytest.mark.requirement(104, 112)
@pytest.mark.parametrize("bearing", [0.0, math.pi])
def test_by_contact_a_zone_alone_is_no_danger(
    tuned: Profile, environment_of: Callable[..., Environment], bearing: float
) -> None:
    """A user 1.4 m away in whose zone the robot is, who walks off sideways or stands."""
    environment, user = environment_of(tuned), user_seeing(bearing, 1.4)
    assert danger.in_zone(tuned.settings.escape, user, HERE)

    for velocity in (STANDING, Twist2(0.5, 0.5), Twist2(0.0, 1.5)):
        args = (user, HERE, velocity, STANDING)
        zones = by_zones(tuned)
        assert not is_required(environment, tuned.settings, *args)
        assert is_safe(environment, tuned.settings, *args)
        assert is_required(environment, zones, *args) is (velocity is not STANDING)
        assert not is_safe(environment, zones, *args)


@pytest.mark.requirement(104)
def test_the_robot_s_own_motion_counts_towards_a_contact(
    tuned: Profile, environment_of: Callable[..., Environment]
) -> None:
    """It drives into the way of somebody who walks slowly, outside the zones; at any yaw."""
    environment, slowly, rules = environment_of(tuned), Twist2(-0.3), by_zones(tuned)
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
    environment, rules = environment_of(tuned), by_zones(tuned)
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
    zones=st.booleans(),
    predict=st.booleans(),
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
    zones: bool,
    predict: bool,
) -> None:
    environment = environment_of(profile)
    rules = replace(
        profile.settings.escape,
        trigger="zones" if zones else "contact",
        predict=predict or not zones,
    )
    chosen = replace(profile.settings, escape=rules)
    args = (user_seeing(bearing, distance), replace(HERE, yaw=yaw), Twist2(*v), Twist2(*own))

    required = is_required(environment, chosen, *args)

    assert not (required and is_safe(environment, chosen, *args))


@pytest.mark.requirement(104)
def test_tuned_sees_a_walker_coming_who_is_in_no_zone_yet(
    paper: Profile, tuned: Profile, environment_of: Callable[..., Environment]
) -> None:
    user, towards_the_robot = user_seeing(2.0, 2.6), Twist2(-1.5)

    def required(profile: Profile, velocity: Twist2) -> bool:
        environment = environment_of(profile)
        return is_required(environment, profile.settings, user, HERE, velocity, STANDING)

    assert required(tuned, towards_the_robot)
    assert not required(paper, towards_the_robot)
    assert not required(tuned, Twist2(1.5))  # away
    assert not required(tuned, Twist2(0.0, 1.5))  # past


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


class Fleeing:
    """`Flee` in a situation, with its base and what the user is shown."""

    def __init__(self, now: Situation, context: Any, safe: bool = False) -> None:
        self.base, self.vr = Base("escape"), Vr()
        poses = escape_poses.poses(now.settings, now.planners["escape"], now.user, now.pose)
        values = {
            "environment": now.environment, "settings": now.settings, "base.pose": now.pose,
            "base.twist": now.twist, "user.pose": now.user, "user.velocity": now.velocity,
            "escape.poses": poses, "escape.safe": safe,
        }  # fmt: skip
        self.ctx = context(values, {"base": self.base, "vr": self.vr})
        self.run = escape.Flee().run(self.ctx)

    def go(self, **values: Any) -> str | None:
        """A step, with new values of signals; its outcome, or None while it drives."""
        self.ctx.values |= {name.replace("_", ".", 1): value for name, value in values.items()}
        try:
            next(self.run)
        except StopIteration as ended:
            outcome: str = ended.value
            return outcome
        return None


COMING = UserPose(Pose2(12.0, 10.0, math.pi), math.pi)


@pytest.mark.requirement(109, 110, 111)
def test_fleeing_drives_away_from_the_user_without_turning(
    profile: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    now = situation_of(profile, replace(HERE, yaw=0.7), COMING, Twist2(-1.0))
    fleeing = Fleeing(now, context)

    assert fleeing.go() is None

    command = fleeing.base.command
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
    fleeing = Fleeing(situation_of(profile, Pose2(0.9, 0.9), user, WALKING, room=cell), context)

    fleeing.ctx.values["escape.poses"] = ()
    assert fleeing.go() == "no_pose"
    assert fleeing.base.command is None


@pytest.mark.requirement(149)
@pytest.mark.parametrize("missing", ["user_pose", "user_velocity", "base_pose"])
def test_with_a_signal_missing_escape_brakes_and_then_drives_on(
    tuned: Profile, situation_of: Callable[..., Situation], context: Any, missing: str
) -> None:
    fleeing = Fleeing(situation_of(tuned, HERE, COMING, Twist2(-1.0)), context)
    known = fleeing.ctx.values[missing.replace("_", ".")]
    assert fleeing.go() is None
    assert fleeing.base.command is not None

    for _ in range(3):
        assert fleeing.go(**{missing: None}) is None
        assert fleeing.base.command is None
    assert fleeing.go(**{missing: known}) is None
    assert fleeing.base.command is not None


CORRIDOR = Room(outer=((0.0, 0.0), (20.0, 0.0), (20.0, 2.2), (0.0, 2.2)))
BEHIND = Pose2(1.0, 1.1, 0.0)
"""At the end of a corridor too narrow to pass anybody in."""


def in_the_corridor(speed: float, distance: float = 2.6) -> dict[str, Any]:
    user = UserPose(Pose2(BEHIND.x + distance, 1.1, math.pi), math.pi)
    return {"user": user, "velocity": Twist2(-speed), "room": CORRIDOR}


@pytest.mark.requirement(113, 114)
def test_the_sign_is_shown_once_no_drive_avoids_a_touch_and_the_robot_drives_on(
    tuned: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    user = UserPose(Pose2(11.3, 10.0, math.pi), math.pi)
    now = situation_of(tuned, replace(HERE, yaw=math.pi / 2), user, Twist2(-1.5))
    fleeing = Fleeing(now, context)

    for _ in range(5):
        assert fleeing.go() is None

    assert fleeing.vr.told == ["shown"]
    assert fleeing.base.command is not None
    assert fleeing.base.command.speed > 0.0


@pytest.mark.requirement(109, 114)
@pytest.mark.parametrize("distance", [2.4, 3.0])
def test_nothing_is_shown_while_a_drive_avoids_the_touch(
    tuned: Profile, situation_of: Callable[..., Situation], context: Any, distance: float
) -> None:
    user = UserPose(Pose2(10.0 + distance, 10.3, math.pi), math.pi)
    fleeing = Fleeing(situation_of(tuned, HERE, user, Twist2(-0.8)), context)

    assert fleeing.go() is None
    fleeing.run.close()

    assert fleeing.vr.told == []


@pytest.mark.requirement(114)
@pytest.mark.parametrize(
    ("speed", "before", "shown"),
    [(0.6, 1.15, True), (0.6, 0.95, False), (1.0, 0.0, True)],
    ids=["predicted in time", "later", "pursued"],
)
def test_the_sign_waits_until_the_touch_is_within_the_warning_or_the_robot_is_caught(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    context: Any,
    speed: float,
    before: float,
    shown: bool,
) -> None:
    """The gap of 12 cm comes (2.6 - 0.565 - 0.5 - 0.12) m later, give or take a step.

    Whoever walks straight at a robot that has nowhere to go catches it, whatever the warning.
    """
    touch = (2.6 - 0.565 - 0.5 - 0.12) / speed
    rules = replace(tuned.settings.escape, warning=before * touch)
    here = replace(tuned, settings=replace(tuned.settings, escape=rules))
    now = situation_of(here, BEHIND, **in_the_corridor(speed))
    fleeing = Fleeing(now, context)
    fleeing.ctx.values["escape.poses"] = (BEHIND,)  # the one place there is

    assert fleeing.go() is None

    assert fleeing.vr.told == ["shown"] * shown


@pytest.mark.requirement(114)
@pytest.mark.parametrize(
    ("end", "outcome"),
    [
        ({"escape_safe": True}, "safe"),
        ({"user_pose": None}, None),
        ({"escape_poses": ()}, None),
        ({}, "closed"),
    ],
    ids=["safe", "lost", "drives on", "closed from outside"],
)
def test_whatever_ends_an_escape_hides_the_sign_and_releases_the_base(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    context: Any,
    end: dict[str, Any],
    outcome: str | None,
) -> None:
    fleeing = Fleeing(situation_of(tuned, HERE, user_seeing(0.0, 1.3), Twist2(-1.5)), context)
    assert fleeing.go() is None
    assert fleeing.vr.told == ["shown"]

    found = fleeing.go(**end) if outcome != "closed" else outcome
    if outcome in (None, "closed"):
        fleeing.run.close()

    assert found == outcome
    assert fleeing.vr.told == ["shown", "hidden"]
    assert fleeing.base.command is None


@pytest.mark.requirement(114)
def test_paper_shows_nothing_before_inform(
    paper: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    fleeing = Fleeing(situation_of(paper, HERE, user_seeing(0.0, 1.3), Twist2(-1.5)), context)

    assert fleeing.go() is None
    fleeing.run.close()

    assert fleeing.vr.told == []


@pytest.mark.requirement(112)
def test_a_reached_pose_counts_only_once_both_zones_are_clear(
    paper: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    fleeing = Fleeing(situation_of(paper, HERE, COMING, Twist2(-0.3)), context)
    assert fleeing.go() is None
    there = fleeing.ctx.values["escape.poses"][0]

    assert fleeing.go(base_pose=there) is None
    assert fleeing.base.command is not None

    assert fleeing.go(base_pose=there, escape_safe=True) == "safe"
    assert fleeing.base.command is None


@pytest.mark.requirement(112)
def test_an_escape_from_danger_is_over_on_the_way_once_the_danger_is(
    tuned: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    fleeing = Fleeing(situation_of(tuned, HERE, COMING, Twist2(-1.0)), context)
    assert fleeing.go() is None

    assert fleeing.go(escape_safe=True) == "safe"
    assert fleeing.base.command is None


@pytest.mark.requirement(112)
def test_an_escape_is_not_over_where_the_robot_could_not_stop(
    tuned: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    """It rolls at 0.8 m/s, and 0.32 m further is where its centre keeps 0.77 m from the wall."""
    user = UserPose(Pose2(3.0, 10.0, math.pi), math.pi)
    rules = replace(tuned.settings.escape, order="given")
    here = replace(tuned, settings=replace(tuned.settings, escape=rules))
    fleeing = Fleeing(situation_of(here, Pose2(1.0, 10.0), user, Twist2(-1.0)), context)
    assert fleeing.go() is None

    assert fleeing.go(escape_safe=True, base_twist=Twist2(-0.8)) is None
    assert fleeing.go(base_twist=Twist2(-0.6)) == "safe"


@pytest.mark.requirement(112)
def test_an_escape_because_chase_failed_is_not_over_before_a_pose_is_reached(
    tuned: Profile, situation_of: Callable[..., Situation], context: Any
) -> None:
    user = UserPose(Pose2(15.0, 10.0, 0.0), 0.0)
    fleeing = Fleeing(situation_of(tuned, HERE, user), context, safe=True)

    for _ in range(3):
        assert fleeing.go() is None
    poses = fleeing.ctx.values["escape.poses"]
    reached = [fleeing.go(base_pose=pose) for pose in poses]

    assert "safe" in reached


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

    found = dodge.walks_at_it(now, within)

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

    assert not dodge.walks_at_it(now, math.pi)
