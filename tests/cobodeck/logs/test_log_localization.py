"""Localization over logs: what is scored, against what, and that nothing is scored on itself."""

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cobodeck.logs.formats.drive_log import ReferencePose
from cobodeck.logs.log_files import open_log
from cobodeck.logs.log_localization import (
    Localized,
    aligned,
    figures,
    first_pose,
    localize,
    with_steady_wheels,
)
from cobodeck.logs.mapped import built_ground, given_ground, reference_of, room_ground
from cobodeck.logs.seen import WheelPath, scans_of
from engine.files.finding import FileError
from hw.geometry import Pose2
from hw.scene.scene import load_scene
from states.maps.occupancy import save_map
from tests.cobodeck.logs.drives import log_of, world

DATA = Path(__file__).resolve().parents[4] / "shared/data/lidar"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="needs ../shared/data/lidar")
NAMES = ("base.odometry", "base.scan")


@pytest.fixture(scope="module")
def drive():
    return world()


@pytest.fixture(scope="module")
def log(drive):
    return log_of(drive, *NAMES)


def ticking():
    return itertools.count(0.0, 0.001).__next__


@pytest.mark.slow
def test_in_a_drawn_room_the_base_is_found_and_followed(log):
    found = localize(log, room_ground(log, log.room), None, 0, ticking())
    told = figures(found)

    assert told["scans"] == log.count("base.scan")
    assert told["without_pose"] < 10
    assert told["errors"]["position_rmse_m"] < 0.02
    assert told["wall_distance_m"]["share_below_5cm"] > 0.95
    assert told["time_per_scan_ms"]["median"] == pytest.approx(1.0)


def test_a_map_from_corrected_poses_is_in_their_frame(log):
    ground = built_ground(log)
    found = localize(log, ground, first_pose(ground), 0, ticking())

    assert ground.own
    assert figures(found)["errors"]["position_rmse_m"] < 0.04
    assert figures(found)["errors"]["frame"] == "same"


@pytest.mark.parametrize("reference", [True, False])
def test_scans_that_made_the_map_are_not_scored(drive, reference):
    log = log_of(drive, *NAMES, reference=reference)
    ground = built_ground(log)
    made = {one.number for one in ground.placed} - ground.scored
    steps = localize(log, ground, first_pose(ground), 0, ticking()).steps

    assert len(made) >= len(ground.scored) - 1 > 20
    assert len(steps) == len(ground.scored)
    if ground.split == "halves":
        assert max(made) < min(ground.scored)


def test_without_corrected_poses_the_map_is_matched_together(drive):
    log = log_of(drive, *NAMES, reference=False)
    ground = built_ground(log)
    told = figures(localize(log, ground, first_pose(ground), 0, ticking()))

    assert told["errors"] is None
    assert told["wall_distance_m"]["share_below_5cm"] > 0.95


def test_where_the_second_half_is_elsewhere_every_other_scan_makes_the_map(drive):
    log = log_of(drive, *NAMES)
    half = log.samples[len(log.samples) // 2].stamp_ns
    beyond = [
        ReferencePose(ref.stamp_ns, Pose2(ref.pose.x + 50.0 * (ref.stamp_ns > half), ref.pose.y))
        for ref in log.reference
    ]
    ground = built_ground(replace(log, reference=tuple(beyond)))

    assert ground.split == "alternate"


def test_the_same_seed_gives_the_same_poses(log):
    ground = room_ground(log, log.room)
    one, other = (localize(log, ground, None, 5, ticking()) for _ in range(2))

    assert [s.pose for s in one.steps] == [s.pose for s in other.steps]


def test_poses_of_another_map_are_laid_onto_the_estimates(log, tmp_path):
    save_map(built_ground(log).map, tmp_path / "room.yaml")
    away = Pose2(30.0, -12.0, 1.0)
    elsewhere = tuple(ReferencePose(r.stamp_ns, away @ r.pose) for r in log.reference)
    moved = replace(log, reference=elsewhere, form="CARMEN log")
    ground = given_ground(str(tmp_path / "room.yaml"), moved)
    told = figures(localize(moved, ground, log.reference[0].pose, 0, ticking()))

    assert told["errors"]["frame"] == "aligned"
    assert told["errors"]["position_rmse_m"] < 0.05


@pytest.mark.parametrize("yaw", [0.0, 0.5, 3.0, -3.1])
def test_aligned_finds_the_motion_between_two_ways(yaw):
    motion = Pose2(5.0, -3.0, yaw)
    way = [Pose2(0.1 * n, math.sin(0.3 * n), 0.2 * n) for n in range(30)]
    found = aligned(way, [motion @ pose for pose in way])

    assert found.distance_to(motion) < 1e-9
    assert math.remainder(found.yaw - yaw, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_aligned_goes_by_the_turns_where_the_base_stood():
    here = [Pose2(1.0, 2.0, 0.3)] * 5
    found = aligned(here, [Pose2(4.0, 4.0, 0.8)] * 5)

    assert (found @ here[0]).distance_to(Pose2(4.0, 4.0)) < 1e-9
    assert found.yaw == pytest.approx(0.5)


def test_wheels_that_speak_seldom_are_told_in_between_on_arcs(drive):
    log = log_of(drive, *NAMES)
    seldom = [s for s in log.samples if s.name != "base.odometry"]
    wheels = [s for s in log.samples if s.name == "base.odometry"]
    samples = sorted([*seldom, *wheels[::50]], key=lambda s: s.stamp_ns)
    dense = with_steady_wheels(samples)

    stamps = [s.stamp_ns for s in dense if s.name == "base.odometry"]
    assert max(np.diff(stamps)) <= 100_000_000
    assert set(samples) <= set(dense)
    assert [s.stamp_ns for s in dense] == sorted(s.stamp_ns for s in dense)
    assert with_steady_wheels(log.samples) == list(log.samples)


def test_the_way_of_the_wheels_is_told_between_their_words(log):
    way = WheelPath(log)
    wheels = [s for s in log.samples if s.name == "base.odometry"]
    first, second = wheels[100], wheels[101]
    middle = way.at((first.stamp_ns + second.stamp_ns) // 2)

    assert way.at(first.stamp_ns).distance_to(first.value.pose) < 1e-12
    assert middle.distance_to(first.value.pose.between(second.value.pose, 0.5)) < 1e-4
    assert way.at(-5) == wheels[0].value.pose
    assert way.at(10**12) == wheels[-1].value.pose


def test_corrected_poses_far_apart_say_nothing_of_what_is_between(log):
    few = replace(log, reference=(log.reference[0], log.reference[-1]))

    assert reference_of(log)(1_010_000_000) is not None
    assert reference_of(few)(1_010_000_000) is None
    assert reference_of(few)(few.reference[-1].stamp_ns) == few.reference[-1].pose
    assert reference_of(few)(10**15) is None


def test_scans_are_straightened_by_the_wheels(drive, log):
    """Ends of beams lie on walls from the true pose at the scan's instant, driving and turning."""
    ground = room_ground(log, log.room)
    off = [
        np.median(ground.field.distances(drive.drive.pose(seen.stamp_ns * 1e-9), seen.points))
        for seen in scans_of(log)
    ]

    assert np.percentile(off, 95) < 0.03


def test_too_few_scans_make_no_map(log):
    scans = [s for s in log.samples if s.name == "base.scan"]
    few = replace(log, samples=tuple(scans[:3]))

    with pytest.raises(FileError, match="has 3 scans: too few for a map of its own"):
        built_ground(few)
    with pytest.raises(FileError, match="has poses for 0 scans only"):
        built_ground(replace(log, reference=(ReferencePose(10**15, Pose2(0.0, 0.0)),)))


@needs_data
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.few(1)
def test_a_real_log_is_found_anywhere_in_a_real_map(seed):
    log = open_log(DATA / "localization_demo.rawlog")
    ground = given_ground(str(DATA / "localization_demo.simplemap.gz"), log)
    told = figures(localize(log, ground, None, seed, ticking()))

    assert told["scored"] >= 20
    assert told["wall_distance_m"]["share_below_5cm"] >= 0.95
    assert told["wall_distance_m"]["max"] <= 0.15


@needs_data
@pytest.mark.slow
@pytest.mark.parametrize("anywhere", [True, False])
def test_a_real_round_is_mapped_and_driven_again(anywhere):
    log = open_log(DATA / "sena_one_loop.rawlog")
    ground = built_ground(log)
    start = None if anywhere else first_pose(ground)
    told = figures(localize(log, ground, start, 0, ticking()))

    assert ground.split == "alternate"
    assert told["scored"] >= 75
    assert told["wall_distance_m"]["share_below_5cm"] >= 0.95
    assert told["wall_distance_m"]["max"] <= 0.15


@pytest.mark.parametrize(
    ("late", "told"),
    [
        (None, []),
        (0.02, []),
        (0.2, ["stamps of the odometry are 0.20 s late"]),
        (-0.12, ["stamps of the odometry are 0.12 s early"]),
    ],
)
def test_a_clock_that_is_off_is_told(late, told):
    log = log_of(world(seconds=1.0), "base.odometry")
    ground = room_ground(log, load_scene("lab_a").room)
    found = Localized(log, ground, None, 0, (), {}, clock_offset=late)
    assert found.remarks == [*log.remarks, *told]
