"""Logs as people have them: each gives the right samples, or a sentence that says what is wrong."""

import bz2
import gzip
import lzma
import math
import shutil

import numpy as np
import pytest
import zstandard
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from cobodeck.__main__ import main
from cobodeck.logs.log_files import open_log
from cobodeck.logs.log_localization import with_steady_wheels
from cobodeck.terminal.console import FAILED, OK, USAGE
from engine.files.finding import FileError
from hw.geometry import STILL, Pose2
from hw.samples import Odometry, Sample
from tests.cobodeck.logs.formats import test_bag as ros1
from tests.cobodeck.logs.formats.test_carmen import flaser, odom

PACKS = {
    "gzip": gzip.compress,
    "bzip2": bz2.compress,
    "xz": lzma.compress,
    "zstd": zstandard.compress,
}
STORE = get_typestore(Stores.ROS2_HUMBLE)
T = STORE.types
UNIT, NOUGHT = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 0.0)


def lines(times):
    """A CARMEN log of a drive of 0.1 m per scan; its stamps."""
    return "".join(
        odom(at, 0.1 * n) + flaser(at, (0.1 * n, 0, 0), (0.1 * n, 0, 0))
        for n, at in enumerate(times)
    )


def opened(tmp_path, data, name="some.log"):
    path = tmp_path / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return open_log(path)


def header(stamp, frame):
    time = T["builtin_interfaces/msg/Time"](sec=int(stamp), nanosec=round(stamp % 1 * 1e9))
    return T["std_msgs/msg/Header"](stamp=time, frame_id=frame)


def scan(stamp, ranges=(1.0, 2.0, 3.0)):
    return T["sensor_msgs/msg/LaserScan"](
        header=header(stamp, "laser"), angle_min=-1.0, angle_max=1.0, angle_increment=1.0,
        time_increment=0.0, scan_time=0.1, range_min=0.1, range_max=30.0,
        ranges=np.array(ranges, np.float32), intensities=np.zeros(0, np.float32),
    )  # fmt: skip


def bag2(folder, plugin, compression=None, scans=5):
    """A bag of ROS 2 with scans; returns its only file with messages."""
    with_file = Writer(folder, version=9, storage_plugin=plugin)
    if compression is not None:
        with_file.set_compression(compression, CompressionFormat.ZSTD)
    with with_file as writer:
        kind = "sensor_msgs/msg/LaserScan"
        topic = writer.add_connection("/scan", kind, typestore=STORE)
        for n in range(scans):
            message = scan(5.0 + 0.1 * n)
            writer.write(topic, 10**9 + n, bytes(STORE.serialize_cdr(message, kind)))
    [file] = [one for one in folder.iterdir() if one.name != "metadata.yaml"]
    return file


@pytest.mark.parametrize("plugin", list(StoragePlugin))
@pytest.mark.parametrize("name", ["", "bag of ünïcode", "a.b"])
def test_a_file_of_a_ros_2_bag_is_read_alone_whatever_its_name(tmp_path, plugin, name):
    file = bag2(tmp_path / "bag", plugin)
    alone = file if not name else shutil.copy(file, tmp_path / name)
    log = open_log(alone)

    assert log.count("base.scan") == 5
    assert log.form == "ROS bag"


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_a_folder_of_a_ros_2_bag_without_its_table_of_contents_is_read(tmp_path, plugin):
    bag2(tmp_path / "bag", plugin)
    (tmp_path / "bag" / "metadata.yaml").unlink()

    assert open_log(tmp_path / "bag").count("base.scan") == 5


@pytest.mark.parametrize("pack", [zstandard.compress, gzip.compress], ids=["zstd", "gzip"])
@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_a_packed_file_of_a_ros_2_bag_is_read(tmp_path, plugin, pack):
    data = bag2(tmp_path / "bag", plugin).read_bytes()

    assert opened(tmp_path, pack(data), "bag.zstd").count("base.scan") == 5


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_a_folder_of_a_compressed_ros_2_bag_is_read(tmp_path, mode):
    bag2(tmp_path / "bag", StoragePlugin.SQLITE3, mode)

    assert open_log(tmp_path / "bag").count("base.scan") == 5


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_a_file_of_a_ros_2_bag_that_breaks_off_is_told(tmp_path, plugin):
    data = bag2(tmp_path / "bag", plugin, scans=400).read_bytes()

    with pytest.raises(FileError, match="cannot be read as a bag"):
        opened(tmp_path, data[: len(data) // 3], "half")


@pytest.mark.parametrize("pack", PACKS)
def test_a_packed_text_is_read(tmp_path, pack):
    plain = opened(tmp_path, lines(range(9)))

    assert opened(tmp_path, PACKS[pack](lines(range(9)).encode())).samples == plain.samples


@pytest.mark.parametrize("pack", ["gzip", "zstd", "xz"])
def test_a_packed_text_that_breaks_off_is_read_as_far_as_it_goes(tmp_path, pack):
    packed = PACKS[pack](lines(n + 0.123 * n % 1 for n in range(2_000)).encode())
    log = opened(tmp_path, packed[: len(packed) * 3 // 4], "packed")

    assert 100 < log.count("base.scan") < 2_000
    assert any("cut off" in remark or "malformed" in remark for remark in log.remarks)


def test_a_packed_text_of_one_block_that_breaks_off_is_told(tmp_path):
    packed = bz2.compress(lines(range(99)).encode())

    with pytest.raises(FileError, match="holds nothing that can be unpacked"):
        opened(tmp_path, packed[: len(packed) * 3 // 4], "packed")


@pytest.mark.parametrize(
    "odd",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace(" ", "\t"),
        lambda text: text.replace("\n", " extra words 7\n"),
        lambda text: "# a comment\n\n" + text.rstrip("\n"),
        lambda text: text.replace(".", ","),
    ],
    ids=["crlf", "bom", "tabs", "extra", "comment", "commas"],
)
def test_a_text_in_an_odd_form_is_read(tmp_path, odd):
    plain = opened(tmp_path, lines(range(9)))

    assert opened(tmp_path, odd(lines(range(9))), "odd.log").samples == plain.samples


@pytest.mark.parametrize(
    ("times", "said"),
    [
        ([5.0, 1.7e9, 1.7e9 + 0.1], "by 1699999995 s at 5 s"),
        ([0.1 * n for n in range(20)] + [0.1 * n for n in range(15)], "by -1.9 s at 1.9 s"),
        ([0.0, 0.0, 0.0, *(1.7e9 + 0.1 * n for n in range(9))], "numbered"),
        ([0.0] * 9, "numbered"),
        ([0.1 * n for n in range(9)] + [1e9] + [0.1 * n for n in range(9, 18)], "left out"),
        ([1e11, 5.0, 1e11, 5.0], "the clock jumps"),
        ([1e15, 1.0, 1.1], "malformed"),
    ],
)
def test_stamps_that_cannot_be_are_told_and_no_work(tmp_path, times, said):
    log = opened(tmp_path, lines(times))

    assert any(said in remark for remark in log.remarks)
    assert log.duration < 60.0
    assert len(with_steady_wheels(log.samples)) < 3_000


def test_wheels_are_not_interpolated_over_long_gaps():
    wheels = [
        Sample("base.odometry", at, Odometry(Pose2(0.0, 0.0), STILL)) for at in (0, 10**9, 10**18)
    ]

    assert len(with_steady_wheels(wheels)) == 3 + 9


def told_of(tmp_path, *messages):
    return open_log(ros1.written(tmp_path, *messages))


@pytest.mark.parametrize("q", [NOUGHT, (0.0, 0.0, 0.0, 2.0), (math.nan, 0.0, 0.0, 1.0)])
def test_a_rotation_that_is_none_is_left_out_and_counted(tmp_path, q):
    bad = ros1.wheels(1.1, 2.0)
    bad.pose.pose.orientation = ros1.quaternion(q)
    edge = ros1.frames((1.0, "base_link", "laser", (0.2, 0.0, 0.0), q))
    scans = ("/scan", ros1.scan(1.0, [1.0] * 5))
    told = [("/odom", bad), ("/odom", ros1.wheels(1.0, 1.0)), ("/tf_static", edge), scans]
    log = told_of(tmp_path, *told)

    assert [one.pose.x for one in ros1.values(log, "base.odometry")] == [1.0]
    for where in ("/odom", "/tf_static of laser"):
        assert any(remark.startswith(f"poses on {where} were left out") for remark in log.remarks)


def test_a_map_that_never_moves_against_the_odometry_corrects_nothing(tmp_path):
    told = []
    for n in range(1, 5):
        told.append(("/tf", ros1.frames((n, "odom", "base_link", (n, 0.0, 0.0), UNIT))))
        told.append(("/tf", ros1.frames((n, "map", "odom", (0.0, 7.0, 0.0), UNIT))))
    told += [("/scan", ros1.scan(n, [1.0] * 5, "base_link")) for n in (1.5, 2.5, 3.5)]
    log = told_of(tmp_path, *told)

    assert log.reference == ()
    assert any("map never moves against odom" in remark for remark in log.remarks)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"angle_increment": 0.0}, "angle_increment of 0 rad"),
        ({"angle_increment": math.nan}, "angle_increment of nan"),
        ({"angle_increment": 3.0}, "angle_increment of 3 rad with 5 beams"),
        ({"range_min": 31.0}, "range_min of 31 m and a range_max of 30 m"),
        ({"ranges": np.zeros(0, np.float32)}, "without beams"),
    ],
)
def test_a_scan_that_cannot_be_is_left_out_and_told(tmp_path, changes, said):
    wrong = ros1.scan(1.0, [1.0] * 5)
    for name, value in changes.items():
        setattr(wrong, name, value)
    good = ros1.scan(2.0, [1.0] * 5)
    log = told_of(tmp_path, ("/scan", wrong), ("/scan", good))

    assert log.count("base.scan") == 1
    assert any(said in remark for remark in log.remarks)


def test_angles_that_do_not_fit_the_number_of_beams_are_told(tmp_path):
    log = told_of(tmp_path, ("/scan", ros1.scan(1.0, [1.0] * 9)))

    assert any("angle_max is ignored" in remark for remark in log.remarks)


def two_scanners(tmp_path):
    told = [(f"/{n}/scan", ros1.scan(1.0, [1.0] * 5, n)) for n in ("front", "rear")]
    return ros1.written(tmp_path, *told)


def test_mounts_can_be_given(tmp_path):
    log = open_log(two_scanners(tmp_path)).mounted({"front_scan": Pose2(0.2, 0.1, 0.3)})

    assert log.sensing.mount("front_scan") == Pose2(0.2, 0.1, 0.3)
    assert log.sensing.mount("rear_scan") == Pose2(0.0, 0.0)
    [remark] = log.remarks
    assert "the pose of rear is not in the bag" in remark


@pytest.mark.parametrize(
    ("given", "code"),
    [("0.2,0,0", FAILED), ("side=0,0,0", FAILED), ("=0,0,0", 2), ("front=0", 2)],
)
def test_a_mount_of_no_scanner_is_refused(tmp_path, given, code, capsys):
    assert main(["localize", str(two_scanners(tmp_path)), "--scan-mount", given]) == code
    said = capsys.readouterr().err
    assert "front_scan, rear_scan" in said or "names no scanner" in said or "is no pose" in said


def test_a_mount_behind_the_middle_can_be_written_with_a_blank(tmp_path, capsys):
    path = tmp_path / "one.log"
    path.write_text(lines(range(9)))
    code = main(["localize", str(path), "--map", "lab_a", "--scan-mount", "-0.2,0,3.14"])

    assert code in (OK, FAILED)
    assert "expected one argument" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("empty.log", b"", "is empty"),
        ("some.gz", gzip.compress(b"", mtime=0), "nothing that can be unpacked"),
        ("some.db3", b"SQLite format 3\0", "cannot be read as a bag"),
        ("some.mcap", b"\x89MCAP0\r\n", "cannot be read as a bag"),
        ("a file.zst", b"\x28\xb5\x2f\xfdnonsense", "can be unpacked"),
        ("wide.log", lines([1.0]).encode("utf-16"), "not a known kind"),
        ("nothing.log", b"PARAM a b c\nODOM x y z\n", "without usable data"),
    ],
)
def test_what_is_no_log_is_told_in_a_sentence(tmp_path, name, data, said):
    with pytest.raises(FileError, match=said) as caught:
        opened(tmp_path, data, name)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("only", ["scan", "wheels", "one"])
def test_a_log_with_little_in_it_is_localized_or_told(tmp_path, only, capsys):
    texts = {
        "scan": "".join(flaser(n, (0, 0, 0), (0, 0, 0)) for n in range(6)).replace(
            "FLASER", "FLASER"
        ),
        "wheels": "".join(odom(n, 0.1 * n) for n in range(6)),
        "one": flaser(0, (0, 0, 0), (0, 0, 0)),
    }
    path = tmp_path / f"{only} ~ ü.log"
    path.write_text(texts[only])
    code = main(["localize", str(path)])

    said = capsys.readouterr()
    assert code in (OK, FAILED, USAGE)
    assert "Traceback" not in said.err
    assert str(path) in said.out + said.err
