"""The way through unknown surroundings, by scans alone and slipping wheels."""

import math

import numpy as np
import pytest

from hw.geometry import Pose2
from hw.samples import Odometry, Scan
from states.localization.matching.scans import cloud_of
from states.localization.slam.incremental_mapping import Growing, points_in
from states.maps.mapping import Mapper
from tests.states.localization.world import World, random_drive, sensing


def follow(world):
    """Errors against the truth in m, of the growing map and of the wheels alone."""
    growing, odom, start, errors, drift = Growing(), None, None, [], []
    for sample in world.samples("base.odometry", "base.scan"):
        if isinstance(sample.value, Odometry):
            odom, motion = sample.value.pose, sample.value.twist
        elif isinstance(sample.value, Scan) and odom is not None:
            cloud = cloud_of(sample.value, sample.stamp_ns, world.sensing, 1000, motion)
            pose = growing.add_scan(odom, sample.value.sensor, cloud.points)
            true = world.drive.pose(cloud.stamp_ns * 1e-9)
            start = start or true @ pose.inverse()
            errors.append((start @ pose).distance_to(true))
            drift.append((start @ odom).distance_to(true))
    return np.array(errors), np.array(drift)


@pytest.mark.parametrize("seed", [3, 4])
def test_scans_hold_what_slipping_wheels_lose(seed):
    world = World(random_drive(seed, 25.0, 0.8), seed, sensing(beams=181, rate=8.0))
    errors, drift = follow(world)

    assert drift[-1] > 0.25
    assert np.sqrt(np.mean(errors**2)) < 0.06
    assert errors.max() < 0.15


def test_without_any_walls_the_wheels_are_believed():
    growing = Growing()
    for n in range(5):
        pose = growing.add_scan(Pose2(0.5 * n, 0.0), "laser", np.empty((0, 2)))

    assert pose == Pose2(2.0, 0.0)


def test_points_are_moved_as_poses_are():
    pose = Pose2(3.0, -2.0, 0.7)
    points = np.array([[1.0, 2.0], [-4.0, 0.5]])

    np.testing.assert_allclose(
        points_in(pose, points), [pose.transform(*point) for point in points], atol=1e-12
    )


def test_a_map_of_the_way_shows_the_room():
    """Walls of the drawn room within two cells of those of the map, and the other way round."""
    world = World(random_drive(5, 20.0, 0.6), 5, sensing(rate=6.0), walker=False, outliers=0.0)
    mapper = Mapper(0.05)
    for sample in world.samples("base.scan"):
        cloud = cloud_of(sample.value, sample.stamp_ns, world.sensing, 1000)
        pose = world.drive.pose(cloud.stamp_ns * 1e-9)
        start = pose @ world.sensing.mount(sample.value.sensor)
        mapper.add((start.x, start.y), points_in(pose, cloud.points))
    map_ = mapper.map()

    row, column = np.nonzero(map_.values == 100)
    places = [map_.center(int(r), int(c)) for r, c in zip(row, column, strict=True)]
    off = [min(_distance(x, y, side) for side in world.room.segments) for x, y in places]
    assert np.mean(np.array(off) < 0.1) > 0.97


def _distance(x, y, side):
    ax, ay, bx, by = side
    length = math.dist((ax, ay), (bx, by))
    share = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length**2
    share = min(max(share, 0.0), 1.0)
    return math.dist((x, y), (ax + share * (bx - ax), ay + share * (by - ay)))
