"""The costmaps of one navigation subsystem, and its planners on them (R34-R38).

The map's costmap is inflated once with the subsystem's own values; scanned obstacles are added to
it. Subsystems share only the static layer and the obstacles.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from hw.scene import Ring, Room
from states.maps import Field, Grid, OccupancyMap, grid_over, room_map
from states.navigation.exact import TOLERANCE, Array, ExactPlanner
from states.navigation.grid.costmap import Costmap, StaticLayer
from states.navigation.grid.grid_planners import GridPlanner, NavfnPlanner, ThetaStarPlanner
from states.navigation.grid.inflation import Costs, Inflation
from states.navigation.grid.scanned_obstacles import Obstacles

if TYPE_CHECKING:
    from states.subsystems import CostmapValues

PLANNERS: Mapping[str, type[GridPlanner]] = {
    "theta_star": ThetaStarPlanner,
    "navfn": NavfnPlanner,
}
"""Global planners on costmaps, by the names that profiles use."""


@dataclass(frozen=True, eq=False)
class Costmaps:
    """Costmaps of a subsystem at one instant: the map's (`whole`) with scanned `obstacles`."""

    whole: Costmap
    obstacles: Obstacles | None = None
    _planners: dict[str, GridPlanner] = field(default_factory=dict, init=False, repr=False)

    def among(self, obstacles: Obstacles) -> Costmaps:
        """The same with other obstacles."""
        return Costmaps(self.whole, obstacles)

    @cached_property
    def costs(self) -> Costs:
        """On the cells of the map, (rows, columns)."""
        return self.whole.with_obstacles(self.obstacles) if self.obstacles else self.whole.costs

    def _distances(self) -> Array:
        ground = self.whole.ground
        return ground.among(self.obstacles) if self.obstacles else ground.distances

    def planner(self, name: str) -> GridPlanner:
        """One of `PLANNERS` on these costs; unknown cells are blocked."""
        if name not in self._planners:
            grid, field = self.whole.grid, self._distances
            planner = PLANNERS[name](grid, self.costs, allow_unknown=False, field=field)
            planner.boxes = self.obstacles.boxes if self.obstacles else ()
            self._planners[name] = planner
        return self._planners[name]


def costmaps_of(ground: StaticLayer, kept: float, values: CostmapValues) -> Costmaps:
    """The costmaps before any scan.

    Args:
        ground: static layer of a scanned or drawn map.
        kept: clearance of the robot's centre, m; costmap_2d's inscribed radius. A place at exactly
            this distance is free, so a passage of exactly twice this width is open.
        values: those of the profile.
    """
    reach = max(kept, values.inflation_radius)
    inflation = Inflation(reach, kept - TOLERANCE, values.cost_scaling_factor)
    return Costmaps(Costmap(ground, inflation))


def exact_among(planner: ExactPlanner, obstacles: Obstacles) -> ExactPlanner:
    """The planner of a room with obstacles, shared by all subsystems of the same inflation."""
    if not obstacles:
        return planner
    radius = planner.inflation_radius
    if radius not in obstacles.exact:
        obstacles.exact[radius] = planner.among(obstacles.boxes)
    return obstacles.exact[radius]


def ground_of(
    static: OccupancyMap,
    resolution: float,
    keepouts: Sequence[Ring] = (),
    walls: Field | None = None,
) -> StaticLayer:
    """A map on cells of this size along the map's axes; `walls` if it is that of a drawn room."""
    return StaticLayer.of(static, _grid_over(static, resolution), keepouts, walls)


def map_of(room: Room, resolution: float) -> OccupancyMap:
    """The occupancy map of a known room."""
    return room_map(room.outer, tuple(room.obstacles), resolution)


def _grid_over(static: OccupancyMap, resolution: float) -> Grid:
    rows, columns = static.values.shape
    corner = static.map_from_corner
    width, height = columns * static.resolution, rows * static.resolution
    ends = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
    return grid_over([[corner.transform(*end) for end in ends]], resolution)
