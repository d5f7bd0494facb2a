"""A URDF in the place of our own arm file, named in a robot file.

`urdf: {file: own.urdf, base: base_link, flange: tool0, mount: {xyz: [0, 0, 0.5]}}`; the file's
place is told from the robot file's folder.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hw.document import Item
from hw.prop import Placement, placement_from


@dataclass(frozen=True, slots=True)
class Description:
    """A URDF that the arm is taken from: its chain from link `base` to link `flange` (R17).

    The prop is screwed to `flange`, which looks along its z; `mount` is rover_from_base.
    """

    file: Path
    base: str
    flange: str
    mount: Placement


def description_from(item: Item, height: float) -> Description:
    """Builds a description from a mapping; without a mount the base stands upright at `height` m.

    Raises:
        FileError: with file, line, key and what would be right.
    """
    part = item.section(required=("file", "base", "flange"), optional=("mount",))
    file = Path(item.path).parent / part["file"].text()
    if not file.is_file():
        raise part["file"].fail(f"there is no file {file}")
    above = Placement((0.0, 0.0, height))
    mount = placement_from(part["mount"]) if "mount" in part else above
    return Description(file, part["base"].text(), part["flange"].text(), mount)
