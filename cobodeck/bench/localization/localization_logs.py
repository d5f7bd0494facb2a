"""Benchmark of localization on logs with corrected poses: the localizer beside its peers.

The map is made from part of each log by its corrected poses, the other scans are scored; all start
at the truth. A pose is confidently wrong if it is given as good, but is off by more than `OFF` and
by more than three standard deviations, those of the corrected poses added.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cobodeck.bench.harness import BenchRow
from cobodeck.bench.localization.localization_peers import LOG_PEERS
from cobodeck.bench.localization.log_variants import USUAL, VARIANTS, LogDrive, drive_of
from cobodeck.logs import LocalizedScan, built_ground, open_log, scans_of
from engine.files import mistake
from hw import Pose2
from hw.motion import PoseHistory

NAME = "localization"
OFF = 0.5
"""A pose farther off than this is wrong, m."""
REFERENCE_SIGMA = 0.04
"""Standard deviation of corrected poses, and of maps made by them, m."""
GOOD = ("tracking", "resting", "odometry wrong", "odometry missing")
"""Statuses by which a pose counts as good."""
LOST = ("lost", "ambiguous")
GOALS = {None: 4.5, ("slip", 1.0): 4.5, ("slip", 2.0): 6.0}
"""Goals of the root mean square error by variant, cm."""


LONGEST_NS = 1_000_000_000
"""Longest interval between scans within which true poses are interpolated, ns."""


@dataclass(frozen=True, slots=True)
class LogRow(BenchRow):
    """A row of a log: `time_us` is the median per scan, `error` the RMS of positions, cm.

    `worst`: largest error, cm; `lost`: scans without a known place; `wrong`: share of scans with a
    confidently wrong pose; `nees`: median of squared errors over variances, about 1 if these are
    honest, None without variances; `p99_us`: time per scan.
    """

    worst: float | None = None
    lost: int = 0
    wrong: float = 0.0
    nees: float | None = None
    p99_us: float | None = None


def rows(
    paths: Iterable[Path], variants: Sequence[tuple[str, float]] = (), seed: int = 0
) -> Iterator[LogRow]:
    """A row per log, variant and peer; without variants for the log as it is and all usual ones.

    Raises:
        FileError: a log cannot be read, has no scans, or no corrected poses.
    """
    for path in paths:
        log = open_log(path)
        if not log.reference:
            hint = "the scans are compared with them"
            raise mistake(path, "has no corrected poses", hint=hint)
        drive = drive_of(log, built_ground(log))
        for variant in variants or (None, *USUAL):
            varied = drive if variant is None else _varied(drive, *variant, seed)
            if varied is not None:
                yield from _rows_of(path.name, varied, variant, seed)


def _varied(drive: LogDrive, name: str, value: float, seed: int) -> LogDrive | None:
    return VARIANTS[name](drive, value, np.random.default_rng(seed))


def _rows_of(
    name: str, drive: LogDrive, variant: tuple[str, float] | None, seed: int
) -> Iterator[LogRow]:
    start = next(pose for pose in drive.truth if pose is not None)
    for peer, run in LOG_PEERS.items():
        steps = run(drive, start, seed, time.thread_time)
        yield log_row(name, peer, variant, steps, _true_poses(drive, steps))


def _true_poses(drive: LogDrive, steps: Sequence[LocalizedScan]) -> list[Pose2 | None]:
    """The true pose at the stamp of each step's pose, which may be older than the scan.

    None where that is between scans too far apart: the scan waits for its wheels.
    """
    known = [
        (seen.stamp_ns, true) for seen, true in zip(scans_of(drive.log), drive.truth, strict=True)
    ]
    truth: PoseHistory[Pose2 | None] = PoseHistory(_between, poses=known)
    return [
        true if step.stamp_ns >= stamp else truth.at(step.stamp_ns, LONGEST_NS)
        for step, (stamp, true) in zip(steps, known, strict=True)
    ]


def _between(a: Pose2 | None, b: Pose2 | None, share: float) -> Pose2 | None:
    return None if a is None or b is None else a.between(b, share)


def log_row(
    name: str,
    peer: str,
    variant: tuple[str, float] | None,
    steps: Sequence[LocalizedScan],
    truth: Sequence[Pose2 | None],
) -> LogRow:
    """The figures of a run: one step and one true pose, if known, per scan.

    While it is `starting` a pose is not scored, as by `localize`: the start is not yet confirmed.
    """
    pairs = [
        (step, step.pose.distance_to(true))
        for step, true in zip(steps, truth, strict=True)
        if step.scored and step.pose is not None and true is not None
    ]
    errors = np.array([error for _, error in pairs])
    variances = np.array([step.sigma.position**2 for step, _ in pairs]) + REFERENCE_SIGMA**2
    has_sigma = bool(pairs) and bool(np.isfinite(variances).all())
    good = np.array([step.status in GOOD for step, _ in pairs], dtype=bool)
    wrong = good & (errors > OFF) & (errors > 3.0 * np.sqrt(variances))
    took = np.array([step.took for step in steps])
    knob, value = variant or (None, None)
    return LogRow(
        NAME, name, peer, knob, value,
        time_us=1e6 * float(np.median(took)),
        error=100.0 * math.sqrt(float(np.mean(errors**2))) if pairs else None,
        error_unit="cm rmse",
        reference="corrected poses",
        goal=GOALS.get(variant) if peer == "cobodeck" else None,
        worst=100.0 * float(errors.max()) if pairs else None,
        lost=sum(step.pose is None or step.status in LOST for step in steps),
        wrong=float(wrong.sum()) / len(steps),
        nees=float(np.median(errors**2 / variances)) if has_sigma else None,
        p99_us=1e6 * float(np.percentile(took, 99.0)),
    )  # fmt: skip
