"""ROS 1 bags, written by the library of the reader but for what is asked of them."""

import gzip
import math
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from cobodeck.logs.log_files import open_log
from engine.files.finding import FileError
from hw.geometry import Pose2
from tests.cobodeck.logs.drives import values

JACKAL = Path(__file__).resolve().parents[5] / "shared/data/ekf/test2.bag.gz"
STORE = get_typestore(Stores.ROS1_NOETIC)
T = STORE.types
TF = "tf2_msgs/msg/TFMessage"
if TF not in T:
    STORE.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TF))
LEVEL = (0.0, 0.0, 0.0, 1.0)


def header(stamp, frame):
    seconds, rest = divmod(round(stamp * 1e9), 10**9)
    time = T["builtin_interfaces/msg/Time"](sec=seconds, nanosec=rest)
    return T["std_msgs/msg/Header"](seq=0, stamp=time, frame_id=frame)


def vector(x=0.0, y=0.0, z=0.0):
    return T["geometry_msgs/msg/Vector3"](x=x, y=y, z=z)


def quaternion(q):
    return T["geometry_msgs/msg/Quaternion"](x=q[0], y=q[1], z=q[2], w=q[3])


def scan(stamp, ranges, frame="laser", step=0.5, time_increment=0.0, most=30.0):
    return T["sensor_msgs/msg/LaserScan"](
        header=header(stamp, frame), angle_min=-1.0, angle_max=1.0, angle_increment=step,
        time_increment=time_increment, scan_time=0.1, range_min=0.1, range_max=most,
        ranges=np.array(ranges, np.float32), intensities=np.zeros(0, np.float32),
    )  # fmt: skip


def wheels(stamp, x, child="base_link", speed=0.0):
    pose = T["geometry_msgs/msg/Pose"](
        position=T["geometry_msgs/msg/Point"](x=x, y=0.0, z=0.0), orientation=quaternion(LEVEL)
    )
    twist = T["geometry_msgs/msg/Twist"](linear=vector(speed), angular=vector())
    none = np.zeros(36)
    return T["nav_msgs/msg/Odometry"](
        header=header(stamp, "odom"), child_frame_id=child,
        pose=T["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=none),
        twist=T["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=none),
    )  # fmt: skip


def frames(*edges):
    found = [
        T["geometry_msgs/msg/TransformStamped"](
            header=header(stamp, parent), child_frame_id=child,
            transform=T["geometry_msgs/msg/Transform"](
                translation=vector(*at), rotation=quaternion(q)
            ),
        )
        for stamp, parent, child, at, q in edges
    ]  # fmt: skip
    return T[TF](transforms=found)


def written(tmp_path, *told, name="some.bag", packed=False):
    path = tmp_path / name
    with Writer(tmp_path / "plain.bag") as writer:
        topics = {}
        for number, (topic, message) in enumerate(told):
            kind = message.__msgtype__
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=STORE)
            data = STORE.serialize_ros1(message, kind)
            writer.write(topics[topic], 10**9 + number, bytes(data))
    data = (tmp_path / "plain.bag").read_bytes()
    path.write_bytes(gzip.compress(data) if packed else data)
    return path


@pytest.mark.parametrize(("name", "packed"), [("a.bag", False), ("a.bag.gz", True), ("a", False)])
def test_bags_are_told_by_what_is_in_them(tmp_path, name, packed):
    seen = scan(5.0, [1.0, 2.0, 3.0])
    path = written(tmp_path, ("/scan", seen), ("/odom", wheels(5.1, 1.0)), name=name, packed=packed)
    log = open_log(path)

    assert [(s.name, s.stamp_ns) for s in log.samples] == [
        ("base.scan", 0),
        ("base.odometry", 100_000_000),
    ]
    assert sorted(tmp_path.iterdir()) == sorted({path, tmp_path / "plain.bag"})


def test_no_measurement_is_infinite_whatever_the_driver_writes(tmp_path):
    odd = [math.nan, math.inf, -math.inf, 0.0, 0.05, 30.0, 31.0, 0.5, 29.9]
    log = open_log(written(tmp_path, ("/scan", scan(1.0, odd))))

    [seen] = values(log, "base.scan")
    assert seen.ranges == pytest.approx([math.inf] * 7 + [0.5, 29.9])


def test_a_range_that_says_nothing_is_no_limit(tmp_path):
    log = open_log(written(tmp_path, ("/scan", scan(1.0, [5.0, 99.0], most=0.0))))

    assert values(log, "base.scan")[0].ranges == (5.0, 99.0)


@pytest.mark.parametrize(("increment", "kept"), [(1e-4, 1e-4), (-1e-4, 0.0), (2.0, 0.0)])
def test_times_of_beams_are_kept_where_they_make_sense(tmp_path, increment, kept):
    log = open_log(written(tmp_path, ("/scan", scan(1.0, [1.0] * 3, time_increment=increment))))

    assert values(log, "base.scan")[0].beam_time == pytest.approx(kept)


def test_mounts_come_from_the_frames(tmp_path):
    half = math.sqrt(0.5)
    static = frames((0.0, "base_link", "mast", (0.1, 0.0, 1.0), (0.0, 0.0, half, half)))
    moving = frames((1.0, "mast", "laser", (0.2, 0.0, 0.0), LEVEL))
    told = [("/tf_static", static), ("/tf", moving), ("/scan", scan(9.0, [1.0] * 3, "/laser"))]
    log = open_log(written(tmp_path, *told))

    mount = log.sensing.mount("scan")
    assert (mount.x, mount.y, mount.yaw) == pytest.approx((0.1, 0.2, math.pi / 2))
    assert log.remarks == ()


def test_the_base_may_be_a_child_of_another_frame_of_the_robot(tmp_path):
    static = frames(
        (0.0, "base_link", "base_footprint", (0.0, 0.0, -0.1), LEVEL),
        (0.0, "base_link", "laser", (0.2, 0.0, 0.1), LEVEL),
    )
    told = [("/tf_static", static), ("/scan", scan(9.0, [1.0] * 3))]
    log = open_log(written(tmp_path, *told, ("/odom", wheels(9.0, 0.0, "base_footprint"))))

    assert log.sensing.mount("scan") == Pose2(0.2, 0.0)


def test_a_scanner_upside_down_turns_the_other_way_round(tmp_path):
    static = frames((0.0, "base_link", "laser", (0.2, 0.1, 0.0), (1.0, 0.0, 0.0, 0.0)))
    told = [("/tf_static", static), ("/scan", scan(1.0, [1.0, 2.0, 3.0]))]
    log = open_log(written(tmp_path, *told))

    [seen] = values(log, "base.scan")
    assert (seen.start, seen.step) == (1.0, -0.5)
    assert log.sensing.mount("scan") == Pose2(0.2, 0.1)


def test_tilted_scanners_are_left_out_and_told(tmp_path):
    tilted = (0.0, math.sin(0.2), 0.0, math.cos(0.2))
    static = frames(
        (0.0, "base_link", "laser", (0.2, 0.0, 0.0), LEVEL),
        (0.0, "base_link", "tilt", (0.2, 0.0, 0.0), tilted),
    )
    told = [("/scan", scan(1.0, [1.0] * 3)), ("/tilt_scan", scan(1.0, [1.0] * 3, "tilt"))]
    log = open_log(written(tmp_path, ("/tf_static", static), *told))

    assert [seen.sensor for seen in values(log, "base.scan")] == ["scan"]
    assert log.remarks == ("scans of tilt_scan were left out: it is tilted",)


def test_several_scanners_have_their_own_names_and_mounts(tmp_path):
    static = frames(
        (0.0, "base_link", "front", (0.2, 0.0, 0.0), LEVEL),
        (0.0, "base_link", "rear", (-0.2, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0)),
    )
    told = [
        ("/front/scan", scan(1.0, [1.0] * 3, "front")),
        ("/rear/scan", scan(1.0, [1.0] * 3, "rear")),
    ]
    log = open_log(written(tmp_path, ("/tf_static", static), *told))

    assert log.sensing.mount("front_scan").x == 0.2
    assert log.sensing.mount("rear_scan").x == -0.2


def test_without_frames_it_is_told_that_the_mount_is_taken_for_the_middle(tmp_path):
    log = open_log(written(tmp_path, ("/scan", scan(1.0, [1.0] * 3))))

    [remark] = log.remarks
    assert "the pose of laser is not in the bag: it is assumed to be at base_link" in remark
    assert "--scan-mount scan=X,Y,YAW" in remark


def test_the_odometry_of_the_wheels_is_taken_before_filtered_ones(tmp_path):
    told = [("/odometry/filtered", wheels(1.0 + n, 5.0)) for n in range(3)]
    log = open_log(written(tmp_path, *told, ("/odom", wheels(1.0, 2.0, speed=0.5))))

    [only] = values(log, "base.odometry")
    assert (only.pose.x, only.twist.vx) == (2.0, 0.5)
    assert log.remarks == ("odometry /odometry/filtered was left out: /odom is taken",)


def test_velocities_are_told_by_the_way_where_all_are_zero(tmp_path):
    log = open_log(written(tmp_path, *[("/odom", wheels(n, 0.5 * n)) for n in (1, 2, 3)]))

    assert [o.twist.vx for o in values(log, "base.odometry")] == pytest.approx([0.0, 0.5, 0.5])


def test_frames_give_odometry_and_reference_where_there_is_nothing_else(tmp_path):
    told = []
    for n in range(1, 5):
        told.append(("/tf", frames((n, "odom", "base_link", (n, 0.0, 0.0), LEVEL))))
        told.append(("/tf", frames((n, "map", "odom", (0.0, 5.0 + n, 0.0), LEVEL))))
    told += [("/scan", scan(n, [1.0] * 3, "base_link")) for n in (2.5, 3.5)]
    log = open_log(written(tmp_path, *told))

    assert [o.pose for o in values(log, "base.odometry")] == [Pose2(2.5, 0.0), Pose2(3.5, 0.0)]
    assert [ref.pose for ref in log.reference] == [Pose2(2.5, 7.5), Pose2(3.5, 8.5)]


def test_true_odometry_is_the_reference(tmp_path):
    told = [("/base_pose_ground_truth", wheels(1.0, 3.0)), ("/odom", wheels(1.0, 2.0))]
    log = open_log(written(tmp_path, *told))

    assert [ref.pose.x for ref in log.reference] == [3.0]
    assert [o.pose.x for o in values(log, "base.odometry")] == [2.0]


def test_a_bag_that_breaks_off_is_told_in_one_sentence(tmp_path):
    path = written(tmp_path, *[("/scan", scan(n, [1.0] * 99)) for n in range(1, 40)])
    path.write_bytes(path.read_bytes()[:-800])

    with pytest.raises(FileError, match="cannot be read as a bag") as caught:
        open_log(path)
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(not JACKAL.is_file(), reason="needs ../shared/data/ekf")
def test_the_jackals_bag_is_read_to_its_end():
    log = open_log(JACKAL)

    assert (log.count("base.imu"), log.count("base.odometry")) == (3061, 3060)
    assert log.duration == pytest.approx(61.2, abs=0.01)
    assert values(log, "base.imu")[0].attitude is not None
