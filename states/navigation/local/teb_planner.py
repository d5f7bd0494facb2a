"""The local planner `teb`: a timed elastic band, optimised a little further in every cycle.

For comparison and for cluttered scans; `profile` computes faster, arrives sooner and has no soft
constraints. The band alone would intrude up to 3 cm into the user's disc; the last check of
`LocalPlanner` keeps it out. Beside a walking user this planner is a `ProfilePlanner`: a band stays
on the side of the user on which it began, and would intrude up to 0.9 m.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hw import STILL, DriveMode, Pose2, Twist2, example, wrap
from hw.scene import Disc, Point
from states.navigation.exact import Array, ExactPlanner, Path
from states.navigation.local.local_planner import USER_MARGIN
from states.navigation.local.profile_planner import ProfilePlanner
from states.navigation.local.teb import TebValues
from states.navigation.local.teb_solver import optimized
from states.navigation.planner_interfaces import GlobalPlanner, Limits, Tolerance

Ring = Sequence[Point]

PRUNED = 10
"""Number of leading poses of the band that may lie behind the robot."""
NEW_GOAL = 1.0
"""A goal that moves further than this, m, or turns by more than 0.78 rad starts a new band."""


def values_for(limits: Limits, mode: DriveMode) -> TebValues:
    """The published defaults with a robot's limits; an omni base may strafe and need not turn."""
    sideways = limits.speed if mode == "omni" else 0.0
    return TebValues(
        max_vel_x=float(limits.speed),
        max_vel_x_backwards=float(limits.speed) if mode == "omni" else 0.2,
        max_vel_y=float(sideways),
        max_vel_trans=float(limits.speed),
        max_vel_theta=float(limits.turn_rate),
        acc_lim_x=float(limits.acceleration),
        acc_lim_y=float(limits.acceleration),
        acc_lim_theta=float(limits.turn_acceleration),
        acc_lim_trans=float(limits.acceleration),
        weight_kinematics_nh=0.0 if mode == "omni" else 1000.0,
        weight_kinematics_forward_drive=0.0 if mode == "omni" else 1.0,
    )


class TebPlanner(ProfilePlanner):
    """Follows a timed elastic band, and is a `ProfilePlanner` while a user walks near.

    `walls` are rings from which the band keeps `wall_distance`, m; other obstacles are known to the
    last check only. `values` default to the published ones with these limits.
    """

    def __init__(  # noqa: PLR0913 - most are optional
        self,
        planner: GlobalPlanner,
        limits: Limits,
        tolerance: Tolerance,
        mode: DriveMode = "omni",
        *,
        latency: float = 0.0,
        values: TebValues | None = None,
        walls: Sequence[Ring] = (),
        wall_distance: float = 0.0,
    ) -> None:
        super().__init__(planner, limits, tolerance, mode, latency=latency)
        self._values = values
        self._walls = _wall_rows(walls, wall_distance)
        self._wall_distance = wall_distance
        self._boxes: tuple[tuple[Ring, ...], Array] = ((), _wall_rows((), wall_distance))
        self._band: Array | None = None
        self._band_side = 0

    @property
    def band(self) -> Array | None:
        """The present band, (n, 4): x, y, yaw, dt; None before the first command."""
        return self._band

    def _begin(self) -> None:
        super()._begin()
        if self._band is None or self.goal is None:
            return
        moved = math.hypot(self._band[-1, 0] - self.goal.x, self._band[-1, 1] - self.goal.y)
        if moved > NEW_GOAL or abs(wrap(self._band[-1, 2] - self.goal.yaw)) > 0.78:
            self._band = None

    def _wanted(self, pose: Pose2, now: Twist2, user: Disc | None, dt: float) -> Twist2:
        assert self.goal is not None
        if user is not None and self._comes_near(pose, user):
            self._band = None
            return super()._wanted(pose, now, user, dt)
        start, goal = (pose.x, pose.y), (self.goal.x, self.goal.y)
        self.path = self._best_path(start, goal, self._with_margin(user, start, goal), now)
        self.status = "blocked" if self.path is None else "driving"
        if self.path is None:
            self._band = None
            return self._braked(now, dt)
        values = self._values or values_for(self._limits, self.mode)
        band = self._fresh_band(pose, values) if self._is_stale() else self._carried_band(pose)
        self._band_side = self._side
        motion = now.rotated(-pose.yaw)
        ends = np.array([[motion.vx, motion.vy, motion.wz], [0.0, 0.0, 0.0]])
        obstacles = self._obstacles(user, values)
        holonomic = self.mode == "omni"
        self._band = optimized(band, ends, obstacles, np.empty((0, 2)), holonomic, values)
        return self._first_velocity(self._band, pose, now, dt)

    def _is_stale(self) -> bool:
        return self._band is None or self._band_side not in (0, self._side)

    def _fresh_band(self, pose: Pose2, values: TebValues) -> Array:
        assert self.path is not None
        assert self.goal is not None
        spacing = values.max_vel_x * values.dt_ref
        points = _spread(self.path, spacing, values.min_samples)
        parts = np.linspace(0.0, 1.0, len(points))
        band = np.empty((len(points), 4))
        band[:, :2] = points
        band[:, 2] = pose.yaw + parts * wrap(self.goal.yaw - pose.yaw)
        if self.mode == "differential":
            steps = np.diff(points, axis=0)
            band[:-1, 2] = np.arctan2(steps[:, 1], steps[:, 0])
        band[0, 2], band[-1, 2] = pose.yaw, self.goal.yaw
        band[:, 3] = values.dt_ref
        return band

    def _carried_band(self, pose: Pose2) -> Array:
        """The last band, from the robot's present pose to the goal."""
        assert self._band is not None
        assert self.goal is not None
        first = self._band[: min(PRUNED, len(self._band) - 2)]
        nearest = (
            int(np.argmin(np.hypot(first[:, 0] - pose.x, first[:, 1] - pose.y)))
            if len(first)
            else 0
        )
        band = self._band[nearest:].copy()
        band[0, :3] = pose.x, pose.y, pose.yaw
        band[-1, :3] = self.goal.x, self.goal.y, self.goal.yaw
        return band

    def _obstacles(self, user: Disc | None, values: TebValues) -> Array:
        """All obstacles, with radii for which min_obstacle_dist is the clearance required."""
        if self.planner.boxes is not self._boxes[0]:
            boxes = self.planner.boxes
            self._boxes = boxes, _wall_rows(boxes, self._wall_distance)
        walls = np.concatenate((self._walls, self._boxes[1]))
        walls[:, 4] -= values.min_obstacle_dist
        if user is None:
            return walls
        # the penalty starts penalty_epsilon further out; half of that is enough clearance
        radius = user.radius - values.min_obstacle_dist - 0.5 * values.penalty_epsilon
        radius += self._margin - USER_MARGIN
        row = (user.x, user.y, user.x, user.y, radius, 0.0, 0.0)
        return np.concatenate((walls, [row]))

    def _first_velocity(self, band: Array, pose: Pose2, now: Twist2, dt: float) -> Twist2:
        """The velocity for the end of this period, on the way to the band's first one.

        The velocity between two poses is that halfway between them, dt / 2 ahead; sent at once, as
        in the published planner, it brakes too early and costs 3 % more time.
        """
        time = float(band[0, 3])
        part = min(1.0, 2.0 * dt / time)
        vx, vy = ((band[1, :2] - band[0, :2]) / time).tolist()
        turning = now.wz + part * (wrap(float(band[1, 2] - band[0, 2])) / time - now.wz)
        vx, vy = now.vx + part * (vx - now.vx), now.vy + part * (vy - now.vy)
        if self.mode == "differential":
            ahead = vx * math.cos(pose.yaw) + vy * math.sin(pose.yaw)
            look = pose.yaw + 0.5 * (now.wz + turning) * dt
            vx, vy = ahead * math.cos(look), ahead * math.sin(look)
        return self._limited(Twist2(vx, vy, turning), now, dt)

    def _limited(self, wanted: Twist2, now: Twist2, dt: float) -> Twist2:
        """The wanted velocity within the limits on speed and acceleration, both as norms."""
        limits = self._limits
        scale = min(1.0, limits.speed / wanted.speed) if wanted.speed else 1.0
        dx, dy = scale * wanted.vx - now.vx, scale * wanted.vy - now.vy
        change = math.hypot(dx, dy)
        part = min(1.0, limits.acceleration * dt / change) if change else 1.0
        rate = max(-limits.turn_rate, min(limits.turn_rate, wanted.wz))
        most = limits.turn_acceleration * dt
        rate = now.wz + max(-most, min(most, rate - now.wz))
        return Twist2(now.vx + part * dx, now.vy + part * dy, rate)


def _wall_rows(walls: Sequence[Ring], distance: float) -> Array:
    rows = [
        (*ring[i - 1], *corner, distance, 0.0, 0.0)
        for ring in walls
        for i, corner in enumerate(ring)
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 7)


def _spread(path: Path, spacing: float, least: int) -> Array:
    """Points at equal distances along a path, its ends included."""
    points = path.line[:, :2]
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    count = max(least, math.ceil(along[-1] / spacing) + 1)
    at = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(at, along, points[:, k]) for k in (0, 1)], axis=1)


@example
def _example() -> None:
    room = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
    driver = TebPlanner(ExactPlanner(room, inflation_radius=0.5), Limits(), Tolerance())
    driver.go_to(Pose2(7.0, 4.0, 1.0))
    driver.command(Pose2(1.0, 4.1), STILL, Disc(4.0, 4.0, 1.0), 0.05)
