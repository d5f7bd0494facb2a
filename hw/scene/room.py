"""A room as polygons: an outer ring, walls and columns in it, and the tracked area.

Checks and distances are plain Python; shapely is imported only for areas and the largest disc.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated

from engine.files.declared import Count, Fault, Item, Written, reader_of
from hw.places import PlanePoint

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

Point = tuple[float, float]
Ring = tuple[Point, ...]
Segment = tuple[float, float, float, float]

MIN_WIDTH = 1e-3
"""A ring whose corners are all closer than this to one line has no area, m."""
MAX_CORNERS = 1000
"""Largest number of corners of a ring."""


@dataclass(frozen=True, slots=True)
class Disc:
    """A circle in the map, m."""

    x: float
    y: float
    radius: float

    def grown(self, margin: float, *places: Point) -> Disc:
        """Grown by up to `margin`, m, but not over one of the places."""
        radius = self.radius + margin
        for place in places:
            radius = min(radius, math.dist(place, (self.x, self.y)))
        return Disc(self.x, self.y, max(self.radius, radius))


_corners = reader_of(tuple[PlanePoint, ...])


def ring(item: Item) -> Ring:
    """A polygon written as a list of corners.

    Raises:
        FileError: an invalid corner, or the ring has no area or crosses itself.
    """
    corners: Ring = _corners(item)
    if len(corners) > 1 and corners[0] == corners[-1]:
        corners = corners[:-1]  # the closed form of GeoJSON is accepted
    fault = ring_fault(corners)
    if fault is not None:
        raise item.error(fault)
    return corners


_Corners = Annotated[tuple[PlanePoint, ...], Count(3, MAX_CORNERS + 1)]
Polygon = Annotated[Ring, ring, Written(_Corners)]


@dataclass(frozen=True)
class Room:
    """Rings are closed without repeating the first corner, m, in either direction."""

    outer: Polygon
    """The corners of the room."""
    walls: tuple[Polygon, ...] = ()
    """Polygons inside it that block the way."""
    columns: tuple[Polygon, ...] = ()
    """The same, for columns."""
    tracked_area: Polygon | None = None
    """Where the person's tracking works (R6); everywhere without it."""

    def faults(self) -> Iterator[Fault]:
        """Walls and columns outside the room, by key."""
        for key, rings in (("walls", self.walls), ("columns", self.columns)):
            for n, ring in enumerate(rings):
                if not self._reaches(ring):
                    yield f"{key}.{n}", "lies outside the room's outer ring"

    def _reaches(self, ring: Ring) -> bool:
        x_low, y_low, x_high, y_high = self.bounds
        crosses_x = any(x > x_low for x, _ in ring) and any(x < x_high for x, _ in ring)
        return crosses_x and any(y > y_low for _, y in ring) and any(y < y_high for _, y in ring)

    @property
    def obstacles(self) -> tuple[Ring, ...]:
        """Walls and columns."""
        return self.walls + self.columns

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """Every edge of every ring: x1, y1, x2, y2, m."""
        return tuple(edge for ring in (self.outer, *self.obstacles) for edge in edges(ring))

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max of the outer ring."""
        xs, ys = zip(*self.outer, strict=True)
        return min(xs), min(ys), max(xs), max(ys)

    @cached_property
    def free_space(self) -> BaseGeometry:
        """The free floor as a shapely geometry (Polygon or MultiPolygon)."""
        from shapely.geometry import Polygon
        from shapely.ops import unary_union

        return Polygon(self.outer).difference(unary_union([Polygon(r) for r in self.obstacles]))

    @cached_property
    def largest_free_disc(self) -> Disc:
        """The largest free circle, to 1 mm; recordings are placed at its centre."""
        import shapely

        radius_line = shapely.maximum_inscribed_circle(self.free_space, tolerance=1e-3)
        (x, y), _ = radius_line.coords
        return Disc(x, y, radius_line.length)

    def is_free(self, x: float, y: float) -> bool:
        """True if this point is on the floor, outside walls and columns."""
        if not contains(self.outer, x, y):
            return False
        return not any(contains(ring, x, y) for ring in self.obstacles)

    def is_tracked(self, x: float, y: float) -> bool:
        """True if the person's tracking works here."""
        return self.tracked_area is None or contains(self.tracked_area, x, y)

    def sees(self, x1: float, y1: float, x2: float, y2: float) -> bool:
        """True if the segment between two points crosses no wall."""
        way = (x1, y1, x2, y2)
        if not (self.is_free(x1, y1) and self.is_free(x2, y2)):
            return False
        return not any(_cross(way, edge, adjacent=False) for edge in self.segments)

    def clearance(self, x: float, y: float) -> float:
        """Distance to the nearest wall, m; 0 for a point that is not free."""
        if not self.is_free(x, y):
            return 0.0
        return min(distance_to_segment(x, y, edge) for edge in self.segments)

    def way_clearance(self, x1: float, y1: float, x2: float, y2: float) -> float:
        """Least distance of a segment to the walls, m; 0 if it leaves the free floor."""
        if not self.sees(x1, y1, x2, y2):
            return 0.0
        way = (x1, y1, x2, y2)
        # two segments that do not cross are nearest at an end of one of them
        ends = (
            min(distance_to_segment(*e[:2], way), distance_to_segment(*e[2:], way))
            for e in self.segments
        )
        return min(self.clearance(x1, y1), self.clearance(x2, y2), *ends)


def edges(ring: Ring) -> list[Segment]:
    """The sides of a ring, the closing one last."""
    return [(*a, *b) for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]


def contains(ring: Ring, x: float, y: float) -> bool:
    """True for a point (m) inside a ring, by the even-odd rule; on an edge it may be either."""
    inside = False
    for x1, y1, x2, y2 in edges(ring):
        if (y1 > y) != (y2 > y) and x < x1 + (y - y1) * (x2 - x1) / (y2 - y1):
            inside = not inside
    return inside


def distance_to_segment(x: float, y: float, segment: Segment) -> float:
    """Distance of a point to a segment, m."""
    x1, y1, x2, y2 = segment
    dx, dy = x2 - x1, y2 - y1
    square = dx * dx + dy * dy
    if square == 0.0:
        return math.hypot(x - x1, y - y1)
    along = min(1.0, max(0.0, ((x - x1) * dx + (y - y1) * dy) / square))
    return math.hypot(x - x1 - along * dx, y - y1 - along * dy)


def foot(x: float, y: float, segment: Segment) -> Point:
    """The point of a segment next to a point, m."""
    x1, y1, x2, y2 = segment
    dx, dy = x2 - x1, y2 - y1
    length = math.hypot(dx, dy)
    along = ((x - x1) * dx + (y - y1) * dy) / length**2 if length else 0.0
    share = min(1.0, max(0.0, along))
    return x1 + share * dx, y1 + share * dy


def _on_one_line(ring: Ring) -> bool:
    far = max(ring, key=lambda corner: math.dist(ring[0], corner))
    line = (*ring[0], *far)
    return max(distance_to_segment(x, y, line) for x, y in ring) < MIN_WIDTH


def ring_fault(ring: Ring) -> str | None:
    """What is wrong with a ring from a file, or None."""
    if len(ring) < 3:
        return f"has {len(ring)} corners; a polygon needs at least 3"
    if len(ring) > MAX_CORNERS:
        return f"has {len(ring)} corners; at most {MAX_CORNERS} are allowed"
    if len(set(ring)) < len(ring):
        return "has the same corner twice; list each corner once, the ring closes by itself"
    if _on_one_line(ring):
        return "has no area; its corners must not lie on one line"
    sides = edges(ring)
    for i, side in enumerate(sides):
        for j in range(i + 1, len(sides)):
            adjacent = j == i + 1 or (i == 0 and j == len(sides) - 1)
            if _cross(side, sides[j], adjacent):
                j_end = (j + 1) % len(sides)
                return f"crosses itself: side {i}-{i + 1} meets side {j}-{j_end}"
    return None


def _cross(a: Segment, b: Segment, adjacent: bool) -> bool:
    ax, ay, bx, by = a
    cx, cy, dx, dy = b
    if adjacent:
        # neighbours share a corner: they overlap only if one folds back onto the other
        (sx, sy), (px, py), (qx, qy) = _fork((ax, ay), (bx, by), (cx, cy), (dx, dy))
        cross = (px - sx) * (qy - sy) - (py - sy) * (qx - sx)
        return cross == 0.0 and (px - sx) * (qx - sx) + (py - sy) * (qy - sy) > 0.0
    side_c, side_d = _side(a, cx, cy), _side(a, dx, dy)
    side_a, side_b = _side(b, ax, ay), _side(b, bx, by)
    if side_c * side_d < 0 and side_a * side_b < 0:
        return True
    touching = ((side_c, cx, cy, a), (side_d, dx, dy, a), (side_a, ax, ay, b), (side_b, bx, by, b))
    return any(side == 0 and _within(line, x, y) for side, x, y, line in touching)


def _fork(a: Point, b: Point, c: Point, d: Point) -> tuple[Point, Point, Point]:
    return (b, a, d) if b == c else (a, b, c)


def _side(line: Segment, x: float, y: float) -> int:
    x1, y1, x2, y2 = line
    cross = (x2 - x1) * (y - y1) - (y2 - y1) * (x - x1)
    return (cross > 0.0) - (cross < 0.0)


def _within(line: Segment, x: float, y: float) -> bool:
    x1, y1, x2, y2 = line
    return min(x1, x2) <= x <= max(x1, x2) and min(y1, y2) <= y <= max(y1, y2)
