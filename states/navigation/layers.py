"""The costmaps of one navigation subsystem: from its map, and from what laser scans show (R34-R38).

A global costmap from the map, computed once; a local window about the robot from laser scans.
`CostmapEstimator` puts both together as they change; what it gives out never changes. Nothing here
is shared between subsystems but the map.
"""

from __future__ import annotations

import bisect
import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from hw.geometry import Pose2, wrap
from hw.person import RADIUS
from hw.room import Disc, Room
from hw.safety_limits import OLD_S
from hw.samples import Scan, UserPose
from states.maps.cells import Grid, grid_over, room_map
from states.maps.occupancy import OccupancyMap
from states.navigation.costmap import Costmap, both
from states.navigation.grid_planners import GridPlanner, NavfnPlanner, ThetaStarPlanner
from states.navigation.inflation import Costs, Inflation
from states.navigation.obstacles import ObstacleLayer
from states.signals.motion import Stamped

if TYPE_CHECKING:
    from states.site import CostmapValues

PLANNERS: Mapping[str, type[GridPlanner]] = {
    "theta_star": ThetaStarPlanner,
    "navfn": NavfnPlanner,
}
"""The global planners on costmaps by the names that profiles use."""

SCAN_GAP_S = 0.3
"""Scans of a scanner come at least this often, s; costmap_2d's `expected_update_rate`."""
POSES_KEPT_S = 1.0
"""A scan that comes later than this after its stamp is left out, s."""
SCANS_WAITING = 8
"""So many scans wait for the pose of the robot at their stamp; then the oldest are left out."""
USER_DISC_M = RADIUS + 0.2
"""Beams that end this near to the middle of the tracked user have met the user, m."""


@dataclass(frozen=True, eq=False)
class Costmaps:
    """The costmaps of a subsystem at one instant.

    `whole` is the map's; `window` and `marks` are cells about the robot with what scans have shown
    there, None before the first scan.
    """

    whole: Costmap
    window: Grid | None = None
    marks: Costs | None = None

    @cached_property
    def local(self) -> Costmap | None:
        """The window, inflated like the map."""
        if self.window is None:
            return None
        return Costmap(self.window, self.whole.inflation, obstacles=self.marks)

    @cached_property
    def costs(self) -> Costs:
        """The costs of both on the cells of the map, (rows, columns)."""
        return self.whole.costs if self.local is None else both(self.whole, self.local)

    def planner(self, name: str) -> GridPlanner:
        """One of `PLANNERS` on these costs; what the map does not know is blocked."""
        return PLANNERS[name](self.whole.grid, self.costs, allow_unknown=False)


def costmaps_of(static: OccupancyMap, kept: float, values: CostmapValues) -> Costmaps:
    """The costmaps before any scan.

    Args:
        static: the map, scanned or drawn; what it does not know is blocked.
        kept: from walls to the robot's centre, m; costmap_2d's inscribed radius.
        values: the profile's.
    """
    reach = max(kept, values.inflation_radius)
    inflation = Inflation(reach, kept, values.cost_scaling_factor)
    return Costmaps(Costmap(_grid_over(static, values.resolution), inflation, static=static))


class CostmapEstimator:
    """Costmaps by the poses of the robot, its scans, and the user, whom cells are not to show.

    Takes `base.pose`, `base.scan` and `user.pose`. Scanners are taken to sit in base_link, whatever
    their name: each scan is put into the map by the pose of the robot at its stamp, between the two
    poses about it, and waits until there is one after it. Beams that end at the user are not
    marked, unless the user is lost: planners know them better than by cells.

    While every scanner heard of goes on scanning, the costmaps are of the newest pose of the robot;
    once one falls silent they are as old as its last scan. Without any scan they do not age.
    """

    def __init__(self, start: Costmaps, values: CostmapValues) -> None:
        grid = start.whole.grid
        rows = math.ceil(values.height / grid.resolution)
        columns = math.ceil(values.width / grid.resolution)
        window = Grid(grid.resolution, rows, columns, grid.x, grid.y)
        self._obstacles = ObstacleLayer(window, rolling=True)
        self._costmaps = start
        self._poses: list[tuple[int, Pose2]] = []
        self._user: tuple[int, Pose2] | None = None
        self._waiting: deque[tuple[int, Scan]] = deque(maxlen=SCANS_WAITING)
        self._scanned: dict[str, int] = {}

    def update(self, signal: str, sample: Stamped) -> None:
        """Take one sample; of the user's poses the newest."""
        value, stamp = sample.value, sample.stamp
        if isinstance(value, Scan):
            self._waiting.append((stamp, value))
        elif isinstance(value, UserPose):
            self._user = max(self._user or (stamp, value.body), (stamp, value.body), key=_stamp)
        elif isinstance(value, Pose2):
            bisect.insort(self._poses, (stamp, value), key=_stamp)
            oldest = self._poses[-1][0] - round(POSES_KEPT_S * 1e9)
            del self._poses[: bisect.bisect_left(self._poses, oldest, key=_stamp)]
        if self._waiting and self._poses:
            self._take_those_with_a_pose()

    def value(self) -> Costmaps:
        """What is known now."""
        return self._costmaps

    def stamp(self) -> int | None:
        """See the class; ns."""
        if not self._scanned:
            return None
        last, now = min(self._scanned.values()), self._poses[-1][0]
        return now if now - last <= round(SCAN_GAP_S * 1e9) else last

    def _take_those_with_a_pose(self) -> None:
        """Take the scans that have waited long enough, in the order in which they came."""
        newest, taken = self._poses[-1][0], False
        for _ in range(len(self._waiting)):
            stamp, scan = self._waiting.popleft()
            if stamp > newest:
                self._waiting.append((stamp, scan))
            elif stamp >= self._scanned.get(scan.sensor, stamp):
                taken |= self._take(scan, stamp)
        if taken:
            grid, marks = self._obstacles.grid, self._obstacles.costs.copy()
            self._costmaps = Costmaps(self._costmaps.whole, grid, marks)

    def _take(self, scan: Scan, stamp: int) -> bool:
        pose = self._pose_at(stamp)
        if pose is None:
            return False
        self._obstacles.see(pose, scan, stamp, self._user_at(stamp))
        self._scanned[scan.sensor] = stamp
        return True

    def _pose_at(self, stamp: int) -> Pose2 | None:
        """Of the robot at an instant not after its newest pose; None: too long ago."""
        later = bisect.bisect_left(self._poses, stamp, key=_stamp)
        then, pose = self._poses[later]
        if then == stamp:
            return pose
        return None if later == 0 else _between(self._poses[later - 1], (then, pose), stamp)

    def _user_at(self, stamp: int) -> Disc | None:
        if self._user is None or abs(stamp - self._user[0]) > round(OLD_S * 1e9):
            return None
        return Disc(self._user[1].x, self._user[1].y, USER_DISC_M)


def map_of(room: Room, resolution: float) -> OccupancyMap:
    """The map of a known room."""
    return room_map(room.outer, tuple(room.obstacles), resolution)


def _stamp(stamped: tuple[int, Pose2]) -> int:
    return stamped[0]


def _between(before: tuple[int, Pose2], after: tuple[int, Pose2], stamp: int) -> Pose2:
    (start, a), (end, b) = before, after
    share = (stamp - start) / (end - start)
    turned = a.yaw + share * wrap(b.yaw - a.yaw)
    return Pose2(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), wrap(turned))


def _grid_over(static: OccupancyMap, resolution: float) -> Grid:
    rows, columns = static.values.shape
    corner = static.map_from_corner
    width, height = columns * static.resolution, rows * static.resolution
    ends = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
    return grid_over([[corner.transform(*end) for end in ends]], resolution)
