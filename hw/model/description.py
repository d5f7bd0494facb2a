"""A URDF in place of an arm file, named in a robot file.

`urdf: {file: own.urdf, base: base_link, flange: tool0, mount: {xyz: [0, 0, 0.5]}}`; the file's path
is relative to the robot file's folder.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from engine.files import is_file
from engine.files.declared import Item, reader_of
from hw.model.prop import Placement


def _file(item: Item) -> Path:
    """A file by its path relative to this file's folder."""
    file = item.path(str(reader_of(str)(item)))
    if not is_file(file):
        raise item.error(f"there is no file {file}")
    return file


@dataclass(frozen=True, slots=True)
class UrdfDescription:
    """A URDF that describes the arm: the chain from link `base` to link `flange` (R17).

    The prop is mounted on `flange`, whose z axis points outwards. `mount` is rover_from_base; None:
    as the arm stands in the robot file.
    """

    file: Annotated[Path, _file]
    base: str
    flange: str
    mount: Placement | None = None
