"""Calibration from a log: base poses from matched scans against tracker poses."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cobodeck.logs.formats import SCAN, TRACKER, SensorLog
from cobodeck.logs.mapped import Ground
from cobodeck.logs.seen import scans_of
from engine.files import mistake
from hw import Pose2, Pose3, Scan, TrackerPose
from hw.model import Placement, Residual, Tracking, TrackingFile, placement_of
from states.localization import Localizer
from states.localization.calibration import (
    BaseReading,
    Calibration,
    NoCalibration,
    TrackerReading,
    calibrate,
)
from states.localization.matching import TrackerValues, match

_NEAR = np.diag([0.05**2, 0.05**2, 0.03**2])
"""Prior covariance (m2, m2, rad2) of one scanner's match, around the pose by all scanners."""


def calibrated(
    log: SensorLog,
    ground: Ground,
    start: Pose2 | None,
    seed: int,
    mounts: Mapping[str, Pose3] | None = None,
) -> Calibration | NoCalibration:
    """Calibrate the trackers and scanners of a log in the map.

    `start` is the first pose of the base, None if unknown. With known `mounts` (base_from_tracker)
    only the tracking's frame is estimated.

    Raises:
        FileError: it has no trackers or no scans.
    """
    for name in (TRACKER, SCAN):
        if log.count(name) == 0:
            hint = "record a drive of the robot with `run` or `simulate --tier 2 --record`"
            raise mistake(log.path, f"has no {name}", hint=hint)
    trackers = [
        TrackerReading(sample.stamp_ns, sample.value.tracker, sample.value.pose)
        for sample in log.samples
        if isinstance(sample.value, TrackerPose)
    ]
    scanners = {name: model.mount.flat for name, model in log.sensing.lidars.items()}
    strange = sorted({one.tracker for one in trackers} - set(mounts)) if mounts is not None else []
    if strange:
        raise mistake(log.path, f"has a tracker {strange[0]}, of which no mount is known")
    bases = matched(log, ground, start, seed)
    return calibrate(trackers, bases, mounts=mounts, scanners=scanners)


def matched(log: SensorLog, ground: Ground, start: Pose2 | None, seed: int) -> list[BaseReading]:
    """Base poses, each matched from one scan alone; trackers are not used."""
    localizer = Localizer(ground.field, log.sensing, Tracking(), start, seed)
    values, found, scans = TrackerValues(), [], iter(scans_of(log))
    for sample in log.samples:
        if isinstance(sample.value, TrackerPose):
            continue
        localizer.update(sample.name, sample.stamp_ns, sample.value)
        if not isinstance(sample.value, Scan):
            continue
        seen = next(scans)
        if localizer.pose is None or localizer.status in ("starting", "lost"):
            continue
        one = match(ground.field, seen.points, localizer.pose, _NEAR, values)
        if one.is_healthy(values):
            found.append(BaseReading(seen.stamp_ns, one.map_from_base, seen.sensor))
    return found


def tracking_file(found: Calibration, name: str, about: str) -> TrackingFile:
    """The calibration as a file."""
    mounts: dict[str, Placement] = {n: placement_of(p) for n, p in found.mounts.items()}
    residual = Residual(found.position_rms, found.yaw_rms)
    return TrackingFile(
        name, placement_of(found.map_from_vive), mounts, residual, dict(found.scanner_yaws), about
    )
