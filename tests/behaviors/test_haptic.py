"""The Haptic rover poses, the choice among them, and the Release."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from behaviors import haptic
from behaviors.profile.profile import Profile
from behaviors.profile.settings import CloseSettings
from behaviors.situation.present_situation import Situation
from engine.state import Stamped
from hw.geometry import Pose2, Pose3, wrap
from hw.samples import UserPose
from hw.scene.room import Room
from states.environment.environment import Environment

DEEP = Pose3.from_yaw(10.0, 10.0, 1.5, 0.0)
S30, C30 = 0.5, math.sqrt(3.0) / 2.0


@pytest.mark.requirement(75, 76, 85)
def test_seven_poses_on_a_half_circle_look_at_the_deep(paper: Profile) -> None:
    found = list(haptic.all_poses(paper.settings.haptic, DEEP))

    expected = [
        (1.0, 0.0), (C30, S30), (C30, -S30), (S30, C30), (S30, -C30), (0.0, 1.0), (0.0, -1.0),
    ]  # fmt: skip
    assert [(p.x - 10.0, p.y - 10.0) for p in found] == [
        pytest.approx(place, abs=1e-12) for place in expected
    ]
    for pose in found:
        assert pose.bearing_to(DEEP.flat()) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.requirement(75, 76, 85)
def test_tuned_the_half_circle_is_finer_and_has_the_seven_in_it(
    tuned: Profile, paper: Profile
) -> None:
    found = list(haptic.all_poses(tuned.settings.haptic, DEEP))
    seven = list(haptic.all_poses(paper.settings.haptic, DEEP))

    assert found[0] == seven[0]
    assert set(seven) <= set(found)
    assert len(found) == 13
    for pose in found:
        assert pose.distance_to(DEEP.flat()) == pytest.approx(1.0)
        assert pose.bearing_to(DEEP.flat()) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.requirement(76, 132)
@given(x=st.floats(-5, 5), y=st.floats(-5, 5), yaw=st.floats(-3.1, 3.1), ahead=st.floats(0.3, 1.5))
@settings(deadline=None, max_examples=50)
def test_the_first_pose_lies_on_the_line_from_the_user_through_the_deep(
    paper: Profile, x: float, y: float, yaw: float, ahead: float
) -> None:
    user = Pose2(x, y, yaw)
    deep = Pose3.from_yaw(*user.transform(ahead, 0.0), 1.5, yaw)

    first = next(haptic.all_poses(paper.settings.haptic, deep))

    assert user.distance_to(first) == pytest.approx(ahead + 1.0)
    assert user.bearing_to(first) == pytest.approx(0.0, abs=1e-9)
    assert abs(wrap(first.yaw - yaw)) == pytest.approx(math.pi)


@pytest.mark.requirement(76)
def test_the_order_is_the_profile_s(paper: Profile) -> None:
    chosen = replace(paper.settings.haptic, angles=(math.radians(30.0), 0.0))

    found = list(haptic.all_poses(chosen, DEEP))

    assert found[0].y > 10.4
    assert found[1].y == pytest.approx(10.0)


@pytest.mark.requirement(77, 120)
def test_two_of_seven_poses_inside_an_obstacle_s_inflation_are_dropped(
    paper: Profile, environment_of: Callable[..., Environment]
) -> None:
    shelf = ((10.4, 11.6), (10.8, 11.6), (10.8, 12.0), (10.4, 12.0))
    room = Room(outer=((0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)), columns=(shelf,))
    environment = environment_of(paper, room)

    every = list(haptic.all_poses(paper.settings.haptic, DEEP))
    found = haptic.poses(paper.settings, environment.static_planners["haptic"], DEEP)

    dropped = [i for i, pose in enumerate(every) if pose not in found]
    assert dropped == [3, 5]  # +60 and +90 degrees
    assert [pose for pose in every if pose in found] == list(found)


def facing_wall(distance: float) -> tuple[Room, UserPose, Pose3]:
    """A user who looks at a wall in front, and the DEEP 0.85 m ahead of them."""
    room = Room(outer=((0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)))
    body = Pose2(20.0 - distance, 10.0, 0.0)
    return room, UserPose(body, 0.0), Pose3.from_yaw(body.x + 0.85, 10.0, 1.5, 0.0)


@pytest.mark.requirement(126)
@pytest.mark.parametrize(("distance", "some"), [(2.34, False), (2.36, True)])
def test_before_a_wall_pose_6_needs_2_35_metres(
    paper: Profile, environment_of: Callable[..., Environment], distance: float, some: bool
) -> None:
    """0.85 + cos 60° + 1.0; the poses at ±90° are free nearer, but beside the user."""
    room, _, deep = facing_wall(distance)

    planner = environment_of(paper, room).static_planners["haptic"]
    found = haptic.poses(paper.settings, planner, deep)

    ahead = [pose for pose in found if pose.x > deep.x + 0.1]
    assert bool(ahead) is some


@pytest.mark.requirement(76, 143)
def test_the_given_order_takes_the_first_pose_that_can_be_driven_to(
    paper: Profile, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(paper, Pose2(10.0, 13.0), UserPose(Pose2(9.15, 10.0), 0.0))
    free = haptic.poses(paper.settings, now.planners["haptic"], DEEP)

    def best(poses: tuple[Pose2, ...]) -> Pose2 | None:
        return haptic.first_pose(now, poses)

    assert best(free) == free[0]
    assert best(free[3:]) == free[3]
    assert best(()) is None


@pytest.mark.requirement(78, 143)
def test_tuned_takes_the_quickest_pose_from_which_the_arm_reaches(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    for start in (Pose2(10.0, 13.0, 0.0), Pose2(10.0, 7.0, 0.0)):
        now = situation_of(tuned, start, UserPose(Pose2(9.15, 10.0), 0.0))
        free = haptic.poses(tuned.settings, now.planners["haptic"], DEEP)

        best = haptic.soonest_pose(now, haptic.reachable(now, "haptic", free), DEEP)

        assert best is not None
        assert (best.y - 10.0) * (start.y - 10.0) >= 0.0
        assert start.distance_to(best) <= start.distance_to(free[0])


@pytest.mark.requirement(61, 83)
def test_letting_go_is_heard_as_an_event_and_as_the_end_of_the_level(context: Any) -> None:
    ctx = context({"vr.haptic_request": DEEP})
    ctx.stamps["vr.haptic_request"] = 5
    run = haptic.Released().run(ctx, since=5)
    next(run)
    ctx.values["vr.haptic_request"] = None
    with pytest.raises(StopIteration):
        next(run)

    ctx.values["vr.haptic_request"] = DEEP
    run = haptic.Released().run(ctx, since=5)
    next(run)
    ctx.pending["vr.release"] = [Stamped(True, 9)]
    with pytest.raises(StopIteration):
        next(run)


@pytest.mark.requirement(83)
def test_another_request_ends_the_one_being_served(context: Any) -> None:
    ctx = context({"vr.haptic_request": DEEP})
    ctx.stamps["vr.haptic_request"] = 6

    with pytest.raises(StopIteration) as ended:
        next(haptic.Released().run(ctx, since=5))

    assert ended.value.value == "released"


def chosen(context: Any, now: Situation, deep: Pose3, **ring: Any) -> tuple[str, Pose2 | None]:
    """The outcome of the policy's choice in a situation, and the pose if there is one."""
    ctx = context(
        {
            "environment": now.environment,
            "settings": now.settings,
            "base.pose": now.pose,
            "base.twist": now.twist,
            "user.pose": now.user,
            "user.velocity": now.velocity,
        }
    )
    paper = now.settings.policy == "paper"
    state = (haptic.ChooseFirstHapticPose if paper else haptic.ChooseHapticPose)(**ring)
    run = state.run(ctx, deep=deep)
    while True:
        try:
            next(run)
        except StopIteration as end:
            found = end.value
            break
    return (found, None) if isinstance(found, str) else (found[0], found[1]["pose"])


@pytest.mark.requirement(78, 82)
@pytest.mark.parametrize(("height", "outcome"), [(1.5, "chosen"), (2.6, "out_of_reach")])
def test_a_deep_too_high_for_the_arm_is_refused_by_name(
    context: Any,
    tuned: Profile,
    situation_of: Callable[..., Situation],
    height: float,
    outcome: str,
) -> None:
    now = situation_of(tuned, Pose2(10.0, 13.0), UserPose(Pose2(9.15, 10.0), 0.0))
    deep = Pose3.from_yaw(10.0, 10.0, height, 0.0)

    assert chosen(context, now, deep)[0] == outcome


@pytest.mark.requirement(77, 126)
@pytest.mark.parametrize(
    ("distance", "outcome"), [(0.8, "deep_blocked"), (1.07, "deep_blocked"), (1.075, "other")]
)
def test_a_deep_that_leaves_the_prop_no_room_before_a_wall_is_refused_by_name(
    profile: Profile,
    context: Any,
    situation_of: Callable[..., Situation],
    distance: float,
    outcome: str,
) -> None:
    """Prop and flange reach 0.218 m beyond the DEEP, and 5 mm are kept."""
    room, user, deep = facing_wall(distance)
    now = situation_of(profile, Pose2(10.0, 10.0), user, room=room)

    blocked = chosen(context, now, deep)[0] == "deep_blocked"

    assert blocked is (outcome == "deep_blocked")


@pytest.mark.requirement(77)
def test_a_deep_behind_a_thin_wall_is_refused_by_name(
    tuned: Profile, context: Any, situation_of: Callable[..., Situation]
) -> None:
    wall = ((9.6, 5.0), (9.65, 5.0), (9.65, 15.0), (9.6, 15.0))
    room = Room(outer=((0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)), walls=(wall,))
    now = situation_of(tuned, Pose2(14.0, 10.0), UserPose(Pose2(9.1, 10.0), 0.0), room=room)

    assert chosen(context, now, DEEP) == ("deep_blocked", None)


CORRIDOR = Room(outer=((0.0, 0.0), (20.0, 0.0), (20.0, 1.5), (0.0, 1.5)))
HOUSE = Room(
    outer=((0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0)),
    walls=(((5.9, 0.0), (6.1, 0.0), (6.1, 3.2), (5.9, 3.2)),
           ((5.9, 4.8), (6.1, 4.8), (6.1, 8.0), (5.9, 8.0))),
)  # fmt: skip
"""Two rooms with a doorway of 1.6 m."""


@pytest.mark.requirement(77, 82)
def test_without_room_for_the_rover_there_is_no_pose(
    profile: Profile, context: Any, situation_of: Callable[..., Situation]
) -> None:
    user = UserPose(Pose2(9.0, 0.75), 0.0)
    now = situation_of(profile, Pose2(3.0, 0.75), user, room=CORRIDOR)

    assert chosen(context, now, Pose3.from_yaw(9.85, 0.75, 1.2, 0.0)) == ("no_pose", None)


@pytest.mark.requirement(77, 82)
@pytest.mark.parametrize(("x", "outcome"), [(6.0, "no_way"), (9.0, "other")])
def test_a_user_in_the_doorway_cuts_off_what_is_behind_them(
    tuned: Profile, context: Any, situation_of: Callable[..., Situation], x: float, outcome: str
) -> None:
    now = situation_of(tuned, Pose2(2.0, 4.0), UserPose(Pose2(x, 4.0), 0.0), room=HOUSE)

    found, goal = chosen(context, now, Pose3.from_yaw(x + 0.85, 4.0, 1.2, 0.0))

    assert (found == "no_way") is (outcome == "no_way")
    assert (goal is None) is (outcome == "no_way")


@pytest.mark.requirement(76, 77, 126)
@pytest.mark.parametrize("distance", [1.7, 1.9])
def test_before_a_wall_tuned_has_a_second_choice_with_escape_s_distances(
    tuned: Profile,
    paper: Profile,
    context: Any,
    situation_of: Callable[..., Situation],
    distance: float,
) -> None:
    room, user, deep = facing_wall(distance)

    now = situation_of(tuned, Pose2(12.0, 10.0), user, room=room)
    outcome, goal = chosen(context, now, deep)

    assert outcome == "close"
    assert goal is not None
    assert 0.77 <= room.clearance(goal.x, goal.y) < 1.0
    assert goal.distance_to(user.body) >= 1.27
    assert 0.8 - 1e-9 <= goal.distance_to(deep.flat()) <= 1.3 + 1e-9
    assert goal.bearing_to(deep.flat()) == pytest.approx(0.0, abs=1e-9)
    literal = situation_of(paper, Pose2(12.0, 10.0), user, room=room)
    _, other = chosen(context, literal, deep)
    assert other is None or room.clearance(other.x, other.y) >= 1.0 - 1e-9


@pytest.mark.requirement(76)
def test_where_a_pose_of_the_half_circle_will_do_it_is_chosen_in_one_tick(
    tuned: Profile, context: Any, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(tuned, Pose2(10.0, 13.0), UserPose(Pose2(9.15, 10.0), 0.0))
    every = set(haptic.all_poses(tuned.settings.haptic, DEEP))

    outcome, goal = chosen(context, now, DEEP)

    assert outcome == "chosen"
    assert goal in every


@pytest.mark.requirement(75)
@pytest.mark.parametrize("degrees", [7.0, 10.0, 15.0, 24.0, 36.0, 50.0, 90.0, 180.0])
def test_the_second_choice_is_all_round_the_deep_without_a_gap_or_a_place_twice(
    degrees: float,
) -> None:
    found = haptic.round_poses(CloseSettings(0.7, 0.7, 0.1, math.radians(degrees)), DEEP)

    bearings = sorted(math.atan2(pose.y - DEEP.y, pose.x - DEEP.x) % math.tau for pose in found)
    gaps = [(b - a) % math.tau for a, b in zip(bearings, bearings[1:] + bearings[:1], strict=True)]
    assert max(gaps) == pytest.approx(math.radians(degrees))
    assert min(gaps) > 0.01


@pytest.mark.requirement(75, 76)
def test_a_node_s_own_half_circle_goes_before_the_profile_s(
    profile: Profile, context: Any, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(profile, Pose2(10.0, 13.0), UserPose(Pose2(9.15, 10.0), 0.0))

    outcome, goal = chosen(context, now, DEEP, radius=0.9, angles=(math.radians(20.0),))

    assert outcome == "chosen"
    assert goal is not None
    assert goal.distance_to(DEEP.flat()) == pytest.approx(0.9)
    assert DEEP.flat().bearing_to(goal) == pytest.approx(math.radians(20.0))
