"""The costmaps of one navigation subsystem, and the planner on them (R34-R38).

A global costmap from the map, computed once; a local window about the robot from laser scans; the
planner goes by both. Nothing here is shared between subsystems but the map.

`see` is where scans come in. The reduced simulation has no scanner and never calls it; whoever has
one calls it for each subsystem when a scan arrives, before the states are stepped, with the pose of
the scanner at the scan's stamp and the user's disc, whom the planners know better than by cells.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from hw.geometry import Pose2
from hw.room import Disc, Room
from hw.samples import Scan
from states.navigation.cells import Grid, grid_over, room_map
from states.navigation.costmap import Costmap, both
from states.navigation.distance import Inflation
from states.navigation.grid_planners import GridPlanner, NavfnPlanner, ThetaStarPlanner
from states.navigation.maps import OccupancyMap
from states.navigation.obstacles import ObstacleLayer

if TYPE_CHECKING:
    from states.site import CostmapValues

PLANNERS: Mapping[str, type[GridPlanner]] = {
    "theta_star": ThetaStarPlanner,
    "navfn": NavfnPlanner,
}
"""The global planners on costmaps by the names that profiles use."""


class Layers:
    """Costmaps `whole` and `local` in the map, and a `planner` on both.

    Args:
        planner: one of `PLANNERS`.
        static: the map, scanned or drawn; what it does not know is blocked.
        kept: from walls to the robot's centre, m; costmap_2d's inscribed radius.
        values: the profile's.
    """

    def __init__(
        self, planner: str, static: OccupancyMap, kept: float, values: CostmapValues
    ) -> None:
        reach = max(kept, values.inflation_radius)
        inflation = Inflation(reach, kept, values.cost_scaling_factor)
        grid = _grid_over(static, values.resolution)
        rows = math.ceil(values.height / grid.resolution)
        columns = math.ceil(values.width / grid.resolution)
        window = Grid(grid.resolution, rows, columns, grid.x, grid.y)
        self._obstacles = ObstacleLayer(window, rolling=True)
        self.whole = Costmap(grid, inflation, static=static)
        self.local = Costmap(window, inflation, obstacles=self._obstacles)
        self.planner = PLANNERS[planner](grid, self.whole.costs, allow_unknown=False)

    def see(
        self, map_from_sensor: Pose2, scan: Scan, stamp_ns: int, ignore: Disc | None = None
    ) -> None:
        """Take a scan: roll the window, mark and clear, and plan on it from now on.

        Args:
            map_from_sensor: where the scanner was at the stamp.
            scan: ranges; see `ObstacleLayer.see`.
            stamp_ns: when.
            ignore: who is known better than by cells; not marked.
        """
        self._obstacles.see(map_from_sensor, scan, stamp_ns, ignore)
        self.local.update()
        self.planner.use(self.whole.grid, both(self.whole, self.local))


def map_of(room: Room, resolution: float) -> OccupancyMap:
    """The map of a known room."""
    return room_map(room.outer, tuple(room.obstacles), resolution)


def _grid_over(static: OccupancyMap, resolution: float) -> Grid:
    rows, columns = static.values.shape
    corner = static.map_from_corner
    width, height = columns * static.resolution, rows * static.resolution
    ends = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
    return grid_over([[corner.transform(*end) for end in ends]], resolution)
