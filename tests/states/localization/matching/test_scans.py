"""Beams become points where the base was in the middle of the scan."""

import math

import numpy as np
import pytest
import shapely

from hw.geometry import Pose2, Twist2
from hw.model.sensing import Sensing
from hw.samples import Scan
from states.localization.matching.scans import cloud_of
from tests.states.localization.world import ROOM, Drive, World, sensing

WALLS = shapely.MultiLineString([[s[:2], s[2:]] for s in ROOM.segments])


def turning(vx, vy, wz):
    """A steady velocity in the base's own frame, integrated in small steps."""
    times = np.arange(0.0, 1.0001, 0.001)
    yaw = 0.4 + wz * times
    dx, dy = np.cos(yaw) * vx - np.sin(yaw) * vy, np.sin(yaw) * vx + np.cos(yaw) * vy
    x = 3.0 + np.concatenate(([0.0], np.cumsum(0.5 * (dx[1:] + dx[:-1])) * 0.001))
    y = 2.5 + np.concatenate(([0.0], np.cumsum(0.5 * (dy[1:] + dy[:-1])) * 0.001))
    return Drive(times, x, y, yaw)


def off_walls(world, cloud):
    pose = world.drive.pose(cloud.stamp_ns * 1e-9)
    return max(WALLS.distance(shapely.Point(pose.transform(*point))) for point in cloud.points)


def clean(drive):
    return World(drive, 0, noise=0.0, outliers=0.0, walker=False)


@pytest.mark.parametrize("name", ["front_laser", "rear_laser"])
def test_the_smear_of_a_moving_base_is_undone(name):
    world = clean(turning(1.2, 0.5, 1.0))
    start, scan = world.scan(name, 3)
    stamp = round(start * 1e9)
    still = cloud_of(scan, stamp, world.sensing, 1000)
    taken = cloud_of(scan, stamp, world.sensing, 1000, Twist2(1.2, 0.5, 1.0))
    assert off_walls(world, taken) < 1e-3
    assert off_walls(world, still) > 0.05
    assert taken.stamp_ns - stamp == pytest.approx(90 * scan.beam_time * 1e9, abs=1)


def test_beams_are_thinned_evenly_to_at_most_as_many_as_wanted():
    world = clean(turning(0.0, 0.0, 0.0))
    _, scan = world.scan("front_laser", 0)
    whole = cloud_of(scan, 0, world.sensing, 181).points
    assert len(whole) == 181
    for beams in (1, 2, 60, 90, 180):
        some = cloud_of(scan, 0, world.sensing, beams).points
        assert beams / 2 <= len(some) <= beams
        np.testing.assert_allclose(some, whole[:: math.ceil(181 / beams)], atol=1e-12)


def test_beams_without_an_end_are_left_out():
    ranges = (math.nan, math.inf, -math.inf, -1.0, 0.0, 0.05, 0.051, 29.99, 30.0, 1e308)
    scan = Scan("front_laser", 0.0, 0.1, ranges)
    assert len(cloud_of(scan, 0, sensing(), 100).points) == 2


@pytest.mark.parametrize("ranges", [(), (math.inf,) * 5])
def test_a_scan_of_nothing_has_no_points(ranges):
    assert cloud_of(Scan("front_laser", 0.0, 0.1, ranges, 1e-4), 7, sensing(), 60).points.shape == (
        0,
        2,
    )


def test_a_scanner_that_the_robot_file_does_not_name_is_in_base_link():
    scan = Scan("other", 0.5 * math.pi, 0.1, (2.0,))
    np.testing.assert_allclose(cloud_of(scan, 0, Sensing(), 60).points, [(0.0, 2.0)], atol=1e-12)


def test_points_stand_where_the_mount_says():
    scan = Scan("rear_laser", -0.75 * math.pi, 0.1, (2.0,))
    point = (
        Pose2(-0.2865, 0.2089, 0.75 * math.pi) @ Pose2(0.0, 0.0, -0.75 * math.pi) @ Pose2(2.0, 0.0)
    )
    expected = [(point.x, point.y)]
    np.testing.assert_allclose(cloud_of(scan, 0, sensing(), 60).points, expected, atol=1e-12)


def test_less_than_one_beam_is_refused():
    with pytest.raises(ValueError, match="0 beams of a scan; at least 1"):
        cloud_of(Scan("front_laser", 0.0, 0.1, (1.0,)), 0, sensing(), 0)
