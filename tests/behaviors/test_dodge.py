"""RolloutEvaluation of drives beside a walking user, and the places chosen by them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from shapely.geometry import LineString, Point, Polygon

from behaviors.chase.beside import place_with_room
from behaviors.escape import escape_poses
from behaviors.escape.escape_candidates import candidates
from behaviors.escape.pursuit import is_caught, walks_at_it
from behaviors.person.band import haste, off_the_band
from behaviors.person.drives import STEP_S, roll_out, steps_of
from behaviors.person.lines import predict_user
from behaviors.person.touch import evaluate, pursued
from behaviors.profile.profile import Profile
from behaviors.situation.present_situation import Situation
from hw.geometry import Outline, Pose2, Twist2
from hw.model.robot import Footprint
from hw.samples import USER_RADIUS, UserPose
from hw.scene.room import Room
from hw.sim.contact.contact import gap
from states.signals.prediction import PREDICTORS
from tests.behaviors.straight import command_towards
from tests.repeats import examples


def facing(x: float, y: float, yaw: float) -> UserPose:
    return UserPose(Pose2(x, y, yaw), yaw)


def best_of(
    now: Situation,
    goals: Sequence[Pose2],
    present: Pose2 | None = None,
    outline: Outline | None = None,
) -> Pose2 | None:
    """The Escape pose to drive to, with the profile's hysteresis."""
    return candidates(now, goals, outline).better_than(present, earlier_by=0.2, wider_by=0.05)


def test_tracks_are_the_predictors_step_by_step(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(tuned, Pose2(5.0, 5.0), facing(10.0, 10.0, 0.3), Twist2(1.0, 0.2, 0.5))

    names = sorted(PREDICTORS)
    found = predict_user(now, names)

    assert found.shape == (len(names), steps_of(now), 3)
    for row, name in zip(found, names, strict=True):
        last = PREDICTORS[name].at(now.user.body, now.velocity, 3.0, now.pose)
        assert row[-1] == pytest.approx((last.x, last.y, last.yaw))


COLUMN = ((5.0, 2.0), (5.4, 2.0), (5.4, 3.1), (5.0, 3.1))
OUTER = ((0.0, 0.0), (9.0, 0.0), (9.0, 7.0), (0.0, 7.0))


@pytest.mark.requirement(66)
@given(
    x=st.floats(0.1, 8.9), y=st.floats(0.1, 6.9), yaw=st.floats(-3.1, 3.1),
    speed=st.floats(0.2, 2.0), turning=st.floats(-1.5, 1.5),
)  # fmt: skip
@settings(deadline=None, max_examples=examples(100))
def test_nobody_is_predicted_to_walk_through_a_wall(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    x: float,
    y: float,
    yaw: float,
    speed: float,
    turning: float,
) -> None:
    """Each trajectory is the predictor's up to the step that would cross a wall, and ends there."""
    floor = Polygon(OUTER, [COLUMN])
    body = Pose2(x, y, yaw)
    assume(floor.buffer(-1e-3).contains(Point(x, y)))
    walking = Twist2(speed * math.cos(yaw), speed * math.sin(yaw), turning)
    room = Room(outer=OUTER, columns=(COLUMN,))
    now = situation_of(tuned, Pose2(7.0, 5.0), facing(x, y, yaw), walking, room=room)
    names = sorted(PREDICTORS)

    for name, row in zip(names, predict_user(now, names).tolist(), strict=True):
        here = (x, y)
        for step, (found_x, found_y, _) in enumerate(row):
            there = PREDICTORS[name].at(body, walking, STEP_S * (step + 1), now.pose)
            if LineString((here, (there.x, there.y))).crosses(floor.boundary):
                assert [place[:2] for place in row[step:]] == [[*here]] * len(row[step:])
                break
            assert (found_x, found_y) == pytest.approx((there.x, there.y), abs=1e-9)
            here = found_x, found_y


@pytest.mark.requirement(50)
@given(
    x=st.floats(-3.0, 3.0), y=st.floats(-3.0, 3.0),
    vx=st.floats(-1.5, 1.5), vy=st.floats(-1.5, 1.5),
)  # fmt: skip
@settings(deadline=None, max_examples=60)
def test_a_rollout_keeps_the_limits_and_ends_at_its_place(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    x: float,
    y: float,
    vx: float,
    vy: float,
) -> None:
    now = situation_of(tuned, Pose2(10, 10), facing(1, 1, 0), twist=Twist2(vx, vy))
    place = (10.0 + x, 10.0 + y)

    trajectory = roll_out(now, [place], 2.5).trajectories[0]

    steps = np.diff(np.vstack(([10.0, 10.0], trajectory)), axis=0) / STEP_S
    assert np.hypot(*steps.T).max() <= 2.5 + 1e-9
    assert np.hypot(*np.diff(steps, axis=0).T).max() <= 1.0 * STEP_S + 1e-9


def test_a_rollout_from_standstill_arrives(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(tuned, Pose2(10, 10), facing(1, 1, 0))

    found = roll_out(now, [(11.0, 10.5)], 2.5)

    assert found.trajectories[0, -1] == pytest.approx((11.0, 10.5), abs=0.05)


@given(x=st.floats(-3.0, 3.0), y=st.floats(-3.0, 3.0), yaw=st.floats(-3.1, 3.1))
@settings(deadline=None, max_examples=100)
def test_the_gap_of_a_rollout_is_that_of_the_outline(
    tuned: Profile, situation_of: Callable[..., Situation], x: float, y: float, yaw: float
) -> None:
    pose = Pose2(10.0 + x, 10.0 + y, yaw)
    now = situation_of(tuned, pose, facing(10.0, 10.0, 0.0))

    found = evaluate(now, roll_out(now, [(pose.x, pose.y)], 2.5), predict_user(now, ("stays",)))

    expected = gap(now.environment.robot.footprint, pose, 10.0, 10.0)
    assert found.gap[0] == pytest.approx(max(expected, -0.5), abs=1e-9)


def test_safe_after_is_when_the_zones_stay_clear(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    """1.5 m aside of a user who looks elsewhere: clear at 1.7 m, 0.2 m away from rest."""
    now = situation_of(tuned, Pose2(10.0, 11.5), facing(10.0, 10.0, math.pi))

    places = [(10.0, 12.5), (10.0, 11.5)]
    found = evaluate(now, roll_out(now, places, 2.5), predict_user(now, ("stays",)))

    needed = math.sqrt(2.0 * 0.2 / 1.0)
    assert found.safe_after[0] == pytest.approx(needed, abs=STEP_S + 1e-9)
    assert found.safe_after[1] == math.inf


def test_the_band_counts_what_is_missing_on_either_side_of_the_band() -> None:
    apart = np.array([[3.5, 3.5], [2.5, 3.5], [3.5, 5.0], [1.0, 3.5]])
    ways = np.stack((1.0 + 0.6 * apart, 2.0 + 0.8 * apart), axis=-1)
    standing = np.array([[[1.0, 2.0, 0.0]] * 2])

    found = off_the_band(ways, standing, 3.0, 4.0, 5.0, 1.5, 10.0)

    assert found == pytest.approx([0.0, 0.25, 5.0, 4.0 + 10.0 * 0.25])


@pytest.mark.requirement(109)
def test_the_way_out_of_a_walker_s_path_is_sideways_and_touches_nobody(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(tuned, Pose2(10, 10, math.pi / 2), facing(13.0, 10.2, math.pi), Twist2(-1.3))
    goals = escape_poses.poses(now.settings, now.planners["escape"], now.user, now.pose)

    seen = candidates(now, goals)
    goal = best_of(now, goals)

    assert goal is not None
    assert seen.touch_after == math.inf
    assert goal.y < 10.0
    likely = predict_user(now, now.settings.user.likely)
    assert evaluate(now, roll_out(now, [(goal.x, goal.y)], 2.5), likely).gap[0] > 0.0


@pytest.mark.requirement(109)
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_of_two_ways_out_the_one_under_way_is_kept(
    tuned: Profile, situation_of: Callable[..., Situation], side: float
) -> None:
    """Left and right of a user who walks straight at the robot are worth the same."""
    now = situation_of(tuned, Pose2(10, 10), facing(13.0, 10.0, math.pi), Twist2(-1.0))
    goals = [Pose2(9.5, 10.0 + 2.0 * y) for y in (-1.0, 1.0)]
    present = next(goal for goal in goals if (goal.y - 10.0) * side > 0.0)

    assert best_of(now, goals, present) is present
    later = [Pose2(10.0, 10.0 + 0.3 * side), goals[0] if side > 0.0 else goals[1]]
    assert best_of(now, later, later[0]) is later[1]


@pytest.mark.requirement(109, 114)
def test_where_each_drive_ends_in_a_contact_the_one_with_the_larger_gap_until_the_stop_is_taken(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    """A robot that drives to the right cannot get out to the left before the user has stopped."""
    rolling = Twist2(0.0, -0.8)
    now = situation_of(
        tuned, Pose2(10, 10), facing(11.8, 10.0, math.pi), Twist2(-1.5), twist=rolling
    )
    left, right = Pose2(10.0, 12.5), Pose2(10.0, 9.2)
    found = evaluate(
        now,
        roll_out(now, [(left.x, left.y), (right.x, right.y)], 2.5),
        predict_user(now, now.settings.user.likely),
    )
    assert (found.gap <= 0.0).all()
    assert found.gap_soon[1] > found.gap_soon[0]

    assert best_of(now, [left, right]) is right
    assert best_of(now, [left, right], left) is right


@pytest.mark.parametrize(("room", "touches"), [(0.11, True), (0.13, False)])
def test_passing_nearer_than_twelve_centimetres_counts_as_a_touch(
    tuned: Profile, situation_of: Callable[..., Situation], room: float, touches: bool
) -> None:
    aside = 0.455 + USER_RADIUS + room
    now = situation_of(tuned, Pose2(10, 10), facing(11.0, 10.0 + aside, math.pi), Twist2(-1.0))

    found = evaluate(
        now, roll_out(now, [(10.0, 10.0)], 2.5), predict_user(now, ("constant_velocity",))
    )

    assert found.gap[0] == pytest.approx(room)
    assert bool(found.touch_after[0] < math.inf) is touches


@pytest.mark.requirement(91)
def test_room_is_made_away_from_the_walk(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(tuned, Pose2(10, 10), facing(13.0, 10.0, math.pi), Twist2(-1.0))

    place, _ = place_with_room(now, (3.4, 4.0), None)

    assert math.dist(place, (13.0, 10.0)) > 3.4


@pytest.mark.requirement(91)
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("walking", [0.0, 1.3])
def test_room_is_made_to_the_side_on_which_the_robot_is_even_before_the_user_sets_off(
    tuned: Profile, situation_of: Callable[..., Situation], side: float, walking: float
) -> None:
    """It does not cross the line on which somebody who has turned may walk."""
    user = facing(10.0, 10.0, math.pi)
    now = situation_of(tuned, Pose2(7.4, 10.0 + 0.3 * side), user, Twist2(-walking))

    (_, y), _ = place_with_room(now, (3.4, 4.0), None)

    assert side * (y - 10.0) > 0.3


@pytest.mark.requirement(91)
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("off", [0.1, 0.2])
def test_room_is_made_to_the_side_from_which_the_user_turns_towards_the_robot(
    tuned: Profile, situation_of: Callable[..., Situation], side: float, off: float
) -> None:
    """A turn that is not over yet mostly ends beyond the robot; the way out is behind it."""
    user, turning = facing(10.0, 10.0, math.pi - side * off), Twist2(0.0, 0.0, 3.0 * side)

    (_, y), _ = place_with_room(
        situation_of(tuned, Pose2(6.2, 10.0), user, turning), (3.4, 3.7), None
    )

    assert side * (y - 10.0) > 0.5


@pytest.mark.requirement(52)
def test_room_is_not_made_through_a_wall_even_with_momentum(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    room = Room(outer=((0.0, 0.0), (12.0, 0.0), (12.0, 12.0), (0.0, 12.0)))
    now = situation_of(
        tuned, Pose2(1.6, 6.0), facing(4.5, 6.0, math.pi), Twist2(-1.0), Twist2(-0.9), room
    )

    place, _ = place_with_room(now, (3.4, 4.0), None)
    found = roll_out(now, [place], 1.5)

    assert min(x for x, _ in found.trajectories[0]) >= 0.99


@pytest.mark.requirement(50, 52)
def test_a_command_from_which_braking_would_end_in_a_wall_is_not_given(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    rolling = situation_of(tuned, Pose2(1.9, 10.0), facing(6.0, 10.0, 0.0), twist=Twist2(-1.4))

    assert command_towards(rolling, (1.0, 13.0), "chase") == Twist2(0.0)
    assert command_towards(rolling, (1.0, 13.0), "escape").speed > 0.0


@pytest.mark.requirement(50, 52)
@pytest.mark.parametrize(("user", "given"), [((2.7, 8.6), False), ((2.7, 14.0), True)])
def test_a_command_whose_rest_after_the_safety_chain_ends_in_a_wall_is_not_given(
    tuned: Profile, situation_of: Callable[..., Situation], user: tuple[float, float], given: bool
) -> None:
    """Along a wall to the right: what is left of a motion to somebody on the left leads into it."""
    now = situation_of(tuned, Pose2(1.2, 10.0), facing(*user, 0.0), twist=Twist2(-0.5, -1.2))

    command = command_towards(now, (1.0, 6.0), "escape")

    assert (command != Twist2(0.0)) is given


def test_an_arm_that_is_out_widens_the_outline_and_a_parked_one_does_not(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    environment = situation_of(tuned, Pose2(10, 10), facing(13, 10, 0)).environment
    rover = environment.outline()

    assert rover == (0.565, 0.565, 0.455, 0.455)
    assert environment.outline(environment.robot.parked) == rover
    level = environment.outline((0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert max(level) > 1.0
    assert all(out >= inside for out, inside in zip(level, rover, strict=True))


@given(
    front=st.floats(0.6, 1.5), left=st.floats(0.5, 1.5),
    x=st.floats(-3.0, 3.0), y=st.floats(-3.0, 3.0), yaw=st.floats(-3.1, 3.1),
)  # fmt: skip
@settings(deadline=None, max_examples=60)
def test_the_gap_of_a_rollout_counts_the_arm(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    front: float,
    left: float,
    x: float,
    y: float,
    yaw: float,
) -> None:
    """The rectangle of rover and arm is moved into the middle, and measured as a footprint is."""
    pose, outline = Pose2(10.0 + x, 10.0 + y, yaw), Outline(front, 0.565, left, 0.455)
    now = situation_of(tuned, pose, facing(10.0, 10.0, 0.0))

    here = roll_out(now, [(pose.x, pose.y)], 2.5)
    found = evaluate(now, here, predict_user(now, ("stays",)), outline)

    box = Footprint(front + 0.565, left + 0.455, 0.1, 2.0)
    middle = Pose2(*pose.transform(0.5 * (front - 0.565), 0.5 * (left - 0.455)), yaw)
    whole = gap(box, middle, 10.0, 10.0)
    rover = gap(now.environment.robot.footprint, pose, 10.0, 10.0)
    assert found.gap[0] == pytest.approx(whole if whole >= 0.2 else rover, abs=1e-9)


def test_an_arm_that_is_with_the_user_is_taken_away(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    """Right after a Release the arm is where the hand was; going back is no touch."""
    now = situation_of(tuned, Pose2(10, 10), facing(11.5, 10.0, math.pi), Twist2(-0.25))
    goals = escape_poses.poses(now.settings, now.planners["escape"], now.user, now.pose)

    goal = best_of(now, goals, outline=Outline(0.99, 0.565, 0.455, 0.455))

    assert goal is not None
    assert goal.x < 10.0


def test_who_walks_at_a_robot_is_warned_as_much_earlier_as_poses_and_commands_are_late(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    """At 1 m/s a second is a metre; so is one that a danger is to last longer, once it is one."""

    def farthest(delay: float, calm: float = 0.0) -> float:
        for centimetres in range(500, 50, -2):
            user = facing(10.0 + 0.01 * centimetres, 10.0, math.pi)
            now = situation_of(tuned, Pose2(10.0, 10.0), user, Twist2(-1.0))
            late = replace(now.environment, user_delay=now.environment.user_delay + delay)
            if is_caught(replace(now, environment=late), [now.pose], calm=calm):
                return 0.01 * centimetres
        return math.nan

    at_once = farthest(0.0)
    assert farthest(1.0) - at_once == pytest.approx(1.0, abs=0.11)  # predicted in steps of 0.1 s
    assert farthest(0.0, calm=1.0) - at_once == pytest.approx(1.0, abs=0.11)


@pytest.mark.parametrize("around", [0.0, 0.6, 1.2, math.pi / 2, 2.5, math.pi, -2.0, -0.4])
@pytest.mark.parametrize("yaw", [0.0, 0.8])
def test_who_walks_at_a_robot_that_stands_reaches_it_from_any_side_in_the_time_of_the_gap(
    tuned: Profile, situation_of: Callable[..., Situation], around: float, yaw: float
) -> None:
    """By shapely: the first step of 0.1 s at whose end its outline is nearer than that counts."""
    here = Pose2(10.0, 10.0, yaw)
    c, s = math.cos(around), math.sin(around)
    now = situation_of(tuned, here, facing(10.0 + 2.5 * c, 10.0 + 2.5 * s, 0.0), Twist2(-c, -s))
    o = now.environment.outline()
    corners = ((o.front, o.left), (-o.back, o.left), (-o.back, -o.right), (o.front, -o.right))
    outline = Polygon([here.transform(*corner) for corner in corners])
    closest = 0.12 + now.environment.user_margin + USER_RADIUS
    gaps = [
        outline.distance(Point(10.0 + (2.5 - 0.1 * n) * c, 10.0 + (2.5 - 0.1 * n) * s))
        for n in range(1, 25)
    ]

    (found,) = pursued(now, roll_out(now, [(10.0, 10.0)], 2.5)).tolist()

    expected = next(0.1 * n for n, gap_ in enumerate(gaps, 1) if gap_ < closest)
    assert found == pytest.approx(expected)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("rate", "by"), [(0.5, 0.25), (1.2, 0.6), (5.0, 0.6), (-0.5, 0.0)])
def test_a_bend_towards_the_robot_counts_for_half_a_second_at_1_2_radians_per_second_at_most(
    tuned: Profile, situation_of: Callable[..., Situation], side: float, rate: float, by: float
) -> None:
    user = facing(8.0, 10.0, 0.0)
    robot = Pose2(8.0 + 3.0 * math.cos(0.8), 10.0 + side * 3.0 * math.sin(0.8))
    now = situation_of(tuned, robot, user, Twist2(1.0, 0.0, side * rate))

    assert walks_at_it(now, 0.81 - by)
    assert not walks_at_it(now, 0.79 - by)


@pytest.mark.parametrize("braking", [0.5, 2.0])
def test_haste_is_the_speed_from_which_the_robot_could_not_stop_at_the_distance_to_keep(
    braking: float,
) -> None:
    """Towards a user at the origin at 1 m/s; the way to stop from a speed v is v^2 / 2a."""
    places = np.array([[[4.0 - 0.1 * n, 0.0] for n in range(15)]])
    expected = 0.0
    for x in places[0, 1:, 0].tolist():
        stops = [
            v for v in np.arange(0.0, 4.0, 1e-4).tolist() if v * v / (2.0 * braking) <= x - 2.9
        ]
        expected += max(0.0, 1.0 - max(stops, default=0.0)) ** 2

    [found] = haste(places, (0.0, 0.0), 2.9, braking)

    assert found == pytest.approx(expected, abs=2e-3)
    assert expected > 0.5
    assert haste(places[:, ::-1].copy(), (0.0, 0.0), 2.9, braking) == [0.0]
