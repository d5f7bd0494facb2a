"""The global planner `exact`: the shortest path among polygons and around the user.

Walls and columns are inflated with round corners, as costmap_2d does, but as geometry instead of
cells; the user is a disc that may be elsewhere in every query (R34, R51, R120). The path is the
shortest one, not an approximation on a grid.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from copy import copy
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hw import example
from hw.scene import Disc, Point
from states.navigation.exact.arcs import shortest_path
from states.navigation.exact.circles import blocked_arcs
from states.navigation.exact.clearance import (
    TOLERANCE,
    TURN,
    Array,
    are_free,
    check_radius,
    comes_no_nearer,
    distance_to_nearest,
    is_free,
    line_comes_no_nearer,
    passes_disc,
)
from states.navigation.exact.nearest_free import nearest_free, notches
from states.navigation.exact.path import Path
from states.navigation.exact.tangents import InflatedRoom, UserDisc, goes_straight, link_world

Ring = Sequence[Point]

LEAST_RADIUS = 1e-3
"""Least inflation, m, so that paths neither touch polygons nor lead between touching ones."""

NOBODY = Disc(0.0, 0.0, 0.0)


class ExactPlanner:
    """Shortest paths for the robot's centre in a known room.

    The centre stays inside the ring `outer`, `inflation_radius` away from it and from all
    `obstacles` (walls, columns); m, in the map. Rings may touch and overlap.

    Raises:
        ValueError: a coordinate or radius is not finite, or a ring has fewer than three corners.
    """

    def __init__(
        self,
        outer: Ring,
        obstacles: Iterable[Ring] = (),
        *,
        inflation_radius: float,
    ) -> None:
        self.inflation_radius = inflation_radius
        self._sides = _sides([(ring, inflation_radius) for ring in (outer, *obstacles)])
        check_radius(inflation_radius)
        self._discs = _discs(self._sides)
        self.boxes: tuple[Ring, ...] = ()
        _ = self._world, self._notches

    def among(self, boxes: Iterable[Ring]) -> ExactPlanner:
        """A planner with these obstacles too; tangents around them are found when first needed."""
        found = copy(self)
        found.boxes = tuple(boxes)
        more = _sides([(ring, self.inflation_radius) for ring in found.boxes])
        more[:, 5] += self._sides[-1, 5] + 1.0
        found.__dict__.pop("_world", None)
        found.__dict__.pop("_notches", None)
        found._sides = np.concatenate((self._sides, more))
        found._discs = _discs(found._sides)
        return found

    @cached_property
    def _world(self) -> InflatedRoom:
        return _world(self._discs, self._sides)

    @cached_property
    def _notches(self) -> Array:
        return notches(self._discs, self._sides)

    def plan(
        self, start: Point, goal: Point, user: Disc | None = None, side: int = 0
    ) -> Path | None:
        """The shortest path from start to goal, or None if there is none.

        A start inside an inflation is left first, straight to the nearest free place. With `side`
        +1 the path passes the user counter-clockwise (who is then on its left), with -1 clockwise,
        with 0 on the shorter side.
        """
        start, goal = as_floats(start), as_floats(goal)
        disc = as_disc(user)
        begin = start if self.is_free(start, user) else self.nearest_free(start, user)
        if begin is None or not self.is_free(goal, user):
            return None
        walls = UserDisc(disc.x, disc.y, disc.radius, *separating_ray(begin, goal, disc, side))
        path = self._straight(begin, goal, walls) or self._around(begin, goal, walls)
        if path is None or begin == start:
            return path
        leaving = np.array(((*start, math.inf),))
        return Path(np.concatenate((leaving, path.line)), path.length + math.dist(start, begin))

    def is_free(self, place: Point, user: Disc | None = None) -> bool:
        """True if the robot's centre may be here; False for NaN."""
        x, y = as_floats(place)
        if user is not None and math.dist((x, y), (user.x, user.y)) < user.radius - TOLERANCE:
            return False
        if not (math.isfinite(x) and math.isfinite(y)):
            return False
        return bool(is_free(x, y, self._discs, self._sides))

    def are_free(self, places: Array) -> NDArray[np.bool_]:
        """`is_free` of each of the places (n, 2), m, without the user: (n,)."""
        return are_free(places, self._discs, self._sides)

    def allows(
        self, start: Point, end: Point, user: Disc | None = None, slack: float = 0.0
    ) -> bool:
        """True if going straight from start to end keeps all required distances.

        The robot may start too near to something: it may then move along or away from that, but
        not nearer to it. `slack` is subtracted from the required distances to walls, m.
        """
        start, end = as_floats(start), as_floats(end)
        if user is not None and user.radius > 0.0:
            x, y = float(user.x), float(user.y)
            reach = min(float(user.radius), math.dist(start, (x, y))) - TOLERANCE
            if not passes_disc(*start, *end, x, y, reach):
                return False
        return bool(comes_no_nearer(*start, *end, self._sides, float(slack)))

    def allows_line(self, line: Array, user: Disc | None = None) -> bool:
        """`allows` from each point of a line (n, 3), x and y first, to the next."""
        disc = as_disc(user)
        around = disc.x, disc.y, disc.radius
        return bool(line_comes_no_nearer(line, around, self._sides))

    def nearest_free(self, place: Point, user: Disc | None = None) -> Point | None:
        """The nearest free place that `allows` lets the robot go straight to, or None."""
        place, disc = as_floats(place), as_disc(user)
        if not (math.isfinite(place[0]) and math.isfinite(place[1])):
            return None
        around = np.array((disc.x, disc.y, disc.radius))
        found = nearest_free(*place, self._discs, self._sides, self._notches, around)
        return (float(found[0]), float(found[1])) if len(found) else None

    def clearance(self, place: Point) -> float:
        """Distance to the nearest side of any ring, not inflated, m."""
        return float(distance_to_nearest(*as_floats(place), self._sides))

    def _straight(self, start: Point, goal: Point, user: UserDisc) -> Path | None:
        if not goes_straight(*start, *goal, user, self._discs, self._sides):
            return None
        return Path.of_points((start, goal))

    def _around(self, start: Point, goal: Point, user: UserDisc) -> Path | None:
        length, line = shortest_path(self._world, user, start, goal)
        return Path(line, float(length)) if math.isfinite(length) else None


def as_floats(place: Point) -> Point:
    """A place as floats: integers would make numba compile another version during a run."""
    return float(place[0]), float(place[1])


def as_disc(user: Disc | None) -> Disc:
    """The user's disc as floats, of radius 0 if there is no user."""
    if user is None:
        return NOBODY
    return Disc(float(user.x), float(user.y), float(user.radius))


def _discs(sides: Array) -> Array:
    return np.unique(sides[:, [0, 1, 4]], axis=0)


def _sides(rings: list[tuple[Ring, float]]) -> Array:
    rows = []
    for number, (ring, radius) in enumerate(rings):
        corners = [corner for i, corner in enumerate(ring) if tuple(corner) != tuple(ring[i - 1])]
        if len(corners) < 3:
            raise ValueError(f"ring {number}: {len(corners)} different corners; at least 3 needed")
        if not (math.isfinite(radius) and np.isfinite(corners).all()):
            raise ValueError(f"ring {number}: a corner or its radius {radius} is not finite")
        grown = max(LEAST_RADIUS, float(radius))
        for i, (x, y) in enumerate(corners):
            rows.append((*corners[i - 1], x, y, grown, float(number)))
    return np.array(rows, dtype=np.float64)


def _world(discs: Array, sides: Array) -> InflatedRoom:
    kept, arcs, arc_at = [], [], [0]
    for x, y, radius in discs:
        blocked, some_free = blocked_arcs(x, y, radius, discs, sides)
        if not some_free:
            continue
        kept.append((x, y, radius))
        arcs.append(blocked)
        arc_at.append(arc_at[-1] + len(blocked))
    corners = np.array(kept, dtype=np.float64).reshape(-1, 3)
    flat = np.concatenate([*arcs, np.empty((0, 2))])
    return link_world(corners, discs, sides, np.array(arc_at), flat)


def separating_ray(start: Point, goal: Point, user: Disc, side: int) -> Point:
    """Unit vector of a ray from the user that paths on `side` must not cross; (0, 0): any side.

    It points to the middle of the arc around the user, from start to goal, on the other side.
    """
    if side == 0 or user.radius == 0.0:
        return 0.0, 0.0
    first = math.atan2(start[1] - user.y, start[0] - user.x)
    last = math.atan2(goal[1] - user.y, goal[0] - user.x)
    other = (TURN - (side * (last - first)) % TURN) / 2.0
    return math.cos(first - side * other), math.sin(first - side * other)


@example
def _example() -> None:
    room = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
    column = ((3.8, 3.8), (4.2, 3.8), (4.2, 4.2), (3.8, 4.2))
    planner = ExactPlanner(room, (column,), inflation_radius=0.5)
    user = Disc(6.0, 6.0, 1.0)
    planner.plan((0.1, 0.1), (7.2, 7.4), user, side=1)
    planner.plan((1.0, 1.0), (2.0, 2.0))
    planner.allows((1.0, 1.0), (2.0, 2.0))
    planner.allows_line(np.ones((2, 3)))
    planner.clearance((1.0, 1.0))
    planner.are_free(np.ones((2, 2)))
    planner.among((column,)).plan((0.1, 0.1), (7.2, 7.4))
