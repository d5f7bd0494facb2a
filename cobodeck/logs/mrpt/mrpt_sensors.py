"""Sensor readings and movements in MRPT archives, in every version ever written."""

from __future__ import annotations

from dataclasses import dataclass

from cobodeck.logs.mrpt.archive_reader import ArchiveReader, Kinds
from hw import ImuReading, Pose2, Pose3

BY_WHEELS = 0
"""The code of movements measured by wheels; others were estimated from scans."""
_STEP_NS = 100


@dataclass(frozen=True, slots=True)
class RangeScan:
    """A planar scan; beams are spread evenly over `aperture`, rad, the middle one ahead."""

    stamp_ns: int | None
    label: str
    base_from_sensor: Pose3
    aperture: float
    right_to_left: bool
    max_range: float
    ranges: tuple[float, ...]
    valid: bytes


@dataclass(frozen=True, slots=True)
class Movement:
    """Movement of the base since the previous sensory frame: its pose relative to that frame."""

    source: int
    step: Pose2


@dataclass(frozen=True, slots=True)
class WheelReadings:
    """The pose of the base from wheel odometry."""

    stamp_ns: int | None
    odom_from_base: Pose2


@dataclass(frozen=True, slots=True)
class Inertial:
    """An inertial reading in the sensor's frame, with its mount."""

    stamp_ns: int | None
    base_from_sensor: Pose3
    reading: ImuReading


@dataclass(frozen=True, slots=True)
class RobotPose:
    """The pose of the base from another source, map_from_base."""

    stamp_ns: int | None
    pose: Pose3


def _stamp(ticks: int) -> int | None:
    """Stamp, ns, from ticks of 100 ns since the year 1601; 0 means unknown."""
    return ticks * _STEP_NS if ticks else None


def _scan(reader: ArchiveReader, version: int) -> RangeScan:
    aperture, right_to_left, max_range = reader.numbers("fBf")
    mount = reader.part()
    if version < 6:
        reader.part()
    count = reader.count(4)
    ranges = reader.numbers(f"{count}f")
    valid = reader.read(count) if version >= 1 else b"\1" * count
    if version >= 2:
        reader.number("f")
    ticks = reader.number("Q") if version >= 3 else 0
    if version >= 4:
        reader.number("f")
    label = ""
    if version >= 5:
        label = reader.text()
        reader.number("d")
    if version >= 7 and reader.number("B"):
        reader.numbers(f"{count}i")
    return RangeScan(
        _stamp(ticks), label, mount, aperture, right_to_left != 0, max_range, ranges, valid
    )


def _wheels(reader: ArchiveReader, version: int) -> WheelReadings:
    pose = reader.part()
    reader.text()
    ticks = reader.number("Q")
    if version >= 1:
        if reader.number("B") or version < 2:
            reader.numbers("2i")
        _pass_velocities(reader, conditional=version >= 2)
    return WheelReadings(_stamp(ticks), pose)


def _pass_velocities(reader: ArchiveReader, conditional: bool) -> None:
    """Skip velocities: poses give them too, and old writers left their flag uninitialised."""
    known = reader.number("B")
    if conditional:
        reader.read(24 if known else 0)
    else:
        reader.read(8)


def _movement(reader: ArchiveReader, version: int) -> Movement:
    source = BY_WHEELS
    if version < 2:
        step = reader.part()
        source = reader.number("I")
    else:
        source = reader.number("I")
        step = reader.part()
        if source == BY_WHEELS:
            reader.read(_MODEL_BYTES[min(version, 5)])
    if version >= 1:
        _pass_velocities(reader, conditional=version >= 7)
        if reader.number("B") or version < 7:
            reader.numbers("2i")
    reader.read(8 if version >= 6 else 0)
    return Movement(source, step)


_MODEL_BYTES = {2: 44, 3: 4 + 5 * 4 + 4 + 4 * 4, 4: 4 + 6 * 4 + 4 + 4 * 4, 5: 4 + 6 * 4 + 4 + 6 * 4}
"""Size of the motion model's parameters, bytes, by version."""


def _movement3(reader: ArchiveReader, version: int) -> Movement:
    source = reader.number("I")
    step: Pose3 = reader.part()
    reader.read(reader.count(1))
    reader.numbers(f"{reader.count(4)}f")
    reader.read(8 if version >= 1 else 0)
    return Movement(source, step.flat())


def _inertial(reader: ArchiveReader, version: int) -> Inertial:
    mount = reader.part()
    if version >= 4:
        count = 31
        present = reader.read(count)
    else:
        present = reader.read(reader.count(1))
    ticks = reader.number("Q")
    if version < 4:
        count = reader.count(4 if version == 0 else 8)
    values = reader.numbers(f"{count}{'f' if version == 0 else 'd'}")
    reader.text()
    known = [value if n < len(present) and present[n] else 0.0 for n, value in enumerate(values)]
    ax, ay, az, yaw, pitch, roll = (*known, *[0.0] * 6)[:6]
    if version < 2:
        yaw, roll = roll, yaw
    return Inertial(_stamp(ticks), mount, ImuReading((roll, pitch, yaw), (ax, ay, az)))


def _robot_pose(reader: ArchiveReader, version: int) -> RobotPose:
    pose = reader.part()
    reader.text()
    ticks = reader.number("Q")
    if version >= 1:
        reader.part()
    return RobotPose(_stamp(ticks), pose)


def _comment(reader: ArchiveReader, _version: int) -> str:
    text = reader.text()
    reader.number("Q")
    return text


SENSORS: Kinds = {
    "CObservation2DRangeScan": _scan,
    "CObservationOdometry": _wheels,
    "CObservationIMU": _inertial,
    "CObservationRobotPose": _robot_pose,
    "CObservationComment": _comment,
    "CActionRobotMovement2D": _movement,
    "CActionRobotMovement3D": _movement3,
}
