"""Logs in CARMEN's text format: one message per line, its name first.

    FLASER count ranges… x y theta odom_x odom_y odom_theta stamp host logger_stamp
    ROBOTLASER1 type start view resolution max_range accuracy remission count ranges…
                [count remissions…] laser_x laser_y laser_theta robot_x robot_y robot_theta
                tv rv forward_safety side_safety turn_axis stamp host logger_stamp
    ODOM x y theta tv rv acceleration stamp host logger_stamp
    TRUEPOS x y theta odom_x odom_y odom_theta stamp host logger_stamp

Units are m, rad and s. Of a scan with two poses the first one is the scanner's if it is constant
relative to the robot; in logs that were corrected afterwards it is the robot's corrected pose.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median

from cobodeck.logs.formats.drive_log import ODOMETRY, Gathered, RawScan, SensorLog, odometry_of
from cobodeck.logs.formats.log_content import content, head
from cobodeck.logs.formats.stamps import Stamp, straightened
from hw import Pose2, Pose3, wrap
from hw.motion import PoseHistory

OLD = ("FLASER", "RLASER", "LASER3", "LASER4", "LASER5")
RAW = tuple(f"RAWLASER{n}" for n in range(1, 6))
ROBOT = tuple(f"ROBOTLASER{n}" for n in range(1, 6))
_KNOWN = frozenset((*OLD, *RAW, *ROBOT, "ODOM", "TRUEPOS", "PARAM"))
_FARTHEST = 80.0
"""Largest range if a message does not state it, m: that of the usual scanner of the time."""
_MOVED, _TURNED = 0.02, 0.01
"""A scan's pose that varies on the robot by more than this, m, rad, is no mount but corrected."""
_STRAY = 0.25
"""Poses farther than this from the odometry are corrected ones, m."""
_LATEST = 1e12
"""Largest stamp that is a time, s."""
_HEAD = 1 << 16
_MIDDLE = Pose3(0.0, 0.0, 0.0)


def is_carmen(path: Path) -> bool:
    """True if one of the first lines is a known message."""
    lines = head(path, _HEAD).decode("utf-8-sig", "replace").splitlines()
    if not lines or "\0" in lines[0]:
        return False
    names = (words[0] for line in lines if len(words := line.split(None, 1)) > 1)
    return any(name in _KNOWN and name != "PARAM" for name in names)


def read_carmen(path: Path) -> SensorLog:
    """Read a CARMEN log.

    Raises:
        FileError: it cannot be read, or holds nothing usable.
    """
    data, broken = content(path)
    gathered = Gathered(path, "CARMEN log")
    if broken is not None:
        gathered.remark(broken)
    lines = _Lines(gathered)
    for number, line in enumerate(data.decode("utf-8-sig", "replace").splitlines(), start=1):
        words = line.split()
        if words and words[0] in _KNOWN:
            if "," in line and words[0] != "PARAM":
                gathered.remark("lines with decimal commas were read as if with points")
                words = line.replace(",", ".").split()
            try:
                lines.add_line(words)
            except (ValueError, IndexError):
                lines.wrong.append((number, words[0]))
    lines.close()
    return gathered.finished()


@dataclass(frozen=True, slots=True)
class _Message:
    """A message: first pose (scanner's or corrected), the robot's by odometry, and the scan."""

    stamp_ns: int | None
    name: str
    first: Pose2 | None
    robot: Pose2 | None
    scan: RawScan | None = None


@dataclass(slots=True)
class _Lines:
    gathered: Gathered
    messages: list[_Message] = field(default_factory=list)
    given: dict[str, str] = field(default_factory=dict)
    wrong: list[tuple[int, str]] = field(default_factory=list)

    def add_line(self, words: Sequence[str]) -> None:
        """Take a line, split into words.

        Raises:
            ValueError, IndexError: it is malformed.
        """
        name = words[0]
        if name == "PARAM":
            self.given[words[1].lower()] = words[2]
        elif name in OLD:
            self.messages.append(self._old(words))
        elif name in ROBOT or name in RAW:
            self.messages.append(_new(words, poses=name in ROBOT))
        elif name == "ODOM":
            self.messages.append(_Message(_stamp(words, 7), name, None, _pose(words, 1)))
        else:
            self.messages.append(_Message(_stamp(words, 7), name, _pose(words, 1), _pose(words, 4)))

    def _old(self, words: Sequence[str]) -> _Message:
        count = int(words[1])
        ranges = [float(word) for word in words[2 : 2 + count]]
        if count < 2 or len(ranges) < count:
            raise ValueError("breaks off")
        side = {"FLASER": "front", "RLASER": "rear"}.get(words[0], words[0].lower())
        most = float(self.given.get(f"robot_{side}_laser_max", _FARTHEST))
        start, step = _spread(count)
        at = 2 + count
        scan = RawScan(words[0].lower(), _MIDDLE, start, step, ranges, most)
        stamp, first = _stamp(words, at + 6), _pose(words, at)
        return _Message(stamp, words[0], first, _pose(words, at + 3), scan)

    def close(self) -> None:
        """Put all messages into the log."""
        for number, name in self.wrong[:1]:
            more = f", and {len(self.wrong) - 1} more lines" if len(self.wrong) > 1 else ""
            self.gathered.remark(f"line {number} is a malformed {name} and was left out{more}")
        told = [Stamp(one.name, one.stamp_ns, one.scan is not None) for one in self.messages]
        stamps = straightened(told, self.gathered.remark)
        mounts = {name: self._mount(name) for name in {one.name for one in self.messages}}
        both = zip(stamps, self.messages, strict=True)
        pairs = [(stamp, one) for stamp, one in both if stamp is not None]
        wheels = {at: one.robot for at, one in pairs if one.name == "ODOM" and one.robot}
        others = {at: one.robot for at, one in pairs if one.name != "ODOM" and one.robot}
        if wheels and _stray(others, wheels):
            for stamp, pose in others.items():
                self.gathered.refer(stamp, pose)
        else:
            wheels |= others
        for stamp, odometry in odometry_of(wheels.items()):
            self.gathered.add_sample(ODOMETRY, stamp, odometry)
        for stamp, one in pairs:
            mount = mounts[one.name]
            if one.first is not None and mount is None:
                self.gathered.refer(stamp, one.first)
            if one.scan is not None:
                placed = (mount or self._offset(one.name)).upright()
                self.gathered.scan(stamp, replace(one.scan, base_from_sensor=placed))

    def _mount(self, name: str) -> Pose2 | None:
        """robot_from_scanner from the messages; None if their first pose is a corrected one."""
        if name == "TRUEPOS":
            return None
        found = [one for one in self.messages if one.name == name and one.first is not None]
        if not found:
            return self._offset(name)
        seen = [one.robot.inverse() @ one.first for one in found if one.robot and one.first]
        if any(not _same(seen[0], other) for other in seen):
            return None
        return self._offset(name) if _same(seen[0], Pose2(0.0, 0.0)) else seen[0]

    def _offset(self, name: str) -> Pose2:
        """robot_from_scanner from the PARAM lines; the robot's centre if there are none."""
        side = "rear" if name in ("RLASER", "ROBOTLASER2", "RAWLASER2") else "front"
        ahead = float(self.given.get(f"robot_{side}laser_offset", 0.0))
        return Pose2(ahead, 0.0, 0.0 if side == "front" else math.pi)


def _new(words: Sequence[str], poses: bool) -> _Message:
    start, view, step, most = (float(word) for word in words[2:6])
    count = int(words[8])
    ranges = [float(word) for word in words[9 : 9 + count]]
    if count < 2 or len(ranges) < count:
        raise ValueError("breaks off")
    rest = words[9 + count :]
    tail = 14 if poses else 3
    if len(rest) > tail:
        rest = rest[1 + int(rest[0]) :]
    step = step or view / (count - 1)
    most = most if most > 0.0 else _FARTHEST
    scan = RawScan(words[0].lower(), _MIDDLE, start, step, ranges, most)
    if not poses:
        return _Message(_stamp(rest, 0), words[0], None, None, scan)
    return _Message(_stamp(rest, 11), words[0], _pose(rest, 0), _pose(rest, 3), scan)


def _spread(count: int) -> tuple[float, float]:
    """First angle and step, rad, of a scan of which only the number of beams is known.

    Such scanners covered 180 degrees in steps of 1 or 0.5 degrees, or 100 in steps of 0.25. Scans
    with an even count lack the last beam; their first beam is at -90 degrees as well.
    """
    if count == 401:
        return -math.radians(50.0), math.radians(0.25)
    closed = count % 2 == 1
    return -0.5 * math.pi, math.pi / (count - 1 if closed else count)


def _stamp(words: Sequence[str], at: int) -> int | None:
    """A stamp, s, as ns; None if the line ends before it."""
    if at >= len(words):
        return None
    stamp = float(words[at])
    if not abs(stamp) < _LATEST:
        raise ValueError("is no time")
    return round(stamp * 1e9)


def _pose(words: Sequence[str], at: int) -> Pose2:
    x, y, yaw = (float(word) for word in words[at : at + 3])
    return Pose2.checked(x, y, yaw)


def _stray(poses: Mapping[int, Pose2], wheels: Mapping[int, Pose2]) -> bool:
    """True if poses of scans differ from the odometry of the same stamps, so are corrected ones."""
    if not poses:
        return False
    way = PoseHistory(Pose2.between, poses=sorted(wheels.items()))
    return median(way.held(stamp).distance_to(pose) for stamp, pose in poses.items()) > _STRAY


def _same(one: Pose2, other: Pose2) -> bool:
    near = one.distance_to(other) <= _MOVED
    return near and abs(wrap(one.yaw - other.yaw)) <= _TURNED
