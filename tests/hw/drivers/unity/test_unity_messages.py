"""ROS messages as bytes: each frame here is written out by hand, by the rules of ROS 1 and of CDR.

CDR: little-endian after the four bytes 00 01 00 00, each number at a multiple of its size counted
from there, texts with their NUL counted.
"""

import math
import struct

import pytest

from hw.drivers.unity.protocol.ros_messages import (
    Messages,
    frame_of,
    is_upright,
    long_name,
    pose_of,
    stamp_of,
    time_of,
)
from hw.geometry import Pose3, Twist2

SEC, NSEC = 1_700_000_000, 123_456_789
STAMP = SEC * 10**9 + NSEC
POSE = Pose3(1.25, -2.5, 1.5, 0.0, 0.0, math.sin(0.3), math.cos(0.3))
NUMBERS = (POSE.x, POSE.y, POSE.z, POSE.qx, POSE.qy, POSE.qz, POSE.qw)


class Cdr:
    """An encoder of CDR by its rules, for these tests."""

    def __init__(self) -> None:
        self.data = b""

    def put(self, code: str, *values: object) -> "Cdr":
        size = struct.calcsize("<" + code)
        for value in values:
            self.data += bytes(-len(self.data) % size) + struct.pack("<" + code, value)
        return self

    def text(self, content: str) -> "Cdr":
        data = content.encode() + b"\0"
        self.put("I", len(data))
        self.data += data
        return self

    def header(self, frame: str) -> "Cdr":
        return self.put("i", SEC).put("I", NSEC).text(frame)

    @property
    def bytes(self) -> bytes:
        return b"\0\x01\0\0" + self.data


def text(content: str) -> bytes:
    return struct.pack("<I", len(content)) + content.encode()


def header(frame: str, number: int = 1) -> bytes:
    return struct.pack("<III", number, SEC, NSEC) + text(frame)


ROS1 = {
    "geometry_msgs/PoseStamped": header("vive", 7) + struct.pack("<7d", *NUMBERS),
    "std_msgs/Bool": b"\x01",
    "sensor_msgs/TimeReference": header("", 7) + struct.pack("<II", 5, 6) + text("42"),
}
ROS2 = {
    "geometry_msgs/PoseStamped": Cdr().header("vive").put("d", *NUMBERS).bytes,
    "std_msgs/Bool": bytes.fromhex("0001000001"),
    "sensor_msgs/TimeReference": Cdr().header("").put("i", 5).put("I", 6).text("42").bytes,
}


@pytest.mark.parametrize(("build", "golden"), [("ros1", ROS1), ("ros2", ROS2)])
def test_what_unity_sends_is_read(build, golden) -> None:
    messages = Messages(build)
    seen = messages.read("geometry_msgs/PoseStamped", golden["geometry_msgs/PoseStamped"])
    assert pose_of(seen).distance_to(POSE) == 0.0
    assert pose_of(seen).angle_to(POSE) < 1e-9
    assert (stamp_of(seen), frame_of(seen)) == (STAMP, "vive")
    assert messages.read("std_msgs/Bool", golden["std_msgs/Bool"]).data is True
    answer = messages.read("sensor_msgs/TimeReference", golden["sensor_msgs/TimeReference"])
    assert stamp_of(answer) == STAMP
    assert time_of(answer.time_ref) == 5 * 10**9 + 6
    assert answer.source == "42"


def test_the_cdr_of_a_pose_is_these_bytes() -> None:
    golden = bytes.fromhex(
        "00010000"  # little-endian CDR
        "00f15365" "15cd5b07"  # 1 700 000 000 s, 123 456 789 ns
        "05000000" "7669766500"  # 5 bytes: vive and NUL
        "000000" "0000000000000000" # none: 17 bytes so far, the next double is at 24
    )  # fmt: skip
    assert ROS2["geometry_msgs/PoseStamped"][:21] == golden[:21]
    assert len(ROS2["geometry_msgs/PoseStamped"]) == 4 + 24 + 7 * 8
    assert ROS2["geometry_msgs/PoseStamped"][28:36] == struct.pack("<d", 1.25)


def test_what_a_ros_1_build_is_sent() -> None:
    made = Messages("ros1")
    none = bytes(36 * 8)
    odometry = made.odometry(STAMP, "vive", POSE, Twist2(0.5, -0.25, 0.125))
    assert made.write("nav_msgs/Odometry", odometry) == (
        header("vive") + text("base_link") + struct.pack("<7d", *NUMBERS) + none
        + struct.pack("<6d", 0.5, -0.25, 0.0, 0.0, 0.0, 0.125) + none
    )  # fmt: skip
    state = made.joint_state(STAMP, ("a", "bc"), (0.5, 1.5))
    assert made.write("sensor_msgs/JointState", state) == (
        header("", 2) + struct.pack("<I", 2) + text("a") + text("bc")
        + struct.pack("<I2d", 2, 0.5, 1.5) + struct.pack("<II", 0, 0)
    )  # fmt: skip
    assert made.write("std_msgs/Bool", made.flag(True)) == b"\x01"
    tree = made.transforms(STAMP, [("vive", "map", POSE)])
    assert made.write("tf2_msgs/TFMessage", tree) == (
        struct.pack("<I", 1) + header("vive", 3) + text("map") + struct.pack("<7d", *NUMBERS)
    )
    asked = made.time_reference(STAMP, 5 * 10**9 + 6, "42")
    assert made.write("sensor_msgs/TimeReference", asked) == (
        header("", 4) + struct.pack("<II", 5, 6) + text("42")
    )
    assert made.write("std_srvs/Trigger_Response", made.reply(True, "ok")) == b"\x01" + text("ok")


def test_what_a_ros_2_build_is_sent() -> None:
    made = Messages("ros2")
    none = [0.0] * 36
    odometry = made.odometry(STAMP, "vive", POSE, Twist2(0.5, -0.25, 0.125))
    wanted = Cdr().header("vive").text("base_link").put("d", *NUMBERS, *none)
    wanted.put("d", 0.5, -0.25, 0.0, 0.0, 0.0, 0.125, *none)
    assert made.write("nav_msgs/Odometry", odometry) == wanted.bytes
    state = made.joint_state(STAMP, ("a", "bc"), (0.5, 1.5))
    wanted = Cdr().header("").put("I", 2).text("a").text("bc")
    wanted.put("I", 2).put("d", 0.5, 1.5).put("I", 0, 0)
    assert made.write("sensor_msgs/JointState", state) == wanted.bytes
    assert made.write("std_msgs/Bool", made.flag(True)) == ROS2["std_msgs/Bool"]
    tree = made.transforms(STAMP, [("vive", "map", POSE)])
    wanted = Cdr().put("I", 1).header("vive").text("map").put("d", *NUMBERS)
    assert made.write("tf2_msgs/TFMessage", tree) == wanted.bytes
    asked = made.time_reference(STAMP, 5 * 10**9 + 6, "42")
    assert made.write("sensor_msgs/TimeReference", asked) == ROS2["sensor_msgs/TimeReference"]
    wanted = Cdr().put("B", 1).text("ok")
    assert made.write("std_srvs/Trigger_Response", made.reply(True, "ok")) == wanted.bytes


@pytest.mark.parametrize(("build", "golden"), [("ros1", ROS1), ("ros2", ROS2)])
def test_every_shorter_message_is_refused(build, golden) -> None:
    messages = Messages(build)
    for kind, body in golden.items():
        for size in range(len(body)):
            with pytest.raises(ValueError, match=f"no {kind}"):
                messages.read(kind, body[:size])


@pytest.mark.requirement(15)
@pytest.mark.parametrize(
    ("numbers", "fault"),
    [
        ((math.nan, 0, 0, 0, 0, 0, 1), "x is nan"),
        ((0, math.inf, 0, 0, 0, 0, 1), "y is inf"),
        ((0, 0, 0, 0, 0, 0, 0), "length 0"),
        ((0, 0, 0, 0, 0, 1, 1), "length 1.41"),
    ],
)
def test_poses_that_are_none_are_refused(numbers, fault) -> None:
    body = header("vive") + struct.pack("<7d", *numbers)
    message = Messages("ros1").read("geometry_msgs/PoseStamped", body)
    with pytest.raises(ValueError, match=fault):
        pose_of(message)


def test_a_stamp_that_nobody_set_is_none_and_one_with_too_many_nanoseconds_is_refused() -> None:
    messages = Messages("ros1")
    unset = struct.pack("<III", 1, 0, 0) + text("") + struct.pack("<7d", *NUMBERS)
    assert stamp_of(messages.read("geometry_msgs/PoseStamped", unset)) is None
    strange = struct.pack("<III", 1, 1, 2 * 10**9) + text("") + struct.pack("<7d", *NUMBERS)
    with pytest.raises(ValueError, match="2000000000 ns"):
        stamp_of(messages.read("geometry_msgs/PoseStamped", strange))
    bare = messages.read("geometry_msgs/Pose", struct.pack("<7d", *NUMBERS))
    assert (stamp_of(bare), frame_of(bare)) == (None, None)
    assert pose_of(bare).distance_to(POSE) == 0.0
    with pytest.raises(ValueError, match="no pose"):
        pose_of(messages.flag(True))


def test_messages_of_one_s_own_are_registered_by_their_text() -> None:
    text_ = "std_msgs/Header header\ngeometry_msgs/Pose pose\nfloat32 confidence"
    messages = Messages("ros1", {"lab_msgs/Seen": text_})
    messages.check("lab_msgs/Seen")
    body = header("map") + struct.pack("<7d", *NUMBERS) + struct.pack("<f", 0.5)
    assert pose_of(messages.read("lab_msgs/Seen", body)).x == POSE.x
    with pytest.raises(ValueError, match="no message 'lab_msgs/Felt' is known"):
        messages.check("lab_msgs/Felt")
    with pytest.raises(ValueError, match="definition of lab_msgs/msg/Bad"):
        Messages("ros1", {"lab_msgs/Bad": "((("})
    with pytest.raises(ValueError, match="'lab_msgs/Bad' has a field of no known type"):
        Messages("ros1", {"lab_msgs/Bad": "float99 x"}).check("lab_msgs/Bad")
    with pytest.raises(ValueError, match="'ros3' is none of ros1, ros2"):
        Messages("ros3")


def test_both_ways_of_writing_a_message_s_name_are_one() -> None:
    assert long_name("std_msgs/Bool") == long_name("std_msgs/msg/Bool") == "std_msgs/msg/Bool"


@pytest.mark.parametrize(
    ("head", "body", "upright"),
    [
        ((0.1, 0.0, 1.7), (0.0, 0.0, 1.0), True),
        ((0.0, 0.1, 1.2), (0.0, 0.0, 0.7), True),
        ((0.0, 1.7, 0.1), (0.0, 1.0, 0.0), False),  # y upwards
        ((1.0, 1.7, 2.0), (1.0, 1.0, 2.0), False),  # Unity's own axes
        ((0.1, 0.0, 1700.0), (0.0, 0.0, 1000.0), False),  # millimetres
        ((0.1, 0.0, -1.7), (0.0, 0.0, -1.0), False),  # upside down
    ],
)
def test_who_stands_upright_has_the_head_above_the_body(head, body, upright) -> None:
    assert is_upright(Pose3(*head), Pose3(*body)) is upright
