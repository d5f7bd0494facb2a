"""CARMEN's text logs: scans with two poses, wheels, and poses that were corrected afterwards."""

import gzip
import math

import pytest

from cobodeck.logs.log_files import open_log
from engine.files.finding import FileError
from hw.geometry import Pose2
from tests.cobodeck.logs.drives import values

RANGES = "1.5 2.5 81.83 0 3.5"
HEAD = "# CARMEN Logfile\nPARAM robot_width 0.5 nohost 0\nSYNC start 1.0 nohost 1.0\n"


def flaser(stamp, first, robot, ranges=RANGES, name="FLASER"):
    count = len(ranges.split())
    poses = " ".join(map(str, (*first, *robot)))
    return f"{name} {count} {ranges} {poses} {stamp} host {stamp + 0.01}\n"


def robotlaser(stamp, first, robot, remissions="0", ranges=RANGES):
    poses = " ".join(map(str, (*first, *robot)))
    count = len(ranges.split())
    head = "ROBOTLASER1 0 -1.0 2.0 0.5 50.0 0.01 0"
    return f"{head} {count} {ranges} {remissions} {poses} 0.1 0.0 0.5 0.5 0 {stamp} host {stamp}\n"


def odom(stamp, x, y=0.0, yaw=0.0):
    return f"ODOM {x} {y} {yaw} 0.5 0.0 0.0 {stamp} host {stamp}\n"


def opened(tmp_path, *lines, head=HEAD, packed=False):
    path = tmp_path / "some.log"
    data = (head + "".join(lines)).encode()
    path.write_bytes(gzip.compress(data) if packed else data)
    return open_log(path)


@pytest.mark.parametrize("packed", [True, False])
def test_old_messages_are_read(tmp_path, packed):
    lines = [flaser(1000.5 + 0.1 * n, (n, 0, 0.1), (n, 0, 0.1)) for n in range(3)]
    log = opened(tmp_path, *lines, packed=packed)

    seen = values(log, "base.scan")[0]
    assert seen.ranges == (1.5, 2.5, math.inf, math.inf, 3.5)
    assert (seen.start, seen.step) == pytest.approx((-math.pi / 2, math.pi / 4))
    assert [o.pose for o in values(log, "base.odometry")] == [Pose2(n, 0.0, 0.1) for n in range(3)]
    assert [s.stamp_ns for s in log.samples] == [0, 0, 10**8, 10**8, 2 * 10**8, 2 * 10**8]
    assert log.reference == ()


@pytest.mark.parametrize(
    ("count", "start", "end"),
    [(180, -90, 89), (181, -90, 90), (360, -90, 89.5), (361, -90, 90), (401, -50, 50)],
)
def test_angles_are_told_by_the_number_of_beams(tmp_path, count, start, end):
    log = opened(tmp_path, flaser(1.0, (0, 0, 0), (0, 0, 0), " ".join(["1.0"] * count)))

    [seen] = values(log, "base.scan")
    found = math.degrees(seen.start), math.degrees(seen.start + (count - 1) * seen.step)
    assert found == pytest.approx((start, end))


def test_where_the_scanner_sits_is_told_by_its_pose(tmp_path):
    lines = [robotlaser(n, (n - 0.3, 0.2, math.pi / 2), (n, 0.0, math.pi / 2)) for n in range(1, 4)]
    log = opened(tmp_path, *lines)

    mount = log.sensing.mount("robotlaser1")
    assert (mount.x, mount.y, mount.yaw) == pytest.approx((0.2, 0.3, 0.0))
    assert log.reference == ()


def test_where_the_scanner_sits_is_told_by_a_parameter_else(tmp_path):
    head = HEAD + "PARAM robot_frontlaser_offset 0.4 nohost 0\nPARAM robot_front_laser_max 3 h 0\n"
    log = opened(tmp_path, flaser(1.0, (1, 2, 3), (1, 2, 3)), head=head)

    assert log.sensing.mount("flaser") == Pose2(0.4, 0.0)
    assert values(log, "base.scan")[0].ranges == (1.5, 2.5, math.inf, math.inf, math.inf)


@pytest.mark.parametrize("remissions", ["0", "3 1 2 3", ""])
def test_new_messages_are_read_with_remissions_and_without(tmp_path, remissions):
    log = opened(tmp_path, robotlaser(7.0, (1, 2, 0.5), (1, 2, 0.5), remissions))

    [seen] = values(log, "base.scan")
    assert (seen.start, seen.step) == (-1.0, 0.5)
    assert seen.ranges == (1.5, 2.5, math.inf, math.inf, 3.5)
    assert values(log, "base.odometry")[0].pose == Pose2(1.0, 2.0, 0.5)


def test_a_first_pose_that_wanders_off_is_a_corrected_one(tmp_path):
    lines = [flaser(n, (n, 0.1 * n, 0), (n, 0, 0)) for n in range(1, 5)]
    log = opened(tmp_path, *lines)

    assert [ref.pose.y for ref in log.reference] == pytest.approx([0.1, 0.2, 0.3, 0.4])
    assert [o.pose.y for o in values(log, "base.odometry")] == [0, 0, 0, 0]
    assert log.sensing.mount("flaser") == Pose2(0.0, 0.0)


def test_poses_of_scans_away_from_the_wheels_are_corrected_ones(tmp_path):
    lines = []
    for n in range(1, 9):
        lines += [odom(n - 0.01, n, 0.0), flaser(n, (n, n, 0), (n, n, 0))]
    log = opened(tmp_path, *lines)

    assert [ref.pose.y for ref in log.reference] == list(range(1, 9))
    assert {o.pose.y for o in values(log, "base.odometry")} == {0.0}


def test_wheels_that_agree_are_taken_with_the_poses_of_scans(tmp_path):
    lines = []
    for n in range(1, 9):
        lines += [odom(n - 0.5, n - 0.5), flaser(n, (n, 0, 0), (n, 0, 0))]
    log = opened(tmp_path, *lines)

    assert log.reference == ()
    assert [o.pose.x for o in values(log, "base.odometry")] == [0.5 * n for n in range(1, 17)]
    assert values(log, "base.odometry")[3].twist.vx == pytest.approx(1.0)


def test_true_poses_are_the_reference(tmp_path):
    true = "TRUEPOS 5 6 0.5 1 0 0 2.0 host 2.0\n"
    log = opened(tmp_path, odom(1.0, 0.0), true, odom(3.0, 2.0))

    assert [ref.pose for ref in log.reference] == [Pose2(5.0, 6.0, 0.5)]


def test_raw_scans_have_no_poses(tmp_path):
    raw = f"RAWLASER1 0 -1.0 2.0 0.5 50.0 0.01 0 5 {RANGES} 0 3.0 host 3.0\n"
    log = opened(tmp_path, odom(2.0, 1.0), raw, odom(4.0, 2.0))

    assert [s.name for s in log.samples] == ["base.odometry", "base.scan", "base.odometry"]


def test_lines_that_break_off_are_told_and_left_out(tmp_path):
    whole = [flaser(n, (n, 0, 0), (n, 0, 0)) for n in range(1, 4)]
    log = opened(tmp_path, *whole, "FLASER 180 1.0 2.0\n", "ODOM 1 2\n", whole[0][:20])

    assert log.count("base.scan") == 3
    assert log.remarks == ("line 7 is a malformed FLASER and was left out, and 2 more lines",)


def test_poses_with_numbers_that_are_none_are_left_out(tmp_path):
    log = opened(tmp_path, odom(1.0, "nan"), odom(2.0, "inf"), flaser(3.0, (0, 0, 0), (0, 0, 0)))

    assert log.count("base.odometry") == 1
    assert "line 4 is a malformed ODOM" in log.remarks[0]


def test_lines_without_stamps_come_one_after_another(tmp_path):
    line = f"FLASER 5 {RANGES} 0 0 0 0 0 0\n"
    log = opened(tmp_path, line, line)

    assert [s.stamp_ns for s in log.samples if s.name == "base.scan"] == [0, 100_000_000]


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "is empty"),
        (b"nothing of use\n", "is not a known kind of log"),
        (b"\x00\x01\x02", "is not a known kind of log"),
        (gzip.compress(b"abc", mtime=0), "is not a known kind of log"),
        (b"FLASER 3 1 2\n", "is a CARMEN log without usable data"),
        (b"FLASER 99999999999 1 2\n", "is a CARMEN log without usable data"),
        (b"PNG \xff\xfe FLASER", "is not a known kind of log"),
    ],
)
def test_what_is_no_log_is_told_in_one_sentence(tmp_path, content, told):
    path = tmp_path / "x.log"
    path.write_bytes(content)

    with pytest.raises(FileError, match=told) as caught:
        open_log(path)
    assert "\n" not in str(caught.value)


def test_folders_pipes_and_missing_files_are_told(tmp_path):
    with pytest.raises(FileError, match="is a folder"):
        open_log(tmp_path)
    with pytest.raises(FileError, match="cannot be read: No such file"):
        open_log(tmp_path / "nowhere.log")


@pytest.mark.parametrize(("ranges", "left_out"), [("4 4 4 4 4", True), (RANGES, False)])
def test_wheels_that_never_move_though_the_scans_do_are_left_out(tmp_path, ranges, left_out):
    stands = [flaser(stamp, (0, 0, 0), (0, 0, 0)) for stamp in range(20)]
    log = opened(
        tmp_path, *stands, *(flaser(s, (0, 0, 0), (0, 0, 0), ranges) for s in range(20, 40))
    )
    told = "odometry never moves, though the scans do: it was left out"

    assert (told in log.remarks) is left_out
    assert (log.count("base.odometry") == 0) is left_out
