from __future__ import annotations

import math

import numpy as np
import pytest

from hw.geometry import Pose2, Pose3
from states.arm.kinematics.collision import CollisionChecker, Cylinder, Surroundings
from states.arm.kinematics.inverse_kinematics import inverse
from states.arm.planning.reach import ANGLES, Reach, ReachPlace, around, disc, rover_from_deep

HEIGHTS = [round(0.5 + 0.1 * i, 1) for i in range(15)]


@pytest.fixture(scope="module")
def reach(arm):
    return Reach(arm, arm)


@pytest.mark.requirement(75, 85)
def test_the_seven_rover_poses_stand_on_a_half_circle_and_face_the_deep():
    poses = around(Pose3(2.0, 1.0, 1.5), ANGLES, [1.0])
    assert (poses[0].x, poses[0].y) == (3.0, 1.0)
    assert abs(poses[0].yaw) == pytest.approx(math.pi)
    assert (poses[5].x, poses[5].y) == pytest.approx((2.0, 2.0))
    for pose, angle in zip(poses, ANGLES, strict=True):
        assert math.hypot(pose.x - 2.0, pose.y - 1.0) == pytest.approx(1.0)
        assert math.atan2(pose.y - 1.0, pose.x - 2.0) == pytest.approx(angle)
        assert pose.bearing_to(Pose2(2.0, 1.0)) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.requirement(84)
def test_the_deep_in_the_rover_frame_is_the_map_s_turned_and_shifted():
    seen = rover_from_deep(Pose2(1.0, 2.0, math.pi / 2), Pose3.from_yaw(1.0, 3.0, 1.5, math.pi))
    assert seen[:3, 3] == pytest.approx([1.0, 0.0, 1.5])
    assert math.atan2(seen[1, 0], seen[0, 0]) == pytest.approx(math.pi / 2)
    assert seen[2] == pytest.approx([0.0, 0.0, 1.0, 1.5])


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
def test_a_pose_that_reaches_from_its_rings_reaches_from_the_whole_disc(reach, sets):
    deep = Pose3.from_yaw(2.0, 3.0, 1.4, 0.7)
    poses = around(deep, ANGLES, [0.8, 0.9])
    whole = [p for p in poses if reach.reached(disc(p, 0.2, 0.1), deep, ReachPlace()).all()]
    for _ in range(100):
        size, angle = 0.2 * math.sqrt(sets.rng.uniform()), sets.rng.uniform(-math.pi, math.pi)
        off = Pose2(
            whole[0].x + size * math.cos(angle),
            whole[0].y + size * math.sin(angle),
            whole[0].yaw + sets.rng.uniform(-0.1, 0.1),
        )
        assert reach.reached([off], deep, ReachPlace())[0]


@pytest.mark.requirement(43, 78)
def test_a_wall_or_a_person_in_the_way_takes_the_reach(reach):
    deep = Pose3(0.0, 0.0, 1.0)
    pose = around(deep, [0.0], [1.0])
    assert reach.reached(pose, deep, ReachPlace()).tolist() == [True]
    assert reach.reached(pose, deep, ReachPlace(walls=[(0.1, -3, 0.1, 3)])).tolist() == [False]
    person = Cylinder(0.0, 0.0, 0.3, 1.8)
    assert reach.reached(pose, deep, ReachPlace(people=[person])).tolist() == [False]
    behind = Cylinder(-0.85, 0.0, 0.5, 1.8)
    assert reach.reached(pose, deep, ReachPlace(people=[behind])).tolist() == [True]


@pytest.mark.requirement(43, 78)
def test_the_reach_of_many_poses_is_that_of_each_by_its_own_checks(reach, sets):
    rng, reached = sets.rng, []
    for _ in range(12):
        deep = Pose3.from_yaw(2.0, 3.0, rng.uniform(0.5, 1.6), rng.uniform(-math.pi, math.pi))
        poses = around(deep, rng.uniform(-1.5, 1.5, 6).tolist(), [0.9, 1.2])
        walls = [tuple(rng.uniform((0.0, 1.0, 0.0, 1.0), (4.0, 5.0, 4.0, 5.0))) for _ in range(2)]
        people = [Cylinder(*rng.uniform((1.0, 2.0), (3.0, 4.0)), 0.3, 1.8)]

        found = reach.reached(poses, deep, ReachPlace(walls, people))

        for pose, is_reached in zip(poses, found.tolist(), strict=True):
            seen = Surroundings.seen_from(pose, walls, people)
            checker = CollisionChecker.of(reach.arm, seen)
            joints = inverse(reach.inverted, rover_from_deep(pose, deep)).branches()
            assert is_reached is bool(len(joints) and checker.free(joints).any())
        reached += found.tolist()
    assert 0.1 < np.mean(reached) < 0.9


def test_nobody_reaches_from_nowhere(reach):
    assert reach.reached([], Pose3(0.0, 0.0, 1.0), ReachPlace()).tolist() == []


def test_a_disc_has_its_centre_and_two_rings():
    points = disc(Pose2(1.0, 2.0, 0.3), 0.2, 0.1)
    away = [math.hypot(p.x - 1.0, p.y - 2.0) for p in points]
    assert len(points) == 19
    assert points[0] == Pose2(1.0, 2.0, 0.3)
    assert sorted({round(a, 9) for a in away}) == [0.0, 0.1, 0.2]
    assert max(abs(p.yaw - 0.3) for p in points) == pytest.approx(0.1)
    assert disc(Pose2(1.0, 2.0, 0.3), 0.0) == [Pose2(1.0, 2.0, 0.3)]
