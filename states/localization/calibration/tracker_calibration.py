"""Calibration of the tracking: its frame in the map, and the trackers' mounts on the base.

From a drive during which trackers gave vive_from_tracker and a scan matcher map_from_base, all
frames are found at once by robust least squares (`hand_eye.py`). Planar motion leaves the height
open; by convention the tracking's floor is taken as the map's, unless mounts are known.
Readings are averaged over windows, so that residuals show systematic errors, not noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from hw import Pose2, Pose3
from states.localization.calibration.hand_eye import (
    CalibrationProblem,
    Frames,
    first_guess,
    fit,
    robust_weights,
)
from states.localization.calibration.pose_pairs import Array, pairs_of

GREATEST_OFFSET = 0.005
GREATEST_TURN = math.radians(0.1)
"""Largest residuals and uncertainties accepted, m and rad; 0.1 degrees are 1 cm at 5 m."""

WINDOW_S = 1.0
LEAST_WINDOWS = 10
_CLOCK_S = 0.02  # expected size of the clock offset between trackers and scanners


class TrackerReading(NamedTuple):
    """Pose of one tracker, vive_from_tracker, at a stamp, ns."""

    stamp_ns: int
    tracker: str
    vive_from_tracker: Pose3


class BaseReading(NamedTuple):
    """Matched pose, map_from_base, at a stamp, ns, by the scanner of this name alone.

    Without a name it comes from several scanners or another source; no scanner yaw is estimated.
    """

    stamp_ns: int
    map_from_base: Pose2
    scanner: str = ""


@dataclass(frozen=True, slots=True)
class Calibration:
    """The frames, how well they fit the log, and the standard deviation of each unknown.

    `mounts`: base_from_tracker. `scanner_yaws`: yaw of each scanner relative to its nominal mount,
    rad; with unknown mounts only differences are observable, and their mean is 0. `clock_offset`:
    delay of tracker stamps behind scanner stamps, s. `position_rms` (m) and `yaw_rms` (rad) are
    residuals of the window means, weighted as in the fit: a tracker that is off for a while, near
    the border of its coverage or found again after a loss, does not speak against the frames.
    `sigmas` are by the unknown's name, in m, rad or s.
    """

    map_from_vive: Pose3
    mounts: Mapping[str, Pose3]
    scanner_yaws: Mapping[str, float]
    clock_offset: float
    position_rms: float
    yaw_rms: float
    windows: int
    sigmas: Mapping[str, float]

    @property
    def tilt(self) -> float:
        """Angle between the tracking's vertical and that of the map, rad."""
        return _upright(self.map_from_vive)


@dataclass(frozen=True, slots=True)
class NoCalibration:
    """Why a log gives no calibration, and the rejected result, if there is one.

    `data`: too few readings overlap in time; `motion`: the drive does not determine all unknowns,
    the text names which; `residual`: the readings contradict each other.
    """

    reason: Literal["data", "motion", "residual"]
    text: str
    found: Calibration | None = None


def calibrate(
    trackers: Sequence[TrackerReading],
    bases: Sequence[BaseReading],
    *,
    mounts: Mapping[str, Pose3] | None = None,
    scanners: Mapping[str, Pose2] | None = None,
    window: float = WINDOW_S,
) -> Calibration | NoCalibration:
    """Calibrate all frames at once; with known `mounts` (base_from_tracker) only map_from_vive.

    `scanners` has the nominal base_from_scanner of the scanners that the base readings name;
    readings are averaged over `window`, s.

    Raises:
        ValueError: a tracker or a scanner is named that `mounts` or `scanners` does not have.
    """
    pairs = pairs_of(trackers, bases, window)
    for what, given, needed in (
        ("mounts", mounts, pairs.trackers),
        ("scanners", scanners or {}, [name for name in pairs.scanners if name]),
    ):
        missing = [name for name in needed if given is not None and name not in given]
        if missing:
            raise ValueError(f"{what}: there is none of {missing[0]}; given: {sorted(given or {})}")
    if pairs.windows < LEAST_WINDOWS:
        text = f"{pairs.windows} windows of {window:g} s with trackers and scans; {LEAST_WINDOWS}"
        return NoCalibration("data", f"{text} are needed")
    named = [at for at, name in enumerate(pairs.scanners) if name]
    nominal = [(scanners or {}).get(name, Pose2(0.0, 0.0)) for name in pairs.scanners]
    free = 1 if mounts is not None else 1 + len(pairs.trackers)
    scales = (GREATEST_OFFSET, GREATEST_TURN, _CLOCK_S)
    problem = CalibrationProblem(pairs, free, named, nominal, scales)
    return _judged(problem, *fit(problem, first_guess(pairs, mounts)))


def _judged(
    problem: CalibrationProblem, frames: Frames, rest: Array, slope: Array
) -> Calibration | NoCalibration:
    pairs = problem.pairs
    offset, turn = problem.misses(frames)
    poses = [
        Pose3(*place, *turn.as_quat().tolist())
        for place, turn in zip(frames.places.tolist(), frames.turns, strict=True)
    ]
    found = Calibration(
        map_from_vive=poses[0],
        mounts=dict(zip(pairs.trackers, poses[1:], strict=True)),
        scanner_yaws={pairs.scanners[at]: float(frames.yaws[at]) for at in problem.named},
        clock_offset=frames.clock,
        position_rms=math.sqrt(float(np.sum(_robust_square(offset, problem.scales[0])))),
        yaw_rms=math.sqrt(float(_robust_square(turn, problem.scales[1])[2])),
        windows=pairs.windows,
        sigmas=dict(zip(_names(problem), _sigmas(problem, rest, slope), strict=True)),
    )
    if found.position_rms > GREATEST_OFFSET or found.yaw_rms > GREATEST_TURN:
        return NoCalibration("residual", _contradiction(found), found)
    left_open = [name for name, sigma in found.sigmas.items() if sigma > _allowed(name)]
    if left_open:
        text = f"the drive leaves open: {', '.join(left_open)}; it needs turns both ways and"
        return NoCalibration("motion", f"{text} places metres apart in two directions", found)
    return found


def _robust_square(rows: Array, scale: float) -> Array:
    """Means (3,) of squared residuals (w, 3), each with its weight in the fit, 1/sqrt(1 + r^2)."""
    weights = robust_weights(rows / scale)
    return np.asarray((weights * rows**2).sum(axis=0) / weights.sum(axis=0))


def _names(problem: CalibrationProblem) -> list[str]:
    """Names of the unknowns, in their order."""
    frames = ["vive", *problem.pairs.trackers][: problem.free]
    moved = [f"{frame} {axis}" for frame in frames for axis in "xyz"]
    turned = [f"{frame} about {axis}" for frame in frames for axis in "xyz"]
    scanners = [f"scanner {problem.pairs.scanners[at]} yaw" for at in problem.named]
    return [*moved, *turned, *scanners, "clock"]


def _sigmas(problem: CalibrationProblem, rest: Array, slope: Array) -> list[float]:
    """Standard deviations of the unknowns, from the weighted Jacobian J = U S V^T.

    The covariance is s^2 (J^T J)^-1 = s^2 V S^-2 V^T, with s^2 the residual variance; singular
    values near 0, which are directions left open, give huge sigmas. An error of a scan is in the
    residuals of all trackers alike, so that these count as one: s^2 is times their number.
    """
    _, values, rows = np.linalg.svd(slope, full_matrices=False)
    variance = float(rest @ rest) / max(len(rest) - slope.shape[1], 1)
    variance = max(variance, 1e-6) * len(problem.pairs.trackers)
    spread = np.square(rows / np.maximum(values, 1e-9)[:, None]).sum(axis=0)
    return [math.sqrt(v) for v in variance * spread]


def _allowed(name: str) -> float:
    if name == "clock":
        return math.inf
    return GREATEST_TURN if "about" in name or "yaw" in name else GREATEST_OFFSET


def _contradiction(found: Calibration) -> str:
    return (
        f"trackers and scans differ by {1e3 * found.position_rms:.1f} mm and "
        f"{math.degrees(found.yaw_rms):.2f} degrees; {1e3 * GREATEST_OFFSET:g} mm and "
        f"{math.degrees(GREATEST_TURN):g} degrees are allowed"
    )


def _upright(pose: Pose3) -> float:
    """Angle between a frame's z axis and the vertical, rad."""
    return 2.0 * math.asin(min(math.hypot(pose.qx, pose.qy), 1.0))
