"""The measured chain of one robot's arm, as its maker's calibration tells it.

A file has `about`, whose it is, and `chain`: for six joints, shoulder first, the joint's frame in
the link before it, `{xyz: [0, 0, 0.1279], rpy: [0, 0, 0]}`, in m and rad.
"""

from __future__ import annotations

from pathlib import Path

from hw.document import FileError, read_document
from hw.prop import Placement, placement_from

FOLDER = Path(__file__).parent / "calibrations"


class CalibrationError(FileError):
    """A calibration file is wrong or missing."""


def load_calibration(name_or_path: str | Path = "robotnik_ur10") -> tuple[Placement, ...]:
    """The calibrated chain of one robot, by name or by file.

    Raises:
        CalibrationError: with file, line, key and what would be right.
    """
    name = str(name_or_path)
    is_file = name.endswith((".yaml", ".yml")) or "/" in name
    path = Path(name) if is_file else FOLDER / f"{name}.yaml"
    item = read_document(path, CalibrationError)
    chain = item.section(required=("chain",), optional=("about",))["chain"]
    found = tuple(placement_from(part) for part in chain.items())
    if len(found) != 6:
        raise chain.fail(f"needs 6 joints, has {len(found)}")
    return found
