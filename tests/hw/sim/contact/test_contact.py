import math

import pytest
from hypothesis import given, settings, strategies as st
from shapely import affinity
from shapely.geometry import LineString, Point, box

from hw.geometry import Pose2
from hw.model.robot import load_robot
from hw.samples import USER_RADIUS
from hw.sim.contact.contact import gap, rectangle_segment_distance, swept_gap
from tests.repeats import examples

FOOTPRINT = load_robot("rbkairos_ur10").footprint
RECTANGLE = box(-0.565, -0.455, 0.565, 0.455)

near = st.floats(-3.0, 3.0)
step = st.floats(-0.12, 0.12)


def outline(x, y, yaw):
    return affinity.translate(affinity.rotate(RECTANGLE, yaw, (0, 0), use_radians=True), x, y)


@pytest.mark.requirement(3, 23)
def test_straight_ahead_they_touch_at_half_length_plus_half_a_metre():
    robot = Pose2(1.0, 2.0, math.pi / 2)
    touch = 0.565 + 0.5
    assert gap(FOOTPRINT, robot, 1.0, 2.0 + touch + 0.01) == pytest.approx(0.01)
    assert gap(FOOTPRINT, robot, 1.0, 2.0 + touch - 0.01) == pytest.approx(-0.01)
    assert gap(FOOTPRINT, robot, 1.0 + 0.455 + 0.5, 2.0) == pytest.approx(0.0, abs=1e-12)


def test_the_corners_of_the_foam_are_square():
    corner = FOOTPRINT.half_diagonal + USER_RADIUS
    bearing = math.atan2(FOOTPRINT.half_width, FOOTPRINT.half_length)
    x, y = corner * math.cos(bearing), corner * math.sin(bearing)
    assert gap(FOOTPRINT, Pose2(0.0, 0.0), x, y) == pytest.approx(0.0, abs=1e-12)


def test_inside_the_outline_the_gap_is_minus_the_radius():
    assert gap(FOOTPRINT, Pose2(0.0, 0.0), 0.1, 0.1) == -USER_RADIUS


@settings(deadline=None, max_examples=examples(200))
@given(near, near, st.floats(-4, 4), near, near)
def test_the_gap_is_the_distance_of_the_polygon_less_the_radius(x, y, yaw, px, py):
    expected = outline(x, y, yaw).distance(Point(px, py)) - USER_RADIUS
    assert gap(FOOTPRINT, Pose2(x, y, yaw), px, py) == pytest.approx(expected, abs=1e-9)


@settings(deadline=None, max_examples=examples(300))
@given(near, near, near, near)
def test_the_distance_of_a_segment_is_that_of_the_polygon(x1, y1, x2, y2):
    expected = RECTANGLE.distance(LineString([(x1, y1), (x2, y2)]))
    found = rectangle_segment_distance(0.565, 0.455, (x1, y1), (x2, y2))
    assert found == pytest.approx(expected, abs=1e-9)


@settings(deadline=None, max_examples=examples(150))
@given(near, near, st.floats(-4, 4), step, step, st.floats(-0.2, 0.2), near, near, step, step)
def test_the_swept_gap_is_the_least_of_a_dense_sampling(x, y, yaw, dx, dy, turn, px, py, ux, uy):
    found = swept_gap(
        FOOTPRINT,
        (Pose2(x, y, yaw), Pose2(x + dx, y + dy, yaw + turn)),
        (Pose2(px, py), Pose2(px + ux, py + uy)),
    )
    count = 400
    sampled = min(
        outline(x + s * dx, y + s * dy, yaw + s * turn).distance(Point(px + s * ux, py + s * uy))
        for s in (i / count for i in range(count + 1))
    )
    reach = math.hypot(px - x, py - y) + 0.5
    between = (0.35 + 0.2 * reach) / (2 * count)  # what may happen between two samples
    pieces = max(1, math.ceil(abs(turn) / 0.02))
    t, w = abs(turn) / pieces, math.hypot(ux - dx, uy - dy) / pieces
    missed = (t * t * (reach + 0.35) + 2 * t * w) / 8  # the documented bound
    assert (
        sampled - USER_RADIUS - between - missed - 1e-9
        <= found
        <= sampled - USER_RADIUS + missed + 1e-9
    )


def test_a_touch_between_two_instants_is_found():
    robot = (Pose2(0.0, 0.0), Pose2(0.0, 0.0))
    person = (Pose2(2.0, -0.9), Pose2(-0.3, 2.0))
    assert all(gap(FOOTPRINT, robot[0], p.x, p.y) > 0.0 for p in person)
    assert swept_gap(FOOTPRINT, robot, person) < 0.0


def test_a_robot_that_drives_past_between_two_instants_is_found():
    robot = (Pose2(-3.0, 0.0), Pose2(3.0, 0.0))
    person = (Pose2(0.0, 0.3), Pose2(0.0, 0.3))
    assert swept_gap(FOOTPRINT, robot, person) == pytest.approx(-USER_RADIUS)


def test_a_corner_that_turns_into_the_person_is_found():
    x = FOOTPRINT.half_diagonal + USER_RADIUS - 0.01
    bearing = math.atan2(FOOTPRINT.half_width, FOOTPRINT.half_length)
    robot = (Pose2(0.0, 0.0, -bearing - 0.3), Pose2(0.0, 0.0, -bearing + 0.3))
    person = (Pose2(x, 0.0), Pose2(x, 0.0))
    assert all(gap(FOOTPRINT, pose, x, 0.0) > 0.0 for pose in robot)
    assert swept_gap(FOOTPRINT, robot, person) == pytest.approx(-0.01, abs=1e-4)


@settings(deadline=None, max_examples=examples(100))
@given(near, near, st.floats(-4, 4), near, near)
def test_for_things_that_stand_the_swept_gap_is_the_gap(x, y, yaw, px, py):
    robot, person = Pose2(x, y, yaw), Pose2(px, py)
    assert swept_gap(FOOTPRINT, (robot, robot), (person, person)) == pytest.approx(
        gap(FOOTPRINT, robot, px, py), abs=1e-12
    )


@pytest.mark.parametrize("turn", [0.1, -0.1])
def test_a_sweep_across_half_a_turn_is_that_of_the_same_motion_elsewhere(turn):
    """Beside a corner a whole turn would touch; a tenth of a radian does not."""
    gaps = []
    for yaw in (0.0, math.pi - 0.05, 0.05 - math.pi):
        start, end = Pose2(0.0, 0.0, yaw), Pose2(0.0, 0.0, math.remainder(yaw + turn, math.tau))
        person = Pose2(*Pose2(0.0, 0.0, yaw).transform(0.0, 1.1))
        gaps.append(swept_gap(FOOTPRINT, (start, end), (person, person)))
    assert gaps == pytest.approx([gaps[0]] * 3, abs=1e-9)
    assert gaps[0] > 0.05
