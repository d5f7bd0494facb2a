"""A sensor log: what sensors said, in the product's own samples, in the order of their stamps."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import NamedTuple

from engine.files.finding import mistake
from hw.finite import is_finite
from hw.geometry import STILL, Pose2, Pose3, wrap
from hw.room import Room
from hw.samples import Odometry, Sample, Scan
from hw.sensing import ImuModel, LidarModel, Mount, OdometryModel, Sensing
from states.localization.trail import velocity_of

SCAN, ODOMETRY, IMU, TRACKER = "base.scan", "base.odometry", "base.imu", "rover.tracker"
_ORDER = (ODOMETRY, IMU, TRACKER, SCAN)
"""Of samples with one stamp the motion comes first: a scan is seen from where it has led to."""
_UNSTAMPED_NS = 100_000_000
"""From scan to scan of a log that says nothing of time."""
_LEAST_UPRIGHT = math.cos(math.radians(5.0))
"""Sensors that are tilted by more than 5 degrees do not see the map."""
_SAME = 1e-3
"""Mounts that differ by less, m and rad, are one."""


class ReferencePose(NamedTuple):
    """Where the base was, as the log's maker has corrected it: map_from_base."""

    stamp_ns: int
    pose: Pose2


@dataclass(frozen=True, slots=True)
class SensorLog:
    """What was read of a log.

    Attributes:
        path: the file or folder.
        form: what kind of log it is, in words.
        samples: `base.odometry`, `base.scan`, `base.imu` and `rover.tracker`; stamps count from
            the first one, in ns.
        sensing: the scanners with their mounts, and which other sensors there are.
        reference: corrected or true poses, in order; empty where there are none.
        remarks: what was left out, and why.
        room: in which the log was made, where it says so.
    """

    path: Path
    form: str
    samples: tuple[Sample, ...]
    sensing: Sensing
    reference: tuple[ReferencePose, ...] = ()
    remarks: tuple[str, ...] = ()
    room: Room | None = None

    def count(self, name: str) -> int:
        """How many samples of a name there are."""
        return sum(sample.name == name for sample in self.samples)

    @property
    def duration(self) -> float:
        """From the first sample to the last, s."""
        return self.samples[-1].stamp_ns / 1e9


@dataclass(frozen=True, slots=True)
class RawScan:
    """A scan as a log has it: beam i is at start + i * step, rad, in the sensor's frame.

    What is nearer than `min_range`, at `max_range` or farther is no measurement; m.
    """

    label: str
    base_from_sensor: Pose3
    start: float
    step: float
    ranges: Sequence[float]
    max_range: float
    min_range: float = 0.0
    beam_time: float = 0.0

    def model(self) -> LidarModel:
        """The scanner that makes such scans; how often is not known yet."""
        at = self.base_from_sensor
        view = abs(self.step) * (len(self.ranges) - 1)
        mount = Mount(at.x, at.y, at.z, at.yaw)
        return LidarModel(mount, len(self.ranges), view, 1.0, self.min_range, self.max_range)


@dataclass(slots=True)
class Gathered:
    """What a reader has found so far, in any order; stamps in ns of any clock.

    `sensing` is that of a robot file, where the log has one; else it is told by the samples.
    `room` is that of its scene.
    """

    path: Path
    form: str
    samples: list[Sample] = field(default_factory=list)
    reference: list[ReferencePose] = field(default_factory=list)
    lidars: dict[str, LidarModel] = field(default_factory=dict)
    remarks: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    sensing: Sensing | None = None
    room: Room | None = None

    def put(self, name: str, stamp_ns: int, value: object) -> None:
        """Take a sample; one with numbers that are none is left out, and told."""
        if is_finite(value):
            self.samples.append(Sample(name, stamp_ns, value))
        else:
            self.remark(f"{name} with numbers that are none was left out")

    def refer(self, stamp_ns: int, pose: Pose2) -> None:
        """Take a corrected pose."""
        if is_finite(pose):
            self.reference.append(ReferencePose(stamp_ns, pose))

    def scan(self, stamp_ns: int, raw: RawScan) -> None:
        """Take a scan; of one that is tilted it is told that it was left out."""
        up = _upright(raw.base_from_sensor)
        if abs(up) < _LEAST_UPRIGHT:
            self.remark(f"scans of {raw.label} were left out: it is tilted")
            return
        if len(raw.ranges) < 2:
            self.remark(f"scans of {raw.label} without beams were left out")
            return
        side = 1.0 if up > 0.0 else -1.0  # hanging upside down it turns the other way round
        ranges = in_range(raw.ranges, raw.min_range, raw.max_range)
        name = self._scanner(raw)
        self.put(
            SCAN, stamp_ns, Scan(name, side * raw.start, side * raw.step, ranges, raw.beam_time)
        )

    def _scanner(self, raw: RawScan) -> str:
        """The name of the scanner with this mount; scanners of one label are numbered."""
        mount = raw.base_from_sensor.flat()
        for number in range(1, len(self.lidars) + 2):
            name = raw.label if number == 1 else f"{raw.label}_{number}"
            known = self.lidars.get(name)
            if known is None:
                self.lidars[name] = raw.model()
                return name
            at = known.mount.flat
            if at.distance_to(mount) < _SAME and abs(wrap(at.yaw - mount.yaw)) < _SAME:
                return name
        raise AssertionError("one of the names is free")

    def remark(self, text: str) -> None:
        """Something to be told; the same is told once, with how often it was."""
        self.remarks[text] += 1

    def finished(self) -> SensorLog:
        """The log.

        Raises:
            FileError: nothing in it is of use.
        """
        told = tuple(t if n == 1 else f"{t} ({n} times)" for t, n in self.remarks.items())
        if not self.samples:
            why = told[0] if told else "no scans, no odometry, no inertial readings"
            raise mistake(self.path, f"is a {self.form} without anything to go by: {why}")
        rank = {name: number for number, name in enumerate(_ORDER)}
        ordered = sorted(self.samples, key=lambda s: (s.stamp_ns, rank[s.name]))
        start = ordered[0].stamp_ns
        samples = tuple(Sample(s.name, s.stamp_ns - start, s.value) for s in ordered)
        poses = {ref.stamp_ns - start: ref.pose for ref in self.reference}
        sensing = self.sensing or self._sensing(samples)
        reference = tuple(ReferencePose(at, poses[at]) for at in sorted(poses))
        return SensorLog(self.path, self.form, samples, sensing, reference, told, self.room)

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


def _rate(stamps: Sequence[int]) -> float:
    gaps = [after - before for before, after in pairwise(stamps) if after > before]
    return 1e9 / median(gaps) if gaps else 1.0


def numbered_stamps(stamps: Sequence[int | None]) -> list[int]:
    """Stamps as they are; where any is unknown, all are made up: ten in a second."""
    known = [stamp for stamp in stamps if stamp is not None]
    if len(known) == len(stamps):
        return known
    return [number * _UNSTAMPED_NS for number in range(len(stamps))]


def in_range(ranges: Iterable[float], low: float, high: float) -> tuple[float, ...]:
    """Ranges in m; inf for whatever is no measurement: NaN, 0, below `low`, `high` and above."""
    least = max(low, 1e-6)
    return tuple(r if least <= r < high else math.inf for r in ranges)


def _upright(pose: Pose3) -> float:
    """How far up the sensor's z axis points: 1 upright, -1 upside down."""
    return 1.0 - 2.0 * (pose.qx * pose.qx + pose.qy * pose.qy)


def odometry_of(poses: Iterable[tuple[int, Pose2]]) -> list[tuple[int, Odometry]]:
    """Odometry in the order of stamps, with the velocities that its poses tell."""
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
