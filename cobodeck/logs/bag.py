"""ROS bags: scans, odometry, inertial readings, and mounts of sensors from the tf frames.

Of several odometry topics a raw one is used, not one whose name says that it was filtered. If the
bag has the robot's pose in a map frame, that gives reference poses.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from cobodeck.logs.content import head, plain_file
from cobodeck.logs.log import IMU, ODOMETRY, Gathered, RawScan, SensorLog, odometry_of
from engine.files.finding import mistake
from hw.geometry import Pose2, Pose3, Twist2
from hw.samples import ImuReading, Odometry
from states.localization.transforms import NoTransform, TransformBuffer

_BAG1 = b"#ROSBAG V"
_FOLDER = "metadata.yaml"
_TRUE = ("truth", "gt_", "mocap")
_ESTIMATED = ("filter", "ekf", "ukf", "amcl", "slam", "visual", "vio", "gps", "global", "map")
_MAPS = ("map", "world")
_ODOMS = ("odom", "odom_combined")
_BASES = ("base_footprint", "base_link", "base")
_FARTHEST = 100.0
"""Largest range if a scan does not state it, m."""
_LONGEST_SCAN = 0.5
"""Longest plausible duration of a scan, s; beam times beyond it are ignored."""
_CACHE_S = 1e8
"""History kept of the frames, s: more than any bag."""


def is_bag(path: Path) -> bool:
    """True for a ROS 1 bag, compressed or not, and for the folder of a ROS 2 bag."""
    if path.is_dir():
        return (path / _FOLDER).is_file()
    return head(path, len(_BAG1)) == _BAG1


def read_bag(path: Path) -> SensorLog:
    """Read a bag.

    Raises:
        FileError: it cannot be read, or holds nothing usable.
    """
    gathered = Gathered(path, "ROS bag")
    messages = _Messages()
    opened = nullcontext((path, None)) if path.is_dir() else plain_file(path, ".bag")
    with opened as (plain, broken):
        if broken is not None:
            gathered.remark(broken)
        try:
            _read(plain, messages)
        except Exception as error:  # noqa: BLE001  the library may raise anything on a damaged file
            if not any((messages.scans, messages.odometry, messages.imu)):
                hint = "`rosbag reindex` repairs bags that were cut off"
                raise mistake(path, f"cannot be read as a bag: {error}", hint=hint) from None
            gathered.remark(f"it is cut off: {error}")
    _Frames(messages, gathered).put_all()
    return gathered.finished()


class _Wheels(NamedTuple):
    """An odometry message."""

    stamp_ns: int
    child: str
    pose: Pose2
    twist: Twist2


@dataclass(slots=True)
class _Messages:
    """The messages of a bag, by topic, with stamps and frames."""

    scans: list[tuple[int, str, str, Any]] = field(default_factory=list)
    odometry: dict[str, list[_Wheels]] = field(default_factory=lambda: defaultdict(list))
    imu: list[tuple[int, str, Any]] = field(default_factory=list)
    frames: TransformBuffer = field(default_factory=lambda: TransformBuffer(_CACHE_S))
    known: set[str] = field(default_factory=set)

    def scan(self, topic: str, at_ns: int, message: Any) -> None:
        self.scans.append((_stamp(message, at_ns), topic, _name(message.header.frame_id), message))

    def wheels(self, topic: str, at_ns: int, message: Any) -> None:
        twist = message.twist.twist
        velocity = Twist2(twist.linear.x, twist.linear.y, twist.angular.z)
        pose = _pose(message.pose.pose.position, message.pose.pose.orientation).flat()
        child = _name(message.child_frame_id)
        self.odometry[topic].append(_Wheels(_stamp(message, at_ns), child, pose, velocity))

    def inertial(self, _topic: str, at_ns: int, message: Any) -> None:
        self.imu.append((_stamp(message, at_ns), _name(message.header.frame_id), message))

    def edges(self, topic: str, at_ns: int, message: Any) -> None:
        for edge in message.transforms:
            parent, child = _name(edge.header.frame_id), _name(edge.child_frame_id)
            pose = _pose(edge.transform.translation, edge.transform.rotation)
            self.known |= {parent, child}
            try:
                if topic.endswith("static"):
                    self.frames.fix(parent, child, pose)
                else:
                    self.frames.put(parent, child, _stamp(edge, at_ns), pose)
            except ValueError:  # NaN, infinite, or not a unit quaternion
                continue


_TAKING: Mapping[str, Any] = {
    "sensor_msgs/msg/LaserScan": _Messages.scan,
    "nav_msgs/msg/Odometry": _Messages.wheels,
    "sensor_msgs/msg/Imu": _Messages.inertial,
    "tf2_msgs/msg/TFMessage": _Messages.edges,
    "tf/msg/tfMessage": _Messages.edges,
}


def _read(path: Path, messages: _Messages) -> None:
    """Take all usable messages."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        worth = [found for found in reader.connections if found.msgtype in _TAKING]
        for connection, at_ns, data in reader.messages(connections=worth):
            message = reader.deserialize(data, connection.msgtype)
            _TAKING[connection.msgtype](messages, connection.topic, at_ns, message)


class _Frames:
    """Transforms the bag's messages into the base frame, and puts them into the log."""

    def __init__(self, messages: _Messages, gathered: Gathered) -> None:
        self._messages = messages
        self._gathered = gathered
        self._wheels = self._best_odometry()
        child = self._wheels[0].child if self._wheels else ""
        found = (name for name in _BASES if name in messages.known)
        self._base = child or next(found, _BASES[1])
        self._mounts: dict[str, Pose3] = {}

    def put_all(self) -> None:
        """Put everything into the log."""
        for stamp, topic, frame, message in self._messages.scans:
            self._scan(stamp, topic, self._mount(frame, stamp), message)
        for stamp, frame, message in self._messages.imu:
            self._gathered.put(IMU, stamp, _reading(message, self._mount(frame, stamp)))
        for stamp, odometry in self._odometry():
            self._gathered.put(ODOMETRY, stamp, odometry)
        self._reference()

    def _best_odometry(self) -> Sequence[_Wheels]:
        def merit(topic: str) -> tuple[bool, int]:
            estimated = any(word in topic.lower() for word in _ESTIMATED)
            return not estimated, len(self._messages.odometry[topic])

        measured = [t for t in self._messages.odometry if not any(w in t.lower() for w in _TRUE)]
        if not measured:
            return ()
        best = max(measured, key=merit)
        for other in sorted(set(measured) - {best}):
            self._gathered.remark(f"odometry {other} was left out: {best} is taken")
        return self._messages.odometry[best]

    def _odometry(self) -> list[tuple[int, Odometry]]:
        """Odometry of the chosen topic, otherwise the base's poses in the frame `odom`."""
        wheels = self._wheels
        if wheels:
            reckoned = odometry_of([(one.stamp_ns, one.pose) for one in wheels])
            if all(one.twist == Twist2(0.0, 0.0, 0.0) for one in wheels):
                return reckoned
            return [(one.stamp_ns, Odometry(one.pose, one.twist)) for one in wheels]
        odom = next((name for name in _ODOMS if name in self._messages.known), None)
        return [] if odom is None else odometry_of(self._ways(odom))

    def _ways(self, fixed: str) -> list[tuple[int, Pose2]]:
        """Poses of the base in `fixed` at each scan (or inertial reading) that the frames cover."""
        stamps = sorted({found[0] for found in self._messages.scans or self._messages.imu})
        looked_up = ((at, self._messages.frames.lookup(fixed, self._base, at)) for at in stamps)
        return [(at, pose.flat()) for at, pose in looked_up if isinstance(pose, Pose3)]

    def _reference(self) -> None:
        for topic, found in self._messages.odometry.items():
            if any(word in topic.lower() for word in _TRUE):
                for one in found:
                    self._gathered.refer(one.stamp_ns, one.pose)
                return
        fixed = next((name for name in _MAPS if name in self._messages.known), None)
        for stamp, pose in [] if fixed is None else self._ways(fixed):
            self._gathered.refer(stamp, pose)

    def _mount(self, frame: str, stamp: int) -> Pose3:
        """base_from_frame, looked up once: sensors do not move on the base."""
        if frame in self._mounts:
            return self._mounts[frame]
        found: Pose3 | NoTransform = Pose3(0.0, 0.0, 0.0)
        if frame != self._base:
            found = self._messages.frames.lookup(self._base, frame, stamp)
            if isinstance(found, NoTransform):
                found = self._messages.frames.lookup(self._base, frame)
        if isinstance(found, NoTransform):
            remark = f"the pose of {frame} is not in the bag: it is assumed to be at {self._base}"
            self._gathered.remark(remark)
            found = Pose3(0.0, 0.0, 0.0)
        self._mounts[frame] = found
        return found

    def _scan(self, stamp: int, topic: str, mount: Pose3, message: Any) -> None:
        count, most = len(message.ranges), float(message.range_max)
        beam_time = float(message.time_increment)
        if not 0.0 <= beam_time * count <= _LONGEST_SCAN:
            self._gathered.remark(f"beam times on {topic} are implausible: they are ignored")
            beam_time = 0.0
        raw = RawScan(
            topic.strip("/").replace("/", "_") or "scan",
            mount,
            float(message.angle_min),
            float(message.angle_increment),
            message.ranges.tolist(),
            most if 0.0 < most < 1e4 else _FARTHEST,
            max(0.0, float(message.range_min)),
            beam_time,
        )
        self._gathered.scan(stamp, raw)


def _stamp(message: Any, at_ns: int) -> int:
    """Stamp of the measurement, ns; `at_ns`, that of its arrival, if it has none."""
    stamp = message.header.stamp
    measured: int = stamp.sec * 10**9 + stamp.nanosec
    return measured or at_ns


def _name(frame: str) -> str:
    return frame.lstrip("/")


def _pose(at: Any, turned: Any) -> Pose3:
    return Pose3(at.x, at.y, at.z, turned.x, turned.y, turned.z, turned.w)


def _reading(message: Any, mount: Pose3) -> ImuReading:
    """An inertial reading in the base frame."""
    turn = Pose3(0.0, 0.0, 0.0, mount.qx, mount.qy, mount.qz, mount.qw)
    w, a, q = message.angular_velocity, message.linear_acceleration, message.orientation
    attitude = None
    if (
        message.orientation_covariance[0] >= 0.0
        and abs(q.x**2 + q.y**2 + q.z**2 + q.w**2 - 1) < 0.02
    ):
        pose = Pose3(0.0, 0.0, 0.0, q.x, q.y, q.z, q.w) @ turn.inverse()
        attitude = (pose.qx, pose.qy, pose.qz, pose.qw)
    return ImuReading(turn.transform(w.x, w.y, w.z), turn.transform(a.x, a.y, a.z), attitude)
