"""Turns scans and poses, as they arrive, into obstacles for the subsystems' planners (R37, R51)."""

from __future__ import annotations

import bisect
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hw import EXACT, USER_RADIUS, Outline, Pose2, PoseSigma, Scan, UserPose, wrap
from hw.safety import OLD_S
from hw.scene import Disc, Room
from states.localization import PoseEstimate
from states.maps import Grid, room_field
from states.navigation.grid import obstacles
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
        self._poses: list[tuple[int, Pose2]] = []
        self._user: tuple[int, Pose2] | None = None
        self._waiting: deque[tuple[int, Scan]] = deque(maxlen=SCANS_WAITING)
        self._scanned: dict[str, int] = {}
        self._oldest_scan: int | None = None  # of the scanners' newest ones

    def update(self, _signal: str, sample: StampedPlace) -> None:
        """Take one sample; of the user only the newest pose counts."""
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
        """The present obstacles."""
        return self._shown.obstacles

    def stamp(self) -> int | None:
        """Stamp of the obstacles, ns, as described in the class; None before the first scan."""
        last = self._oldest_scan
        if last is None:
            return None
        now = self._poses[-1][0]
        return now if now - last <= SCAN_GAP_NS else last

    def _keep(self, stamp: int, pose: Pose2) -> None:
        """Store a pose; it replaces one of the same instant."""
        poses = self._poses
        if not poses or stamp > poses[-1][0]:
            poses.append((stamp, pose))
            if stamp - poses[0][0] > 2 * POSES_KEPT_NS:  # trimmed only now and then
                del poses[: bisect.bisect_left(poses, stamp - POSES_KEPT_NS, key=_stamp)]
        elif stamp == poses[-1][0]:
            poses[-1] = stamp, pose
        else:
            bisect.insort(poses, (stamp, pose), key=_stamp)

    def _take_those_with_a_pose(self) -> None:
        """Process the scans that have a pose after their stamp, in the order of arrival."""
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
        """Process one scan; False if it was dropped, or there was nothing to mark or clear."""
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
        """Pose of the robot at an instant not before its oldest known pose."""
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
    """Interpolation between two poses, or extrapolation from them."""
    (start, a), (end, b) = before, after
    share = (stamp - start) / (end - start) if end > start else 1.0
    pose = a.between(b, share)
    return Pose2(pose.x, pose.y, wrap(pose.yaw))


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
