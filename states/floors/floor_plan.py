"""A room of polygons as a measurable floor, see `space.Floor`.

Corners are inflated round, as costmap_2d and the planners do, or square, as the paper counts its
column (R118); areas with round corners are exact to 1e-4 m2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from hw.scene import Room
from states.floors.passages import closed_passages, sides_of
from states.floors.usable_space import LEAST_PIECE, Corners, Obstacle, Passage, Quarter, obstacle_in
from states.navigation.exact import TOLERANCE, Array

Geometry = Any  # shapely carries no types

_ARC_PARTS = 128
_SHARP = 10.0
_COARSE = 2e-3
_FIT_SLACK = 0.01
_LONG_SIDE = 0.5
_ANGLE_STEP = math.radians(5.0)


@dataclass(frozen=True)
class RoomFloor:
    """See `space.Floor`."""

    room: Room
    corners: Corners = "round"
    _left: dict[float, Geometry] = field(default_factory=dict, init=False, repr=False)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Of the free floor, m."""
        free = self.room.free_space
        return (0.0, 0.0, 0.0, 0.0) if free.is_empty else free.bounds

    @property
    def free_m2(self) -> float:
        """Area that nothing stands on."""
        return float(self.room.free_space.area)

    def usable(self, inflation: float) -> Geometry:
        """Where the robot's centre may be, a Polygon or MultiPolygon, boundary included."""
        if inflation not in self._left:
            style = "round" if self.corners == "round" else "mitre"
            # a passage of exactly twice the inflation is open, as it is for the planners
            left = self.room.free_space.buffer(
                TOLERANCE - inflation, quad_segs=_ARC_PARTS, join_style=style, mitre_limit=_SHARP
            )
            shapely.prepare(left)
            self._left[inflation] = left
        return self._left[inflation]

    def usable_m2(self, inflation: float) -> float:
        """Area for the robot's centre."""
        return float(self.usable(inflation).area)

    def pieces(self, inflation: float) -> tuple[float, ...]:
        """Areas of the connected pieces, largest first."""
        areas = shapely.area(shapely.get_parts(self.usable(inflation))).tolist()
        return tuple(sorted((area for area in areas if area >= LEAST_PIECE), reverse=True))

    def closed_passages(self, inflation: float) -> tuple[Passage, ...]:
        """Closed passages with exact widths, narrowest first."""
        reach = inflation * (math.sqrt(2.0) if self.corners == "square" else 1.0)
        return closed_passages(self.room.free_space, self.usable(inflation), 2.0 * reach)

    def is_clear(self, x: Array, y: Array, clearance: float) -> NDArray[np.bool_]:
        """True for places at least `clearance` from walls."""
        found: NDArray[np.bool_] = shapely.intersects_xy(self.usable(clearance), x, y)
        return found

    def quarter(self, inflation: float, radius: float) -> Quarter | None:
        """Tried along all long sides and every 5 degrees, to 1 cm.

        A quarter holds a disc of (sqrt(2) - 1) times its radius: without room for that disc it
        cannot fit. Else its possible centres are the usable floor less, for each side, the
        Minkowski sum of the side and the reflected quarter.
        """
        left = self.usable(inflation).simplify(_COARSE)
        disc_in_quarter = (math.sqrt(2.0) - 1.0) * (radius - _FIT_SLACK)
        if left.is_empty or _largest_radius(left) < disc_in_quarter - _FIT_SLACK:
            return None
        sides = sides_of(left).reshape(-1, 2, 1, 2)
        for angle in _angles(self.room):
            sector = Quarter(0.0, 0.0, angle, radius - _FIT_SLACK).corners()
            swept = (sides - sector).reshape(len(sides), -1, 2)
            blocked = shapely.union_all(shapely.convex_hull(shapely.multipoints(swept)))
            centres = left.difference(blocked)
            if not centres.is_empty:
                centre = centres.representative_point()
                return Quarter(centre.x, centre.y, angle, radius)
        return None

    def obstacles_at(self, quarter: Quarter, inflation: float) -> tuple[Obstacle, ...]:
        """Walls and columns within the room; of the outer wall there is none."""
        sector = shapely.Polygon(quarter.corners())
        rings = [shapely.Polygon(ring) for ring in self.room.obstacles]
        near = [ring for ring in rings if ring.distance(sector) < inflation - _FIT_SLACK]
        near.sort(key=shapely.Point(quarter.x, quarter.y).distance)
        return tuple(obstacle_in(ring.bounds) for ring in near)


def _largest_radius(area: Geometry) -> float:
    return float(shapely.maximum_inscribed_circle(area, tolerance=0.5 * _FIT_SLACK).length)


def _angles(room: Room) -> Iterator[float]:
    """Angles to try, those of the walls first, each with its three quarter turns."""
    walls = {
        round(math.atan2(y2 - y1, x2 - x1) % (0.5 * math.pi), 9)
        for x1, y1, x2, y2 in room.segments
        if math.hypot(x2 - x1, y2 - y1) >= _LONG_SIDE
    }
    steps = [i * _ANGLE_STEP for i in range(round(0.5 * math.pi / _ANGLE_STEP))]
    for angle in (*sorted(walls), *steps):
        for quarter in range(4):
            yield angle + 0.5 * math.pi * quarter
