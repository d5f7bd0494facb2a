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

from hw import compiled, example
from hw.scene import Disc, Point
from states.navigation.exact.arcs import shortest_path
from states.navigation.exact.circles import blocked_arcs
from states.navigation.exact.clearance import (
    Array,
    Circle,
    are_free,
    check_radius,
    distance_to_nearest,
    first_way,
    is_free_beside,
    leg_comes_no_nearer,
    line_comes_no_nearer,
    rays_come_no_nearer,
)
from states.navigation.exact.nearest_free import nearest_free, notches
from states.navigation.exact.path import Path
from states.navigation.exact.tangents import (
    InflatedRoom,
    UserDisc,
    goes_straight,
    link_world,
    separating_ray,
)

Ring = Sequence[Point]

LEAST_RADIUS = 1e-3
"""Least inflation, m, so that paths neither touch polygons nor lead between touching ones."""

NOBODY = (0.0, 0.0, 0.0)
NO_WAY, STRAIGHT, AROUND = 0, 1, 2
"""What `first_look` finds."""


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
        start, goal = (float(start[0]), float(start[1])), (float(goal[0]), float(goal[1]))
        disc = as_disc(user)
        is_free = is_free_beside(start, disc, self._discs, self._sides)
        begin = start if is_free else self.nearest_free(start, user)
        if begin is None:
            return None
        way, ray = first_look(begin, goal, disc, side, self._discs, self._sides)
        if way == NO_WAY:
            return None
        if way == STRAIGHT:
            path = Path.straight(begin, goal)
        else:
            length, line = shortest_path(self._world, disc, ray, begin, goal)
            if len(line) == 0:
                return None
            path = Path(line, float(length))
        if begin == start:
            return path
        leaving = np.array(((*start, math.inf),))
        return Path(np.concatenate((leaving, path.line)), path.length + math.dist(start, begin))

    def is_free(self, place: Point, user: Disc | None = None) -> bool:
        """True if the robot's centre may be here; False for NaN."""
        at = float(place[0]), float(place[1])
        return bool(is_free_beside(at, as_disc(user), self._discs, self._sides))

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
        begin, there = (float(start[0]), float(start[1])), (float(end[0]), float(end[1]))
        return bool(leg_comes_no_nearer(begin, there, as_disc(user), self._sides, float(slack)))

    def first_allowed(
        self, start: Point, ways: Array, user: Disc | None, slack: float, spare: float
    ) -> int:
        """Index of the first of some ways that is allowed, see `GlobalPlanner`."""
        place = float(start[0]), float(start[1])
        return int(first_way(place, ways, as_disc(user), self._sides, slack, float(spare)))

    def allows_each(self, start: Point, ends: Array, user: Disc | None = None) -> bool:
        """`allows` from the start to each of some places (n, 2)."""
        place = float(start[0]), float(start[1])
        return bool(rays_come_no_nearer(place, ends, as_disc(user), self._sides))

    def allows_line(self, line: Array, user: Disc | None = None) -> bool:
        """`allows` from each point of a line (n, 3), x and y first, to the next."""
        return bool(line_comes_no_nearer(line, as_disc(user), self._sides))

    def nearest_free(self, place: Point, user: Disc | None = None) -> Point | None:
        """The nearest free place that `allows` lets the robot go straight to, or None."""
        x, y = float(place[0]), float(place[1])
        if not (math.isfinite(x) and math.isfinite(y)):
            return None
        around = np.array(as_disc(user))
        found = nearest_free(x, y, self._discs, self._sides, self._notches, around)
        return (float(found[0]), float(found[1])) if len(found) else None

    def clearance(self, place: Point) -> float:
        """Distance to the nearest side of any ring, not inflated, m."""
        return float(distance_to_nearest(float(place[0]), float(place[1]), self._sides))


def as_floats(place: Point) -> Point:
    """A place as floats: integers would make numba compile another version during a run."""
    return float(place[0]), float(place[1])


def as_disc(user: Disc | None) -> Circle:
    """The user's disc as floats: x, y, radius; of radius 0 if there is no user."""
    if user is None:
        return NOBODY
    return float(user.x), float(user.y), float(user.radius)


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


@compiled
def first_look(
    start: Point, goal: Point, user: Circle, side: int, discs: Array, sides: Array
) -> tuple[int, Point]:
    """Whether there is a straight way (`STRAIGHT`), maybe another one (`AROUND`), or `NO_WAY`.

    From a free start. Besides, the ray from the user that it must not cross.
    """
    ray = separating_ray(start, goal, user, side)
    if not is_free_beside(goal, user, discs, sides):
        return NO_WAY, ray
    walls = UserDisc(user[0], user[1], user[2], ray[0], ray[1])
    if goes_straight(start[0], start[1], goal[0], goal[1], walls, discs, sides):
        return STRAIGHT, ray
    return AROUND, ray


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
    planner.allows_each((1.0, 1.0), np.ones((1, 2)))
    planner.first_allowed((1.0, 1.0), np.ones((1, 10)), user, 0.001, 0.1)
    planner.clearance((1.0, 1.0))
    planner.are_free(np.ones((2, 2)))
    planner.among((column,)).plan((0.1, 0.1), (7.2, 7.4))
