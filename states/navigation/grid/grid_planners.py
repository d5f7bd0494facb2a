"""Global planners on costmaps, for places known only as cells: `theta_star` and `navfn`.

Both have the interface of `visibility.ExactPlanner` and can take its place.
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hw import compiled, example
from hw.scene import Disc, Point
from states.maps import Grid, distances, room_map
from states.navigation.exact import (
    TOLERANCE,
    Array,
    Path,
    UserDisc,
    as_disc,
    as_floats,
    passes_disc,
    separating_ray,
)
from states.navigation.grid.costmap import Costmap, StaticLayer
from states.navigation.grid.inflation import INSCRIBED, LETHAL, NO_INFORMATION, Costs, Inflation
from states.navigation.grid.navfn import crossing_costs, descend, potential_from
from states.navigation.grid.theta_star import line_is_free, shortcut, theta_star

Ring = Sequence[Point]

RESOLUTION = 0.05
"""Side of the cells of a room given as polygons, m."""


class GridPlanner(ABC):
    """Paths for the robot's centre through the cells of a costmap.

    Cells with a cost of `lethal_cost` or more are blocked; unknown ones only if `allow_unknown` is
    false. `boxes` are scanned obstacles as polygons, for local planners that need walls in this
    form. `field` returns the `distances` if they have been computed elsewhere.
    """

    boxes: tuple[Ring, ...] = ()

    def __init__(
        self,
        grid: Grid,
        costs: Costs,
        *,
        lethal_cost: int = INSCRIBED,
        allow_unknown: bool = True,
        field: Callable[[], Array] | None = None,
    ) -> None:
        self.grid, self.costs = grid, costs
        self._field = field
        self.lethal_cost = lethal_cost
        self.allow_unknown = allow_unknown
        blocked = costs >= lethal_cost
        if allow_unknown:
            blocked &= costs != NO_INFORMATION
        self._free = np.ascontiguousarray(~blocked)

    @classmethod
    def in_room(
        cls,
        outer: Ring,
        obstacles: Iterable[Ring] = (),
        *,
        inflation_radius: float,
        resolution: float = RESOLUTION,
    ) -> GridPlanner:
        """A planner for a known room; cells within `inflation_radius` of walls, m, are blocked."""
        map_ = room_map(outer, tuple(obstacles), resolution)
        corner = map_.map_from_corner
        rows, columns = map_.values.shape
        grid = Grid(resolution, rows, columns, corner.x, corner.y)
        inflation = Inflation(inflation_radius, inflation_radius - TOLERANCE)
        costmap = Costmap(StaticLayer.of(map_, grid), inflation)
        return cls(grid, costmap.costs, allow_unknown=False)

    def plan(
        self, start: Point, goal: Point, user: Disc | None = None, side: int = 0
    ) -> Path | None:
        """A path from start to goal, or None; like `ExactPlanner.plan`."""
        start, goal, disc = as_floats(start), as_floats(goal), as_disc(user)
        begin = start if self.is_free(start, user) else self.nearest_free(start, user)
        if begin is None or not self.is_free(goal, user):
            return None
        ray = separating_ray(begin, goal, disc, side)
        x, y = self._in_cells(disc[:2])
        around = UserDisc(x, y, disc[2] / self.grid.resolution, *ray)
        found = self._search(np.array([self._in_cells(begin), self._in_cells(goal)]), around)
        if len(found) == 0:
            return None
        points = [self._in_map(place) for place in found[1:-1].tolist()]
        leaving = [] if begin == start else [start]
        return Path.of_points((*leaving, begin, *points, goal))

    def is_free(self, place: Point, user: Disc | None = None) -> bool:
        """True if the robot's centre may be here; False outside the map and for NaN."""
        cell = self.grid.cell(*place)
        if cell is None or not self._free[cell]:
            return False
        return user is None or math.dist(place, (user.x, user.y)) >= user.radius - TOLERANCE

    def are_free(self, places: Array) -> NDArray[np.bool_]:
        """`is_free` of each of the places (n, 2), m, without the user: (n,)."""
        grid = self.grid
        return _are_free(self._free, (grid.x, grid.y), grid.resolution, places)

    def clearance(self, place: Point) -> float:
        """Distance to the nearest lethal cell, m, interpolated between the centres of cells.

        Half a cell is subtracted: a lethal cell begins at its side. 0 outside the map.
        """
        if self.grid.cell(*place) is None:
            return 0.0
        between = float(interpolated(self.distances, *self._in_cells(place)))
        return max(0.0, between - 0.5 * self.grid.resolution)

    def allows(
        self, start: Point, end: Point, user: Disc | None = None, slack: float = 0.0
    ) -> bool:
        """True if a straight line's cells are free, or no nearer to lethal ones than its start.

        `slack`, m, applies only to a robot that is too near already: a cell is free or it is not.
        """
        start, end, disc = as_floats(start), as_floats(end), as_disc(user)
        cell = self.grid.cell(*start)
        if cell is None:
            return False
        reach = min(disc[2], math.dist(start, disc[:2])) - TOLERANCE
        if not passes_disc(*start, *end, *disc[:2], reach):
            return False
        ends = (*self._in_cells(start), *self._in_cells(end))
        if self._free[cell]:
            return bool(line_is_free(self._free, *ends))
        return bool(comes_no_nearer(self.distances, *ends, float(slack) + TOLERANCE))

    def first_allowed(
        self, start: Point, ways: Array, user: Disc | None, slack: float, spare: float
    ) -> int:
        """Index of the first of some ways that is allowed, see `GlobalPlanner`."""
        for i, way in enumerate(ways.tolist()):
            there, end, *held = zip(way[::2], way[1::2], strict=True)
            if not (
                self.allows(start, there, user, slack) and self.allows(there, end, user, slack)
            ):
                continue
            if spare == math.inf or all(self.allows(there, at, None, spare) for at in held):
                return i
        return len(ways)

    def allows_each(self, start: Point, ends: Array, user: Disc | None = None) -> bool:
        """`allows` from the start to each of some places (n, 2)."""
        return all(self.allows(start, (x, y), user) for x, y in ends.tolist())

    def allows_line(self, line: Array, user: Disc | None = None) -> bool:
        """`allows` from each point of a line (n, 3), x and y first, to the next."""
        points = [(x, y) for x, y, _ in line.tolist()]
        return all(self.allows(a, b, user) for a, b in itertools.pairwise(points))

    def nearest_free(self, place: Point, user: Disc | None = None) -> Point | None:
        """Centre of the nearest free cell that can be reached in a straight line, or None."""
        place, disc = as_floats(place), as_disc(user)
        at = self.grid.cell(*place)
        if at is None:
            return None
        # differences below a cell's diagonal are within the resolution
        nearest = self.distances[at] - math.sqrt(2.0) * self.grid.resolution
        passable = self._free | (self.distances >= nearest)
        x, y = self._in_cells(disc[:2])
        around = np.array((x, y, disc[2] / self.grid.resolution))
        found = _nearest_free(self._free, passable, *self._in_cells(place), around)
        return self._in_map(found) if found[0] >= 0.0 else None

    @cached_property
    def distances(self) -> Array:
        """Distance of each cell to the nearest lethal one, centre to centre, m, (rows, columns)."""
        if self._field is not None:
            return self._field()
        return distances(self.costs == LETHAL, self.grid.resolution)

    def _in_cells(self, place: Point) -> Point:
        return (
            (place[0] - self.grid.x) / self.grid.resolution,
            (place[1] - self.grid.y) / self.grid.resolution,
        )

    def _in_map(self, place: Sequence[float]) -> Point:
        return (
            self.grid.x + place[0] * self.grid.resolution,
            self.grid.y + place[1] * self.grid.resolution,
        )

    @abstractmethod
    def _search(self, ends: Array, user: UserDisc) -> Array:
        """The path between two places, (k, 2) in cells; empty if there is none."""


class ThetaStarPlanner(GridPlanner):
    """Any-angle paths, nearly the shortest; costs of free cells are ignored."""

    def _search(self, ends: Array, user: UserDisc) -> Array:
        path = theta_star(self._free, ends, user)
        return path if len(path) == 0 else shortcut(self._free, path, user)


class NavfnPlanner(GridPlanner):
    """Potential and gradient as in ROS's global_planner: prefers cells of low cost."""

    @cached_property
    def _crossing(self) -> Array:
        return crossing_costs(self.costs, self.lethal_cost, self.allow_unknown)

    def _search(self, ends: Array, user: UserDisc) -> Array:
        (start_x, start_y), (goal_x, goal_y) = ends.tolist()
        start, goal = (int(start_y), int(start_x)), (int(goal_y), int(goal_x))
        crossing = self._crossing.copy()
        if user.radius > 0.0:
            crossing[self._user_cells(user)] = math.inf
        crossing[start] = 50.0
        return descend(potential_from(crossing, start, goal), ends)

    def _user_cells(self, user: UserDisc) -> NDArray[np.bool_]:
        rows, columns = self._free.shape
        xs, ys = np.arange(columns) + 0.5 - user.x, np.arange(rows)[:, None] + 0.5 - user.y
        inside: NDArray[np.bool_] = np.hypot(xs, ys) < user.radius
        # blocked cells along the ray keep the path on its side of the user
        along, across = xs * user.ray_x + ys * user.ray_y, ys * user.ray_x - xs * user.ray_y
        return (
            inside | ((along > 0.0) & (np.abs(across) < 0.75))
            if user.ray_x or user.ray_y
            else inside
        )


@compiled
def _are_free(
    free: NDArray[np.bool_], corner: tuple[float, float], resolution: float, places: Array
) -> NDArray[np.bool_]:
    rows, columns = free.shape
    found = np.zeros(len(places), np.bool_)
    for i in range(len(places)):
        x, y = (places[i, 0] - corner[0]) / resolution, (places[i, 1] - corner[1]) / resolution
        if 0.0 <= x < columns and 0.0 <= y < rows:
            found[i] = free[int(y), int(x)]
    return found


@compiled
def _nearest_free(
    free: NDArray[np.bool_], passable: NDArray[np.bool_], px: float, py: float, user: Array
) -> tuple[float, float]:
    """Centre of the nearest visible free cell, in cells; (-1, -1) if there is none.

    Searches square rings of cells around the place until the next ring cannot be nearer.
    """
    rows, columns = free.shape
    row, column = math.floor(py), math.floor(px)
    reach = min(user[2], math.hypot(px - user[0], py - user[1])) - TOLERANCE
    best, found_x, found_y = math.inf, -1.0, -1.0
    for ring in range(max(rows, columns)):
        if ring - 1.0 > best:
            break
        for up in range(-ring, ring + 1):
            step = 1 if abs(up) == ring else max(1, 2 * ring)
            for across in range(-ring, ring + 1, step):
                r, c = row + up, column + across
                if not (0 <= r < rows and 0 <= c < columns and free[r, c]):
                    continue
                x, y = c + 0.5, r + 0.5
                away = math.hypot(x - px, y - py)
                if away >= best or math.hypot(x - user[0], y - user[1]) < user[2]:
                    continue
                if passes_disc(px, py, x, y, user[0], user[1], reach) and line_is_free(
                    passable, px, py, x, y
                ):
                    best, found_x, found_y = away, x, y
    return found_x, found_y


@compiled
def interpolated(field: Array, x: float, y: float) -> float:
    """Bilinear interpolation between the centres of cells; border values extend outwards."""
    rows, columns = field.shape
    x, y = min(max(x - 0.5, 0.0), columns - 1.0), min(max(y - 0.5, 0.0), rows - 1.0)
    column, row = min(int(x), columns - 2), min(int(y), rows - 2)
    u, v = x - column, y - row
    low = (1.0 - u) * field[row, column] + u * field[row, column + 1]
    high = (1.0 - u) * field[row + 1, column] + u * field[row + 1, column + 1]
    return float((1.0 - v) * low + v * high)


@compiled
def comes_no_nearer(field: Array, px: float, py: float, qx: float, qy: float, slack: float) -> bool:
    """True if the segment p-q, in cells, keeps p's distance to lethal cells less `slack`, m."""
    rows, columns = field.shape
    if not (0.0 <= qx < columns and 0.0 <= qy < rows):
        return False
    least = interpolated(field, px, py) - slack
    steps = math.ceil(2.0 * math.hypot(qx - px, qy - py))
    for i in range(1, steps + 1):
        part = i / steps
        if interpolated(field, px + part * (qx - px), py + part * (qy - py)) < least:
            return False
    return True


@example
def _example() -> None:
    room = ((0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0))
    for planner in (ThetaStarPlanner, NavfnPlanner):
        built = planner.in_room(room, inflation_radius=0.3, resolution=0.1)
        built.plan((0.1, 0.1), (2.5, 2.5), Disc(1.5, 1.5, 0.4), side=1)
        built.allows((1.0, 1.0), (1.2, 1.0), Disc(2.5, 2.5, 0.2))
        built.allows((0.1, 0.1), (0.2, 0.2))
        built.clearance((1.0, 1.0))
        built.are_free(np.ones((2, 2)))
