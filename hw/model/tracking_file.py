"""The file of a calibrated tracking system, as written by `cobodeck calibrate`.

tracking: lab_a
map_from_vive: {xyz: [3.1, 0.4, 0.0], rpy: [0, 0, 1.57]}
mounts:                        # base_from_tracker, by tracker name
  front_tracker: {xyz: [0.38, 0.27, 0.45], rpy: [0, 0, 0]}
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
from hw.geometry import Pose3
from hw.model.prop import Placement
from hw.model.tracking import Tracking
from hw.places import AnyAngle

FOLDER = Path(__file__).parent.parent / "trackings"


@dataclass(frozen=True, slots=True)
class Residual:
    """Residuals of the calibration, root mean square, m and rad."""

    position: Annotated[Length, Range(0.0, 10.0)]
    yaw: Annotated[Angle, Range(0.0, math.pi)]


@dataclass(frozen=True, slots=True)
class TrackingFile:
    """A named calibration and its residuals."""

    tracking: Name
    map_from_vive: Placement
    mounts: Mapping[str, Placement]
    residual: Residual
    scanner_yaws: Mapping[str, AnyAngle] = field(default_factory=dict)
    about: str = ""

    def poses(self) -> Tracking:
        """The calibrated poses."""
        mounts = {name: pose_of(placed) for name, placed in self.mounts.items()}
        return Tracking(pose_of(self.map_from_vive), mounts)

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


def pose_of(placed: Placement) -> Pose3:
    """A pose from roll, pitch and yaw about fixed axes: yaw @ pitch @ roll."""
    roll, pitch, yaw = (0.5 * angle for angle in placed.rpy)
    level = Pose3(*placed.xyz, 0.0, 0.0, math.sin(yaw), math.cos(yaw))
    nodded = Pose3(0.0, 0.0, 0.0, 0.0, math.sin(pitch), 0.0, math.cos(pitch))
    return level @ nodded @ Pose3(0.0, 0.0, 0.0, math.sin(roll), 0.0, 0.0, math.cos(roll))


def placement_of(pose: Pose3) -> Placement:
    """Roll, pitch and yaw of a pose; the pitch is within 90 degrees."""
    return Placement((pose.x, pose.y, pose.z), pose.roll_pitch_yaw)


def _written(placed: Placement) -> str:
    x, y, z = placed.xyz
    roll, pitch, yaw = placed.rpy
    return f"{{xyz: [{x!r}, {y!r}, {z!r}], rpy: [{roll!r}, {pitch!r}, {yaw!r}]}}"
