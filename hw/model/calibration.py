"""The measured kinematic chain of one robot's arm, from its manufacturer's calibration.

A file has `calibration`, its name, `about`, which robot it is, and `chain`: for each of six joints,
shoulder first, the joint's frame in the link before it, `{x: 0, y: 0, z: 0.1279, yaw: -0.00007}`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from engine.files.declared import Count, Name, find_file, load_yaml, record
from hw.model.prop import JOINTS, Placement, SpatialPose

FOLDER = Path(__file__).parent.parent / "calibrations"


@dataclass(frozen=True, slots=True)
class CalibrationFile:
    """The measured chain of one robot's arm."""

    calibration: Name
    """Its name."""
    chain: Annotated[tuple[SpatialPose, ...], Count(JOINTS, JOINTS)]
    """The frame of each joint in the link before it, shoulder first."""
    about: str = ""
    """Which robot it is, and where the numbers come from."""


def load_calibration(name_or_path: str | Path = "robotnik_ur10") -> tuple[Placement, ...]:
    """The calibrated chain of one robot, by name or by file.

    Raises:
        FileError: every mistake in it, with file, line, column and a suggestion.
    """
    path = find_file(str(name_or_path), FOLDER, "calibration")
    return load_yaml(path, lambda item: record(item, CalibrationFile)).chain
