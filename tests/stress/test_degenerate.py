"""Coincident and collinear points, tangent circles, paths without length, sides of no length."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from cobodeck.avoidable.shapes import segment_distance, way_distance
from hw.geometry import Pose2, Pose3, Twist2
from hw.people.walking.leaving import walked
from hw.safety.separation import nearness
from hw.scene.room import Disc, Room, distance_to_segment, foot
from hw.sim.sensors.rays import beams, cast, cast_discs
from states.arm.kinematics.inverse_kinematics import inverse, inverse_near
from states.arm.kinematics.kinematics import deviation, forward
from states.arm.motion.joint_path import JointPath
from states.arm.motion.timing import time_path
from states.localization.matching.scan_tracker import match
from states.localization.slam.pose_graph import PoseEdge, solved
from states.maps.field import room_field
from states.navigation.exact.tangents import tangent
from states.navigation.exact.visibility import ExactPlanner
from states.navigation.local.profile_planner import ProfilePlanner
from states.navigation.local.speed_profile import SpeedLimits, heading_after, travel_time
from states.navigation.local.teb_planner import TebPlanner
from states.navigation.planner_interfaces import Limits, Tolerance
from states.signals.prediction import PREDICTORS, chord, time_to_contact
from tests.stress.bodies import LIMITS, ROOM
from tests.stress.planners import JOINTS, arm

SQUARE = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
SMALL = st.sampled_from((0.0, 5e-324, 1e-310, 1e-200, 1e-160, 1e-30, 1e-12, 1e-9, 1e-6, 1e-3))


@given(SMALL, SMALL, st.permutations(range(5)))
def test_a_side_of_next_to_no_length_changes_no_path(
    along: float, aside: float, order: list[int]
) -> None:
    """Corners as near to each other as floats can be, at any place of the ring."""
    ring = [(0.0, 0.0), (along, -aside), *SQUARE[1:]]
    turned = ring[order[0] :] + ring[: order[0]]
    box = [(3.0, 3.0), (3.0 + along, 3.0), (3.5, 3.0), (3.5, 3.5), (3.0, 3.5)]
    planner = ExactPlanner(turned, (box,), inflation_radius=0.5)
    plain = ExactPlanner(SQUARE, (box[:1] + box[2:],), inflation_radius=0.5)
    found, usual = (p.plan((1.0, 1.0), (7.0, 7.2)) for p in (planner, plain))
    out = planner.nearest_free((0.1, 0.1))

    assert found is not None
    assert usual is not None
    assert found.length == pytest.approx(usual.length, abs=1e-5 + 4.0 * max(along, aside))
    assert out is not None
    assert math.dist(out, (0.5, 0.5)) < 1e-5 + 4.0 * max(along, aside)


@given(SMALL, st.floats(0.0, 2.0 * math.pi))
def test_a_path_of_no_length_is_none_and_a_drive_along_it_has_arrived(
    length: float, direction: float
) -> None:
    start = (2.0, 2.0)
    goal = (2.0 + length * math.cos(direction), 2.0 + length * math.sin(direction))
    planner = ExactPlanner(SQUARE, inflation_radius=0.5)
    path = planner.plan(start, goal)
    assert path is not None
    assert path.length <= 1.001 * length
    for kind in (ProfilePlanner, TebPlanner):
        driver = kind(planner, Limits(), Tolerance())
        driver.go_to(Pose2(*goal, 3.1))
        command = driver.command(Pose2(*start, 3.1), Twist2(0.0), None, 0.033)
        assert driver.status == "arrived"
        assert command.speed < 0.05
    pace = SpeedLimits(1.5, 1.0, 0.9, 0.03)
    line = np.array([(*start, math.inf), (*start, math.inf), (*goal, math.inf)])
    assert 0.0 <= travel_time(line, 0.0, pace) <= 2.0 * math.sqrt(length) + 1e-9
    assert math.isfinite(heading_after(line, length))


@given(SMALL)
def test_the_user_s_disc_may_touch_start_goal_and_walls(gap: float) -> None:
    planner = ExactPlanner(SQUARE, inflation_radius=0.5)
    for radius in (1.0, 1.0 + gap, 1.0 - gap):
        for centre in ((4.0, 3.0), (4.0, 1.5), (1.0, 4.0)):
            path = planner.plan((4.0, 2.0), (4.0, 6.0), Disc(*centre, radius))
            if path is not None:
                assert np.isfinite(path.line[:, :2]).all()
                assert path.length >= math.dist((4.0, 2.0), (4.0, 6.0)) - 2.1e-6


@given(SMALL, st.sampled_from((-1.0, 1.0)), st.sampled_from((-1.0, 1.0)), st.floats(-3.1, 3.1))
def test_tangents_of_circles_that_touch_are_right(
    gap: float, turn: float, after: float, direction: float
) -> None:
    """From circles in each other to circles apart: a line at both radii, or none."""
    first = np.array((1.0, 2.0, 0.7))
    for apart in (1.2 - gap, 1.2 + gap, 0.2 + gap, 0.2 - gap, gap):
        at = (1.0 + apart * math.cos(direction), 2.0 + apart * math.sin(direction))
        second, line = np.array((*at, 0.5)), np.empty(7)
        if not tangent(first, turn, second, after, line):
            continue
        assert np.isfinite(line).all()
        assert math.dist(line[:2], first[:2]) == pytest.approx(0.7, abs=1e-9)
        assert math.dist(line[2:4], second[:2]) == pytest.approx(0.5, abs=1e-9)
        if line[6] > 1e-3:
            side = (*line[:2].tolist(), *line[2:4].tolist())
            assert distance_to_segment(1.0, 2.0, side) == pytest.approx(0.7, abs=1e-5)


@given(st.floats(-3.0, 3.0), SMALL)
def test_who_grazes_is_met_late_or_not_at_all(across: float, off: float) -> None:
    """Walking past at just the reach: the double root of the contact."""
    for lateral in (0.6, 0.6 + off, 0.6 - off):
        time = time_to_contact((-5.0, lateral), (1.0, 0.0), 0.6)
        assert time == math.inf or 0.0 <= time <= 5.0 + 1e-6
    length, mean, turned = chord(1.0, across * off, 1.0, 3.0)
    assert length == pytest.approx(3.0, rel=1e-2)
    assert abs(mean) <= abs(across) * 3e-3
    assert abs(turned) <= abs(across) * 1e-3
    for predictor in PREDICTORS.values():
        soon = predictor.at(Pose2(2.0, 3.0), Twist2(off, 0.0, off), 0.0, Pose2(2.0, 3.0))
        assert math.hypot(soon.x - 2.0, soon.y - 3.0) < 1e-12


@given(SMALL, SMALL)
def test_segments_that_are_points_have_distances(dx: float, dy: float) -> None:
    segment = (1.0, 2.0, 1.0 + dx, 2.0 + dy)
    expected = pytest.approx(math.hypot(3.0, 1.0), abs=2.0 * (dx + dy) + 1e-12)
    near = foot(4.0, 3.0, segment)

    assert distance_to_segment(4.0, 3.0, segment) == expected
    assert segment_distance(segment, 4.0, 3.0) == expected
    assert math.dist(near, (4.0, 3.0)) == expected
    assert way_distance(0.5, 0.5, 4.0, 3.0, 4.0 + dx, 3.0 + dy) == pytest.approx(
        math.hypot(3.5, 2.5), abs=dx + dy + 1e-12
    )


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_somebody_on_the_robot_is_a_touch_with_a_direction(x: float, y: float) -> None:
    for px, py in ((x, y), (0.0, 0.0), (0.565, y), (x, 0.455), (0.565, 0.455)):
        near = nearness(0.565, 0.455, px, py, 0.5)
        assert math.hypot(near.nx, near.ny) == pytest.approx(1.0)
        assert math.isfinite(near.lever)
        if abs(px) <= 0.565 and abs(py) <= 0.455:
            assert near.gap <= -0.5


def test_points_of_one_place_and_of_one_line_match_without_a_claim() -> None:
    field, unsure = room_field(ROOM), np.diag([0.01, 0.01, 0.01])
    here = Pose2(5.0, 3.0, 3.1)
    beside = np.column_stack([np.linspace(-2.0, 2.0, 50), np.full(50, -3.0)])
    for points in (np.zeros((60, 2)), np.full((60, 2), 1e-320), beside):
        found = match(field, points, here, unsure)
        pose = found.map_from_base
        assert all(map(math.isfinite, (pose.x, pose.y, pose.yaw)))
        assert np.linalg.eigvalsh(found.information).min() >= -1e-6 * found.information.max()


def test_a_graph_of_coincident_poses_stays_where_it_is() -> None:
    here = Pose2(2.0, 3.0, math.pi)
    edges = [PoseEdge(n, n + 1, Pose2(0.0, 0.0), np.eye(3)) for n in range(4)]
    found = solved([here] * 5, [*edges, PoseEdge(0, 4, Pose2(0.0, 0.0), np.eye(3), True)])

    assert all(found.kept)
    assert all(pose.is_near(here, 1e-9, 1e-9) for pose in found.poses)


def test_a_motion_of_the_arm_to_where_it_is_takes_no_time() -> None:
    for goal in (JOINTS, JOINTS + 5e-324, JOINTS + 1e-15):
        course = time_path(arm(), JointPath.through(np.array([JOINTS, goal])), LIMITS)
        assert course.duration < 1e-6
        assert np.isfinite(course.at(np.array([0.0]))[0]).all()


@pytest.mark.parametrize("off", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3])
def test_singular_arms_reach_what_they_reach(off: float) -> None:
    """Wrist, elbow and shoulder at, or next to, their singularities."""
    singular = [JOINTS.copy() for _ in range(3)]
    singular[0][4] = off
    singular[1][2] = off
    singular[2][[2, 4]] = off
    for joints in singular:
        pose = forward(arm(), joints)
        found = inverse(arm(), pose).branches()
        assert len(found)
        distance, angle = deviation(forward(arm(), found), pose[None])
        assert max(distance.max(), angle.max()) < 1e-6
    far = forward(arm(), JOINTS)
    far[:3, 3] *= 1e6
    near = inverse_near(arm(), far)
    assert np.isfinite(near.joints).all()


def test_a_scanner_on_a_wall_and_in_a_corner_and_discs_around_it() -> None:
    segments = np.array(ROOM.segments)
    for x, y in ((0.0, 5.0), (0.0, 0.0), (12.0, 10.0), (4.0, 4.6)):
        still = np.array([[0.0, x, y, 0.3], [0.06, x, y, 0.3]])
        sweep = beams(still, np.zeros(3), -2.2, 0.02, 3e-4, 200)
        ranges = cast(sweep, segments, -2.2, 0.02)
        cast_discs(ranges, sweep, np.array([[x, y, x, y, 0.5], [x + 0.5, y, x + 0.5, y, 0.5]]))
        assert not np.isnan(ranges).any()
        assert (ranges >= -1e-12).all()


def test_walking_and_seeing_from_where_one_is() -> None:
    here = Pose2(3.0, 3.0, 1.0)
    there, speed = walked(here, (3.0, 3.0), 1.0, 3.0, 0.1)
    assert there.distance_to(here) < 1e-9
    assert speed >= 0.0
    room = Room(SQUARE)
    assert room.sees(3.0, 3.0, 3.0, 3.0)
    assert room.way_clearance(3.0, 3.0, 3.0, 3.0) == pytest.approx(3.0)
    up = Pose3.from_angles(0.0, 0.0, 0.0, (0.3, 0.5 * math.pi, 0.7))
    assert up.roll_pitch_yaw[1] == pytest.approx(0.5 * math.pi, abs=1e-7)
