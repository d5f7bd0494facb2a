"""MRPT rawlogs and simplemaps.

A rawlog is a sequence of movements and sensory frames, or of single observations with stamps; both
are read. A simplemap is a sequence of corrected poses with the observations made there. It has no
odometry: the corrected poses replace it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cobodeck.logs.formats import (
    IMU,
    ODOMETRY,
    Gathered,
    RawScan,
    SensorLog,
    Stamp,
    content,
    head,
    odometry_of,
    straightened,
)
from cobodeck.logs.mrpt.archive import objects
from cobodeck.logs.mrpt.archive_reader import header_at
from cobodeck.logs.mrpt.mrpt_sensors import (
    BY_WHEELS,
    Inertial,
    Movement,
    RangeScan,
    RobotPose,
    WheelReadings,
)
from hw import ImuReading, Pose2, Pose3

_MAPS = ("CSimpleMap", "CSensFrameProbSequence")
_FRAMES = ("CSensoryFrame", "CSensorialFrame")
STOOD_IN = "it has no odometry: its corrected poses are used instead"


def is_rawlog(path: Path) -> bool:
    """True if the file begins like an MRPT archive."""
    return header_at(head(path, 256), 0) is not None


def read_rawlog(path: Path) -> SensorLog:
    """Read a rawlog or a simplemap.

    Raises:
        FileError: it cannot be read, or holds nothing usable.
    """
    data, broken = content(path)
    first = header_at(data, 0)
    is_map = first is not None and first.kind in _MAPS
    gathered = Gathered(path, "MRPT simplemap" if is_map else "MRPT rawlog")
    if broken is not None:
        gathered.remark(broken)
    row = _Row(gathered)
    for found in objects(data, gathered.remark):
        row.add_object(found.kind, found.value)
    row.close()
    return gathered.finished()


@dataclass(frozen=True, slots=True)
class _Seen:
    """A scan, the number of its sensory frame, its pose from movements, and the corrected one."""

    scan: RangeScan
    frame: int
    reckoned: Pose2
    corrected: Pose2 | None


@dataclass(slots=True)
class _Row:
    """Collects the objects; stamps are assigned once all objects are read."""

    gathered: Gathered
    seen: list[_Seen | WheelReadings | Inertial | RobotPose] = field(default_factory=list)
    frame: int = 0
    moves: list[Movement] | None = None
    reckoned: Pose2 = field(default_factory=lambda: Pose2(0.0, 0.0))
    corrected: Pose2 | None = None

    def add_object(self, kind: str, value: Any) -> None:
        """Take the next object."""
        if kind in _FRAMES:
            self.frame += 1
            self._moved()
        elif isinstance(value, Movement):
            self.moves = [*(self.moves or []), value]
        elif isinstance(value, Pose2 | Pose3):
            self.corrected = value.flat() if isinstance(value, Pose3) else value
        elif isinstance(value, RangeScan):
            self._moved()
            self.seen.append(_Seen(value, self.frame, self.reckoned, self.corrected))
        elif isinstance(value, WheelReadings | Inertial | RobotPose):
            if value.stamp_ns is None:
                self.gathered.remark(f"{type(value).__name__} without a stamp was left out")
            else:
                self.seen.append(value)

    def _moved(self) -> None:
        """Apply the movement since the last frame; of several estimates, that of the wheels."""
        if self.moves:
            move = next((m for m in self.moves if m.source == BY_WHEELS), self.moves[0])
            self.reckoned = self.reckoned @ move.step
            self.moves = []

    def close(self) -> None:
        """Put all objects into the log, with stamps."""
        stamps = straightened([_stamp(one) for one in self.seen], self.gathered.remark)
        wheels: list[tuple[int, Pose2]] = []
        poses: dict[int, tuple[int, Pose2]] = {}
        for stamp, one in zip(stamps, self.seen, strict=True):
            if stamp is None:
                continue
            if isinstance(one, WheelReadings):
                wheels.append((stamp, one.odom_from_base))
            elif isinstance(one, RobotPose):
                self.gathered.refer(stamp, one.pose.flat())
            elif isinstance(one, Inertial):
                self.gathered.add_sample(IMU, stamp, _in_base(one))
            else:
                self._seen(stamp, one, poses)
        if self.moves is None and poses and not wheels:
            self.gathered.remark(STOOD_IN)
        for stamp, odometry in odometry_of(wheels or poses.values()):
            self.gathered.add_sample(ODOMETRY, stamp, odometry)

    def _seen(self, stamp: int, one: _Seen, poses: dict[int, tuple[int, Pose2]]) -> None:
        """Put a scan; the pose of its frame goes to `poses`, by the frame's number."""
        self._scan(stamp, one.scan)
        if one.corrected is not None:
            self.gathered.refer(stamp, one.corrected)
        pose = one.corrected if self.moves is None else one.reckoned
        if pose is not None:
            poses.setdefault(one.frame, (stamp, pose))

    def _scan(self, stamp: int, scan: RangeScan) -> None:
        side = 1.0 if scan.right_to_left else -1.0
        start = -0.5 * side * scan.aperture
        step = side * scan.aperture / max(1, len(scan.ranges) - 1)
        checked = zip(scan.ranges, scan.valid, strict=True)
        ranges = [r if valid else math.inf for r, valid in checked]
        label, mount = scan.label or "laser", scan.base_from_sensor
        self.gathered.scan(stamp, RawScan(label, mount, start, step, ranges, scan.max_range))


def _stamp(one: _Seen | WheelReadings | Inertial | RobotPose) -> Stamp:
    """The stamp of an object; scanners with the same label are told apart by their mounts."""
    if isinstance(one, _Seen):
        mount = one.scan.base_from_sensor
        name = f"{one.scan.label or 'laser'} at {mount.x:g}, {mount.y:g} m, {mount.yaw:g} rad"
        return Stamp(name, one.scan.stamp_ns, is_scan=True)
    return Stamp(type(one).__name__, one.stamp_ns)


def _in_base(found: Inertial) -> ImuReading:
    """An inertial reading in the base frame."""
    turn = found.base_from_sensor
    turn = Pose3(0.0, 0.0, 0.0, turn.qx, turn.qy, turn.qz, turn.qw)
    reading = found.reading
    return ImuReading(turn.transform(*reading.rates), turn.transform(*reading.accelerations))
