from __future__ import annotations

import math

import numpy as np
import pytest

from hw.geometry import Pose2, Pose3
from states.arm.collision import CollisionModel, Cylinder
from states.arm.reach import ANGLES, Reach, ReachPlace, around, disc, level, seen_from
from states.arm.trajectory import ArmLimits

HEIGHTS = [round(0.5 + 0.1 * i, 1) for i in range(15)]


@pytest.fixture(scope="module")
def reach(arm, chain):
    return Reach(chain, CollisionModel.of(arm))


@pytest.fixture(scope="module")
def limits(arm):
    return ArmLimits.even(arm.max_speed, 5.0, tool_speed=1.0)


def ranked(reach, arm, limits, poses, deep, place=None, drives=None, tolerance=(0.2, 0.1)):
    """The ranking, and how often it yielded."""
    work = reach.ranked(
        poses, deep, place or ReachPlace(), drives or [1.0] * len(poses), tolerance,
        arm.tool.parked, limits,
    )  # fmt: skip
    yields = 0
    while True:
        try:
            next(work)
            yields += 1
        except StopIteration as done:
            return done.value, yields


@pytest.mark.requirement(75, 85)
def test_the_seven_rover_poses_stand_on_a_half_circle_and_face_the_deep():
    poses = around(level(2.0, 1.0, 1.5, 0.0), ANGLES, [1.0])
    assert (poses[0].x, poses[0].y) == (3.0, 1.0)
    assert abs(poses[0].yaw) == pytest.approx(math.pi)
    assert (poses[5].x, poses[5].y) == pytest.approx((2.0, 2.0))
    for pose, angle in zip(poses, ANGLES, strict=True):
        assert math.hypot(pose.x - 2.0, pose.y - 1.0) == pytest.approx(1.0)
        assert math.atan2(pose.y - 1.0, pose.x - 2.0) == pytest.approx(angle)
        assert pose.bearing_to(Pose2(2.0, 1.0)) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.requirement(84)
def test_the_deep_seen_from_the_rover_is_the_one_of_the_map():
    rover, deep = Pose2(1.0, -2.0, 0.7), Pose3.from_yaw(1.5, -1.2, 1.3, 2.5)
    seen = seen_from(rover, level(deep.x, deep.y, deep.z, 2.5))
    expected = Pose3.from_yaw(rover.x, rover.y, 0.0, rover.yaw).inverse() @ deep
    assert seen[:3, 3] == pytest.approx([expected.x, expected.y, expected.z])
    assert math.atan2(seen[1, 0], seen[0, 0]) == pytest.approx(expected.yaw)


@pytest.mark.requirement(147)
def test_the_reach_by_height_is_the_one_of_the_exact_meshes(reach):
    shares = reach.table(HEIGHTS, [0.8, 1.0, 1.2]).share
    near = [7] * 12 + [5, 1, 0]
    paper = [7] * 9 + [5, 5, 3, 0, 0, 0]
    far = [5] * 8 + [3, 3, 0, 0, 0, 0, 0]
    assert (shares * 7).round().astype(int).T.tolist() == [near, paper, far]


@pytest.mark.requirement(147)
def test_the_papers_band_of_heights_is_reached_from_a_metre_and_not_beyond(reach):
    share = reach.table([0.5, 1.6, 1.7], [1.0]).share[:, 0]
    assert share[0] == 1.0
    assert share[1] > 0.0
    assert share[2] == 0.0


@pytest.mark.requirement(147)
def test_a_closer_rover_reaches_higher(reach):
    share = reach.table([1.6], [0.8, 0.9, 1.0, 1.1]).share[0]
    assert (np.diff(share) < 0).all()


@pytest.mark.requirement(79)
def test_a_tolerance_of_the_drive_costs_reach(reach):
    heights = [1.0, 1.3, 1.5]
    exact = reach.table(heights, [0.9, 1.0, 1.1]).share
    drifting = reach.table(heights, [0.9, 1.0, 1.1], tolerance=(0.2, 0.1)).share
    assert (drifting <= exact).all()
    assert (drifting < exact).any()


@pytest.mark.requirement(79, 80)
def test_a_pose_that_reaches_from_its_rings_reaches_from_the_whole_disc(reach, arm, limits, sets):
    deep = level(2.0, 3.0, 1.4, 0.7)
    best = ranked(reach, arm, limits, around(deep, ANGLES, [0.8, 0.9]), deep)[0][0]
    assert best.reach == 1.0
    for _ in range(100):
        size, angle = 0.2 * math.sqrt(sets.rng.uniform()), sets.rng.uniform(-math.pi, math.pi)
        off = Pose2(
            best.pose.x + size * math.cos(angle),
            best.pose.y + size * math.sin(angle),
            best.pose.yaw + sets.rng.uniform(-0.1, 0.1),
        )
        assert reach.reached([off], deep, ReachPlace())[0]


@pytest.mark.requirement(76, 78)
def test_poses_that_reach_from_their_whole_disc_come_first_and_the_quickest_of_them_first(
    reach, arm, limits
):
    deep = level(2.0, 3.0, 1.5, 0.7)
    poses = around(deep, ANGLES, [0.8, 0.9, 1.0])
    found, yields = ranked(reach, arm, limits, poses, deep)
    assert yields == len(poses)
    shares = [c.reach for c in found]
    assert shares == sorted(shares, reverse=True)
    assert shares[0] == 1.0 > shares[-1]
    whole = [c.total_time for c in found if c.reach == 1.0]
    assert whole == sorted(whole)
    assert len(whole) > 3
    assert ranked(reach, arm, limits, poses, deep)[0] == found
    for candidate in found:
        assert candidate.pose == poses[candidate.index]


@pytest.mark.requirement(76, 78)
def test_a_long_drive_puts_a_pose_behind_one_that_is_near(reach, arm, limits):
    deep = level(0.0, 0.0, 1.0, 0.0)
    poses = around(deep, [0.0, 0.5], [0.9])
    first, _ = ranked(reach, arm, limits, poses, deep, drives=[1.0, 9.0])
    second, _ = ranked(reach, arm, limits, poses, deep, drives=[9.0, 1.0])
    assert [c.index for c in first] == [0, 1]
    assert [c.index for c in second] == [1, 0]


@pytest.mark.requirement(78)
def test_a_pose_that_cannot_reach_at_all_comes_last_with_no_time(reach, arm, limits):
    deep = level(0.0, 0.0, 1.0, 0.0)
    poses = [Pose2(2.5, 0.0, math.pi), *around(deep, [0.0], [1.0])]
    found, _ = ranked(reach, arm, limits, poses, deep)
    assert [c.index for c in found] == [1, 0]
    assert found[-1].reach == 0.0
    assert math.isinf(found[-1].total_time)


@pytest.mark.requirement(43, 78)
def test_a_wall_or_a_person_in_the_way_takes_the_reach(reach):
    deep = level(0.0, 0.0, 1.0, 0.0)
    pose = around(deep, [0.0], [1.0])
    assert reach.reached(pose, deep, ReachPlace()).tolist() == [True]
    assert reach.reached(pose, deep, ReachPlace(walls=[(0.1, -3, 0.1, 3)])).tolist() == [False]
    person = Cylinder(0.0, 0.0, 0.3, 1.8)
    assert reach.reached(pose, deep, ReachPlace(people=[person])).tolist() == [False]
    behind = Cylinder(-0.85, 0.0, 0.5, 1.8)
    assert reach.reached(pose, deep, ReachPlace(people=[behind])).tolist() == [True]


def test_a_disc_has_its_centre_and_two_rings():
    points = disc(Pose2(1.0, 2.0, 0.3), 0.2, 0.1)
    away = [math.hypot(p.x - 1.0, p.y - 2.0) for p in points]
    assert len(points) == 19
    assert points[0] == Pose2(1.0, 2.0, 0.3)
    assert sorted({round(a, 9) for a in away}) == [0.0, 0.1, 0.2]
    assert max(abs(p.yaw - 0.3) for p in points) == pytest.approx(0.1)
    assert disc(Pose2(1.0, 2.0, 0.3), 0.0) == [Pose2(1.0, 2.0, 0.3)]
