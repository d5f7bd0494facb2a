"""What local planners have in common: goal, side of the user, limits, and the last check.

A local planner turns goal, pose and velocity into the velocity to send, in each control cycle. Each
planner chooses it in its own way; the last check, that braking from it hits nothing, is here.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import replace

import numpy as np

from hw import STILL, DriveMode, Pose2, Twist2
from hw.scene import NO_ZONES, Disc, Point
from states.navigation.exact import NOBODY, Path
from states.navigation.local.corner_rounding import time_along
from states.navigation.local.cycle import (
    IN_BASE,
    IN_MAP,
    NONE,
    braked,
    perceive,
    rotated,
    ways_to_stop,
)
from states.navigation.local.reckoning import DELAY, track_of
from states.navigation.planner_interfaces import DriveStatus, GlobalPlanner, Limits, Tolerance

USER_MARGIN = 0.01
"""Extra clearance of planned paths from the user, m; SIGMAS standard deviations are added."""
SIGMAS = 3.0
"""Standard deviations of the robot's position that are added to USER_MARGIN."""
SPREAD = 9.0
"""Growth of a walking user's predicted disc, in standard deviations of the pose per second."""
SWITCH_GAIN = 0.10
"""Share of the time by which the other side of the user has to be faster to be taken."""
ZONE_SHARE = 0.8
"""Share of the acceleration with which the robot brakes for speed zones."""
SLACK = 0.02
"""Depth inside an inflation up to which the robot keeps to its path, m."""
LEAVING_MARGIN = 0.5
"""A robot inside the user's disc drives this far beyond its edge, m, so that it leaves at speed."""
EDGE = {"omni": 0.001, "differential": 0.01}
"""Accuracy with which a base can follow the edge of an inflation, m, by drive mode."""
CRAWL = 0.05
"""Below this speed a differential base may turn as if on the spot, m/s."""


class LocalPlanner(ABC):
    """Drives to one goal after another; `command` is called once per control cycle.

    `status` is that of the last command: `driving`, `arrived` (latched until the robot is pushed
    out of twice the tolerance) or `blocked` (no path: it brakes, or leaves the user's disc).
    `path` is the global planner's, if any. `mode` (R2) and `planner` may be changed at any time.
    `spare`: how much nearer to walls than its inflation the robot touches none, m; infinite: not
    known. `reach`: half the diagonal of its outline, m; 0: not known.

    Plans start from reckoned positions of robot and user, so that noise of measured poses does not
    reach the velocity; see `reckoning`. `latency` is a first guess of the base's delay, s.
    """

    def __init__(
        self,
        planner: GlobalPlanner,
        limits: Limits,
        tolerance: Tolerance,
        mode: DriveMode = "omni",
        *,
        latency: float = 0.0,
    ) -> None:
        self.mode = mode
        self.status: DriveStatus = "driving"
        self.path: Path | None = None
        self.goal: Pose2 | None = None
        self.planner = planner
        self.zones = NO_ZONES
        self.spare, self.reach = math.inf, 0.0
        self._limits = self._own_limits = limits
        self._tolerance = tolerance
        self._rates = np.array(
            (limits.speed, limits.acceleration, limits.turn_rate, limits.turn_acceleration), float
        )
        self._side = 0
        self._sent: Twist2 | None = None  # in the map
        self._track, self._user_place = track_of(latency), np.zeros(3)
        self._seen, self._aim = np.zeros(14), np.zeros(6)
        self._velocities, self._ways = np.zeros((6, 3)), np.zeros((5, 10))
        self._user_velocity, self._margin, self._spread = (0.0, 0.0), USER_MARGIN, 0.0

    def go_to(self, goal: Pose2) -> None:
        """Set the goal, map_from_base; the present one is replaced without stopping.

        Raises:
            ValueError: the goal is not finite.
        """
        if goal == self.goal:
            return
        self.goal = Pose2.checked(goal.x, goal.y, goal.yaw)
        self.status, self._side = "driving", 0
        tolerance = self._tolerance
        self._aim[:3] = self.goal.x, self.goal.y, self.goal.yaw
        self._aim[3:] = tolerance.position, tolerance.yaw, tolerance.speed
        self._begin()

    @property
    def left(self) -> float:
        """Length of the path to the goal, m; infinite without one."""
        return math.inf if self.path is None else self.path.length

    def release(self) -> None:
        """Forget goal, velocity and positions: something else drives the base from now on."""
        self.goal, self._sent, self.path, self.status = None, None, None, "driving"
        self._track, self._user_place = track_of(self.delay), np.zeros(3)

    @property
    def delay(self) -> float:
        """How late the wheels follow what was sent, as estimated so far, s."""
        return float(self._track[DELAY])

    def command(  # noqa: PLR0913 - most are optional
        self,
        pose: Pose2,
        twist: Twist2,
        user: Disc | None,
        dt: float,
        user_velocity: Point = (0.0, 0.0),
        *,
        sigma: float = 0.0,
        admitted: Twist2 | None = None,
        share: float = 1.0,
    ) -> Twist2:
        """The velocity (base frame) to send for the coming period of dt seconds.

        Args:
            pose: map_from_base.
            twist: measured velocity in the base frame.
            user: disc in the map to keep out of, or None.
            dt: period of the control loop, s.
            user_velocity: of the disc in the map, m/s; the disc is reckoned, and predicted, by it.
            sigma: standard deviation of the robot's position relative to the user, m.
            admitted: what the safety chain left of the last command (base frame); None: all of it.
            share: factor on the speed limits, 0 to 1.

        Raises:
            ValueError: there is no goal, or pose, twist or sigma is not finite.
        """
        if self.goal is None:
            raise ValueError("no goal: call go_to first")
        if not 0.0 <= sigma < math.inf:
            raise ValueError(f"sigma is {sigma}; it must be 0 m or more")
        self._margin, self._spread = USER_MARGIN + SIGMAS * sigma, SPREAD * sigma
        self._user_velocity = (float(user_velocity[0]), float(user_velocity[1]))
        dt = float(dt)
        pose, now, user = self._perceived(pose, twist, user, admitted, dt)
        if self.zones.speed:
            self._heed_zones(pose, now, dt)
        if self.status == "arrived":
            wanted = self._braked(now, dt)
        else:
            wanted = self._wanted(pose, now, user, dt)
        safe = self._clear(pose, now, wanted, user, dt)
        if share < 1.0:
            safe = safe.scaled_to(share * self._limits.speed, share * self._limits.turn_rate)
        self._sent = safe
        # the base keeps the command along its own axes, which turn: on average by half the turn
        turn = 0.5 * (now.wz + safe.wz) * dt
        if self.mode == "differential":
            return self._along_heading(pose, now, safe, dt)
        return Twist2(*rotated(safe.vx, safe.vy, -(pose.yaw + 0.5 * turn)), safe.wz)

    def _along_heading(self, pose: Pose2, now: Twist2, safe: Twist2, dt: float) -> Twist2:
        """The command (base frame) of a differential base for a velocity in the map."""
        heading = pose.yaw + 0.5 * (now.wz + safe.wz) * dt
        speed = math.copysign(safe.speed, safe.rotated(-heading).vx)
        before = math.copysign(now.speed, now.rotated(-pose.yaw).vx)
        step = self._limits.acceleration * dt
        command = Twist2(max(before - step, min(before + step, speed)), 0.0, safe.wz)
        self._sent = command.rotated(heading)
        return command

    def _perceived(
        self, pose: Pose2, twist: Twist2, user: Disc | None, admitted: Twist2 | None, dt: float
    ) -> tuple[Pose2, Twist2, Disc | None]:
        """Reckoned pose, velocity in the map, and the user's disc; sets whether it has arrived."""
        if not math.isfinite(pose.x + pose.y + pose.yaw + twist.vx + twist.vy + twist.wz):
            Pose2.checked(pose.x, pose.y, pose.yaw)
            Twist2.checked(twist.vx, twist.vy, twist.wz)
        given = admitted or self._sent or STILL
        disc = (0.0, 0.0, -1.0) if user is None else (user.x, user.y, user.radius)
        self._seen[:] = (
            pose.x, pose.y, pose.yaw, twist.vx, twist.vy, twist.wz,
            given.vx, given.vy, given.wz, *disc, *self._user_velocity,
        )  # fmt: skip
        frame = IN_BASE if admitted else IN_MAP if self._sent else NONE
        before = self.status == "arrived"
        at, now, around, arrived = perceive(
            self._track, self._user_place, self._seen, frame, self._aim, dt, before
        )
        if arrived or before:
            self.status = "arrived" if arrived else "driving"
        return Pose2(*at), Twist2(*now), None if user is None else Disc(*around)

    def _heed_zones(self, pose: Pose2, now: Twist2, dt: float) -> None:
        """Limit the speed to that of the zones ahead, braking in time for them."""
        own, x, y = self._own_limits, pose.x + now.vx * dt, pose.y + now.vy * dt
        allowed = self.zones.speed_at(x, y, ZONE_SHARE * own.acceleration)
        speed = min(own.speed, allowed)
        if speed != self._limits.speed:
            self._limits = replace(own, speed=speed)
            self._rates[0] = speed

    @abstractmethod
    def _begin(self) -> None:
        """Reset what belonged to the previous goal."""

    @abstractmethod
    def _wanted(self, pose: Pose2, now: Twist2, user: Disc | None, dt: float) -> Twist2:
        """The best velocity in the map, within the limits."""

    def _braked(self, now: Twist2, dt: float) -> Twist2:
        """The velocity in the map after one period of braking."""
        return Twist2(*braked((now.vx, now.vy, now.wz), self._rates, dt))

    def _best_path(self, start: Point, goal: Point, user: Disc | None, now: Twist2) -> Path | None:
        """The path on the faster side of the user; the last side if it is nearly as fast."""
        if user is None:
            return self.planner.plan(start, goal)
        if self.planner.allows(start, goal, user):  # else no path is straight
            shortest = self.planner.plan(start, goal, user)
            if shortest is None or len(shortest.line) == 2:
                return shortest
        paths = {side: self.planner.plan(start, goal, user, side) for side in (1, -1)}
        times = {
            side: time_along(path.line, now.vx, now.vy, self._rates)
            for side, path in paths.items()
            if path is not None
        }
        if not times:
            return self.planner.plan(start, goal, user)
        best = min(times, key=lambda side: times[side])
        if self._side in times and times[self._side] * (1.0 - SWITCH_GAIN) <= times[best]:
            best = self._side
        self._side = best
        return paths[best]

    def _with_margin(self, user: Disc | None, start: Point, goal: Point) -> Disc | None:
        """The user's disc for planning: larger, but not over start or goal."""
        return None if user is None else user.grown(self._margin, start, goal)

    def _path_out(self, start: Point, user: Disc | None) -> Path | None:
        """The path straight out of the user's disc, to beyond its edge; None outside of it."""
        if user is None or math.dist(start, (user.x, user.y)) >= user.radius - SLACK:
            return None
        for margin in (LEAVING_MARGIN, 0.0):
            place = self.planner.nearest_free(start, Disc(user.x, user.y, user.radius + margin))
            if place is not None:
                return Path.of_points((start, place))
        return None

    def _clear(
        self, pose: Pose2, now: Twist2, wanted: Twist2, user: Disc | None, dt: float
    ) -> Twist2:
        """The largest share of the wanted change of velocity from which braking hits nothing.

        If even braking comes too near to something, the turn rate is braked, too: turning could
        swing a corner of the robot towards it. Nearer to a wall than its `reach` it does not turn,
        and may come no nearer anyway; it has to get out. Elsewhere no wall is touched either should
        the safety chain hold the robot off the user.
        """
        place, disc = (pose.x, pose.y), NOBODY if user is None else (user.x, user.y, user.radius)
        tight = self.planner.clearance(place) < self.reach
        turns = self.mode == "omni" or now.speed <= CRAWL
        spare = math.inf if tight or user is None else self.spare
        motion, aim = (now.vx, now.vy, now.wz), (wanted.vx, wanted.vy, wanted.wz)
        velocities, ways = self._velocities, self._ways
        ways_to_stop(place, motion, aim, disc, self._rates, dt, turns, tight, velocities, ways)
        first = self.planner.first_allowed(place, ways, user, EDGE[self.mode], spare)
        return Twist2(*velocities[first].tolist())
