"""The Chase space, the choice of a Chase pose, both triggers, and making room."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from behaviors.chase import chase_states as chase, make_room
from behaviors.chase.waiting_place import (
    cells_with_risk,
    chase_cell,
    chase_place,
    free_cells,
    least_cost,
)
from behaviors.escape.zones import in_zone
from behaviors.profile.profile import Profile
from behaviors.situation.chase_cells import (
    Array,
    ChaseRing,
    cells_of,
    length_around,
    response_costs,
    timed_cells,
    weighted_cells,
)
from behaviors.situation.present_situation import Situation
from hw.geometry import Pose2, Pose3, Twist2, wrap
from hw.samples import UserPose
from hw.scene.room import Point, Room
from states.environment.environment import Environment
from states.navigation.local.speed_profile import rest_to_rest

USER = UserPose(Pose2(10.0, 10.0, 0.0), 0.0)


def ring_of(profile: Profile) -> ChaseRing:
    return ChaseRing.of(profile.settings.chase)


def grid(environment: Environment, profile: Profile) -> Array:
    """The cells of the policy's space, each with its weight or cost."""
    chase = profile.settings.chase
    if profile.policy == "paper":
        return weighted_cells(ring_of(profile), chase.best_angle, chase.best_radius)
    return timed_cells(environment, profile.settings, ring_of(profile))


def best_cell(now: Situation, profile: Profile, sample: int | None = None) -> Point | None:
    """The choice of the policy."""
    chase = profile.settings.chase
    if profile.policy == "paper":
        return chase_cell(now, ring_of(profile), chase.best_angle, chase.best_radius, sample)
    return chase_place(now, ring_of(profile))


@pytest.mark.requirement(94)
def test_the_space_has_5998_cells_at_the_paper_s_values(paper: Profile) -> None:
    assert len(cells_of(ring_of(paper))) == 5998


@pytest.mark.requirement(94, 125)
@pytest.mark.parametrize("cell", [0.025, 0.1])
def test_the_resolution_can_be_chosen(paper: Profile, cell: float) -> None:
    chosen = replace(ring_of(paper), cell=cell)

    assert len(cells_of(chosen)) * cell * cell == pytest.approx(5998 * 0.05**2, rel=0.01)


@pytest.mark.requirement(93, 97, 98)
def test_the_space_is_two_equal_arcs_within_the_bounds(profile: Profile) -> None:
    rules = profile.settings.chase
    x, y = cells_of(ring_of(profile)).T

    radius, bearing = np.hypot(x, y), np.degrees(np.abs(np.arctan2(y, x)))
    assert rules.inner <= radius.min() < rules.inner + 0.2
    assert rules.outer - 0.2 < radius.max() <= rules.outer
    assert bearing.min() >= math.degrees(0.5 * rules.front)
    assert bearing.max() <= 180.0 - math.degrees(0.5 * rules.rear)
    if profile.name == "paper":
        assert (rules.inner, rules.outer) == (1.5, 3.0)
    assert np.count_nonzero(y > 0.0) == np.count_nonzero(y < 0.0)


@pytest.mark.requirement(95)
def test_weights_lie_between_0_and_1_and_are_highest_at_the_sides(
    paper: Profile, environment_of: Callable[..., Environment]
) -> None:
    cells = grid(environment_of(paper), paper)

    weights = cells[:, 2]
    assert weights.min() >= 0.0
    assert weights.max() <= 1.0
    x, y, _ = cells[weights.argmax()]
    assert abs(math.degrees(math.atan2(y, x))) == pytest.approx(90.0, abs=1)


@pytest.mark.requirement(103)
def test_from_no_tuned_cell_does_the_user_raise_escape_by_beginning_to_walk(
    tuned: Profile, environment_of: Callable[..., Environment]
) -> None:
    margin = 0.3 - 1e-9
    for x, y, _ in grid(environment_of(tuned), tuned).tolist():
        for turn in (-math.radians(6), 0.0, math.radians(6)):
            user = UserPose(Pose2(0.0, 0.0, 0.0), turn)
            assert not in_zone(tuned.settings.escape, user, Pose2(x, y), margin)


@pytest.mark.requirement(103)
def test_as_printed_3_percent_of_the_cells_lie_in_the_escape_zone(
    paper: Profile, environment_of: Callable[..., Environment]
) -> None:
    user = UserPose(Pose2(0.0, 0.0), 0.0)
    cells = grid(environment_of(paper), paper)

    inside = [in_zone(paper.settings.escape, user, Pose2(x, y)) for x, y, _ in cells]

    assert len(cells) == 5998
    assert sum(inside) / len(cells) == pytest.approx(0.03, abs=0.005)


@pytest.mark.requirement(93)
@given(
    x=st.floats(5.0, 15.0), y=st.floats(5.0, 15.0), yaw=st.floats(-3.1, 3.1),
    head=st.floats(-3.1, 3.1),
)  # fmt: skip
@settings(deadline=None, max_examples=20)
def test_the_space_moves_and_turns_with_the_body_whatever_the_head_does(
    paper: Profile,
    situation_of: Callable[..., Situation],
    x: float,
    y: float,
    yaw: float,
    head: float,
) -> None:
    body = Pose2(x, y, yaw)
    now = situation_of(paper, Pose2(1.0, 1.0), UserPose(body, head))
    found = free_cells(now, grid(now.environment, paper))

    for place_x, place_y, _ in found.tolist()[::500]:
        inside = body.inverse()
        ahead, left = inside.transform(place_x, place_y)
        bearing = math.degrees(abs(math.atan2(left, ahead)))
        assert 1.5 - 1e-9 <= math.hypot(ahead, left) <= 3.0 + 1e-9
        assert 30.0 - 1e-6 <= bearing <= 157.5 + 1e-6


@pytest.mark.requirement(99)
@given(bearing=st.floats(-math.pi, math.pi), now=st.floats(-math.pi, math.pi))
@settings(deadline=None, max_examples=200)
def test_a_long_side_faces_the_user_with_the_smaller_turn(bearing: float, now: float) -> None:
    place = (2.0 * math.cos(bearing), 2.0 * math.sin(bearing))

    yaw = chase.tangent_yaw(Pose2(0.0, 0.0), place, now)

    assert math.cos(yaw) * place[0] + math.sin(yaw) * place[1] == pytest.approx(0.0, abs=1e-9)
    assert abs(wrap(yaw - now)) <= math.pi / 2 + 1e-9


@pytest.mark.requirement(96)
@pytest.mark.parametrize(("cost", "near"), [(3.48, True), (3.52, False)])
def test_of_cells_within_the_tie_the_one_with_the_shortest_way_is_chosen(
    tuned: Profile, situation_of: Callable[..., Situation], cost: float, near: bool
) -> None:
    now = situation_of(tuned, Pose2(5.0, 5.0), USER)
    by_cost = replace(now.settings.chase, tie=0.05)
    now = replace(now, settings=replace(now.settings, chase=by_cost))
    cells = np.array([(15.0, 15.0, 1.0 / 0.335), (6.0, 6.0, cost)])

    found = least_cost(now, cells)

    assert found == ((6.0, 6.0) if near else (15.0, 15.0))


@pytest.mark.requirement(95, 96)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_place_on_this_side_is_chosen_rather_than_one_past_the_users_face(
    tuned: Profile, situation_of: Callable[..., Situation], side: float
) -> None:
    """Both places are as good to wait at: mirror images of each other in the user's view."""
    now = situation_of(tuned, Pose2(11.0, 10.0 + 2.8 * side), USER)
    cells = np.array([(10.0, 13.0, 3.0), (10.0, 7.0, 3.0)])
    with_risk = cells_with_risk(now, cells)
    here, beyond = sorted(with_risk.tolist(), key=lambda cell: -side * cell[1])

    assert least_cost(now, with_risk) == (10.0, 10.0 + 3.0 * side)
    assert here[2] < beyond[2]


@pytest.mark.requirement(100, 120)
def test_cells_nearer_than_a_metre_to_a_wall_are_dropped(
    profile: Profile, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(profile, Pose2(5.0, 5.0), UserPose(Pose2(2.0, 10.0, 0.0), 0.0))
    every = grid(now.environment, profile)

    found = free_cells(now, every)

    assert 0 < len(found) < len(every)
    assert found[:, 0].min() >= 1.0 - 1e-5


@pytest.mark.requirement(96)
def test_the_largest_weight_is_chosen_and_the_nearer_of_two_equals(
    paper: Profile, situation_of: Callable[..., Situation]
) -> None:
    for side in (1.0, -1.0):
        now = situation_of(paper, Pose2(10.0, 10.0 + 3.5 * side), USER)
        found = best_cell(now, paper)

        assert found is not None
        cells = grid(now.environment, paper)
        best = cells[:, 2].max()
        x, y = found[0] - 10.0, found[1] - 10.0
        chosen = cells[np.hypot(cells[:, 0] - x, cells[:, 1] - y).argmin()]
        assert chosen[2] == pytest.approx(best, abs=1e-12)
        assert y * side > 0.0


@pytest.mark.requirement(96)
def test_cells_can_be_sampled_by_weight_and_the_same_seed_gives_the_same(
    paper: Profile, situation_of: Callable[..., Situation]
) -> None:
    now = situation_of(paper, Pose2(10.0, 13.5), USER)

    drawn = [best_cell(now, paper, sample=seed) for seed in (0, 0, 1, 2, 3)]

    assert drawn[0] == drawn[1]
    assert len(set(drawn)) > 2


@pytest.mark.requirement(101)
def test_without_a_free_cell_there_is_no_chase_pose(
    profile: Profile, situation_of: Callable[..., Situation]
) -> None:
    closet = Room(outer=((0.0, 0.0), (2.5, 0.0), (2.5, 2.5), (0.0, 2.5)))
    user = UserPose(Pose2(0.6, 0.6, 0.0), 0.0)
    now = situation_of(profile, Pose2(1.5, 1.5), user, room=closet)

    assert best_cell(now, profile) is None


@pytest.mark.requirement(124)
def test_in_six_by_six_metres_a_user_in_the_middle_can_be_chased_and_served(
    profile: Profile, situation_of: Callable[..., Situation]
) -> None:
    room = Room(outer=((0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (0.0, 6.0)))
    for yaw in np.linspace(-3.0, 3.0, 7):
        user = UserPose(Pose2(3.0, 3.0, yaw), yaw)
        now = situation_of(profile, Pose2(1.1, 1.1), user, room=room)

        assert best_cell(now, profile) is not None


def test_ways_around_the_user_are_no_shorter_than_straight_ones_and_clear_of_them() -> None:
    starts = np.array([(-3.0, 0.0), (0.0, 3.0), (3.0, 0.5)])
    lengths = length_around(starts, (3.0, 0.0), 1.27)

    straight = np.hypot(starts[:, 0] - 3.0, starts[:, 1])
    tangents = 2.0 * math.sqrt(9.0 - 1.27**2) + 1.27 * (math.pi - 2.0 * math.acos(1.27 / 3.0))
    assert lengths[0] == pytest.approx(tangents)
    assert lengths[1:] == pytest.approx(straight[1:])


def test_a_drive_from_rest_to_rest_takes_the_time_of_its_speed_profile() -> None:
    assert rest_to_rest(np.array(1.0), 1.5, 1.0) == pytest.approx(2.0)
    assert rest_to_rest(np.array(3.0), 1.5, 1.0) == pytest.approx(3.5)


@pytest.mark.requirement(60, 73)
def test_a_request_is_heard_as_a_level_and_tells_when_it_came(context: Any) -> None:
    deep = Pose3(1.0, 2.0, 1.5)
    ctx = context({"vr.haptic_request": deep})
    ctx.stamps["vr.haptic_request"] = 42

    with pytest.raises(StopIteration) as ended:
        next(chase.HapticRequest().run(ctx))

    assert ended.value.value == ("requested", {"deep": deep, "since": 42})


@pytest.mark.requirement(82)
def test_a_refused_request_is_not_tried_again_but_the_next_one_is(context: Any) -> None:
    ctx = context({"vr.haptic_request": Pose3(1.0, 2.0, 1.5)})
    ctx.stamps["vr.haptic_request"] = 42
    run = chase.HapticRequest().run(ctx, refused=42)
    next(run)

    ctx.stamps["vr.haptic_request"] = 43

    with pytest.raises(StopIteration):
        next(run)


@pytest.mark.requirement(91)
@pytest.mark.parametrize(
    ("distance", "velocity", "crowded"),
    [
        (3.1, Twist2(-1.0), True),  # will be nearer in a moment
        (3.1, Twist2(1.0), False),
        (2.9, Twist2(1.0), True),
        (2.9, Twist2(0.1), False),  # stands
        (4.5, Twist2(-1.0), False),
    ],
)
def test_a_walking_user_crowds_the_robot_before_they_are_near(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    distance: float,
    velocity: Twist2,
    crowded: bool,
) -> None:
    now = situation_of(tuned, Pose2(10.0 - distance, 10.0), USER, velocity)

    assert make_room.is_crowded(now, room=3.0, ahead=1.0, walking=0.3) is crowded


@pytest.mark.requirement(91)
@pytest.mark.parametrize(
    ("distance", "off", "rate", "crowded"),
    [
        (4.0, 0.0, 0.5, True),
        (4.0, 1.0, 3.0, True),
        (4.0, 1.0, -3.0, False),  # turns away from it
        (2.0, 2.5, 3.0, False),  # too far round
        (4.2, 0.0, 3.0, False),
        (2.0, 0.0, 0.3, False),
    ],
)
def test_who_turns_towards_a_robot_that_might_not_get_aside_in_time_crowds_it(
    tuned: Profile,
    situation_of: Callable[..., Situation],
    distance: float,
    off: float,
    rate: float,
    crowded: bool,
) -> None:
    bearing = USER.body.yaw + off
    robot = Pose2(10.0 + distance * math.cos(bearing), 10.0 + distance * math.sin(bearing))
    now = situation_of(tuned, robot, USER, Twist2(0.0, 0.0, rate))

    assert make_room.is_crowded(now, room=3.0, ahead=1.0, walking=0.3) is crowded


@pytest.mark.requirement(91)
def test_a_robot_that_rolls_towards_a_walker_counts_as_where_it_would_stop(
    tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    walking, pose = Twist2(0.0, 0.5), Pose2(6.5, 10.0)
    assert not make_room.is_crowded(situation_of(tuned, pose, USER, walking), 3.3, 0.0, 0.3)

    rolling = situation_of(tuned, pose, USER, walking, twist=Twist2(1.0))

    assert make_room.is_crowded(rolling, 3.3, 0.0, 0.3)


@pytest.mark.requirement(90)
@pytest.mark.parametrize(("distance", "far"), [(3.99, False), (4.01, True)])
def test_a_standing_user_farther_than_4_m_is_far(
    profile: Profile, situation_of: Callable[..., Situation], distance: float, far: bool
) -> None:
    now = situation_of(profile, Pose2(10.0 - distance, 10.0), USER)

    assert (chase.distance_soon(now, 0.9) > 4.0) is far


@pytest.mark.requirement(90, 91)
def test_tuned_follows_a_walker_before_they_are_far(
    paper: Profile, tuned: Profile, situation_of: Callable[..., Situation]
) -> None:
    pose, leaving, coming = Pose2(6.5, 10.0), Twist2(1.0), Twist2(-1.0)

    assert chase.distance_soon(situation_of(tuned, pose, USER, leaving), 0.9) > 4.0
    assert chase.distance_soon(situation_of(tuned, pose, USER, coming), 0.9) == 3.5
    assert chase.distance_soon(situation_of(paper, pose, USER, leaving), 0.9) == 3.5


def test_from_the_edge_of_the_disc_on_a_way_around_it_is_its_arc_and_one_tangent() -> None:
    """Also where r * r, as numpy squares, is less than r ** 2: no root is of less than 0."""
    some = np.random.default_rng(1).uniform(0.5, 5.0, 20_000).tolist()
    for radius in (1.27, *(r for r in some if r * r < r**2)):
        (length,) = length_around(np.array([(radius, 0.0)]), (-2.0 * radius, 0.0), radius).tolist()

        assert length == pytest.approx(radius * (math.sqrt(3.0) + math.pi - math.acos(0.5)))


def rest_to_rest_time(way: float, speed: float, acceleration: float) -> float:
    ramps = speed * speed / acceleration
    return 2.0 * math.sqrt(way / acceleration) if way < ramps else (way + ramps) / speed


def way_around(start: complex, goal: complex, radius: float) -> float:
    """Straight, or along two tangents and what they leave of the angle between them, m."""
    away = [max(abs(p), radius) for p in (start, goal)]
    tangents = [(r, math.acos(radius / r)) for r in away]
    arc = abs(cmath.phase(start / goal)) - sum(angle for _, angle in tangents)
    if arc <= 0.0:
        return abs(start - goal)
    return sum(math.sqrt(r * r - radius * radius) for r, _ in tangents) + radius * arc


@pytest.mark.requirement(96)
def test_a_cell_weighs_by_the_time_from_it_to_the_soonest_haptic_pose_whichever_side_it_shows(
    tuned: Profile, environment_of: Callable[..., Environment]
) -> None:
    environment, haptic = environment_of(tuned), tuned.settings.haptic
    drive, limits = environment.navigation.haptic, environment.limits
    cells = np.random.default_rng(5).uniform(-3.5, 3.5, (200, 2))
    cells = cells[np.hypot(*cells.T) > 1.5]

    found = response_costs(environment, tuned.settings, cells)

    for (x, y), cost in zip(cells.tolist(), found.tolist(), strict=True):
        times, cell = [], complex(x, y)
        for angle in haptic.angles:
            goal = haptic.deep_ahead + cmath.rect(haptic.radius, angle)
            sides = (cmath.rect(1.0, angle) / (side * cell) for side in (1j, -1j))
            way = way_around(cell, goal, drive.user_radius)
            times.append(
                max(
                    rest_to_rest_time(way, drive.max_speed, limits.base_acceleration),
                    rest_to_rest_time(
                        min(abs(cmath.phase(side)) for side in sides),
                        limits.base_yaw_rate,
                        limits.base_yaw_acceleration,
                    ),
                )
            )
        room = min(1.0, abs(cell) / tuned.settings.chase.best_radius)
        assert cost == pytest.approx((1.0 + min(times)) / room**2)


def test_ways_around_the_user_are_by_tangents_wherever_start_and_goal_lie() -> None:
    rng = np.random.default_rng(6)
    for _ in range(40):
        start, goal = (cmath.rect(*rng.uniform((1.3, -3.14), (4.0, 3.14))) for _ in range(2))

        [found] = length_around(np.array([(start.real, start.imag)]), (goal.real, goal.imag), 1.27)

        assert found == pytest.approx(way_around(start, goal, 1.27))


@pytest.mark.requirement(93, 97, 98)
@pytest.mark.parametrize("state", [chase.ChooseChasePose, chase.ChooseChaseCell])
def test_a_ring_of_a_node_goes_before_the_profile_s(
    profile: Profile, context: Any, situation_of: Callable[..., Situation], state: Any
) -> None:
    """Behind the user: 40 degrees to either side of their back, 2 to 2.6 m away."""
    now = situation_of(profile, Pose2(10.0, 13.5), USER)
    ctx = context({
        "environment": now.environment, "settings": now.settings, "base.pose": now.pose,
        "base.twist": now.twist, "user.pose": now.user, "user.velocity": now.velocity,
    })  # fmt: skip
    ring = {"inner": 2.0, "outer": 2.6, "front": math.radians(280.0), "rear": 0.0}

    with pytest.raises(StopIteration) as ended:
        next(state(**ring).run(ctx))

    outcome, found = ended.value.value
    assert outcome == "chosen"
    assert 2.0 <= found["pose"].distance_to(USER.body) <= 2.6
    assert abs(USER.body.bearing_to(found["pose"])) >= math.radians(140.0)
