"""What Escape's charts watch and do: one node after the other, and the charts of both policies."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from behaviors.escape.escape_states import DriveToBest, NoEscapePose, OutOfDanger, TouchAhead
from behaviors.escape.paper_escape import DriveToFirst, InEscapeZone, OutOfEscapeZone
from behaviors.profile.profile import Profile
from behaviors.situation.present_situation import Situation
from cobodeck.testing.testing import ChartTester
from engine.state import NEVER_NS
from hw.geometry import Pose2, Twist2, wrap
from hw.samples import UserPose
from hw.scene.room import Room
from tests.behaviors.escaping import Escaping
from tests.repeats import examples

HALF_VIEW = math.pi / 5
HERE = Pose2(10.0, 10.0, 0.0)
COMING = UserPose(Pose2(12.0, 10.0, math.pi), math.pi)
FAR = UserPose(Pose2(15.0, 10.0, 0.0), 0.0)
ZONES = {"ahead": 2.5, "half_view": HALF_VIEW, "around": 1.5}


def user_seeing(bearing: float, distance: float, body_yaw: float = 1.0) -> UserPose:
    """A user who sees the robot at HERE at this bearing from the line of sight."""
    yaw = wrap(math.pi - bearing)
    return UserPose(Pose2(HERE.x + distance, HERE.y, body_yaw), yaw)


def best() -> DriveToBest:
    return DriveToBest(earlier_by=0.2, wider_by=0.05)


def inside(now: Situation, moving: float = 0.2) -> bool:
    return Escaping(InEscapeZone(**ZONES, moving=moving), now).go() == "inside"


def outside(now: Situation) -> bool:
    return Escaping(OutOfEscapeZone(**ZONES, hysteresis=0.2), now).go() == "outside"


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
def test_the_zones_reach_farther_in_the_direction_of_view_of_the_head(
    paper: Profile,
    situation_of: Callable[..., Situation],
    bearing: float,
    distance: float,
    expected: bool,
) -> None:
    for body_yaw in (0.0, 1.5, math.pi):
        user = user_seeing(bearing, distance, body_yaw)
        assert inside(situation_of(paper, HERE, user, Twist2(0.5))) is expected


@pytest.mark.requirement(104)
def test_a_user_who_stands_raises_nothing_unless_the_literal_rule_is_chosen(
    paper: Profile, situation_of: Callable[..., Situation]
) -> None:
    user = user_seeing(0.0, 1.85)

    def found(velocity: Twist2, moving: float = 0.2) -> bool:
        return inside(situation_of(paper, HERE, user, velocity), moving)

    assert not found(Twist2(0.0))
    assert not found(Twist2(0.19))
    assert found(Twist2(0.0, 0.21))
    assert found(Twist2(0.0), moving=0.0)


@pytest.mark.requirement(112)
@pytest.mark.parametrize(
    ("bearing", "distance", "expected"),
    [(0.0, 2.69, False), (0.0, 2.71, True), (2.0, 1.69, False), (2.0, 1.71, True)],
)
def test_outside_is_farther_than_the_zones_by_the_hysteresis(
    paper: Profile,
    situation_of: Callable[..., Situation],
    bearing: float,
    distance: float,
    expected: bool,
) -> None:
    assert outside(situation_of(paper, HERE, user_seeing(bearing, distance))) is expected


@pytest.mark.requirement(112)
@given(
    bearing=st.floats(-math.pi, math.pi), distance=st.floats(0.1, 6.0), speed=st.floats(0.0, 2.0)
)
@settings(deadline=None, max_examples=examples(50))
def test_no_robot_is_inside_a_zone_and_outside_both(
    paper: Profile,
    situation_of: Callable[..., Situation],
    bearing: float,
    distance: float,
    speed: float,
) -> None:
    now = situation_of(paper, HERE, user_seeing(bearing, distance), Twist2(speed))

    assert not (inside(now) and outside(now))


@pytest.mark.requirement(109, 110, 111)
@pytest.mark.parametrize("drive", [best(), DriveToFirst()], ids=["best", "first"])
def test_it_drives_away_from_the_user_without_turning(
    profile: Profile, situation_of: Callable[..., Situation], drive: Any
) -> None:
    now = situation_of(profile, replace(HERE, yaw=0.7), COMING, Twist2(-1.0))
    escaping = Escaping(drive, now)

    assert escaping.go() is None

    command = escaping.base.command
    assert command is not None
    assert command.wz == 0.0
    assert command.rotated(0.7).vx < 0.0
    assert 0.0 < command.speed <= 2.5


@pytest.mark.requirement(105, 109)
def test_the_signal_tells_what_the_drive_would_predict_itself(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(tuned, HERE, COMING, Twist2(-1.0))
    alone, with_signal = Escaping(best(), now), Escaping(best(), now)
    with_signal.sees_the_signal()

    for escaping in (alone, with_signal):
        assert escaping.go() is None
        assert escaping.go() is None

    assert alone.base.command == with_signal.base.command


@pytest.mark.requirement(149)
def test_with_late_poses_the_prediction_is_made_for_the_present_not_for_the_signal(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    """At 0.1 s of age the signal says that nobody comes; the extrapolated user does."""
    user = UserPose(Pose2(11.3, 10.0, math.pi), math.pi)
    calm = situation_of(tuned, HERE, user, Twist2(0.0))
    late = Escaping(TouchAhead(within=2.5), calm)
    late.sees_the_signal()
    assert late.go() is None

    late.ctx.ages["user.pose"] = 0.1
    assert late.go(user_velocity=Twist2(-1.5)) == "predicted"


@pytest.mark.requirement(113)
def test_without_a_free_pose_there_is_none_nor_a_way(
    profile: Profile, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(profile, HERE, COMING, Twist2(-1.0))
    for state, outcome in (
        (NoEscapePose(), "none"), (best(), "no_way"), (DriveToFirst(), "no_way"),
    ):  # fmt: skip
        escaping = Escaping(state, now)
        assert escaping.go(escape_poses=()) == outcome
        assert escaping.base.command is None


@pytest.mark.requirement(113)
def test_poses_that_are_free_no_more_do_not_end_a_drive_that_has_begun(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(tuned, HERE, COMING, Twist2(-1.0))
    watching, driving = Escaping(NoEscapePose(), now), Escaping(best(), now)
    assert watching.go() is None
    assert watching.waits.ns == NEVER_NS
    assert driving.go() is None
    assert driving.go(escape_poses=()) is None


@pytest.mark.requirement(149)
@pytest.mark.parametrize("missing", ["user_pose", "user_velocity", "base_pose"])
def test_with_a_signal_missing_it_brakes_and_then_drives_on_and_nothing_is_decided(
    profile: Profile, situation_of: Callable[..., Situation], missing: str
) -> None:
    now = situation_of(profile, HERE, COMING, Twist2(-1.0))
    for state in (best(), DriveToFirst()):
        escaping = Escaping(state, now)
        known = escaping.ctx.values[missing.replace("_", ".")]
        assert escaping.go() is None
        assert escaping.base.command is not None

        for _ in range(3):
            assert escaping.go(**{missing: None}) is None
            assert escaping.base.command is None
        assert escaping.go(**{missing: known}) is None
        assert escaping.base.command is not None

    for state in (OutOfDanger(), NoEscapePose(), TouchAhead(within=9.0)):
        watching = Escaping(state, now, safe=True)
        assert watching.go(**{missing: None}, escape_poses=()) is None


@pytest.mark.requirement(112)
@pytest.mark.parametrize("drive", [best(), DriveToFirst()], ids=["best", "first"])
def test_who_stands_at_the_pose_has_reached_it_and_says_which(
    profile: Profile, situation_of: Callable[..., Situation], drive: Any
) -> None:
    escaping = Escaping(drive, situation_of(profile, HERE, FAR))
    pose = escaping.ctx.values["escape.poses"][0]
    assert escaping.go(escape_poses=(pose,)) is None

    assert escaping.go(base_pose=pose, base_twist=Twist2(0.5)) is None
    assert escaping.go(base_twist=Twist2(0.0)) == "reached"
    assert escaping.outputs == {"pose": pose}
    assert escaping.base.command is None


@pytest.mark.requirement(112)
def test_danger_is_not_over_where_the_robot_could_not_stop(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    """It rolls at 0.8 m/s, and 0.32 m further is where its centre keeps 0.77 m from the wall."""
    user = UserPose(Pose2(9.0, 10.0, math.pi), math.pi)
    now = situation_of(tuned, Pose2(1.0, 10.0), user)
    out = (OutOfDanger(), "safe"), (OutOfEscapeZone(**ZONES, hysteresis=0.2), "outside")
    for state, outcome in out:
        watching = Escaping(state, now, safe=True)
        assert watching.go(base_twist=Twist2(-0.8)) is None
        assert watching.go(base_twist=Twist2(-0.6)) == outcome


@pytest.mark.requirement(112)
def test_what_must_reach_a_pose_is_not_safe_before(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(tuned, HERE, FAR)
    zones = OutOfEscapeZone(**ZONES, hysteresis=0.2, must_reach=True)
    for state in (OutOfDanger(must_reach=True), zones):
        assert Escaping(state, now, safe=True).go() is None
        assert Escaping(state, now, safe=True, reached=HERE).go() is not None


CORRIDOR = Room(outer=((0.0, 0.0), (20.0, 0.0), (20.0, 2.2), (0.0, 2.2)))
BEHIND = Pose2(1.0, 1.1, 0.0)
"""At the end of a corridor too narrow to pass anybody in."""


def in_the_corridor(speed: float, distance: float = 2.6) -> dict[str, Any]:
    user = UserPose(Pose2(BEHIND.x + distance, 1.1, math.pi), math.pi)
    return {"user": user, "velocity": Twist2(-speed), "room": CORRIDOR}


@pytest.mark.requirement(113, 114)
def test_a_touch_is_ahead_once_no_drive_avoids_it(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    user = UserPose(Pose2(11.3, 10.0, math.pi), math.pi)
    now = situation_of(tuned, replace(HERE, yaw=math.pi / 2), user, Twist2(-1.5))

    assert Escaping(TouchAhead(within=2.5), now).go() == "predicted"


@pytest.mark.requirement(109, 114)
@pytest.mark.parametrize("distance", [2.4, 3.0])
def test_no_touch_is_ahead_while_a_drive_avoids_it(
    tuned: Profile, situation_of: Callable[..., Situation], distance: float
) -> None:
    user = UserPose(Pose2(10.0 + distance, 10.3, math.pi), math.pi)
    now = situation_of(tuned, HERE, user, Twist2(-0.8))

    assert Escaping(TouchAhead(within=2.5), now).go() is None


@pytest.mark.requirement(114)
@pytest.mark.parametrize(
    ("speed", "before", "shown"),
    [(0.6, 1.15, True), (0.6, 0.95, False), (1.0, 0.0, True)],
    ids=["predicted in time", "later", "pursued"],
)
@pytest.mark.parametrize("poses", [(BEHIND,), ()], ids=["one pose", "no free pose any more"])
def test_a_touch_counts_once_it_is_within_the_warning_or_the_robot_is_caught(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    speed: float,
    before: float,
    shown: bool,
    poses: tuple[Pose2, ...],
) -> None:
    """The gap of 12 cm comes (2.6 - 0.565 - 0.5 - 0.12) m later, give or take a step.

    Whoever walks straight at a robot that has nowhere to go catches it, whatever the warning.
    """
    touch = (2.6 - 0.565 - 0.5 - 0.12) / speed
    now = situation_of(tuned, BEHIND, **in_the_corridor(speed))
    watching = Escaping(TouchAhead(within=before * touch), now)

    found = watching.go(escape_poses=poses)  # the place where it stands, or none

    assert found == ("predicted" if shown else None)


POSE = Pose2(1.0, 2.0, 0.0)
ENDS = [
    ("fault", "there", "fault"), ("tracking", "lost", "user_lost"),
    ("away/drive/no_pose", "none", "failed"), ("away/drive/go", "no_way", "failed"),
]  # fmt: skip


@pytest.mark.requirement(112, 113)
@pytest.mark.parametrize("chart", ["escape", "paper_escape"])
@pytest.mark.parametrize(("node", "ends", "outcome"), ENDS)
def test_each_node_of_escape_ends_it_its_own_way(
    sim: ChartTester, chart: str, node: str, ends: str, outcome: str
) -> None:
    sim.start(chart)
    sim.tick(3)

    sim.end(node, ends)
    sim.tick()

    assert sim.outcome == outcome


@pytest.mark.requirement(112)
@pytest.mark.parametrize(
    ("chart", "over"), [("escape", "safe"), ("paper_escape", "outside")]
)  # fmt: skip
def test_escape_goes_from_pose_to_pose_until_it_is_safe_or_too_late(
    sim: ChartTester, chart: str, over: str
) -> None:
    for ends in (over, None):
        sim.start(chart)
        for _ in range(3):
            sim.wait(0.5)
            sim.end("away/drive/go", "reached", pose=POSE)
            sim.tick()
            assert "away/drive/go" in sim.active
            assert sim.run.value_of("reached") == POSE
        if ends is not None:
            sim.end("away/drive/safe", ends)
        sim.wait(1.6)  # 3 s from its beginning, not from the last pose
        assert sim.outcome == ("failed" if ends is None else "safe")


@pytest.mark.requirement(112)
def test_safety_goes_before_a_lack_of_poses_in_the_same_tick(sim: ChartTester) -> None:
    sim.start("escape")
    sim.tick()

    sim.end("away/drive/safe", "safe")
    sim.end("away/drive/no_pose", "none")
    sim.tick()

    assert sim.outcome == "safe"


@pytest.mark.requirement(114)
@pytest.mark.parametrize("end", [("away/drive/safe", "safe"), ("tracking", "lost")])
def test_the_sign_stays_from_the_prediction_to_the_end_while_the_robot_drives_on(
    sim: ChartTester, end: tuple[str, str]
) -> None:
    sim.start("escape", real=["sign/show"])
    sim.tick(3)
    assert "sign/calm" in sim.active

    sim.end("sign/calm", "predicted")
    sim.tick()
    sim.end("away/drive/go", "reached", pose=POSE)
    sim.tick(2)
    assert {"sign/show", "away/drive/go"} <= set(sim.active)

    sim.end(*end)
    sim.tick()
    assert sim.outcome is not None
    shown = [call[1:] for call in sim.parts["vr"].commands if call[0] == "inform"]
    assert shown == [(True, 2.0), (False,)]


def test_paper_shows_nothing_in_escape(sim: ChartTester) -> None:
    sim.start("paper_escape")

    classes = {leaf.interface.name for leaf in sim.run.machine.leaves}
    commands = {name for leaf in sim.run.machine.leaves for name in leaf.interface.commands}
    assert "WarnUser" not in classes
    assert commands == {"base"}


ANOTHER_ZONE = """
chart: mine
outcomes: [near, required]
any:
  danger: {watch: EscapeRequired, next: {required: .required}}
  near: {watch: Below, with: {signal: user.distance, limit: 1 m, for: 0.2 s}, next: {below: .near}}
  beside:
    watch: InEscapeZone
    with: {ahead: 1.2 m, half_view: 90 deg, around: 0.9 m, moving: 0.1 m/s}
    next: {inside: .near}
"""


@pytest.mark.requirement(104)
def test_a_chart_may_have_another_zone(sim: ChartTester) -> None:
    sim.start(ANOTHER_ZONE, real=["near"], signals={"user.distance": 1.5})
    sim.wait(1.0)
    assert sim.outcome is None

    sim.signal("user.distance", 0.8)
    sim.wait(0.5)

    assert sim.outcome == "near"
