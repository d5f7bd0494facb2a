"""Points and poses as files write them: `[x, y]` in m, `{x: 1.0, y: 2.0, yaw: 30 deg}`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from engine.files import Angle, Length
from engine.files.declared import Item, Range, Written, record
from hw.geometry import Pose2

FAR = 1e4
"""Coordinates beyond this are refused as a mistake, m."""
TURNS = 4.0 * math.pi
"""Angles beyond this are refused, rad: they are probably meant in degrees."""

Coordinate = Annotated[Length, Range(-FAR, FAR)]
AnyAngle = Annotated[Angle, Range(-TURNS, TURNS)]
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
