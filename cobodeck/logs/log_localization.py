"""Runs the localization on a log and computes its errors.

Without corrected poses the error measure is the median distance, per scan, from the ends of the
beams, as seen from the estimated pose, to the nearest wall.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from cobodeck.logs.formats import ODOMETRY, SCAN, SensorLog
from cobodeck.logs.mapped import Ground, reference_of
from cobodeck.logs.seen import SeenScan, scans_of
from hw import Odometry, Pose2, PoseSigma, Sample, displacement_of, velocity_of, wrap
from hw.model import Tracking
from states.localization import Localizer

_STEADY_NS = 100_000_000
"""Longest interval between odometry samples, ns; longer ones are interpolated."""
_GAP_NS = 3_000_000_000
"""Longest interval between odometry samples that is interpolated, ns: in a longer one the robot may
have stopped, turned and gone on, and an arc at constant velocity is no more likely than a rest."""
NEAR = 0.05
"""Median distance to walls below which a scan counts as well placed, m."""
OFF_CLOCK = 0.05
"""Offset between the clocks of wheels and scans from which it is told, s."""
LogClock = Callable[[], float]
Alignment = Literal["same", "aligned"]


@dataclass(frozen=True, slots=True)
class LocalizedScan:
    """The result of one scan.

    Attributes:
        stamp_ns: stamp of the pose, ns.
        pose: map_from_base, or None while it is unknown.
        sigma: its reported standard deviations.
        status: the localizer's status after the scan.
        wall: median distance of beam ends from the nearest wall, m; None without a pose.
        took: computing time of the scan, s.
        true: the corrected pose at that stamp, where there is one.
    """

    stamp_ns: int
    pose: Pose2 | None
    sigma: PoseSigma
    status: str
    wall: float | None
    took: float
    true: Pose2 | None = None

    @property
    def scored(self) -> bool:
        """True from when the base is found; a given start must first be confirmed by scans."""
        return self.pose is not None and self.status != "starting"

    @property
    def error(self) -> tuple[float, float] | None:
        """Difference from the corrected pose, m and rad; None without a corrected pose."""
        if self.pose is None or self.true is None:
            return None
        return self.pose.distance_to(self.true), abs(wrap(self.pose.yaw - self.true.yaw))


@dataclass(frozen=True, slots=True)
class Localized:
    """A log run through the localization.

    `frame`: how corrected poses relate to the map. `clock_offset`: how late the wheels' stamps are
    against the scans', s; None if their turns do not show it.
    """

    log: SensorLog
    ground: Ground
    start: Pose2 | None
    seed: int
    steps: tuple[LocalizedScan, ...]
    counts: Mapping[str, int]
    frame: Alignment = "same"
    clock_offset: float | None = None

    @property
    def remarks(self) -> list[str]:
        """What is worth a look: those of the log and of its map, and a clock that is off."""
        late, told = self.clock_offset, [*self.log.remarks, *self.ground.remarks]
        if late is None or abs(late) < OFF_CLOCK:
            return told
        which = "late" if late > 0.0 else "early"
        return [*told, f"stamps of the odometry are {abs(late):.2f} s {which}"]

    @property
    def walls(self) -> list[float]:
        """Median distances of beams to walls, by scan, m."""
        return [step.wall for step in self.steps if step.scored and step.wall is not None]

    @property
    def errors(self) -> list[tuple[float, float]]:
        """Differences from the corrected poses, m and rad."""
        return [step.error for step in self.steps if step.scored and step.error is not None]


def localize(
    log: SensorLog, ground: Ground, start: Pose2 | None, seed: int, clock: LogClock
) -> Localized:
    """Run the localization over a log.

    Args:
        log: the samples.
        ground: the map; the scans it was made from are withheld.
        start: start pose of the base; None if unknown.
        seed: of all random numbers.
        clock: returns the time, s, to measure computing times.
    """
    localizer = Localizer(ground.field, log.sensing, Tracking.of(log.sensing), start, seed)
    steps: list[LocalizedScan] = []
    scans, number = scans_of(log), -1
    begin = min(ground.scored, default=0) - 1
    for sample in with_steady_wheels(log.samples):
        number += sample.name == SCAN
        if number < begin and sample.name != SCAN and not steps:
            continue
        if sample.name == SCAN and number not in ground.scored:
            continue
        before = clock()
        localizer.update(sample.name, sample.stamp_ns, sample.value)
        took = clock() - before
        if sample.name == SCAN:
            steps.append(_step(localizer, scans[number], ground, took))
    steps, frame = _judged(steps, log, ground)
    counts, offset = dict(localizer.counts), localizer.clock_offset
    return Localized(log, ground, start, seed, tuple(steps), counts, frame, offset)


def with_steady_wheels(samples: Sequence[Sample]) -> list[Sample]:
    """The samples, with odometry interpolated where its samples are too far apart.

    Between two odometry samples the robot is assumed to move on an arc at constant velocity; gaps
    longer than `_GAP_NS` are left as they are.
    """
    wheels = [one for one in samples if isinstance(one.value, Odometry)]
    more = [new for before, after in pairwise(wheels) for new in _between(before, after)]
    return sorted((*more, *samples), key=lambda one: one.stamp_ns) if more else list(samples)


def _between(before: Sample, after: Sample) -> Iterator[Sample]:
    assert isinstance(before.value, Odometry)
    assert isinstance(after.value, Odometry)
    gap_ns = after.stamp_ns - before.stamp_ns
    parts = math.ceil(gap_ns / _STEADY_NS)
    if parts < 2 or gap_ns > _GAP_NS:
        return
    moved = before.value.pose.inverse() @ after.value.pose
    velocity = velocity_of(moved, gap_ns * 1e-9)
    for part in range(1, parts):
        since_ns = gap_ns * part // parts
        pose = before.value.pose @ displacement_of(velocity, since_ns * 1e-9)
        yield Sample(ODOMETRY, before.stamp_ns + since_ns, Odometry(pose, velocity))


def first_pose(ground: Ground) -> Pose2 | None:
    """Pose of the first scored scan in the map made from the log; None for other maps."""
    for one in ground.placed:
        if one.number in ground.scored:
            return one.pose
    return None


def _step(localizer: Localizer, seen: SeenScan, ground: Ground, took: float) -> LocalizedScan:
    pose, stamp = localizer.pose, localizer.stamp_ns
    status, sigma = localizer.status, localizer.sigma
    wall = None
    if pose is not None:
        distances = ground.field.distances(pose, seen.points)
        wall = float(np.median(distances)) if len(distances) else None
    return LocalizedScan(seen.stamp_ns if stamp is None else stamp, pose, sigma, status, wall, took)


def _judged(
    steps: Sequence[LocalizedScan], log: SensorLog, ground: Ground
) -> tuple[list[LocalizedScan], Alignment]:
    """The steps with corrected poses; those of another map are first aligned as a whole."""
    reference = reference_of(log)
    true = [reference(step.stamp_ns) for step in steps]
    pairs = [(s.pose, t) for s, t in zip(steps, true, strict=True) if s.pose and t]
    if ground.own or not pairs:
        return [replace(s, true=t) for s, t in zip(steps, true, strict=True)], "same"
    there = aligned([t for _, t in pairs], [p for p, _ in pairs])
    return [
        replace(s, true=None if t is None else there @ t) for s, t in zip(steps, true, strict=True)
    ], "aligned"


def aligned(poses: Sequence[Pose2], onto: Sequence[Pose2]) -> Pose2:
    """The rigid motion from `poses` to `onto`, by least squares of positions (Umeyama 1991).

    In the plane, with both sets centred, the angle is atan2(sum of cross products, sum of dot
    products). If the positions are within 0.1 m (RMS), the median difference of yaws is taken.
    """
    a = np.array([[pose.x, pose.y] for pose in poses])
    b = np.array([[pose.x, pose.y] for pose in onto])
    mean_a, mean_b = a.mean(axis=0), b.mean(axis=0)
    da, db = a - mean_a, b - mean_b
    sine = float((da[:, 0] * db[:, 1] - da[:, 1] * db[:, 0]).sum())
    cosine = float((da * db).sum())
    turned = [wrap(q.yaw - p.yaw) for p, q in zip(poses, onto, strict=True)]
    spread = math.sqrt(float((da * da).sum()) / len(a))
    yaw = math.atan2(sine, cosine) if spread > 0.1 else float(np.median(turned))
    x, y = Pose2(0.0, 0.0, yaw).transform(*mean_a.tolist())
    return Pose2(float(mean_b[0]) - x, float(mean_b[1]) - y, yaw)


def figures(found: Localized) -> dict[str, Any]:
    """The figures as JSON; m, rad, s."""
    ground, steps = found.ground, found.steps
    last = next((step.pose for step in reversed(steps) if step.pose), None)
    return {
        "log": str(found.log.path),
        "form": found.log.form,
        "duration_s": found.log.duration,
        "remarks": found.remarks,
        "clock_offset_s": found.clock_offset,
        "map": ground.source,
        "split": ground.split,
        "start": None if found.start is None else _numbers(found.start),
        "seed": found.seed,
        "scans": len(steps),
        "scored": sum(step.scored for step in steps),
        "without_pose": sum(step.pose is None for step in steps),
        "wall_distance_m": walls_figures(found.walls),
        "errors": error_figures(found),
        "status": dict(Counter(step.status for step in steps)),
        "counts": dict(found.counts),
        "time_per_scan_ms": time_figures([step.took for step in steps]),
        "final_pose": None if last is None else _numbers(last),
        "trajectory": [_row(step) for step in steps],
    }


def walls_figures(walls: Sequence[float]) -> dict[str, float] | None:
    """Statistics of the scans' median distances from beam ends to walls, m."""
    if not walls:
        return None
    return {
        "median": float(np.median(walls)),
        "p95": float(np.percentile(walls, 95.0)),
        "max": max(walls),
        "share_below_5cm": float(np.mean(np.array(walls) < NEAR)),
    }


def error_figures(found: Localized) -> dict[str, Any] | None:
    """Statistics of the differences from corrected poses, m and rad."""
    if not found.errors:
        return None
    metres, turns = (np.array(column) for column in zip(*found.errors, strict=True))
    return {
        "frame": found.frame,
        "scans": len(metres),
        "position_rmse_m": math.sqrt(float(np.mean(metres**2))),
        "position_median_m": float(np.median(metres)),
        "position_p95_m": float(np.percentile(metres, 95.0)),
        "position_max_m": float(metres.max()),
        "yaw_rmse_rad": math.sqrt(float(np.mean(turns**2))),
        "yaw_max_rad": float(turns.max()),
    }


def time_figures(took: Sequence[float]) -> dict[str, float] | None:
    """Computing times of scans, ms."""
    if not took:
        return None
    return {
        "median": 1e3 * float(np.median(took)),
        "p99": 1e3 * float(np.percentile(took, 99.0)),
        "max": 1e3 * max(took),
    }


def _numbers(pose: Pose2) -> list[float]:
    return [pose.x, pose.y, pose.yaw]


def _row(step: LocalizedScan) -> dict[str, Any]:
    pose = step.pose
    return {
        "t": step.stamp_ns / 1e9,
        "pose": None if pose is None else _numbers(pose),
        "sigma": None if pose is None else [step.sigma.position, step.sigma.yaw],
        "status": step.status,
        "wall_m": step.wall,
        "error": None if step.error is None else list(step.error),
    }
