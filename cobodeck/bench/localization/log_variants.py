"""Variants of a log, by seeded functions: slipping wheels, fewer scans, gaps, stamps in bunches.

Each takes a drive, its value and random numbers, and returns another drive with the same map and,
scan by scan, the same true poses; None if the log is too short for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from cobodeck.logs import Ground, reference_of, scans_of
from cobodeck.logs.formats import ODOMETRY, SCAN, SensorLog, odometry_of
from hw import Odometry, Pose2, Sample

SCALE, SCALE_SIGMA, SIDEWAYS_SIGMA, TURN_SIGMA = 0.02, 0.05, 0.03, 0.05
"""Slip: mean and standard deviation of the way, of the way sideways and of the turn; shares."""
YAW_SIGMA = math.radians(1.5)
"""Slip: standard deviation of the yaw after 1 m, rad; it grows with the root of the way."""
FLOOR_M = 0.5
"""Way over which a floor makes wheels slip alike, m."""
SQUEEZED = 1e-3
"""Time between the samples of a bunch, as a share of what it was."""
GAP_SPREAD = 1.0 / 3.0
"""Gaps are longer or shorter than asked by up to this share."""
GAP_SHARE = 0.15
"""Share of a log that gaps leave out."""


@dataclass(frozen=True, slots=True, eq=False)
class LogDrive:
    """The scored scans of a log, with the map and, for each scan, the corrected map_from_base."""

    log: SensorLog
    ground: Ground
    truth: tuple[Pose2 | None, ...]


Variant = Callable[[LogDrive, float, np.random.Generator], LogDrive | None]


def drive_of(log: SensorLog, ground: Ground) -> LogDrive:
    """The part of a log that is scored; wheels begin after the scan before."""
    begin = min(ground.scored, default=0) - 1
    numbered = list(zip(_scans_so_far(log.samples), log.samples, strict=True))
    samples = tuple(
        sample
        for number, sample in numbered
        if (number in ground.scored if sample.name == SCAN else number >= begin)
    )
    cut = replace(log, samples=samples)
    truth = tuple(map(reference_of(log), (seen.stamp_ns for seen in scans_of(cut))))
    return LogDrive(cut, replace(ground, scored=frozenset(range(len(truth)))), truth)


def slip(drive: LogDrive, factor: float, rng: np.random.Generator) -> LogDrive:
    """Wheels that follow the corrected path, with `factor` times the slip of the values above.

    Wheel samples at whose stamps there is no corrected pose are left out.
    """
    reference = reference_of(drive.log)
    path = [
        (sample.stamp_ns, pose)
        for sample in drive.log.samples
        if isinstance(sample.value, Odometry) and (pose := reference(sample.stamp_ns)) is not None
    ]
    odom = Pose2(0.0, 0.0)
    poses = [(path[0][0], odom)]
    way, floor = 0.0, rng.standard_normal(4).tolist()
    for (_, before), (stamp_ns, after) in pairwise(path):
        moved = before.inverse() @ after
        length = math.hypot(moved.x, moved.y)
        way += length
        if way > FLOOR_M:
            way, floor = length, rng.standard_normal(4).tolist()
        scale = 1.0 + factor * (SCALE + SCALE_SIGMA * floor[0])
        aside = factor * SIDEWAYS_SIGMA * floor[1] * length
        turn = moved.yaw * (1.0 + factor * TURN_SIGMA * floor[2])
        turn += factor * YAW_SIGMA * floor[3] * length / math.sqrt(max(length, FLOOR_M))
        odom = odom @ Pose2(scale * moved.x, scale * moved.y + aside, turn)
        poses.append((stamp_ns, odom))
    wheels = [Sample(ODOMETRY, stamp, value) for stamp, value in odometry_of(poses)]
    return _with(drive, [s for s in drive.log.samples if s.name != ODOMETRY] + wheels)


def thin(drive: LogDrive, every: float, _rng: np.random.Generator) -> LogDrive:
    """Every n-th scan; wheel samples with the very stamps of the others are left out, too."""
    numbered = list(zip(_scans_so_far(drive.log.samples), drive.log.samples, strict=True))
    gone = {s.stamp_ns for number, s in numbered if s.name == SCAN and number % round(every)}
    return _without(drive, lambda stamp_ns: stamp_ns in gone)


def gap(drive: LogDrive, seconds: float, rng: np.random.Generator) -> LogDrive | None:
    """Whole stretches of about so many seconds left out, all samples; the base moves on in them."""
    stamps = [sample.stamp_ns for sample in drive.log.samples]
    duration = (stamps[-1] - stamps[0]) * 1e-9
    count = math.floor(GAP_SHARE * duration / seconds)
    if count == 0:
        return None
    slot = duration / count
    lengths = seconds * rng.uniform(1.0 - GAP_SPREAD, 1.0 + GAP_SPREAD, count)
    begins = slot * (np.arange(count) + rng.uniform(0.1, 0.7, count))
    gaps = [
        (stamps[0] + round(begin * 1e9), stamps[0] + round((begin + length) * 1e9))
        for begin, length in zip(begins, lengths, strict=True)
    ]
    return _without(drive, lambda stamp_ns: any(a < stamp_ns < b for a, b in gaps))


def bunched(drive: LogDrive, count: float, _rng: np.random.Generator) -> LogDrive:
    """Stamps as of a logger that writes `count` scans at once: all just before the last one's."""
    scans = [sample.stamp_ns for sample in drive.log.samples if sample.name == SCAN]
    ends = scans[round(count) - 1 :: round(count)]

    def at(stamp_ns: int) -> int:
        bunch = int(np.searchsorted(ends, stamp_ns))
        if bunch == len(ends):
            return stamp_ns
        return ends[bunch] - round(SQUEEZED * (ends[bunch] - stamp_ns))

    return _with(drive, [s._replace(stamp_ns=at(s.stamp_ns)) for s in drive.log.samples])


def late(drive: LogDrive, seconds: float, _rng: np.random.Generator) -> LogDrive:
    """Wheels whose stamps are late against those of the scans; early if negative."""
    off_ns = round(seconds * 1e9)
    shifted = [
        s._replace(stamp_ns=s.stamp_ns + off_ns) if s.name == ODOMETRY else s
        for s in drive.log.samples
    ]
    return _with(drive, [s for s in shifted if s.stamp_ns >= 0])


VARIANTS: dict[str, Variant] = {
    "slip": slip,
    "thin": thin,
    "gap": gap,
    "bunched": bunched,
    "late": late,
}
LEAST = {"slip": 0.0, "thin": 1.0, "gap": 1.0, "bunched": 1.0, "late": -60.0}
"""Least value of each."""
USUAL = (
    *(("slip", 1.0), ("slip", 2.0), ("slip", 3.0)),
    *(("thin", 2.0), ("thin", 3.0), ("gap", 30.0), ("bunched", 4.0)),
    *(("late", 0.2), ("late", -0.2)),
)
"""The variants of a whole table."""


def _scans_so_far(samples: Sequence[Sample]) -> Iterator[int]:
    """For each sample the number of the newest scan, its own if it is one; -1 before the first."""
    number = -1
    for sample in samples:
        number += sample.name == SCAN
        yield number


def _with(drive: LogDrive, samples: list[Sample]) -> LogDrive:
    """The drive with other samples, and the same scans, in order of stamps: wheels before scans."""
    ordered = sorted(samples, key=lambda one: (one.stamp_ns, one.name == SCAN))
    return replace(drive, log=replace(drive.log, samples=tuple(ordered)))


def _without(drive: LogDrive, gone: Callable[[int], bool]) -> LogDrive:
    """The drive without the samples of some stamps."""
    samples = drive.log.samples
    scans = [sample for sample in samples if sample.name == SCAN]
    truth = tuple(t for s, t in zip(scans, drive.truth, strict=True) if not gone(s.stamp_ns))
    kept = tuple(sample for sample in samples if not gone(sample.stamp_ns))
    ground = replace(drive.ground, scored=frozenset(range(len(truth))))
    return LogDrive(replace(drive.log, samples=kept), ground, truth)
