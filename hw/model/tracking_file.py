"""The file of a calibrated tracking system, as written by `cobodeck calibrate`.

tracking: lab_a
map_from_vive: {x: 3.1, y: 0.4, z: 0.0, roll: 0, pitch: 0, yaw: 1.57}
mounts:                        # base_from_tracker, by tracker name
  front_tracker: {x: 0.38, y: 0.27, z: 0.45}
scanner_yaws: {front_laser: 0.002}   # rotation against the mounts of the robot file, rad
residual: {position: 0.0016, yaw: 0.0004}   # fit to its log: rms, m and rad
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from engine.files import Angle, Length
from engine.files.declared import Name, Range, find_file, load_yaml, record
from hw.geometry import AnyAngle, Pose3
from hw.model.prop import Placement, SpatialPose
from hw.model.tracking import Tracking

FOLDER = Path(__file__).parent.parent / "trackings"


@dataclass(frozen=True, slots=True)
class Residual:
    """Residuals of the calibration, root mean square, m and rad."""

    position: Annotated[Length, Range(0.0, 10.0)]
    """Of positions, root mean square."""
    yaw: Annotated[Angle, Range(0.0, math.pi)]
    """Of angles, root mean square."""


@dataclass(frozen=True, slots=True)
class TrackingFile:
    """A named calibration and its residuals."""

    tracking: Name
    """Its name."""
    map_from_vive: SpatialPose
    """The pose of the tracking frame in the map."""
    mounts: Mapping[str, SpatialPose]
    """The pose of each tracker on the robot, base_from_tracker, by its name."""
    residual: Residual
    """How well it fits the log it is from."""
    scanner_yaws: Mapping[str, AnyAngle] = field(default_factory=dict)
    """How far scanners are turned against their mounts in the robot file."""
    about: str = ""
    """What it was measured on."""

    def poses(self) -> Tracking:
        """The calibrated poses."""
        mounts = {name: placed.pose() for name, placed in self.mounts.items()}
        return Tracking(self.map_from_vive.pose(), mounts)

    def text(self) -> str:
        """The text of the file."""
        mounts = "".join(f"  {name}: {_written(at)}\n" for name, at in self.mounts.items())
        yaws = "".join(f"  {name}: {yaw!r}\n" for name, yaw in self.scanner_yaws.items())
        return (
            f"tracking: {self.tracking}\nabout: >\n  {self.about}\n"
            f"map_from_vive: {_written(self.map_from_vive)}    # m and rad\n"
            f"mounts:    # base_from_tracker\n{mounts}"
            + (
                f"scanner_yaws:    # against the mounts of the robot file, rad\n{yaws}"
                if yaws
                else ""
            )
            + f"residual: {{position: {self.residual.position!r}, yaw: {self.residual.yaw!r}}}\n"
        )


def load_tracking(name_or_path: str | Path) -> TrackingFile:
    """A calibrated tracking system, by name or by file.

    Raises:
        FileError: every mistake in it, with file, line, column and a suggestion.
    """
    path = find_file(str(name_or_path), FOLDER, "tracking")
    return load_yaml(path, lambda item: record(item, TrackingFile))


def placement_of(pose: Pose3) -> Placement:
    """Roll, pitch and yaw of a pose; the pitch is within 90 degrees."""
    return Placement((pose.x, pose.y, pose.z), pose.roll_pitch_yaw)


def _written(placed: Placement) -> str:
    x, y, z = placed.xyz
    roll, pitch, yaw = placed.rpy
    return f"{{x: {x!r}, y: {y!r}, z: {z!r}, roll: {roll!r}, pitch: {pitch!r}, yaw: {yaw!r}}}"
