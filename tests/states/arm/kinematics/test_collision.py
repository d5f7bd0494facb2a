from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from shapely.geometry import LineString, MultiPolygon, Point

from behaviors.profile.profile import load_profile
from hw.geometry import Pose2
from hw.model.arm import arm_names, load_arm
from hw.model.prop import load_prop, prop_names
from hw.model.robot import load_robot, robot_names
from states.arm.description.robot_arm import manipulator_of
from states.arm.kinematics import kernels
from states.arm.kinematics.collision import (
    CollisionChecker,
    Cylinder,
    Surroundings,
    extent,
    outline,
)
from states.arm.kinematics.kinematics import forward, link_frames
from states.arm.kinematics.model import Manipulator
from tests.repeats import examples

coordinate = st.floats(-2, 2).map(lambda v: round(v, 3))
point3 = st.tuples(coordinate, coordinate, coordinate)
point2 = st.tuples(coordinate, coordinate)


@pytest.fixture(scope="module")
def alone(arm):
    return CollisionChecker.of(arm, Surroundings.empty())


def between(a, b, n=2001):
    return np.linspace(0.0, 1.0, n)[:, None] * (np.subtract(b, a)) + np.array(a)


@settings(deadline=None, max_examples=examples(300))
@given(point3, point3, point3, point3)
def test_the_distance_of_two_axes_is_that_of_their_nearest_points(a, b, c, d):
    ends = np.array([[a, b], [c, d]], float)
    found = kernels.segment_distance(ends, 0, ends, 1)
    n = 201
    grid = np.linalg.norm(between(a, b, n)[:, None] - between(c, d, n)[None], axis=2).min()
    coarse = (math.dist(a, b) + math.dist(c, d)) / (2 * (n - 1))
    assert grid - coarse - 1e-9 <= found <= grid + 1e-6


@settings(deadline=None, max_examples=examples(300))
@given(point2, point2, point2, point2)
def test_the_distance_to_a_wall_seen_from_above_agrees_with_shapely(a, b, c, d):
    walls = np.array([[*c, *d, 0.0, 3.0]])
    found = kernels.wall_distance(*a, *b, walls, 0)
    assert found == pytest.approx(LineString([a, b]).distance(LineString([c, d])), abs=1e-9)


@settings(deadline=None, max_examples=examples(300))
@given(point2, point2, point2)
def test_the_distance_to_a_cylinders_axis_agrees_with_shapely(p, a, b):
    found = kernels.point_distance(*p, *a, *b)
    assert found == pytest.approx(Point(p).distance(LineString([a, b])), abs=1e-9)


@settings(deadline=None, max_examples=examples(300))
@given(point3, point3)
def test_the_distance_to_a_box_is_never_too_large_and_hardly_too_small(a, b):
    low, high = np.array([-0.5, -0.4, 0.0]), np.array([0.6, 0.4, 0.5])
    ends = np.array([[a, b]], float)
    found = kernels.box_distance(ends, 0, np.array([[low, high]]), 0, math.inf)
    points = between(a, b)
    true = np.linalg.norm(points - np.clip(points, low, high), axis=1).min()
    assert true - math.dist(a, b) / 2000 - 1e-5 <= found <= true + 1e-12


def surface_points(arm, q, rng, n=400):
    """Random points on the surface of every capsule, and which capsule each belongs to."""
    ends, radii = outline(arm, q)
    which = np.repeat(np.arange(len(radii)), n)
    along = rng.uniform(size=len(which))[:, None]
    axis = ends[which, 0] * (1 - along) + ends[which, 1] * along
    outward = rng.normal(size=(len(which), 3))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    return axis + radii[which, None] * outward, which


@pytest.mark.requirement(43, 52)
def test_a_clearance_is_never_larger_than_the_distance_of_any_point_of_the_arm(arm, sets):
    walls = np.array([[0.9, -2.0, 0.9, 2.0, 0.0, 3.0], [-1.0, 0.8, 1.0, 0.9, 0.0, 1.0]])
    person = np.array([[-0.9, 0.2, 0.3, 0.0, 1.8]])
    checker = CollisionChecker.of(arm, Surroundings(walls, person))
    for q in sets.anywhere(200):
        points, which = surface_points(arm, q, sets.rng)
        moving = points[which >= arm.solid.first]
        to_person = np.maximum(np.hypot(*(moving[:, :2] - person[0, :2]).T) - 0.3, 0.0)
        nearest = min(
            moving[:, 2].min(),
            np.abs(0.9 - moving[:, 0]).min(),
            np.hypot(to_person, np.maximum(moving[:, 2] - 1.8, 0.0)).min(),
        )
        assert checker.clearance(q)[0] <= nearest + 1e-9


def test_capsules_turn_with_their_links(arm, sets):
    q = sets.anywhere(1)[0]
    frames, (ends, radii) = link_frames(arm, q), outline(arm, q)
    prop = arm.tool.capsules[0]
    k = arm.parts.index("prop")
    assert ends[k, 1] == pytest.approx((frames[6] @ [*prop.end, 1.0])[:3])
    assert radii[k] == prop.radius
    tip = forward(arm, q)[:3, 3]
    assert math.dist(tip, ends[k, 1]) == pytest.approx(prop.radius)


@pytest.mark.parametrize(
    ("q", "touching"),
    [
        ((0, -1.57, 3.1, 0, 0, 0), ("upper_arm", "wrist_1")),
        ((0, -0.6, 2.4, -3.2, -1.57, 0), ("prop", "surroundings")),
        ((0, 0.35, 0, -1.57, 0, 0), ("upper_arm", "surroundings")),
    ],
)
def test_what_is_nearest_to_what_can_be_told(alone, q, touching):
    gap, *names = alone.tightest(q)
    assert tuple(names) == touching
    assert gap == alone.clearance(q)[0]


def inside_frame(arm, joints):
    """How far the whole arm stays inside the 1.13 m x 0.91 m bumper frame, m."""
    ahead, back, left, right = extent(arm, joints)
    return min(0.565 - max(ahead, back), 0.455 - max(left, right))


@pytest.mark.requirement(46)
def test_the_extent_of_the_arm_encloses_every_capsule_on_all_four_sides(arm, sets):
    for q in [np.array(arm.tool.parked), *sets.anywhere(20)]:
        ends, radii = outline(arm, q)
        balls = [
            Point(*end[:2]).buffer(r, 64)
            for pair, r in zip(ends, radii, strict=True)
            for end in pair
        ]
        x_low, y_low, x_high, y_high = MultiPolygon(balls).bounds
        assert extent(arm, q) == pytest.approx((x_high, -x_low, y_high, -y_low), abs=1e-9)


@pytest.mark.requirement(46)
def test_the_parked_arm_stays_inside_the_bumper_frame_and_clear_of_itself(arm, alone):
    assert inside_frame(arm, arm.tool.parked) > 0.05
    assert alone.clearance(arm.tool.parked)[0] >= 0.015


@pytest.mark.requirement(46, 150)
@pytest.mark.parametrize("prop", prop_names())
@pytest.mark.parametrize("robot", robot_names())
def test_with_every_prop_the_parked_arm_stays_inside_and_clear(robot, prop):
    arm = manipulator_of(load_robot(robot, prop=prop))
    of_the_profile = load_profile("paper").robot.parked(arm.name)  # whatever the arm holds
    for parked in (arm.tool.parked, arm.tool.parked_paper, of_the_profile or arm.tool.parked):
        assert inside_frame(arm, parked) > 0.01
        assert CollisionChecker.of(arm, Surroundings.empty()).clearance(parked)[0] >= 0.015


@pytest.mark.requirement(46, 150)
@pytest.mark.parametrize("prop", prop_names())
@pytest.mark.parametrize("shape", arm_names())
def test_every_arm_of_the_maker_is_folded_inside_and_clear_with_every_prop(shape, prop):
    robot = load_robot("rbkairos_ur10", prop=prop)
    own = load_arm(shape)
    held = load_prop(prop).also(shape, own.parked).on(shape)
    arm = Manipulator(own, robot.arm.mount, robot.chassis, held)
    assert inside_frame(arm, held.parked) > 0.01
    assert CollisionChecker.of(arm, Surroundings.empty()).clearance(held.parked)[0] >= 0.015


def test_an_arm_stretched_ahead_stands_out_of_the_frame(arm):
    assert inside_frame(arm, (0, -0.3, 0, 0, 0, 0)) < -0.5


def sampled(start, goal, step=0.01):
    n = max(2, math.ceil(np.abs(goal - start).max() / step) + 1)
    return start + np.linspace(0, 1, n)[:, None] * (goal - start)


@pytest.mark.requirement(43)
def test_a_free_line_keeps_half_the_margin_everywhere_and_a_blocked_one_is_blocked(arm, sets):
    person = Surroundings.seen_from(Pose2(0, 0), cylinders=[Cylinder(1.0, 0.3, 0.25, 1.8)])
    checker = CollisionChecker.of(arm, person, margin=0.01)
    starts = sets.anywhere(600)
    starts = starts[checker.free(starts)]
    free = 0
    for start, goal in pairwise(starts):
        x, checks = checker.sweep(np.array([start, goal - start, np.zeros(6)]), 1.0)
        clearance = checker.clearance(sampled(start, goal))
        if x >= 1.0:
            free += 1
            assert clearance.min() >= 0.005
        else:
            assert checker.clearance(start + x * (goal - start))[0] < 0.01
        assert checks >= 1
    assert 20 < free < len(starts) - 20


@pytest.mark.requirement(43)
def test_a_curved_piece_is_checked_as_exactly(alone, sets):
    rng = sets.rng
    starts = sets.anywhere(600)
    for start in starts[alone.free(starts)]:
        piece = np.array([start, rng.normal(size=6), rng.normal(size=6)])
        x, _ = alone.sweep(piece, 1.0)
        t = np.linspace(0, x, 400)[:, None]
        clearance = alone.clearance(piece[0] + piece[1] * t + piece[2] * t * t)
        if x >= 1.0:
            assert clearance.min() >= 0.5 * alone.margin
        else:
            assert clearance[-1] < alone.margin
            assert clearance[:-1].min(initial=1.0) >= 0.5 * alone.margin


@pytest.mark.requirement(43)
def test_a_thin_pole_between_two_samples_is_not_missed(arm):
    pole = Surroundings(np.zeros((0, 6)), np.array([[0.9, 0.0, 0.001, 0.0, 2.0]]))
    checker = CollisionChecker.of(arm, pole)
    left, right = np.array([-1.2, -0.6, 0, -1.57, 0, 0]), np.array([1.2, -0.6, 0, -1.57, 0, 0])
    assert checker.free([left, right]).all()
    assert not checker.line_free(left, right)


@pytest.mark.requirement(52)
def test_an_arm_that_reaches_through_a_thin_wall_touches_it(arm, alone):
    ahead = np.array([0, -0.6, 0, -1.57, 0, 0])
    wall = Surroundings.seen_from(Pose2(0, 0), walls=[(0.6, -2.0, 0.6, 2.0)])
    behind = Surroundings.seen_from(Pose2(0, 0), walls=[(-0.6, -2.0, -0.6, 2.0)])
    assert alone.free(ahead)[0]
    assert not CollisionChecker.of(arm, wall).free(ahead)[0]
    assert CollisionChecker.of(arm, behind).free(ahead)[0]


def test_a_sweep_stops_when_its_budget_is_used_up(alone, arm):
    parked = np.array(arm.tool.parked)
    piece = np.array([parked, np.array([1.0, 0, 0, 0, 0, 0]), np.zeros(6)])
    whole, checks = alone.sweep(piece, 1.0)
    assert whole == 1.0
    part, used = alone.sweep(piece, 1.0, budget=2)
    assert 0.0 < part < 1.0
    assert used == 2 < checks


@settings(deadline=None, max_examples=examples(100))
@given(
    st.tuples(coordinate, coordinate, st.floats(-3, 3)),
    st.tuples(coordinate, coordinate),
    st.integers(0, 50),
)
def test_the_answer_does_not_depend_on_where_in_the_map_rover_and_person_are(arm, pose, at, k):
    q = np.random.default_rng(k).uniform(-3, 3, 6)
    rover = Pose2(*pose)
    x, y = rover.transform(*at)
    here = Surroundings.seen_from(
        Pose2(0, 0), [(*at, at[0] + 1.0, at[1])], [Cylinder(*at, 0.5, 1.8)], within=10
    )
    far = (*rover.transform(at[0] + 1.0, at[1]),)
    there = Surroundings.seen_from(rover, [(x, y, *far)], [Cylinder(x, y, 0.5, 1.8)], within=10)
    one, other = (CollisionChecker.of(arm, s).clearance(q)[0] for s in (here, there))
    assert one == pytest.approx(other, abs=1e-9)


def test_what_is_far_from_the_rover_is_left_out():
    seen = Surroundings.seen_from(
        Pose2(5, 5),
        walls=[(6, 0, 6, 10), (9, 0, 9, 10), (5, 5, 5, 5)],
        cylinders=[Cylinder(5, 7.4, 0.5, 1.8), Cylinder(5, 7.6, 0.5, 1.8)],
    )
    assert len(seen.walls) == 2
    assert len(seen.cylinders) == 1


def test_one_question_and_many_give_the_same_bits(alone, sets):
    q = sets.anywhere(20)
    assert np.array_equal(alone.clearance(q), [alone.clearance(row)[0] for row in q])
