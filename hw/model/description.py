"""URDFs that robot files and arm files name.

In a robot file it describes the UR arm of its arm file once more:

`urdf: {file: own.urdf, base: base_link, flange: tool0, mount: {z: 50 cm}}`; the file's path
is relative to the robot file's folder.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from engine.files import is_file
from engine.files.declared import Item, Written, reader_of
from hw.model.prop import SpatialPose


def _file(item: Item) -> Path:
    """A file by its path relative to this file's folder."""
    file = item.path(str(reader_of(str)(item)))
    if not is_file(file):
        raise item.error(f"there is no file {file}")
    return file


@dataclass(frozen=True, slots=True)
class ArmUrdf:
    """A URDF that is an arm: the chain from link `base` to link `flange`."""

    file: Annotated[Path, _file, Written(str)]
    """The URDF, relative to this file's folder."""
    base: str
    """The link that the chain begins with."""
    flange: str
    """The link that holds the prop; its z axis points outwards."""


@dataclass(frozen=True, slots=True)
class UrdfDescription:
    """A URDF that describes the arm: the chain from link `base` to link `flange` (R17).

    The prop is mounted on `flange`. `mount` is rover_from_base; None: as in the robot file.
    """

    file: Annotated[Path, _file, Written(str)]
    """The URDF, relative to this file's folder."""
    base: str
    """The link that the chain begins with."""
    flange: str
    """The link that holds the prop; its z axis points outwards."""
    mount: SpatialPose | None = None
    """Where `base` is on the rover; without it as the arm's `mount`."""
