"""Serialisation of ROS messages for a Unity build: ROS 1, or CDR for ROS 2.

`rosbags` knows the standard messages; the missing ones are registered here. Input is checked: any
defect of a message is a `ValueError` with its cause.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from hw.geometry import Pose3, Twist2

BUILDS = ("ros1", "ros2")
SECOND = 1_000_000_000
_LACKING = {
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "std_srvs/msg/Trigger_Response": "bool success\nstring message",
}


class Messages:
    """One serialisation. `definitions` are additional message definitions, by `package/Type`.

    Raises:
        ValueError: an unknown build, or an invalid definition.
    """

    def __init__(self, build: str, definitions: Mapping[str, str] | None = None) -> None:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        if build not in BUILDS:
            raise ValueError(f"build: {build!r} is none of {', '.join(BUILDS)}")
        self.build = build
        store = get_typestore(Stores.ROS1_NOETIC if build == "ros1" else Stores.ROS2_HUMBLE)
        own = {long_name(name): text for name, text in (definitions or {}).items()}
        for name, text in (_LACKING | own).items():
            if name not in store.fielddefs:
                try:
                    store.register(get_types_from_msg(text, name))
                except Exception as error:  # noqa: BLE001  any text may be given
                    raise ValueError(f"definition of {name}: {error}") from None
        self._store = store
        self._sequence = 0

    def check(self, kind: str) -> None:
        """Check that a message and all its fields are known.

        Raises:
            ValueError: they are not.
        """
        name = long_name(kind)
        if name not in self._store.fielddefs:
            raise ValueError(f"no message {kind!r} is known; give its text in `definitions`")
        try:
            self._store.generate_msgdef(name)
        except Exception as error:  # noqa: BLE001  any text may have been given
            raise ValueError(f"message {kind!r} has a field of no known type: {error}") from None

    def read(self, kind: str, body: bytes) -> Any:
        """Parse a message.

        Raises:
            ValueError: the bytes are no such message.
        """
        read = self._store.deserialize_ros1 if self.build == "ros1" else self._store.deserialize_cdr
        try:
            return read(body, long_name(kind))
        except Exception as error:  # noqa: BLE001  any bytes may come
            raise ValueError(f"no {kind}: {type(error).__name__}: {error}") from None

    def is_of_other_build(self, body: bytes, terminated: bool) -> bool:
        """True if bytes that cannot be read here look like a message of the other build.

        `terminated`: the name of its topic ended with NUL. Messages of ROS 2 begin with the kind of
        their CDR; those of ROS 1 do with their first field, and their names have no NUL.
        """
        is_cdr = body[:4] == b"\0\1\0\0"
        return is_cdr if self.build == "ros1" else not (is_cdr or terminated or not body)

    def write(self, kind: str, message: Any) -> bytes:
        """A message as bytes."""
        name = long_name(kind)
        if self.build == "ros1":
            return bytes(self._store.serialize_ros1(message, name))
        return bytes(self._store.serialize_cdr(message, name))

    def flag(self, value: bool) -> Any:
        """`std_msgs/Bool`."""
        return self._new("std_msgs/Bool", value)

    def reply(self, success: bool, text: str) -> Any:
        """The response of `std_srvs/Trigger`."""
        return self._new("std_srvs/Trigger_Response", success, text)

    def time_reference(self, stamp_ns: int, reference_ns: int, source: str) -> Any:
        """`sensor_msgs/TimeReference`."""
        header = self._header(stamp_ns, "")
        return self._new("sensor_msgs/TimeReference", header, self._time(reference_ns), source)

    def odometry(self, stamp_ns: int, frame: str, pose: Pose3, twist: Twist2) -> Any:
        """`nav_msgs/Odometry` of `base_link`, without covariances."""
        import numpy as np

        none = np.zeros(36)
        linear = self._new("geometry_msgs/Vector3", twist.vx, twist.vy, 0.0)
        angular = self._new("geometry_msgs/Vector3", 0.0, 0.0, twist.wz)
        moves = self._new("geometry_msgs/Twist", linear, angular)
        return self._new(
            "nav_msgs/Odometry",
            self._header(stamp_ns, frame),
            "base_link",
            self._new("geometry_msgs/PoseWithCovariance", self._pose(pose), none),
            self._new("geometry_msgs/TwistWithCovariance", moves, none),
        )

    def joint_state(self, stamp_ns: int, names: Sequence[str], joints: Sequence[float]) -> Any:
        """`sensor_msgs/JointState` with positions only, rad."""
        import numpy as np

        header, none = self._header(stamp_ns, ""), np.zeros(0)
        return self._new(
            "sensor_msgs/JointState", header, list(names), np.array(joints), none, none
        )

    def transforms(self, stamp_ns: int, frames: Sequence[tuple[str, str, Pose3]]) -> Any:
        """`tf2_msgs/TFMessage` of (parent, child, parent_from_child)."""
        made = []
        for parent, child, pose in frames:
            moved = self._new("geometry_msgs/Vector3", pose.x, pose.y, pose.z)
            transform = self._new("geometry_msgs/Transform", moved, self._pose(pose).orientation)
            header = self._header(stamp_ns, parent)
            made.append(self._new("geometry_msgs/TransformStamped", header, child, transform))
        return self._new("tf2_msgs/TFMessage", made)

    def _pose(self, pose: Pose3) -> Any:
        return self._new(
            "geometry_msgs/Pose",
            self._new("geometry_msgs/Point", pose.x, pose.y, pose.z),
            self._new("geometry_msgs/Quaternion", pose.qx, pose.qy, pose.qz, pose.qw),
        )

    def _header(self, stamp_ns: int, frame: str) -> Any:
        if self.build == "ros2":
            return self._new("std_msgs/Header", self._time(stamp_ns), frame)
        self._sequence = (self._sequence + 1) & 0xFFFFFFFF
        return self._new("std_msgs/Header", self._sequence, self._time(stamp_ns), frame)

    def _time(self, stamp_ns: int) -> Any:
        return self._new("builtin_interfaces/Time", stamp_ns // SECOND, stamp_ns % SECOND)

    def _new(self, kind: str, *fields: Any) -> Any:
        return self._store.types[long_name(kind)](*fields)


def long_name(kind: str) -> str:
    """`std_msgs/msg/Bool` of `std_msgs/Bool`."""
    package, _, name = kind.rpartition("/")
    return f"{package.removesuffix('/msg')}/msg/{name}"


def pose_of(message: Any) -> Pose3:
    """The pose in a message.

    Raises:
        ValueError: there is none, a number is not finite, or the quaternion is not normalised.
    """
    found = message
    while not hasattr(found, "position") and hasattr(found, "pose"):
        found = found.pose
    if not (hasattr(found, "position") and hasattr(found, "orientation")):
        raise ValueError(f"a {type(message).__name__} has no pose")
    at, q = found.position, found.orientation
    return Pose3.checked((at.x, at.y, at.z), (q.x, q.y, q.z, q.w))


def stamp_of(message: Any) -> int | None:
    """The stamp in a message's header, ns; None if missing or not set."""
    header = getattr(message, "header", None)
    if header is None:
        return None
    stamp = time_of(header.stamp)
    return stamp or None


def time_of(time: Any) -> int:
    """A time of a message, ns.

    Raises:
        ValueError: its nanoseconds exceed a second.
    """
    seconds, rest = int(time.sec), int(time.nanosec)
    if not 0 <= rest < SECOND:
        raise ValueError(f"a time with {rest} ns")
    return seconds * SECOND + rest


def frame_of(message: Any) -> str | None:
    """The frame in a message's header; None without a header."""
    header = getattr(message, "header", None)
    return None if header is None else str(header.frame_id).strip().lstrip("/")


def is_upright(head: Pose3, body: Pose3) -> bool:
    """True if head and body fit a person who stands upright, z upwards, in m.

    Coordinates of Unity itself (y upwards, left-handed), millimetres or feet do not.
    """
    rise = head.z - body.z
    aside = math.hypot(head.x - body.x, head.y - body.y)
    return 0.3 <= body.z <= 1.6 and 0.25 <= rise <= 1.2 and aside <= 0.6
