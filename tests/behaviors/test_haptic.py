"""The Haptic rover poses, the choice among them, and the Release."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behaviors import haptic
from behaviors.profile import Profile
from behaviors.situation import Situation
from engine.state import Stamped
from hw.geometry import Pose2, Pose3, Twist2, wrap
from hw.room import Room
from hw.samples import UserPose
from states.environment import Environment


def ended(run: Any) -> Any:
    """The outcome of a state that is given a tick whenever it asks for one."""
    while True:
        try:
            next(run)
        except StopIteration as end:
            return end.value


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
        return haptic.best_pose(now, haptic.reachable(now, "haptic", poses), DEEP)

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

        best = haptic.best_pose(now, haptic.reachable(now, "haptic", free), DEEP)

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


@pytest.mark.requirement(78, 82)
@pytest.mark.parametrize(("height", "outcome"), [(1.5, "chosen"), (2.6, "out_of_reach")])
def test_a_deep_too_high_for_the_arm_is_refused_by_name(
    context: Any,
    tuned: Profile,
    environment_of: Callable[..., Environment],
    height: float,
    outcome: str,
) -> None:
    environment, still = environment_of(tuned), Twist2(0.0)
    deep = Pose3.from_yaw(10.0, 10.0, height, 0.0)
    ctx = context(
        {
            "environment": environment,
            "settings": tuned.settings,
            "base.pose": Pose2(10.0, 13.0),
            "base.twist": still,
            "user.pose": UserPose(Pose2(9.15, 10.0), 0.0),
            "user.velocity": still,
            "haptic.poses": haptic.poses(
                tuned.settings, environment.static_planners["haptic"], deep
            ),
        }
    )

    found = ended(haptic.ChooseHapticPose().run(ctx, deep=deep))

    assert (found if isinstance(found, str) else found[0]) == outcome
