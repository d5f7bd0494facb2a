"""Passages of a floor of polygons that an inflation closes, with their exact widths (R119).

A door is the shortest line between two facing walls: the circle with it as a diameter contains no
other wall. Doors outside the usable floor cut the free floor into cells; passages are the doors on
a path through the cells from usable to usable floor. Niches and corners have doors too, but no such
path leads through them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from hw.scene import Point
from states.floors.usable_space import LEAST_PIECE, Passage
from states.navigation.exact import TOLERANCE, Array

if TYPE_CHECKING:
    import networkx as nx

Geometry = Any  # shapely carries no types

_BLADE = 1e-4
_LEAST_WIDTH = 1e-2
_USABLE = "usable"


def closed_passages(free: Geometry, usable: Geometry, widest: float) -> tuple[Passage, ...]:
    """Passages narrower than `widest` that lie outside the usable floor, narrowest first, m."""
    if usable.area < LEAST_PIECE:
        return ()
    doors = [door for door in _doors(free, widest) if not usable.intersects(_line(door))]
    if not doors:
        return ()
    import networkx as nx

    blades = [_line(door, _BLADE).buffer(_BLADE, cap_style="flat") for door in doors]
    cells = shapely.get_parts(free.difference(shapely.union_all(blades)))
    names = _names(cells, usable)
    tree = shapely.STRtree(cells)
    graph = nx.Graph()
    found = []
    for number, door in enumerate(doors):
        sides = [_cell(tree, names, place) for place in _both_sides(door)]
        if sides[0] == sides[1] == _USABLE:
            found.append(door)
        elif None not in sides:
            graph.add_edges_from((side, (number,)) for side in sides)
    for block in nx.biconnected_components(graph):
        if _USABLE in block and len(block) > 2:
            found += _along(graph.subgraph(block), doors)
    return tuple(sorted(found, key=lambda door: (door.width, door.start)))


def _along(block: nx.Graph, doors: list[Passage]) -> list[Passage]:
    """The doors of a block of cells; without forks only the narrowest (of equals the middle)."""
    here = [doors[node[0]] for node in block if isinstance(node, tuple)]
    forks = any(block.degree(node) > 2 for node in block if node != _USABLE)
    if forks:
        return here
    least = min(door.width for door in here) + TOLERANCE
    narrow = sorted((d for d in here if d.width <= least), key=lambda door: door.start)
    return [narrow[len(narrow) // 2]]


def _names(cells: Any, usable: Geometry) -> list[str | int]:
    """The number of each cell; all cells with usable floor have one common name."""
    pieces = [piece for piece in shapely.get_parts(usable) if piece.area >= LEAST_PIECE]
    # no door cuts through usable floor, so a piece lies in one cell
    inside = shapely.STRtree(cells).query(
        [piece.representative_point() for piece in pieces], predicate="intersects"
    )
    holding = set(inside[1].tolist())
    return [_USABLE if number in holding else number for number in range(len(cells))]


def _cell(tree: Any, names: list[str | int], place: Point) -> str | int | None:
    """The name of the cell at a place; None inside a wall."""
    numbers = tree.query(shapely.Point(place), predicate="intersects")
    return names[int(numbers[0])] if len(numbers) else None


def _doors(free: Geometry, widest: float) -> list[Passage]:
    sides = sides_of(free)
    tree = shapely.STRtree(shapely.linestrings(sides.reshape(-1, 2, 2)))
    one, two = tree.query(tree.geometries, predicate="dwithin", distance=widest)
    one, two = one[one < two], two[one < two]
    starts, ends = _shortest(sides[one], sides[two])
    widths = np.hypot(*(ends - starts).T)
    middles = 0.5 * (starts + ends)
    shapely.prepare(free)
    facing = (widths >= _LEAST_WIDTH) & (widths <= widest)
    facing &= shapely.contains_xy(free, *middles.T)
    places = shapely.points(middles[facing])
    facing[facing] = shapely.distance(free.boundary, places) > 0.5 * widths[facing] - TOLERANCE
    found: dict[tuple[float, ...], Passage] = {}
    for i in np.flatnonzero(facing):
        door = Passage(tuple(starts[i].tolist()), tuple(ends[i].tolist()), float(widths[i]))
        found.setdefault(tuple(np.round(middles[i], 6).tolist()), door)
    return list(found.values())


def sides_of(area: Geometry) -> Array:
    """x1, y1, x2, y2 of every side of a Polygon or MultiPolygon, (n, 4), m."""
    rings = shapely.get_rings(shapely.get_parts(area))
    rows = []
    for ring in rings:
        corners = shapely.get_coordinates(ring)
        rows.append(np.concatenate([corners[:-1], corners[1:]], axis=1))
    return np.concatenate(rows) if rows else np.empty((0, 4))


def _shortest(one: Array, two: Array) -> tuple[Array, Array]:
    """Ends of the shortest lines between pairs of sides, (n, 2) each.

    Of parallel sides it is the line in the middle of their overlap.
    """
    lines = shapely.shortest_line(*(shapely.linestrings(s.reshape(-1, 2, 2)) for s in (one, two)))
    starts, ends = shapely.get_coordinates(lines).reshape(-1, 2, 2).transpose(1, 0, 2).copy()
    origin, ahead = one[:, :2], one[:, 2:] - one[:, :2]
    length = np.hypot(*ahead.T)
    ahead = ahead / length[:, None]
    left = np.column_stack((-ahead[:, 1], ahead[:, 0]))
    first, second = two[:, :2] - origin, two[:, 2:] - origin
    along = np.sort([(first * ahead).sum(axis=1), (second * ahead).sum(axis=1)], axis=0)
    low, high = np.maximum(0.0, along[0]), np.minimum(length, along[1])
    across = (first * left).sum(axis=1)
    beside = (high > low) & (np.abs((second * left).sum(axis=1) - across) < TOLERANCE)
    middle = origin + (0.5 * (low + high))[:, None] * ahead
    starts[beside] = middle[beside]
    ends[beside] = (middle + across[:, None] * left)[beside]
    return starts, ends


def _line(door: Passage, longer: float = 0.0) -> Geometry:
    """The door as a line, extended at both ends."""
    (x1, y1), (x2, y2) = door.start, door.end
    dx, dy = longer * (x2 - x1) / door.width, longer * (y2 - y1) / door.width
    return shapely.LineString([(x1 - dx, y1 - dy), (x2 + dx, y2 + dy)])


def _both_sides(door: Passage) -> tuple[Point, Point]:
    (x1, y1), (x2, y2), (x, y) = door.start, door.end, door.middle
    dx, dy = 3.0 * _BLADE * (y1 - y2) / door.width, 3.0 * _BLADE * (x2 - x1) / door.width
    return (x + dx, y + dy), (x - dx, y - dy)
