"""Points and poses as files write them: `[x, y]` in m, `{x: 1.0, y: 2.0, yaw: 30 deg}`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from engine.files.declared import Item, Written, record
from hw.geometry import AnyAngle, Coordinate, Pose2

PlanePoint = tuple[Coordinate, Coordinate]


@dataclass(frozen=True, slots=True)
class PoseKeys:
    """A pose in the plane."""

    x: Coordinate
    """In the map or frame, along x."""
    y: Coordinate
    """Along y."""
    yaw: AnyAngle = 0.0
    """Counterclockwise from x."""


def pose(item: Item) -> Pose2:
    """A pose written `{x: 1.0, y: 2.0, yaw: 0.5}`; yaw is 0 if left out.

    Raises:
        FileError: every mistake in it.
    """
    read = record(item, PoseKeys)
    return Pose2.checked(read.x, read.y, read.yaw)


Pose = Annotated[Pose2, pose, Written(PoseKeys)]
