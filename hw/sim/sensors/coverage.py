"""Visibility of a device from base stations in the corners of the tracked area (R6, R31, R32)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hw.jit import compiled, example
from hw.model import ViveErrors
from hw.scene import Room, edges
from hw.sim.sensors.scanned_shapes import Shapes
from hw.sim.sensors.track import PastPoses, held

Floats = NDArray[np.float64]
_END = 1e-6
"""Share at both ends of a line of sight where walls do not block: stations hang on walls."""


class Column(NamedTuple):
    """An upright cylinder that blocks lines of sight: x, y, radius, height above the floor, m."""

    x: float
    y: float
    radius: float
    height: float


NOTHING = Column(0.0, 0.0, 0.0, 0.0)


class Coverage:
    """Lines of sight past walls, which reach to the ceiling, and past bodies, which do not.

    Without a room a device is visible everywhere. Without a tracked area the stations hang in the
    corners of the room, and no place is near a border. `border` has the area's sides, (n, 4);
    `least` stations have to see a device.
    """

    def __init__(self, room: Room | None, shapes: Shapes, errors: ViveErrors) -> None:
        self._shapes, self.least = shapes, 0 if room is None else errors.stations
        area = None if room is None else room.tracked_area
        self.border: Floats = np.array([] if area is None else edges(area)).reshape(-1, 4)
        self._stations = np.empty((0, 3))
        if room is not None:
            xs, ys = zip(*(area or room.outer), strict=True)
            corners = [(x, y) for x in (min(xs), max(xs)) for y in (min(ys), max(ys))]
            self._stations = np.array([(*corner, errors.station_height) for corner in corners])

    def visibility(self, x: float, y: float, z: float, time_ns: int) -> tuple[bool, float]:
        """Whether enough stations see this place (m), and its distance to the area's border, m."""
        inside, to_border = within(x, y, self.border)
        return inside and self.sees(x, y, z, time_ns), to_border

    def sees(self, x: float, y: float, z: float, time_ns: int, also: Column = NOTHING) -> bool:
        """Whether enough stations see this place in the area, m.

        `also` blocks lines of sight in addition to the bodies that are there.
        """
        cylinders, segments = self._shapes.cylinders(time_ns), self._shapes.segments
        return count_seeing(x, y, z, self._stations, segments, cylinders, also) >= self.least

    def looked(
        self,
        past: PastPoses,
        stamp_ns: int,
        mount: tuple[float, float, float, float],
        arm: tuple[float, float],
    ) -> tuple[float, float, float, int, float]:
        """What `look` finds at an instant."""
        shapes = self._shapes
        cylinders = shapes.cylinders(stamp_ns)
        return look(
            past, stamp_ns, mount, arm, self.border, self._stations, (shapes.segments, cylinders)
        )


@compiled
def look(
    past: PastPoses,
    stamp_ns: int,
    mount: tuple[float, float, float, float],
    arm: tuple[float, float],
    border: Floats,
    stations: Floats,
    bodies: tuple[Floats, Floats],
) -> tuple[float, float, float, int, float]:
    """Where a tracker on the base is at an instant, and how many stations see it.

    Args:
        past: of the base's track.
        stamp_ns: the instant.
        mount: x, y of the tracker in the base frame, height above the floor, m; its yaw is unused.
        arm: radius and height of a cylinder around the base's origin, m.
        border: (n, 4) sides of the area.
        stations: see `count_seeing`.
        bodies: walls and cylinders there.

    Returns:
        x, y in the map, m; the base's yaw, rad; the number of stations, -1 outside of the area; the
        distance to the border, m.
    """
    base_x, base_y, yaw = held(past, stamp_ns)
    c, s = math.cos(yaw), math.sin(yaw)
    x, y = base_x + c * mount[0] - s * mount[1], base_y + s * mount[0] + c * mount[1]
    inside, to_border = within(x, y, border)
    if not inside:
        return x, y, yaw, -1, to_border
    also = Column(base_x, base_y, arm[0], arm[1])
    stations_seeing = count_seeing(x, y, mount[2], stations, bodies[0], bodies[1], also)
    return x, y, yaw, stations_seeing, to_border


@compiled
def count_seeing(
    x: float,
    y: float,
    z: float,
    stations: Floats,
    segments: Floats,
    cylinders: Floats,
    also: Column,
) -> int:
    """Number of stations that see a place, m in the map.

    Args:
        x: of the place; y likewise.
        y: see x.
        z: its height.
        stations: (k, 3).
        segments: (s, 4) walls, x1, y1, x2, y2.
        cylinders: (n, 4) x, y, radius, height; one around the place blocks nothing.
        also: one more cylinder.
    """
    count = 0
    for k in range(stations.shape[0]):
        dx, dy, dz = stations[k, 0] - x, stations[k, 1] - y, stations[k, 2] - z
        hidden = _walled(x, y, dx, dy, segments)
        hidden = hidden or _hidden(x, y, z, dx, dy, dz, also[0], also[1], also[2], also[3])
        for n in range(cylinders.shape[0]):
            if hidden:
                break
            cx, cy, radius, height = cylinders[n]
            hidden = _hidden(x, y, z, dx, dy, dz, cx, cy, radius, height)
        count += not hidden
    return count


@compiled
def _walled(x: float, y: float, dx: float, dy: float, segments: Floats) -> bool:
    for k in range(segments.shape[0]):
        ax, ay = segments[k, 0] - x, segments[k, 1] - y
        ex, ey = segments[k, 2] - segments[k, 0], segments[k, 3] - segments[k, 1]
        across = dx * ey - dy * ex
        if across == 0.0:
            continue
        share = (ax * ey - ay * ex) / across
        along = (ax * dy - ay * dx) / across
        if _END < share < 1.0 - _END and 0.0 <= along <= 1.0:
            return True
    return False


@compiled
def _hidden(  # noqa: PLR0913 - plain numbers are what a kernel takes at once
    x: float,
    y: float,
    z: float,
    dx: float,
    dy: float,
    dz: float,
    cx: float,
    cy: float,
    radius: float,
    height: float,
) -> bool:
    square, ax, ay = dx * dx + dy * dy, cx - x, cy - y
    outside = ax * ax + ay * ay - radius * radius
    along = ax * dx + ay * dy
    root = along * along - square * outside
    if outside <= 0.0 or along <= 0.0 or root <= 0.0:
        return False
    share = (along - math.sqrt(root)) / square  # the line rises: lowest where it enters
    return share < 1.0 and z + share * dz < height


@compiled
def within(x: float, y: float, border: Floats) -> tuple[bool, float]:
    """Whether a place is inside a ring of (n, 4) sides, and its distance to the nearest, m.

    Without sides: inside, at infinite distance.
    """
    least, inside = math.inf, border.shape[0] == 0
    for k in range(border.shape[0]):
        x1, y1, x2, y2 = border[k]
        if (y1 > y) != (y2 > y) and x < x1 + (y - y1) * (x2 - x1) / (y2 - y1):
            inside = not inside
        ex, ey = x2 - x1, y2 - y1
        along = ((x - x1) * ex + (y - y1) * ey) / (ex * ex + ey * ey)
        along = min(1.0, max(0.0, along))
        least = min(least, math.hypot(x - x1 - along * ex, y - y1 - along * ey))
    return inside, least


@example
def _example() -> None:
    count_seeing(0.0, 0.0, 0.0, np.ones((1, 3)), np.ones((1, 4)), np.ones((1, 4)), NOTHING)
    border, bodies = np.arange(4.0).reshape(1, 4), (np.ones((1, 4)), np.ones((1, 4)))
    within(0.0, 0.0, border)
    past = np.zeros((1, 4)), 0, 1
    look(past, 0, (0.0, 0.0, 0.0, 0.0), (0.0, 0.0), border, np.ones((1, 3)), bodies)
