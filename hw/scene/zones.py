"""Zones of a room that restrict the robot: keep-out areas and speed limits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from engine.files import Speed
from engine.files.declared import Range
from hw.scene.room import Polygon, contains, distance_to_segment, edges


@dataclass(frozen=True, slots=True)
class SpeedZone:
    """An area in which the robot's centre moves no faster than `limit`, m/s."""

    area: Polygon
    """The corners of the area."""
    limit: Annotated[Speed, Range(0.05, 10.0)]
    """The robot's centre is no faster there."""

    def speed_at(self, x: float, y: float, braking: float) -> float:
        """The speed from which braking, m/s2, still meets the limit at the border, m/s.

        v^2 = limit^2 + 2 braking distance.
        """
        away = 0.0
        if not contains(self.area, x, y):
            away = min(distance_to_segment(x, y, edge) for edge in edges(self.area))
        return math.sqrt(self.limit * self.limit + 2.0 * braking * away)


@dataclass(frozen=True, slots=True)
class Zones:
    """Areas that restrict the robot."""

    keepout: tuple[Polygon, ...] = ()
    """Areas that block the robot like walls."""
    speed: tuple[SpeedZone, ...] = ()
    """Areas with a speed limit."""

    def speed_at(self, x: float, y: float, braking: float) -> float:
        """The largest speed that all zones allow at a place, m/s; infinite without zones."""
        return min((zone.speed_at(x, y, braking) for zone in self.speed), default=math.inf)

    def keeps_out(self, x: float, y: float) -> bool:
        """True if the place (map, m) is in a keep-out zone."""
        return any(contains(ring, x, y) for ring in self.keepout)


NO_ZONES = Zones()
