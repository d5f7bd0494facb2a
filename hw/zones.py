"""Zones of a room that are there for the robot alone: where it may not be, where it goes slowly."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from engine.files.units import Speed
from engine.files.values import Range
from hw.room import Polygon, contains, distance_to_segment, edges


@dataclass(frozen=True, slots=True)
class SpeedZone:
    """An area in which the robot's centre goes no faster than `limit`, m/s."""

    area: Polygon
    limit: Annotated[Speed, Range(0.05, 10.0)]

    def speed_at(self, x: float, y: float, braking: float) -> float:
        """What still lets a robot that brakes with so many m/s2 keep the limit in the area, m/s."""
        away = 0.0
        if not contains(self.area, x, y):
            away = min(distance_to_segment(x, y, edge) for edge in edges(self.area))
        return math.sqrt(self.limit * self.limit + 2.0 * braking * away)


@dataclass(frozen=True, slots=True)
class Zones:
    """`keepout`: areas that the robot keeps off like walls; `speed`: where it goes slowly."""

    keepout: tuple[Polygon, ...] = ()
    speed: tuple[SpeedZone, ...] = ()

    def speed_at(self, x: float, y: float, braking: float) -> float:
        """The largest speed that all zones allow at a place, m/s; infinite where there are none."""
        return min((zone.speed_at(x, y, braking) for zone in self.speed), default=math.inf)

    def keeps_out(self, x: float, y: float) -> bool:
        """Is the place in a zone that the robot keeps out of?"""
        return any(contains(ring, x, y) for ring in self.keepout)


NO_ZONES = Zones()
