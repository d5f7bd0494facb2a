"""The messages of a bag, by what they are; poses whose rotation is none are left out."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from cobodeck.logs.formats.stamps import Stamp
from hw import Pose2, Pose3, Twist2, unit_quaternion


class BagWheels(NamedTuple):
    """An odometry message; `number` is that of its stamp."""

    number: int
    child: str
    pose: Pose2
    twist: Twist2


class Framed(NamedTuple):
    """A scan or an inertial reading in a frame; `number` is that of its stamp."""

    number: int
    topic: str
    frame: str
    message: Any


class BagTransform(NamedTuple):
    """A transform; `number` is that of its stamp, None if it is static."""

    number: int | None
    parent: str
    child: str
    pose: Pose3


@dataclass(slots=True)
class BagMessages:
    """The messages of a bag in their order; `remark` takes a sentence on what is left out."""

    remark: Callable[[str], None]
    stamps: list[Stamp] = field(default_factory=list)
    scans: list[Framed] = field(default_factory=list)
    odometry: dict[str, list[BagWheels]] = field(default_factory=lambda: defaultdict(list))
    imu: list[Framed] = field(default_factory=list)
    transforms: list[BagTransform] = field(default_factory=list)

    @property
    def are_none(self) -> bool:
        """True if there is neither a scan nor odometry nor an inertial reading."""
        return not any((self.scans, self.odometry, self.imu))

    @property
    def known(self) -> set[str]:
        """Names of all frames."""
        return {name for edge in self.transforms for name in (edge.parent, edge.child)}

    def scan(self, topic: str, at_ns: int, message: Any) -> None:
        """Take a LaserScan."""
        number = self._stamp(topic, at_ns, message, is_scan=True)
        self.scans.append(Framed(number, topic, _name(message.header.frame_id), message))

    def wheels(self, topic: str, at_ns: int, message: Any) -> None:
        """Take an Odometry."""
        twist = message.twist.twist
        velocity = Twist2(twist.linear.x, twist.linear.y, twist.angular.z)
        pose = self._pose(topic, message.pose.pose.position, message.pose.pose.orientation)
        if pose is not None:
            number = self._stamp(topic, at_ns, message)
            child = _name(message.child_frame_id)
            self.odometry[topic].append(BagWheels(number, child, pose.flat(), velocity))

    def inertial(self, topic: str, at_ns: int, message: Any) -> None:
        """Take an Imu."""
        number = self._stamp(topic, at_ns, message)
        self.imu.append(Framed(number, topic, _name(message.header.frame_id), message))

    def edges(self, topic: str, at_ns: int, message: Any) -> None:
        """Take a TFMessage."""
        for edge in message.transforms:
            parent, child = _name(edge.header.frame_id), _name(edge.child_frame_id)
            named = f"{topic} of {child}"
            pose = self._pose(named, edge.transform.translation, edge.transform.rotation)
            if pose is not None and parent != child:
                fixed = topic.endswith("static")
                number = None if fixed else self._stamp(named, at_ns, edge)
                self.transforms.append(BagTransform(number, parent, child, pose))

    def _stamp(self, stream: str, at_ns: int, message: Any, *, is_scan: bool = False) -> int:
        """Take the stamp of a measurement, that of its arrival if it has none; its number."""
        stamp = message.header.stamp
        measured = stamp.sec * 10**9 + stamp.nanosec
        self.stamps.append(Stamp(stream, measured or at_ns, is_scan))
        return len(self.stamps) - 1

    def _pose(self, where: str, at: Any, turned: Any) -> Pose3 | None:
        """A pose; None, with a remark, if its quaternion is no rotation."""
        try:
            return Pose3(at.x, at.y, at.z, *unit_quaternion(turned.x, turned.y, turned.z, turned.w))
        except ValueError as error:
            self.remark(f"poses on {where} were left out: {error}")
            return None


def _name(frame: str) -> str:
    return frame.lstrip("/")
