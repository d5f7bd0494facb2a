"""From scans and poses, as they arrive, to the obstacles that all subsystems plan by (R37, R51)."""

from __future__ import annotations

import bisect
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hw.geometry import Outline, Pose2, wrap
from hw.people.person import RADIUS
from hw.room import Disc, Room
from hw.safety.limits import OLD_S
from hw.samples import EXACT, PoseSigma, Scan, UserPose
from states.localization.estimates import PoseEstimate
from states.maps.cells import Grid
from states.maps.field import room_field
from states.navigation import obstacles
from states.navigation.costmap import Costmap, StaticLayer
from states.navigation.inflation import FREE, Inflation
from states.navigation.obstacles import NOBODY, KnownObstacles, ObstacleLayer, ObstacleValues
from states.navigation.unmapped import Obstacles, ShownObstacles
from states.signals.motion import StampedPlace

SCAN_GAP_NS = 300_000_000
"""Scans of a scanner come at least this often; costmap_2d's `expected_update_rate`."""
POSES_KEPT_NS = 1_000_000_000
"""A scan that comes later than this after its stamp is left out."""
SCANS_WAITING = 8
"""So many scans wait for the pose of the robot at their stamp; then the oldest are left out."""
LEAST_STEP_NS = 30_000_000
"""Poses so far apart tell where the robot goes on to; of nearer ones the noise would count."""
USER_DISC_M = RADIUS + 0.2
"""Beams that end this near to the middle of the tracked user have met the user, m."""


@dataclass(frozen=True, slots=True)
class Scanner:
    """What scans are read by: `mount` gives base_from_sensor by the scanner's name.

    `outline` is the robot's own, in the base frame; `sigma` how sure poses are that come without.
    """

    mount: Callable[[str], Pose2]
    outline: Outline
    sigma: PoseSigma = EXACT


class ObstacleEstimator:
    """What scanners have shown and the map does not, by the poses of the robot and of the user.

    Takes `base.pose`, or the estimate that it is part of, `base.scan` and `user.pose`. Each beam is
    put into the map by the pose of the robot at its own time, between the two poses about it or on
    from the last ones; a scan waits until there is a pose after its stamp. Beams that end at the
    user are no obstacle, unless the user is lost: planners know them better than by cells.

    While every scanner heard of goes on scanning, the obstacles are of the newest pose of the
    robot; once one falls silent they are as old as its last scan. Without any they do not age.
    """

    def __init__(
        self, ground: StaticLayer, reach: float, values: ObstacleValues, scanner: Scanner
    ) -> None:
        # a cell's centre is nearer to a wall's than to the wall by half a cell
        walls = ground.distances - 0.5 * ground.grid.resolution
        self._layer = ObstacleLayer(
            ground.grid, np.where(ground.costs == FREE, walls, -1.0), values
        )
        self._shown = ShownObstacles(ground.grid, reach)
        self._scanner = scanner
        self._sigma = scanner.sigma
        self._poses: list[tuple[int, Pose2]] = []
        self._user: tuple[int, Pose2] | None = None
        self._waiting: deque[tuple[int, Scan]] = deque(maxlen=SCANS_WAITING)
        self._scanned: dict[str, int] = {}
        self._oldest_scan: int | None = None  # of the scanners' newest ones

    def update(self, _signal: str, sample: StampedPlace) -> None:
        """Take one sample; of the user's poses the newest."""
        value, stamp = sample.value, sample.stamp
        if isinstance(value, PoseEstimate):
            self._sigma = value.sigma
            self._keep(stamp, value.pose)
        elif isinstance(value, Pose2):
            self._keep(stamp, value)
        elif isinstance(value, Scan):
            self._waiting.append((stamp, value))
        elif isinstance(value, UserPose):
            self._user = max(self._user or (stamp, value.body), (stamp, value.body), key=_stamp)
        if self._waiting and self._poses:
            self._take_those_with_a_pose()

    def value(self) -> Obstacles:
        """What is known now."""
        return self._shown.obstacles

    def stamp(self) -> int | None:
        """See the class; ns."""
        last = self._oldest_scan
        if last is None:
            return None
        now = self._poses[-1][0]
        return now if now - last <= SCAN_GAP_NS else last

    def _keep(self, stamp: int, pose: Pose2) -> None:
        """Keep a pose, in the place of one of the same instant."""
        poses = self._poses
        if not poses or stamp > poses[-1][0]:
            poses.append((stamp, pose))
            if stamp - poses[0][0] > 2 * POSES_KEPT_NS:  # now and then
                del poses[: bisect.bisect_left(poses, stamp - POSES_KEPT_NS, key=_stamp)]
        elif stamp == poses[-1][0]:
            poses[-1] = stamp, pose
        else:
            bisect.insort(poses, (stamp, pose), key=_stamp)

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
            self._shown.update(self._layer.marked)

    def _take(self, scan: Scan, stamp: int) -> bool:
        """True if there is something marked, or was."""
        poses = self._poses
        if stamp < max(poses[0][0], poses[-1][0] - POSES_KEPT_NS):
            return False
        self._scanned[scan.sensor] = stamp
        self._oldest_scan = min(self._scanned.values())
        end = stamp + round(scan.beam_time * (len(scan.ranges) - 1) * 1e9)
        mount, outline = self._scanner.mount(scan.sensor), self._scanner.outline
        known = KnownObstacles(mount, outline, self._user_at(stamp), self._sigma)
        return self._layer.see(scan, self._pose_at(stamp), self._pose_at(end), stamp, known)

    def _pose_at(self, stamp: int) -> Pose2:
        """Of the robot at an instant not before its oldest pose."""
        poses = self._poses
        later = bisect.bisect_left(poses, stamp, key=_stamp)
        if later < len(poses) and poses[later][0] == stamp:
            return poses[later][1]
        if later < len(poses):
            return _on_the_way(poses[later - 1], poses[later], stamp)
        before = bisect.bisect_left(poses, poses[-1][0] - LEAST_STEP_NS, key=_stamp)
        return (
            _on_the_way(poses[min(before, later - 2)], poses[-1], stamp)
            if later > 1
            else poses[0][1]
        )

    def _user_at(self, stamp: int) -> Disc:
        if self._user is None or abs(stamp - self._user[0]) > round(OLD_S * 1e9):
            return NOBODY
        radius = USER_DISC_M + 3.0 * self._sigma.position
        return Disc(self._user[1].x, self._user[1].y, radius)


def _stamp(stamped: tuple[int, Pose2]) -> int:
    return stamped[0]


def _on_the_way(before: tuple[int, Pose2], after: tuple[int, Pose2], stamp: int) -> Pose2:
    """Between two poses, or straight on from them."""
    (start, a), (end, b) = before, after
    share = (stamp - start) / (end - start) if end > start else 1.0
    turned = a.yaw + share * wrap(b.yaw - a.yaw)
    return Pose2(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), wrap(turned))


def warm_up() -> None:
    """Compile, or load from the cache, what scans need."""
    obstacles.warm_up()
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    room_field(Room(square)).distances(Pose2(0.0, 0.0), np.ones((1, 2)))
    grid = Grid(0.1, 10, 10)
    shown = ShownObstacles(grid, 0.2)
    for marked in ([33], [33], [34]):
        shown.update(np.array(marked))
    costmap = Costmap(StaticLayer(grid, np.zeros((10, 10), np.uint8)), Inflation(0.2, 0.1))
    costmap.with_obstacles(shown.obstacles)
