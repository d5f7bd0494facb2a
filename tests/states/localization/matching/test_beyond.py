"""A place at which the map ends is told from one that a scan contradicts."""

import dataclasses
import math

import numpy as np
import pytest

from hw.geometry import Pose2
from hw.scene.room import Room
from states.localization.matching.beyond import is_leaving
from states.maps.cells import room_map
from states.maps.field import map_field
from states.maps.occupancy import UNKNOWN
from tests.states.localization.test_localizer import localizer
from tests.states.localization.world import (
    ROOM,
    Drive,
    World,
    cast,
    random_drive,
    sensing,
)

FITS = 0.125
SAME = "base.odometry", "base.scan"


def known_up_to(room, x):
    """The field of a map that shows only what is left of x, m."""
    whole = room_map(room.outer, (*room.walls, *room.columns), 0.05)
    values = whole.values.copy()
    values[:, round((x - whole.map_from_corner.x) / 0.05) :] = UNKNOWN
    return map_field(dataclasses.replace(whole, values=values))


def seen_from(pose, room):
    angles = np.linspace(-math.pi, math.pi, 180, endpoint=False)
    ranges = cast(pose.x, pose.y, angles + pose.yaw, np.array(room.segments), ())
    return np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=1)


@pytest.mark.parametrize(
    ("true", "thought", "leaving"),
    [
        (Pose2(5.6, 5.0), Pose2(5.6, 5.0), True),
        (Pose2(5.6, 5.0, 2.0), Pose2(5.6, 5.0, 2.0), True),
        (Pose2(5.6, 5.0), Pose2(5.6, 5.0, 1.0), False),
        (Pose2(2.0, 8.0), Pose2(5.6, 5.0), False),
    ],
)
def test_beams_that_lead_off_the_map_say_nothing_and_others_have_to_agree(true, thought, leaving):
    assert is_leaving(known_up_to(ROOM, 6.0), seen_from(true, ROOM), thought, FITS) is leaving


def test_a_wall_on_the_way_is_no_end_of_the_map():
    wide = Room(((0.0, 0.0), (12.0, 0.0), (12.0, 10.0), (0.0, 10.0)))
    narrow = Room(((0.0, 0.0), (6.0, 0.0), (6.0, 10.0), (0.0, 10.0)))
    pose = Pose2(4.0, 5.0)
    assert not is_leaving(known_up_to(narrow, 20.0), seen_from(pose, wide), pose, FITS)
    assert is_leaving(known_up_to(wide, 6.0), seen_from(pose, wide), pose, FITS)


def is_wrong(found, true):
    """More than 0.5 m and 3 sigma off, and certain."""
    off = 0.0 if found.pose is None else found.pose.distance_to(true)
    certain = found.status not in ("starting", "doubtful")
    return certain and off > max(0.5, 3.0 * found.sigma.position)


@pytest.mark.parametrize(
    "seed", [60, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(61, 66))]
)
def test_off_the_map_nobody_is_confidently_wrong_and_back_on_it_the_base_is_found(seed):
    world = World(random_drive(seed, 20.0, stand=0.5), seed, sensing=sensing(beams=61))
    found = localizer(world, world.drive.pose(0.0), field=known_up_to(ROOM, 6.5))
    statuses = set()
    for sample in world.samples(*SAME):
        found.update(*sample)
        assert not is_wrong(found, world.drive.pose(found.stamp_ns * 1e-9))
        statuses.add(found.status)
    assert "tracking" in statuses
    assert statuses & {"lost", "ambiguous", "doubtful"}


@pytest.mark.parametrize(
    "seed", [70, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(71, 76))]
)
def test_along_a_corridor_sigma_grows_with_the_error_and_wheels_are_not_blamed_at_its_end(seed):
    corridor = Room(((0.0, 0.0), (60.0, 0.0), (60.0, 2.4), (0.0, 2.4)))
    times = np.arange(0.0, 41.0, 0.01)
    x = 3.0 + 1.35 * np.clip(times - 0.5, 0.0, 40.0)
    drive = Drive(times, x, np.full(len(times), 1.2), np.zeros(len(times)))
    sense = sensing(beams=61, rate=5.0)
    near = {name: dataclasses.replace(one, max_range=9.0) for name, one in sense.lidars.items()}
    sense = dataclasses.replace(sense, lidars=near)
    world = World(drive, seed, sensing=sense, room=corridor, slip=1.5, walker=False)
    field = map_field(room_map(corridor.outer, (), 0.05))
    found = localizer(world, drive.pose(0.0), field=field)
    for sample in world.samples(*SAME):
        if sample.name == "base.scan":
            value = sample.value
            seen = tuple(r if r < 9.0 else math.inf for r in value.ranges)
            sample = sample._replace(value=dataclasses.replace(value, ranges=seen))
        found.update(*sample)
        assert not is_wrong(found, drive.pose(found.stamp_ns * 1e-9))
        assert found.status != "odometry wrong"
