"""A scanned map as a floor and a room: the outline of its largest free piece, as polygons.

Specks are dropped, unreachable cells are left out, and corners are removed where the outline stays
within half a cell. A speck that was an obstacle after all will be seen by the scanners.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage

from engine.files import mistake
from hw import Pose2
from hw.scene import Point, Ring, Room
from states.maps.cells import Mask
from states.maps.distance import Array, distances
from states.maps.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyMap, load_map

SPECK_AREA, SPECK_SIDE = 0.01, 0.15
"""A speck covers less than this, m2, and is no longer and no wider than that, m: up to three cells
of 5 cm, single beams that went astray. A leg of a table is larger on cells that show it as such."""
LOOSE = 0.5
"""How far the outline may move when corners are removed, in cells."""
ROBOT_M, APART_M = 1.0, 3.0
"""Distances of a robot's start pose from walls and from a person, m, where there is room."""
_LEAST_AREA = 1e-6
_STAIR = 1
_SHOWN = 6
"""Largest number of specks whose places are reported."""
_ROUNDING = 1e-9


def load_floor(path: Path | str) -> OccupancyMap:
    """The floor of a map file, `tidied`: for all that drive on it or measure it.

    Raises:
        FileError: the map is wrong, or none of its cells is free.
    """
    map_ = load_map(path)
    try:
        return tidied(map_)
    except ValueError as refused:
        raise mistake(path, str(refused)) from None


def tidied(map_: OccupancyMap) -> OccupancyMap:
    """The map without specks; free cells not connected to the largest piece become unknown.

    Remarks tell what was left out.

    Raises:
        ValueError: no cell is free.
    """
    free = map_.values == FREE
    if not free.any():
        raise ValueError("no cell of the map is free")
    specks = _specks(free, map_.resolution)
    free |= specks
    pieces, _ = ndimage.label(free)
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    own = pieces == sizes.argmax()
    values = np.where(own, FREE, np.where(map_.values == FREE, UNKNOWN, map_.values))
    values = values.astype(np.int16)
    values.setflags(write=False)
    dropped = specks & (map_.values >= OCCUPIED)
    told = (*map_.remarks, *_speck_remarks(map_, dropped), *_piece_remarks(map_, free & ~own))
    return replace(map_, values=values, remarks=told)


def _specks(free: Mask, resolution: float) -> Mask:
    """Cells that are not free and belong to a speck, seen as obstacles that touch at corners."""
    things, _ = ndimage.label(~free, np.ones((3, 3)))
    area = np.bincount(things.ravel()) * resolution**2
    sides = [max(p.stop - p.start for p in box) for box in ndimage.find_objects(things)]
    small = (area < SPECK_AREA - _ROUNDING) & (
        np.array([0, *sides]) * resolution <= SPECK_SIDE + _ROUNDING
    )
    small[0] = False
    specks: Mask = small[things]
    return specks


def _speck_remarks(map_: OccupancyMap, dropped: Mask) -> Iterator[str]:
    things, count = ndimage.label(dropped, np.ones((3, 3)))
    if count:
        boxes = ndimage.find_objects(things)
        side = map_.resolution * max(p.stop - p.start for box in boxes for p in box)
        places = ", ".join(_place(map_, *np.argwhere(things == n)[0]) for n in _shown_labels(count))
        more = f" and {count - _SHOWN} more" if count > _SHOWN else ""
        specks = "1 speck" if count == 1 else f"{count} specks"
        yield f"{specks} of at most {side:.2g} m left out, at {places}{more}"


def _piece_remarks(map_: OccupancyMap, others: Mask) -> Iterator[str]:
    if others.any():
        area = np.count_nonzero(others) * map_.resolution**2
        yield f"{area:.2f} m2 of free floor left out: it is not connected to the largest piece"


def _shown_labels(count: int) -> range:
    return range(1, 1 + min(count, _SHOWN))


def _place(map_: OccupancyMap, row: int, column: int) -> str:
    x, y = map_.center(int(row), int(column))
    return f"({x:.2f}, {y:.2f})"


def room_of(map_: OccupancyMap) -> Room:
    """The room of a tidied map; every cell that is not free is an obstacle."""
    rings = [np.array(list(_smoothed(ring))) for ring in outlines(map_.values == FREE)]
    areas = [_area(ring) for ring in rings]
    outer = max(range(len(rings)), key=lambda i: areas[i])
    holes = [ring for i, ring in enumerate(rings) if i != outer and areas[i] < -_LEAST_AREA]
    shape = shapely.Polygon(rings[outer], holes)
    shape = shape if shape.is_valid else shape.buffer(0.0)
    loose = shapely.simplify(shape, LOOSE, preserve_topology=True)
    outline = max(shapely.get_parts(loose), key=lambda part: part.area)
    walls = tuple(_ring(hole, map_) for hole in outline.interiors)
    return Room(outer=_ring(outline.exterior, map_), walls=walls)


def start_in(map_: OccupancyMap) -> Pose2:
    """A start pose, yaw 0: the most open place at least APART_M from the very most open one.

    That one is left for people, and a robot can drive between both. Without such a place the start
    is the most open place itself.
    """
    field = distances(np.pad(map_.values != FREE, 1, constant_values=True), map_.resolution)
    field = field[1:-1, 1:-1]
    best = np.unravel_index(int(field.argmax()), field.shape)
    row, column = np.indices(field.shape)
    away = np.hypot(row - best[0], column - best[1]) * map_.resolution
    pieces, _ = ndimage.label(field >= ROBOT_M)
    apart = np.where((pieces == pieces[best]) & (pieces > 0) & (away >= APART_M), field, 0.0)
    found = np.unravel_index(int(apart.argmax()), field.shape) if apart.any() else best
    return Pose2(*map_.center(int(found[0]), int(found[1])))


def outlines(free: Mask) -> list[NDArray[np.int64]]:
    """Boundary rings of the free cells, corners (n, 2) x, y in cells, free cells on the left.

    Free cells that touch only at a corner are not connected.
    """
    leads: dict[Point, list[Point]] = {}
    padded = np.pad(free, 1)
    for (up, across), start, end in _SIDES:
        beside = padded[1 + up : 1 + up + free.shape[0], 1 + across : 1 + across + free.shape[1]]
        for row, column in np.argwhere(free & ~beside).tolist():
            here = (column + start[0], row + start[1])
            leads.setdefault(here, []).append((column + end[0], row + end[1]))
    rings = []
    while leads:
        place = next(iter(leads))
        ring, heading = [place], None
        while place in leads:
            place, heading = _next(leads, place, heading)
            ring.append(place)
        rings.append(np.array(ring[:-1], dtype=np.int64))
    return rings


_SIDES = (
    ((-1, 0), (0, 0), (1, 0)),
    ((1, 0), (1, 1), (0, 1)),
    ((0, -1), (0, 1), (0, 0)),
    ((0, 1), (1, 0), (1, 1)),
)
"""Neighbours of a cell (rows, columns), each with the start and end of the side between."""


def _next(
    leads: dict[Point, list[Point]], place: Point, heading: Point | None
) -> tuple[Point, Point]:
    """The next corner and the heading there; of two sides to follow, the left one."""
    onward = leads[place]
    chosen = 0
    if len(onward) > 1 and heading is not None:
        left = (place[0] - heading[1], place[1] + heading[0])
        chosen = onward.index(left) if left in onward else 0
    there = onward.pop(chosen)
    if not onward:
        del leads[place]
    return there, (there[0] - place[0], there[1] - place[1])


def _smoothed(ring: NDArray[np.int64]) -> Iterator[Point]:
    """The corners of a ring; of stairs (oblique walls on cells), the midpoints of the steps."""
    ahead, behind = np.roll(ring, -1, axis=0) - ring, ring - np.roll(ring, 1, axis=0)
    turns = (ahead != behind).any(axis=1)
    corners = ring[turns]
    lengths = np.abs(np.roll(corners, -1, axis=0) - corners).sum(axis=1)
    found: list[Point] = []
    for i, (x, y) in enumerate(corners.tolist()):
        if lengths[i - 1] > _STAIR and lengths[i] > _STAIR:
            found.append((float(x), float(y)))
        if lengths[i] <= _STAIR:
            far_x, far_y = corners[(i + 1) % len(corners)].tolist()
            found.append((0.5 * (x + far_x), 0.5 * (y + far_y)))
    plain = len(found) < 3 or abs(_area(np.array(found))) < 0.5
    yield from ([(float(x), float(y)) for x, y in corners.tolist()] if plain else found)


def _area(ring: Array) -> float:
    """Signed area in cells, positive if counter-clockwise."""
    x, y = ring.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _ring(line: shapely.LinearRing, map_: OccupancyMap) -> Ring:
    size = map_.resolution
    return tuple(
        map_.map_from_corner.transform(x * size, y * size) for x, y in list(line.coords)[:-1]
    )
