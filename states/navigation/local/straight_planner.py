"""Straight drives, as rollouts simulate them: towards a place, and braking from it is safe."""

from __future__ import annotations

import math

import numpy as np

from hw import STILL, USER_RADIUS, Pose2, Twist2, compiled, example, wrapped
from hw.model import Footprint
from hw.safety import nearness
from hw.scene import Disc, Point
from states.navigation.exact import NOBODY, Array, Triple
from states.navigation.planner_interfaces import DriveStatus, GlobalPlanner, Limits, Tolerance

STEP_S = 0.1
"""The last stretch takes this long, s: the step of rollouts."""
AT_IT = 1e-6
"""Nearer to its goal than this, m, a drive has no direction: a tolerance of rounding."""

Rates = tuple[float, float, float, float, float, float, float]
"""Greatest speed, acceleration and deceleration; a period, and the time until a command of the next
tick acts; length and width of the footprint."""


class StraightPlanner:
    """Drives straight to one goal after another without turning; see `LocalPlanner` for the terms.

    Standstill instead, if braking straight ahead from the next tick on would end too near to a
    wall, because the drive may be aborted then. `deceleration` is the wheels' own, m/s2, `latency`
    the time until they hear a command, s.
    """

    def __init__(
        self,
        planner: GlobalPlanner,
        limits: Limits,
        tolerance: Tolerance,
        *,
        footprint: Footprint,
        deceleration: float,
        latency: float = 0.0,
    ) -> None:
        self.planner = planner
        self.goal: Pose2 | None = None
        self.status: DriveStatus = "driving"
        self.left = math.inf
        self._limits, self._tolerance = limits, tolerance
        self._footprint, self._deceleration, self._latency = footprint, deceleration, latency

    def go_to(self, goal: Pose2) -> None:
        """Set the goal; its yaw does not count."""
        self.goal, self.status = goal, "driving"

    def release(self) -> None:
        """Forget the goal."""
        self.goal, self.left = None, math.inf

    def command(  # noqa: PLR0913 - as for every local planner
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

        Of the `user` only the place counts: the safety chain may hold the robot off it.

        Raises:
            ValueError: there is no goal.
        """
        if self.goal is None:
            raise ValueError("no goal: call go_to first")
        limits, goal, place = self._limits, (self.goal.x, self.goal.y), (pose.x, pose.y)
        self.left = math.dist(place, goal)
        near = self.left <= self._tolerance.position and twist.speed < self._tolerance.speed
        self.status = "arrived" if near else "driving"
        wanted, ends = drive_towards(
            (pose.x, pose.y, pose.yaw),
            (twist.vx, twist.vy, twist.wz),
            NOBODY if user is None else (user.x, user.y, user.radius),
            goal,
            self._rates(dt),
        )
        if len(ends) == 0 or not self.planner.allows_each(place, ends):
            return STILL
        command = Twist2(*wanted)
        if share >= 1.0:
            return command
        return command.scaled_to(share * limits.speed, share * limits.turn_rate)

    def _rates(self, dt: float) -> Rates:
        return (
            float(self._limits.speed),
            float(self._limits.acceleration),
            float(self._deceleration),
            float(dt),
            float(dt + self._latency),
            float(self._footprint.length),
            float(self._footprint.width),
        )


@compiled
def drive_towards(
    pose: Triple, twist: Triple, user: Triple, goal: Point, rates: Rates
) -> tuple[Point, Array]:
    """The command (base frame), and where the robot stands that brakes a tick later, (n, 2).

    There are up to 8 places: wheels that slow down may change their direction as fast as they can
    brake, and the safety chain may brake away the part of a velocity that leads to the user; the
    rest turns away from them, maybe to a wall. None at the goal.
    """
    (x, y, yaw), max_speed, acceleration = pose, rates[0], rates[1]
    dx, dy = goal[0] - x, goal[1] - y
    left = math.hypot(dx, dy)
    if left < AT_IT:
        return (0.0, 0.0), np.empty((0, 2))
    speed = min(max_speed, math.sqrt(2.0 * acceleration * left))
    pace = min(speed / left, 1.0 / STEP_S)
    wanted, motion = (pace * dx, pace * dy), _turned((twist[0], twist[1]), yaw)
    away = _to_user(pose, user, rates) if user[2] > 0.0 else (0.0, 0.0)
    ends, count = np.empty((8, 2)), 0
    for target in (wanted, _held_back(wanted, away)):
        for rate in (acceleration, rates[2]):
            plain = _changed(motion, target, 2.0 * rate * rates[3])
            for vx, vy in (plain, _held_back(plain, away)):
                # times it: the way until braking begins, and braking, v^2 / (2 a)
                braking = rates[4] + math.hypot(vx, vy) / (2.0 * acceleration)
                ends[count, 0], ends[count, 1] = x + braking * vx, y + braking * vy
                count += 1
    return _turned(wanted, -yaw), ends


@compiled
def _turned(velocity: Point, yaw: float) -> Point:
    c, s = math.cos(yaw), math.sin(yaw)
    return c * velocity[0] - s * velocity[1], s * velocity[0] + c * velocity[1]


@compiled
def _changed(velocity: Point, target: Point, by: float) -> Point:
    """A velocity after a change towards a target by so much at most, m/s."""
    ax, ay = target[0] - velocity[0], target[1] - velocity[1]
    share = min(1.0, by / max(1e-9, math.hypot(ax, ay)))
    return velocity[0] + share * ax, velocity[1] + share * ay


@compiled
def _to_user(pose: Triple, user: Triple, rates: Rates) -> Point:
    """Unit vector from the nearest point of the footprint to the user, in the axes of the map."""
    x, y, yaw = pose
    c, s = math.cos(yaw), math.sin(yaw)
    ax, ay, back = -c * x - s * y, s * x - c * y, wrapped(-yaw)
    c, s = math.cos(back), math.sin(back)
    ux, uy = ax + c * user[0] - s * user[1], ay + s * user[0] + c * user[1]
    near = nearness(0.5 * rates[5], 0.5 * rates[6], ux, uy, USER_RADIUS)
    return _turned((near.nx, near.ny), yaw)


@compiled
def _held_back(velocity: Point, away: Point) -> Point:
    """What the safety chain leaves of a velocity that closes in on the user."""
    toward = away[0] * velocity[0] + away[1] * velocity[1]
    if toward <= 0.0:
        return velocity
    return velocity[0] - toward * away[0], velocity[1] - toward * away[1]


@example
def _example() -> None:
    at = (0.0, 0.0, 0.0)
    drive_towards(at, at, at, (1.0, 0.0), (1.0, 1.0, 1.0, 0.1, 0.1, 1.0, 1.0))
