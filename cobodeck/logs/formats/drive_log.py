"""A sensor log in the common form: samples of our own types, in order of their stamps."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import NamedTuple

from engine.files import mistake
from hw import STILL, Odometry, Pose2, Pose3, Sample, Scan, is_finite, velocity_of
from hw.model import ImuModel, LidarModel, Mount, OdometryModel, Sensing
from hw.scene import Room

SCAN, ODOMETRY, IMU, TRACKER = "base.scan", "base.odometry", "base.imu", "rover.tracker"
_ORDER = (ODOMETRY, IMU, TRACKER, SCAN)
"""Order of samples with equal stamps: motion before scans, which are taken after it."""
_LEAST_UPRIGHT = math.cos(math.radians(5.0))
"""Cosine of the largest accepted tilt; sensors tilted more do not measure in the map's plane."""
_WIDEST = 2.0 * math.pi * 1.02
"""Widest field of view, rad: some scanners repeat the first beams of a circle."""
_SAME = 1e-3
"""Mounts that differ by less than this, m and rad, count as the same."""
_MOVED, _LOOKS = 0.3, 20
"""By so many m the median beam of a scanner that stands may differ, over so many scans."""


class ReferencePose(NamedTuple):
    """A corrected pose from the log, map_from_base."""

    stamp_ns: int
    pose: Pose2


@dataclass(frozen=True, slots=True)
class SensorLog:
    """The content of a log.

    Attributes:
        path: the file or folder.
        form: format of the log, in words.
        samples: `base.odometry`, `base.scan`, `base.imu` and `rover.tracker`; stamps count from
            the first one, in ns.
        sensing: scanners with their mounts, and other sensors present.
        reference: corrected or true poses in order; may be empty.
        remarks: what was left out and why.
        room: the room of the log, where it is known.
        assumed: by sensor, the remark that its mount is not in the log.
    """

    path: Path
    form: str
    samples: tuple[Sample, ...]
    sensing: Sensing
    reference: tuple[ReferencePose, ...] = ()
    remarks: tuple[str, ...] = ()
    room: Room | None = None
    assumed: Mapping[str, str] = field(default_factory=dict)

    def count(self, name: str) -> int:
        """Number of samples with a name."""
        return sum(sample.name == name for sample in self.samples)

    @property
    def duration(self) -> float:
        """Time from the first sample to the last, s."""
        return self.samples[-1].stamp_ns / 1e9

    def mounted(self, mounts: Mapping[str, Pose2]) -> SensorLog:
        """The same log with other mounts of its scanners, by name; "" is that of its only one.

        Raises:
            FileError: it has no such scanner, or several.
        """
        lidars, assumed = dict(self.sensing.lidars), dict(self.assumed)
        names = f"its scanners are {', '.join(sorted(lidars))}" if lidars else "it has no scanners"
        for given, at in mounts.items():
            name = given or (next(iter(lidars)) if len(lidars) == 1 else "")
            if name not in lidars:
                which = f"has no scanner {given!r}" if given else "has not one scanner"
                raise mistake(self.path, f"{which}: {names}", hint="NAME=X,Y,YAW names one")
            mount = replace(lidars[name].mount, x=at.x, y=at.y, yaw=at.yaw)
            lidars[name] = replace(lidars[name], mount=mount)
            assumed.pop(name, None)
        gone = {text for text in self.assumed.values() if text not in assumed.values()}
        return replace(
            self,
            sensing=replace(self.sensing, lidars=lidars),
            remarks=tuple(text for text in self.remarks if text not in gone),
            assumed=assumed,
        )


@dataclass(frozen=True, slots=True)
class RawScan:
    """A scan as logged: beam i is at start + i * step, rad, in the sensor's frame.

    Ranges below `min_range`, or at `max_range` and beyond, are no measurements; m.
    """

    label: str
    base_from_sensor: Pose3
    start: float
    step: float
    ranges: Sequence[float]
    max_range: float
    min_range: float = 0.0
    beam_time: float = 0.0

    @property
    def wrong(self) -> str | None:
        """Why the scan cannot be used, in words."""
        if len(self.ranges) < 2:
            return "without beams"
        if not 0.0 < abs(self.step) * (len(self.ranges) - 1) < _WIDEST:
            return f"an angle_increment of {self.step:g} rad with {len(self.ranges)} beams"
        if not self.min_range < self.max_range:
            return f"a range_min of {self.min_range:g} m and a range_max of {self.max_range:g} m"
        return None

    def model(self) -> LidarModel:
        """The model of a scanner with such scans; its rate is set later."""
        at = self.base_from_sensor
        view = abs(self.step) * (len(self.ranges) - 1)
        mount = Mount(at.x, at.y, at.z, at.yaw)
        return LidarModel(mount, len(self.ranges), view, 1.0, self.min_range, self.max_range)


@dataclass(slots=True)
class Gathered:
    """What a reader has found so far, in any order; stamps in ns, of any clock.

    `sensing` and `room` are those of the robot and scene files, where the log has them; else
    `sensing` is derived from the samples.
    """

    path: Path
    form: str
    samples: list[Sample] = field(default_factory=list)
    reference: list[ReferencePose] = field(default_factory=list)
    lidars: dict[str, LidarModel] = field(default_factory=dict)
    remarks: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    assumed: dict[str, str] = field(default_factory=dict)
    sensing: Sensing | None = None
    room: Room | None = None

    def add_sample(self, name: str, stamp_ns: int, value: object) -> None:
        """Take a sample; one with NaN or infinite numbers is left out, with a remark."""
        if is_finite(value):
            self.samples.append(Sample(name, stamp_ns, value))
        else:
            self.remark(f"{name} with NaN or infinite numbers was left out")

    def refer(self, stamp_ns: int, pose: Pose2) -> None:
        """Take a corrected pose."""
        if is_finite(pose):
            self.reference.append(ReferencePose(stamp_ns, pose))

    def scan(self, stamp_ns: int, raw: RawScan) -> None:
        """Take a scan; tilted, empty and impossible ones are left out, with a remark."""
        up = _upright(raw.base_from_sensor)
        wrong = "it is tilted" if abs(up) < _LEAST_UPRIGHT else raw.wrong
        if wrong is not None:
            self.remark(f"scans of {raw.label} were left out: {wrong}")
            return
        side = 1.0 if up > 0.0 else -1.0  # if mounted upside down it scans in the opposite sense
        ranges = in_range(raw.ranges, raw.min_range, raw.max_range)
        name = self._scanner(raw)
        self.add_sample(
            SCAN, stamp_ns, Scan(name, side * raw.start, side * raw.step, ranges, raw.beam_time)
        )

    def _scanner(self, raw: RawScan) -> str:
        """The name of the scanner with this mount; scanners with the same label are numbered."""
        mount = raw.base_from_sensor.flat()
        for number in range(1, len(self.lidars) + 2):
            name = raw.label if number == 1 else f"{raw.label}_{number}"
            known = self.lidars.get(name)
            if known is None:
                self.lidars[name] = raw.model()
                return name
            if is_same(known.mount.flat, mount):
                return name
        raise AssertionError("one of the names is free")

    def assume(self, sensor: str, text: str) -> None:
        """Add a remark that the mount of a sensor is not known."""
        hint = "" if sensor == IMU else f"; --scan-mount {sensor}=X,Y,YAW gives it"
        self.assumed.setdefault(sensor, text + hint)

    def remark(self, text: str) -> None:
        """Add a remark; repeated ones are counted."""
        self.remarks[text] += 1

    def finished(self) -> SensorLog:
        """The finished log.

        Raises:
            FileError: it holds nothing usable.
        """
        told = [t if n == 1 else f"{t} ({n} times)" for t, n in self.remarks.items()]
        remarks = (*told, *dict.fromkeys(self.assumed.values()))
        if not self.samples:
            why = remarks[0] if remarks else "no scans, no odometry, no inertial readings"
            raise mistake(self.path, f"is a {self.form} without usable data: {why}")
        rank = {name: number for number, name in enumerate(_ORDER)}
        ordered = sorted(self.samples, key=lambda s: (s.stamp_ns, rank[s.name]))
        if _stand_while_scans_move(ordered):
            remarks += ("odometry never moves, though the scans do: it was left out",)
            ordered = [sample for sample in ordered if sample.name != ODOMETRY]
        start = ordered[0].stamp_ns
        samples = tuple(Sample(s.name, s.stamp_ns - start, s.value) for s in ordered)
        poses = {ref.stamp_ns - start: ref.pose for ref in self.reference}
        sensing = self.sensing or self._sensing(samples)
        reference = tuple(ReferencePose(at, poses[at]) for at in sorted(poses))
        return SensorLog(
            self.path, self.form, samples, sensing, reference, remarks, self.room, self.assumed
        )

    def _sensing(self, samples: Sequence[Sample]) -> Sensing:
        stamps: dict[str, list[int]] = defaultdict(list)
        for sample in samples:
            name = sample.value.sensor if isinstance(sample.value, Scan) else sample.name
            stamps[name].append(sample.stamp_ns)
        rates = {name: _rate(found) for name, found in stamps.items()}
        lidars = {
            name: replace(model, rate=rates[name])
            for name, model in self.lidars.items()
            if name in rates
        }
        odometry = OdometryModel(rates[ODOMETRY]) if ODOMETRY in rates else None
        imu = ImuModel(rates[IMU]) if IMU in rates else None
        return Sensing(lidars, {}, odometry, imu)


def _stand_while_scans_move(samples: Sequence[Sample]) -> bool:
    """True if the odometry is constant, but scans of a sensor differ by more than people explain.

    The median beam of a standing scanner keeps its length; `_LOOKS` scans are compared.
    """
    if len({s.value.pose for s in samples if isinstance(s.value, Odometry)}) != 1:
        return False
    scans: dict[str, list[Scan]] = defaultdict(list)
    for sample in samples:
        if isinstance(sample.value, Scan):
            scans[sample.value.sensor].append(sample.value)
    return any(_differ(found) for found in scans.values())


def _differ(scans: Sequence[Scan]) -> bool:
    first = scans[0]
    some = scans[:: math.ceil(len(scans) / _LOOKS)]
    for other in some:
        off = [
            abs(a - b)
            for a, b in zip(first.ranges, other.ranges, strict=False)
            if a < math.inf and b < math.inf
        ]
        if off and median(off) > _MOVED:
            return True
    return False


def is_same(one: Pose2, other: Pose2) -> bool:
    """True if two mounts differ by `_SAME` at most."""
    return one.is_near(other, _SAME, _SAME)


def _rate(stamps: Sequence[int]) -> float:
    gaps = [after - before for before, after in pairwise(stamps) if after > before]
    return 1e9 / median(gaps) if gaps else 1.0


def in_range(ranges: Iterable[float], low: float, high: float) -> tuple[float, ...]:
    """Ranges, m; inf where there is no measurement: NaN, 0, below `low`, at or above `high`."""
    least = max(low, 1e-6)
    return tuple(r if least <= r < high else math.inf for r in ranges)


def _upright(pose: Pose3) -> float:
    """Vertical component of the sensor's z axis: 1 upright, -1 upside down."""
    return 1.0 - 2.0 * (pose.qx * pose.qx + pose.qy * pose.qy)


def odometry_of(poses: Iterable[tuple[int, Pose2]]) -> list[tuple[int, Odometry]]:
    """Odometry in order of stamps, with velocities from differences of poses."""
    found: list[tuple[int, Odometry]] = []
    for stamp, pose in sorted(poses, key=lambda one: one[0]):
        if not is_finite(pose) or (found and stamp == found[-1][0]):
            continue
        twist = STILL
        if found:
            before, known = found[-1]
            twist = velocity_of(known.pose.inverse() @ pose, (stamp - before) / 1e9)
        found.append((stamp, Odometry(pose, twist)))
    return found
