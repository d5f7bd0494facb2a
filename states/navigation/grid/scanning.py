"""Turns scans and poses, as they arrive, into obstacles for the subsystems' planners (R37, R51)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hw import EXACT, OLD_NS, USER_RADIUS, Outline, Pose2, PoseSigma, Scan, UserPose, example
from hw.motion import PoseHistory, wrapped
from hw.scene import Disc, Room
from states.localization import PoseEstimate
from states.maps import Grid, room_field
from states.navigation.grid.costmap import Costmap, StaticLayer
from states.navigation.grid.inflation import FREE, Inflation
from states.navigation.grid.obstacles import NOBODY, KnownObstacles, ObstacleLayer, ObstacleValues
from states.navigation.grid.scanned_obstacles import Obstacles, ShownObstacles
from states.signals import StampedPlace

SCAN_GAP_NS = 300_000_000
"""Longest interval between scans of a scanner, ns; costmap_2d's `expected_update_rate`."""
POSES_KEPT_NS = 1_000_000_000
"""Scans that arrive later than this after their stamp are dropped, ns."""
SCANS_WAITING = 8
"""Largest number of scans that wait for a pose after their stamp; older ones are dropped."""
LEAST_STEP_NS = 30_000_000
"""Least interval between poses used to extrapolate, ns; with closer ones noise would dominate."""
USER_DISC_M = USER_RADIUS + 0.2
"""Beams that end within this distance of the tracked user's centre have hit the user, m."""


@dataclass(frozen=True, slots=True)
class Scanner:
    """How scans are read: `mount` gives base_from_sensor by the scanner's name.

    `outline` is the robot's own, in the base frame; `sigma` that of poses that come without one.
    """

    mount: Callable[[str], Pose2]
    outline: Outline
    sigma: PoseSigma = EXACT


class ObstacleEstimator:
    """Estimates the obstacles that scanners show and the map does not.

    Takes `base.pose`, or the estimate that it is part of, `base.scan` and `user.pose`. Each beam is
    placed in the map by the robot's pose at its own time, interpolated between poses or
    extrapolated from the last ones; a scan waits until there is a pose after its stamp. Beams that
    end at the tracked user mark nothing: planners have the user as a disc.

    While all scanners heard so far keep scanning, the stamp of the obstacles is that of the newest
    pose of the robot; once one falls silent, that of its last scan. Without scans they do not age.
    """

    def __init__(
        self, ground: StaticLayer, reach: float, values: ObstacleValues, scanner: Scanner
    ) -> None:
        # distances are between centres: the wall itself is half a cell nearer
        walls = ground.distances - 0.5 * ground.grid.resolution
        self._layer = ObstacleLayer(
            ground.grid, np.where(ground.costs == FREE, walls, -1.0), values
        )
        self._shown = ShownObstacles(ground.grid, reach)
        self._scanner = scanner
        self._sigma = scanner.sigma
        self._poses = PoseHistory(wrapped, POSES_KEPT_NS)
        self._user: tuple[int, Pose2] | None = None
        self._waiting: deque[tuple[int, Scan]] = deque(maxlen=SCANS_WAITING)
        self._scanned: dict[str, int] = {}
        self._oldest_scan: int | None = None  # of the scanners' newest ones

    def update(self, _signal: str, sample: StampedPlace) -> None:
        """Take one sample; of the user only the newest pose counts."""
        value, stamp = sample.value, sample.stamp
        match value:
            case PoseEstimate():
                self._sigma = value.sigma
                self._poses.insert(stamp, value.pose)
            case Pose2():
                self._poses.insert(stamp, value)
            case Scan():
                self._waiting.append((stamp, value))
            case UserPose() if self._user is None or stamp > self._user[0]:
                self._user = stamp, value.body
        if self._waiting and self._poses.newest is not None:
            self._take_those_with_a_pose()

    def value(self) -> Obstacles:
        """The present obstacles."""
        return self._shown.obstacles

    def stamp(self) -> int | None:
        """Stamp of the obstacles, ns, as described in the class; None before the first scan."""
        last, newest = self._oldest_scan, self._poses.newest
        if last is None or newest is None:
            return None
        now = newest[0]
        return now if now - last <= SCAN_GAP_NS else last

    def _take_those_with_a_pose(self) -> None:
        """Process the scans that have a pose after their stamp, in the order of arrival."""
        assert self._poses.newest is not None
        newest, taken = self._poses.newest[0], False
        for _ in range(len(self._waiting)):
            stamp, scan = self._waiting.popleft()
            if stamp > newest:
                self._waiting.append((stamp, scan))
            elif stamp >= self._scanned.get(scan.sensor, stamp):
                taken |= self._add_scan(scan, stamp, newest)
        if taken:
            self._shown.update(self._layer.marked)

    def _add_scan(self, scan: Scan, stamp: int, newest: int) -> bool:
        """Process one scan; False if it was dropped, or there was nothing to mark or clear."""
        poses = self._poses
        if stamp < max(poses.oldest_ns, newest - POSES_KEPT_NS):
            return False
        self._scanned[scan.sensor] = stamp
        self._oldest_scan = min(self._scanned.values())
        end = stamp + round(scan.beam_time * (len(scan.array) - 1) * 1e9)
        mount, outline = self._scanner.mount(scan.sensor), self._scanner.outline
        known = KnownObstacles(mount, outline, self._user_at(stamp), self._sigma)
        first, last = poses.extended(stamp, LEAST_STEP_NS), poses.extended(end, LEAST_STEP_NS)
        return self._layer.add_scan(scan, first, last, stamp, known)

    def _user_at(self, stamp: int) -> Disc:
        if self._user is None or abs(stamp - self._user[0]) > OLD_NS:
            return NOBODY
        radius = USER_DISC_M + 3.0 * self._sigma.position
        return Disc(self._user[1].x, self._user[1].y, radius)


@example
def _example() -> None:
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    room_field(Room(square)).distances(Pose2(0.0, 0.0), np.ones((1, 2)))
    grid = Grid(0.1, 10, 10)
    shown = ShownObstacles(grid, 0.2)
    for marked in ([33], [33], [34]):
        shown.update(np.array(marked))
    costmap = Costmap(StaticLayer(grid, np.zeros((10, 10), np.uint8)), Inflation(0.2, 0.1))
    costmap.with_obstacles(shown.obstacles)
    assert shown.obstacles.boxes
