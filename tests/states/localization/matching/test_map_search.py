"""A search is never sure of one of several like places, and bounds what it does at once."""

import dataclasses
import math

import pytest

from hw.geometry import Pose2
from hw.model.tracking import Tracking
from hw.scene.room import Room
from states.localization.localizer import Localizer
from states.localization.matching import map_search as searching
from states.localization.matching.amcl import AmclValues
from states.localization.matching.map_search import Search
from states.localization.matching.proposals import SLICE, Proposals
from states.localization.matching.scan_tracker import TrackerValues
from states.localization.matching.scans import cloud_of
from states.maps.field import room_field
from tests.states.localization.world import ROOM, World, random_drive, sensing, standing


def box(x, y, width, height):
    return ((x, y), (x + width, y), (x + width, y + height), (x, y + height))


SQUARE = Room(box(0.0, 0.0, 12.0, 12.0))
TURNED = Room(
    box(0.0, 0.0, 12.0, 10.0),
    columns=(box(3.5, 4.6, 0.4, 0.6), box(8.1, 4.8, 0.4, 0.6)),
)
"""Looks the same from the other side."""


def localized(room, drive, seed, start=None):
    """The localizer and, at each scan, its status and error, m."""
    world = World(drive, seed, sensing=sensing(beams=91), room=room)
    found = Localizer(room_field(room), world.sensing, Tracking.of(world.sensing), start)
    told = []
    for sample in world.samples("base.odometry", "base.scan"):
        found.update(*sample)
        if sample.name == "base.scan":
            true = drive.pose(found.stamp_ns * 1e-9)
            told.append((found.status, found.pose and found.pose.distance_to(true)))
    return found, told


@pytest.mark.parametrize("room", [SQUARE, TURNED], ids=["square", "turned"])
@pytest.mark.few(1)
def test_like_places_are_ambiguous_and_give_no_pose(room):
    found, told = localized(room, random_drive(7, 4.0), 7)
    assert found.status == "ambiguous"
    assert found.pose is None
    assert {status for status, _ in told} == {"starting", "ambiguous"}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20, 26))
@pytest.mark.parametrize("room", [ROOM, SQUARE, TURNED], ids=["unlike", "square", "turned"])
def test_nobody_is_confidently_wrong(room, seed):
    drive = random_drive(seed, 10.0, stand=1.0)
    found, told = localized(room, drive, seed)
    assert all(off is None or off < 0.5 for status, off in told if status != "starting")
    assert (found.status in ("tracking", "resting")) == (room is ROOM)


def test_a_given_start_is_no_like_place():
    drive = random_drive(8, 3.0)
    found, _ = localized(TURNED, drive, 8, start=drive.pose(0.0))
    assert found.status == "tracking"
    assert found.pose.distance_to(drive.pose(found.stamp_ns * 1e-9)) < 0.1


def scans_of(room, pose, count):
    world = World(standing(pose, 1.0), 3, sensing=sensing(beams=91), room=room, walker=False)
    field, sense = room_field(room), world.sensing
    clouds = [
        cloud_of(scan, 0, sense, 91)
        for scan in (world.scan("front_laser", number)[1] for number in range(count))
    ]
    return field, [cloud.points for cloud in clouds]


def test_repeated_scans_from_one_place_are_no_new_evidence():
    field, clouds = scans_of(ROOM, Pose2(5.5, 7.8, 0.3), 3)
    search = Search(field, AmclValues(), TrackerValues())
    logs = []
    for k in range(200):
        search.update(Pose2(0.0, 0.0), clouds[k % len(clouds)], "front")
        logs += [search._hypotheses[0].log] if search.best else []
    assert logs[-1] == pytest.approx(logs[5], abs=3.0)


def test_the_same_scans_after_motion_count_anew():
    field, clouds = scans_of(ROOM, Pose2(5.5, 7.8, 0.3), 1)
    search = Search(field, AmclValues(), TrackerValues())
    while search.best is None:
        search.update(Pose2(0.0, 0.0), clouds[0], "front")
    before = search._hypotheses[0].log
    search.update(Pose2(0.0, 0.0, 0.11), clouds[0], "front")
    assert search._places == 1
    assert search._hypotheses[0].log < before  # two places, each with its own misfit


def test_a_slice_is_bounded_and_the_lattice_misses_no_place():
    field, clouds = scans_of(SQUARE, Pose2(5.0, 5.0), 1)
    proposals, poses = Proposals(field, clouds[0]), []
    slices = list(proposals._slices)
    assert max(map(len, slices)) <= SLICE
    for some in slices:
        poses += [(round(x, 3), round(y, 3)) for x, y, _ in some.tolist()]
    places = set(poses)
    for x, y in ((3.0, 3.0), (6.1, 9.7), (11.0, 2.2)):
        near = min(math.dist((x + 2.0, y + 2.0), place) for place in places)
        assert near < 0.3


def test_refinement_is_sliced(monkeypatch):
    field, clouds = scans_of(SQUARE, Pose2(5.0, 4.0), 1)
    counts = [0]
    match = searching.match

    def counted(*about):
        counts[-1] += 1
        return match(*about)

    monkeypatch.setattr(searching, "match", counted)
    search = Search(field, AmclValues(), TrackerValues())
    for _ in range(60):
        counts.append(0)
        search.update(Pose2(0.0, 0.0), clouds[0], "front")
    assert 0 < max(counts) <= searching.REFINED


def test_more_like_places_than_hypotheses_are_never_one(monkeypatch):
    monkeypatch.setattr(searching, "KEPT", 2)
    field, clouds = scans_of(SQUARE, Pose2(5.0, 4.0), 1)
    search = Search(field, AmclValues(), TrackerValues())
    answers = [search.update(Pose2(0.0, 0.0), clouds[0], "front") for _ in range(80)]
    assert answers == [None] * 80
    assert search._more


def test_wheels_that_lead_off_the_map_end_in_lost():
    half = Room(box(0.0, 0.0, 12.0, 10.0))
    out = dataclasses.replace(
        standing(Pose2(6.0, 5.0), 8.0), x=6.0 + 2.0 * standing(Pose2(0.0, 0.0), 8.0).times
    )
    wide = Room(box(-60.0, -60.0, 120.0, 120.0))
    world = World(out, 1, sensing=sensing(beams=91), room=wide, walker=False)
    found = Localizer(room_field(half), world.sensing, Tracking.of(world.sensing), Pose2(6.0, 5.0))
    for sample in world.samples("base.odometry", "base.scan"):
        found.update(*sample)
        assert found.status not in ("tracking", "resting")
