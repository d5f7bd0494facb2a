"""What local planners have in common: goal, side of the user, limits, and the last check.

A local planner turns goal, pose and velocity into the velocity to send, in each control cycle. Each
planner chooses it in its own way; the last check, that braking from it hits nothing, is here.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import replace

from hw import DriveMode, Pose2, Twist2, wrap
from hw.scene import NO_ZONES, Disc, Point
from states.navigation.exact import Path
from states.navigation.local.corner_rounding import time_from
from states.navigation.local.reckoning import ReckonedPlace, ReckonedPose
from states.navigation.local.speed_profile import SpeedLimits
from states.navigation.planner_interfaces import DriveStatus, GlobalPlanner, Limits, Tolerance

USER_MARGIN = 0.01
"""Extra clearance of planned paths from the user, m; SIGMAS standard deviations are added."""
SIGMAS = 3.0
"""Standard deviations of the robot's position that are added to USER_MARGIN."""
SPREAD = 9.0
"""Growth of a walking user's predicted disc, in standard deviations of the pose per second."""
BEND_SHARE = 0.9
"""Share of the acceleration that bends are planned with; the rest is for corrections."""
CORNER_ERROR = 0.03
"""Deviation within which corners of paths found on grids are rounded, m."""
SWITCH_GAIN = 0.10
"""Share of the time by which the other side of the user has to be faster to be taken."""
ZONE_SHARE = 0.8
"""Share of the acceleration with which the robot brakes for speed zones."""
SLACK = 0.02
"""Depth inside an inflation up to which the robot keeps to its path, m."""
LEAVING_MARGIN = 0.5
"""A robot inside the user's disc drives this far beyond its edge, m, so that it leaves at speed."""
EDGE_OF_DISC = 1e-6
"""Rounding of a disc that ends at the goal, m."""
EDGE = {"omni": 0.001, "differential": 0.01}
"""Accuracy with which a base can follow the edge of an inflation, m, by drive mode."""
ASIDE = 0.35
"""The user is seen from the robot's nearest side in a direction that differs by this from that seen
from its centre, rad."""
CRAWL = 0.05
"""Below this speed a differential base may turn as if on the spot, m/s."""
LOST_TRACK = 0.3
"""If measured and sent velocity differ by more, m/s, planning starts from the measured one."""


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
        self._tight = False
        self._limits = self._own_limits = limits
        self._tolerance = tolerance
        self._pace = SpeedLimits(
            float(limits.speed), float(limits.acceleration), BEND_SHARE, CORNER_ERROR
        )
        self._side = 0
        self._sent: Twist2 | None = None  # in the map
        self._reckoned = ReckonedPose(latency)
        self._reckoned_user = ReckonedPlace()
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
        self._begin()

    def release(self) -> None:
        """Forget goal, velocity and positions: something else drives the base from now on."""
        self.goal, self._sent, self.path, self.status = None, None, None, "driving"
        self._reckoned = ReckonedPose(self._reckoned.delay)
        self._reckoned_user = ReckonedPlace()

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
        pose = Pose2.checked(pose.x, pose.y, pose.yaw)
        measured = Twist2.checked(twist.vx, twist.vy, twist.wz).rotated(pose.yaw)
        given = admitted.rotated(pose.yaw) if admitted else self._sent or measured
        lost = _apart(given, measured) > LOST_TRACK
        now = measured if lost else given
        pose = self._reckoned.update(pose, measured, now, dt, lost=lost)
        self._heed_zones(pose, now, dt)
        self._user_velocity = (float(user_velocity[0]), float(user_velocity[1]))
        user = self._reckoned_disc(user, dt)
        self._margin = _margin(sigma)
        self._spread = SPREAD * sigma
        if self._has_arrived(pose, now):
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
        return safe.rotated(-(pose.yaw + 0.5 * turn))

    def _along_heading(self, pose: Pose2, now: Twist2, safe: Twist2, dt: float) -> Twist2:
        """The command (base frame) of a differential base for a velocity in the map."""
        heading = pose.yaw + 0.5 * (now.wz + safe.wz) * dt
        speed = math.copysign(safe.speed, safe.rotated(-heading).vx)
        before = math.copysign(now.speed, now.rotated(-pose.yaw).vx)
        step = self._limits.acceleration * dt
        command = Twist2(max(before - step, min(before + step, speed)), 0.0, safe.wz)
        self._sent = command.rotated(heading)
        return command

    def _reckoned_disc(self, user: Disc | None, dt: float) -> Disc | None:
        """The disc at the user's reckoned place; a goal outside of it as measured stays outside."""
        if user is None:
            self._reckoned_user = ReckonedPlace()
            return None
        place = self._reckoned_user.update((user.x, user.y), self._user_velocity, dt)
        assert self.goal is not None
        goal, radius = (self.goal.x, self.goal.y), user.radius
        if math.dist((user.x, user.y), goal) >= radius - EDGE_OF_DISC:
            radius = min(radius, math.dist(place, goal))
        return Disc(*place, radius)

    def _heed_zones(self, pose: Pose2, now: Twist2, dt: float) -> None:
        """Limit the speed to that of the zones ahead, braking in time for them."""
        if not self.zones.speed:
            return
        own, x, y = self._own_limits, pose.x + now.vx * dt, pose.y + now.vy * dt
        allowed = self.zones.speed_at(x, y, ZONE_SHARE * own.acceleration)
        speed = min(own.speed, allowed)
        if speed != self._limits.speed:
            self._limits = replace(own, speed=speed)
            self._pace = self._pace._replace(speed=float(speed))

    @abstractmethod
    def _begin(self) -> None:
        """Reset what belonged to the previous goal."""

    @abstractmethod
    def _wanted(self, pose: Pose2, now: Twist2, user: Disc | None, dt: float) -> Twist2:
        """The best velocity in the map, within the limits."""

    def _braked(self, now: Twist2, dt: float) -> Twist2:
        """The velocity in the map after one period of braking."""
        scale = max(0.0, 1.0 - self._limits.acceleration * dt / now.speed) if now.speed else 0.0
        slower = self._limits.turn_acceleration * dt
        return Twist2(scale * now.vx, scale * now.vy, now.wz - max(-slower, min(slower, now.wz)))

    def _has_arrived(self, pose: Pose2, now: Twist2) -> bool:
        assert self.goal is not None
        tolerance = self._tolerance
        away, turned = pose.distance_to(self.goal), abs(wrap(self.goal.yaw - pose.yaw))
        if self.status == "arrived":
            if away <= 2.0 * tolerance.position and turned <= 2.0 * tolerance.yaw:
                return True
            self.status = "driving"
        near = away <= tolerance.position and turned <= tolerance.yaw
        if near and now.speed <= tolerance.speed and abs(now.wz) <= tolerance.speed:
            self.status = "arrived"
            return True
        return False

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
            side: time_from(path.line, now.vx, now.vy, self._pace)
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

    def _turn(self, pose: Pose2, now: Twist2, dt: float, yaw: float | None = None) -> float:
        """The turn rate for the end of this period that ends at `yaw` (None: the goal's), rad/s.

        The largest rate w that can still be braked: w^2 / (2 a) is covered while braking and half
        of w dt in this period, so w = sqrt((a dt / 2)^2 + 2 a rest) - a dt / 2.
        """
        assert self.goal is not None
        limits = self._limits
        error = wrap((self.goal.yaw if yaw is None else yaw) - pose.yaw)
        if self.status != "driving":
            error = 0.0
        half = 0.5 * limits.turn_acceleration * dt
        rest = max(0.0, abs(error) - 0.5 * math.copysign(1.0, error) * now.wz * dt)
        rate = math.sqrt(half * half + 2.0 * limits.turn_acceleration * rest) - half
        wanted = math.copysign(min(limits.turn_rate, rate), error)
        return max(now.wz - 2.0 * half, min(now.wz + 2.0 * half, wanted))

    def _clear(
        self, pose: Pose2, now: Twist2, wanted: Twist2, user: Disc | None, dt: float
    ) -> Twist2:
        """The largest share of the wanted change of velocity from which braking hits nothing.

        If even braking comes too near to something, the turn rate is braked, too: turning could
        swing a corner of the robot towards it. Nearer to a wall than its `reach` it does not turn.
        """
        stopped = braked = self._braked(now, dt)
        self._tight = self.planner.clearance((pose.x, pose.y)) < self.reach
        if self._tight:
            wanted = Twist2(wanted.vx, wanted.vy, stopped.wz)
        if self.mode == "omni" or now.speed <= CRAWL:
            braked = Twist2(braked.vx, braked.vy, wanted.wz)
        for part in (1.0, 0.75, 0.5, 0.25):
            vx = braked.vx + part * (wanted.vx - braked.vx)
            vy = braked.vy + part * (wanted.vy - braked.vy)
            if self._can_brake(pose, now, (vx, vy), user, dt):
                return Twist2(vx, vy, wanted.wz)
        rests = self._can_brake(pose, now, (stopped.vx, stopped.vy), user, dt)
        return braked if rests else stopped

    def _can_brake(
        self, pose: Pose2, now: Twist2, velocity: Point, user: Disc | None, dt: float
    ) -> bool:
        vx, vy = velocity
        start = (pose.x, pose.y)
        then = (pose.x + 0.5 * (now.vx + vx) * dt, pose.y + 0.5 * (now.vy + vy) * dt)
        # braking covers v^2 / 2a: the velocity times this time
        time = 0.5 * math.hypot(vx, vy) / self._limits.acceleration
        end = (then[0] + vx * time, then[1] + vy * time)
        slack = EDGE[self.mode]
        return (
            self.planner.allows(start, then, user, slack)
            and self.planner.allows(then, end, user, slack)
            and self._can_be_held(then, velocity, user)
        )

    def _can_be_held(self, place: Point, velocity: Point, user: Disc | None) -> bool:
        """True if no wall is touched either should the safety chain hold the robot off the user.

        The chain takes out the part of the velocity that closes the gap; the rest leads elsewhere.
        Nearer to a wall than its `reach` the robot may come no nearer anyway, and has to get out.
        """
        if user is None or self.spare == math.inf or self._tight:
            return True
        at = math.atan2(user.y - place[1], user.x - place[0])
        for off in (0.0, ASIDE, -ASIDE):
            nx, ny = math.cos(at + off), math.sin(at + off)
            toward = max(0.0, velocity[0] * nx + velocity[1] * ny)
            vx, vy = velocity[0] - toward * nx, velocity[1] - toward * ny
            time = 0.5 * math.hypot(vx, vy) / self._limits.acceleration
            end = (place[0] + vx * time, place[1] + vy * time)
            if not self.planner.allows(place, end, None, self.spare):
                return False
        return True


def _apart(a: Twist2, b: Twist2) -> float:
    return math.dist((a.vx, a.vy, a.wz), (b.vx, b.vy, b.wz))


def _margin(sigma: float) -> float:
    if not 0.0 <= sigma < math.inf:
        raise ValueError(f"sigma is {sigma}; it must be 0 m or more")
    return USER_MARGIN + SIGMAS * sigma
