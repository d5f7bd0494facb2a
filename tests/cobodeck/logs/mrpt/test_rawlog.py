"""MRPT rawlogs and simplemaps: every version of each class, what breaks off, what is not known."""

import gzip
import math
import random
from itertools import pairwise
from pathlib import Path

import pytest

from cobodeck.logs.log_files import open_log
from engine.files.finding import FileError
from hw.geometry import Pose2
from tests.cobodeck.logs.drives import values
from tests.cobodeck.logs.mrpt_writing import (
    NEW,
    OLD,
    actions,
    frame,
    gaussian,
    inertial,
    movement,
    odometry,
    pack,
    pose3,
    scan,
    text,
    thing,
)

DATA = Path(__file__).resolve().parents[5] / "shared/data/lidar"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="needs ../shared/data/lidar")
SECOND = 10_000_000  # MRPT counts 100 ns
RANGES = [1.0, 2.0, 0.0, 90.0, 3.0]


def written(tmp_path, *things, packed=True):
    path = tmp_path / "log.bin"
    data = b"".join(things)
    path.write_bytes(gzip.compress(data) if packed else data)
    return path


@pytest.mark.parametrize("form", [OLD, NEW])
@pytest.mark.parametrize("version", range(8))
def test_every_version_of_a_scan_is_read(tmp_path, version, form):
    log = open_log(written(tmp_path, frame(scan(RANGES, version, form), form=form)))

    [seen] = values(log, "base.scan")
    assert seen.ranges == (1.0, 2.0, math.inf, math.inf, 3.0)
    assert seen.start == pytest.approx(-1.5)
    assert seen.step == pytest.approx(0.75)
    assert seen.sensor == ("front" if version >= 5 else "laser")
    assert log.sensing.mount(seen.sensor) == Pose2(0.5, 0.25, 0.0)
    assert log.sensing.lidars[seen.sensor].max_range == 80.0


@pytest.mark.parametrize("form", [OLD, NEW])
@pytest.mark.parametrize("version", range(8))
def test_every_version_of_a_movement_is_read(tmp_path, version, form):
    moves = [actions(movement(1.0, 0.0, math.pi / 2, version, form), form=form)]
    frames = [frame(scan(RANGES, 6, form, ticks=SECOND * n), form=form) for n in (1, 2, 3)]
    log = open_log(written(tmp_path, frames[0], *moves, frames[1], *moves, frames[2]))

    poses = [odometry.pose for odometry in values(log, "base.odometry")]
    assert [(p.x, p.y, p.yaw) for p in poses] == [
        (0.0, 0.0, 0.0),
        pytest.approx((1.0, 0.0, math.pi / 2)),
        pytest.approx((1.0, 1.0, math.pi)),
    ]
    names = [sample.name for sample in log.samples]
    assert names == ["base.odometry", "base.scan"] * 3


@pytest.mark.parametrize("version", range(4))
@pytest.mark.parametrize("form", [OLD, NEW])
def test_every_version_of_a_mount_is_read(tmp_path, version, form):
    mount = pose3(0.3, -0.2, 0.5, (0.0, 1.0), version, form)
    log = open_log(written(tmp_path, frame(scan(RANGES, 6, form, mount=mount), form=form)))

    at = log.sensing.mount("front")
    assert (at.x, at.y, at.yaw) == pytest.approx((0.3, -0.2, math.pi / 2), abs=1e-6)


def test_a_scanner_that_hangs_upside_down_turns_the_other_way_round(tmp_path):
    hanging = pose3(0.0, 0.0, 1.0, (1.0, 0.0), upside_down=True)
    log = open_log(written(tmp_path, frame(scan(RANGES, mount=hanging))))

    [seen] = values(log, "base.scan")
    assert (seen.start, seen.step) == pytest.approx((1.5, -0.75))


def test_a_scan_from_left_to_right_is_turned_as_it_says(tmp_path):
    log = open_log(written(tmp_path, frame(scan(RANGES, right_to_left=False))))

    [seen] = values(log, "base.scan")
    assert (seen.start, seen.step) == pytest.approx((1.5, -0.75))


def test_scanners_without_labels_are_told_apart_by_their_mounts(tmp_path):
    rear = pose3(-0.5, 0.0, 0.3, (-1.0, 0.0))
    both = frame(scan(RANGES, label=""), scan(RANGES, label="", mount=rear))
    log = open_log(written(tmp_path, both, both))

    assert [seen.sensor for seen in values(log, "base.scan")] == ["laser", "laser_2"] * 2
    assert log.sensing.mount("laser_2").x == -0.5


def test_names_with_namespaces_as_new_files_have_them_are_read(tmp_path):
    named = scan(RANGES, name="mrpt::obs::CObservation2DRangeScan")
    log = open_log(written(tmp_path, frame(named, name="mrpt::obs::CSensoryFrame")))

    assert log.count("base.scan") == 1


@pytest.mark.parametrize("version", range(3))
def test_single_observations_have_their_own_stamps(tmp_path, version):
    log = open_log(
        written(
            tmp_path,
            odometry(1.0, 0.0, 0.0, SECOND * 5, version),
            scan(RANGES, ticks=SECOND * 5 + 500_000),
            odometry(2.0, 0.0, 0.0, SECOND * 6, version),
        )
    )

    assert [(s.name, s.stamp_ns) for s in log.samples] == [
        ("base.odometry", 0),
        ("base.scan", 50_000_000),
        ("base.odometry", 1_000_000_000),
    ]
    assert values(log, "base.odometry")[1].twist.vx == pytest.approx(1.0)


@pytest.mark.parametrize("version", range(5))
def test_inertial_readings_are_turned_into_the_frame_of_the_base(tmp_path, version):
    rates = (0.3, 0.2, 0.1) if version >= 2 else (0.1, 0.2, 0.3)  # old ones: roll first
    mount = pose3(0.0, 0.0, 0.0, (0.0, 1.0))
    log = open_log(written(tmp_path, inertial([1.0, 2.0, 9.8, *rates], SECOND, version, mount)))

    [reading] = values(log, "base.imu")
    assert reading.accelerations == pytest.approx((-2.0, 1.0, 9.8))
    assert reading.rates == pytest.approx((-0.2, 0.1, 0.3))


def test_of_several_estimates_of_a_movement_that_of_the_wheels_counts(tmp_path):
    both = actions(movement(9.0, 0.0, 0.0, by_wheels=False), movement(1.0, 0.0, 0.0))
    log = open_log(written(tmp_path, both, frame(scan(RANGES))))

    assert values(log, "base.odometry")[0].pose.x == 1.0


@pytest.mark.parametrize("version", range(3))
@pytest.mark.parametrize("form", [OLD, NEW])
def test_a_simplemap_has_corrected_poses(tmp_path, version, form):
    pairs = []
    for n in range(3):
        pairs.append(gaussian(n, 0.5 * n, 0.1, version, form))
        pairs.append(frame(scan(RANGES, 4, form, ticks=SECOND * n + 1), form=form))
    log = open_log(written(tmp_path, thing("CSimpleMap", 0, pack("I", 3) + b"".join(pairs), form)))

    assert [(ref.pose.x, ref.pose.y) for ref in log.reference] == [(0, 0), (1, 0.5), (2, 1)]
    assert [o.pose.x for o in values(log, "base.odometry")] == [0, 1, 2]
    assert log.remarks == ("it has no odometry: its corrected poses are used instead",)


def test_twists_between_the_frames_of_new_simplemaps_are_passed(tmp_path):
    pair = gaussian(1.0, 2.0, 0.0) + frame(scan(RANGES)) + b"\1" + pack("6d", *[0.5] * 6)
    log = open_log(written(tmp_path, thing("CSimpleMap", 2, pack("I", 2) + pair + pair)))

    assert log.count("base.scan") == 2


def test_what_is_not_known_is_told_and_nothing_else_lost(tmp_path):
    image = thing("CObservationImage", 4, b"\x88CPose2D\0" + bytes(range(256)))
    held = frame(scan(RANGES, ticks=SECOND), image, scan(RANGES, ticks=2 * SECOND), image)
    log = open_log(written(tmp_path, held, frame(scan(RANGES, ticks=3 * SECOND))))

    assert log.count("base.scan") == 3
    assert "CObservationImage is not read (2 times)" in log.remarks


def test_a_comment_stands_in_nobodys_way(tmp_path):
    comment = thing("CObservationComment", 0, text("CSensoryFrame was here") + pack("Q", 1))
    log = open_log(written(tmp_path, comment, frame(scan(RANGES))))

    assert log.count("base.scan") == 1
    assert log.remarks == ()


@pytest.mark.parametrize("packed", [True, False])
def test_a_log_that_breaks_off_is_read_up_to_there(tmp_path, packed):
    dice = random.Random(1)  # so that gzip finds nothing to save
    seen = [[dice.uniform(1.0, 9.0) for _ in range(90)] for _ in range(20)]
    frames = [frame(scan(seen[n], ticks=SECOND * (n + 1))) for n in range(20)]
    path = written(tmp_path, *frames, packed=packed)
    path.write_bytes(path.read_bytes()[: int(0.63 * path.stat().st_size)])
    log = open_log(path)

    assert 8 <= log.count("base.scan") < 20
    assert any("cut off" in remark for remark in log.remarks)


def test_scans_without_stamps_are_told_apart_in_time_all_the_same(tmp_path):
    log = open_log(written(tmp_path, *[frame(scan(RANGES, ticks=0))] * 3))

    stamps = [sample.stamp_ns for sample in log.samples if sample.name == "base.scan"]
    assert all(before < after for before, after in pairwise(stamps))


def test_numbers_that_are_none_are_left_out(tmp_path):
    log = open_log(
        written(
            tmp_path,
            frame(scan([math.nan, -math.inf, 1.0], 0)),
            odometry(math.nan, 0.0, 0.0, SECOND),
            odometry(1e300, 0.0, 0.0, SECOND),
        )
    )

    assert values(log, "base.scan")[0].ranges == (math.inf, math.inf, 1.0)
    assert [o.pose.x for o in values(log, "base.odometry")] == [1e300]


@pytest.mark.parametrize("content", [frame(), b"\x8dCSensoryFrame\2", pose3(0, 0, 0, (1, 0))])
def test_an_archive_of_nothing_is_told_in_one_sentence(tmp_path, content):
    with pytest.raises(FileError, match="MRPT rawlog without usable data"):
        open_log(written(tmp_path, content))


@needs_data
@pytest.mark.parametrize(
    ("name", "scans", "seconds"), [("localization_demo", 37, 9.3), ("sena_one_loop", 225, 59.1)]
)
def test_real_rawlogs_are_read_to_their_ends(name, scans, seconds):
    log = open_log(DATA / f"{name}.rawlog")

    assert log.count("base.scan") == log.count("base.odometry") == scans
    assert log.duration == pytest.approx(seconds, abs=0.1)
    assert log.remarks == ()
    assert log.sensing.mount("laser").x == pytest.approx(0.78)


@needs_data
def test_a_real_simplemap_is_read_to_its_end():
    log = open_log(DATA / "localization_demo.simplemap.gz")

    assert log.count("base.scan") == len(log.reference) == 72
