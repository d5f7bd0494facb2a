"""The local planner `profile`: the shortest path, driven as fast as the limits allow.

Each cycle replans from the robot's position: the path around walls and user on either side, its
next bend widened for speed, the largest velocity from which every later bend and the goal can
still be met. A last check in `LocalPlanner` makes sure that braking from it ends in time.
"""

from __future__ import annotations

import math

import numpy as np

from hw import STILL, Pose2, Twist2, compiled, example, wrap
from hw.scene import Disc
from states.navigation.exact import Array, ExactPlanner, Path, Triple
from states.navigation.local.corner_rounding import (
    ARC_PARTS,
    circles_for,
    time_along,
    widened,
)
from states.navigation.local.cycle import turn_rate
from states.navigation.local.local_planner import EDGE, SLACK, LocalPlanner
from states.navigation.local.predicted_gap import (
    HORIZON,
    least_gap_braking,
    least_gap_on,
    predicted_disc,
    steps_aside,
)
from states.navigation.local.speed_profile import (
    BEND_SHARE,
    SpeedLimits,
    heading_after,
    next_speed,
    pace_of,
)
from states.navigation.planner_interfaces import Limits, Tolerance

STANDING = 0.1
"""A user slower than this counts as standing, m/s."""
LOOKS_AHEAD = (0.5, 1.0, 1.5, 2.0)
"""Times ahead, s: paths around the user's position after each of them are candidates."""

NO_CIRCLE = np.zeros(4)


class ProfilePlanner(LocalPlanner):
    """Shortest path, widened bends, speed by forward and backward pass; see `LocalPlanner`."""

    _circle: Array = NO_CIRCLE  # sense of turning and circle of the bend that is being driven

    def _begin(self) -> None:
        self._circle = NO_CIRCLE

    @property
    def _pace(self) -> SpeedLimits:
        return pace_of(self._rates)

    def _wanted(self, pose: Pose2, now: Twist2, user: Disc | None, dt: float) -> Twist2:
        line = self._line(pose, now, user)
        if line is None:
            return self._braked(now, dt)
        if self.mode == "differential":
            return self._steer(pose, now, line, dt)
        return self._drive(pose, now, line, dt)

    def _line(self, pose: Pose2, now: Twist2, user: Disc | None) -> Array | None:
        line = self._line_around(pose, now, user)
        if user is None or not self._comes_near(pose, user):
            return line
        gap = self._least_gap(pose, now, user, line)
        return line if gap >= 0.0 else self._evasion(pose, now, user, _Choice(gap, line, self))

    def _line_around(
        self, pose: Pose2, now: Twist2, user: Disc | None, *, either_side: bool = True
    ) -> Array | None:
        """The path around the disc as a line, on the faster or the shorter side; None: brake."""
        assert self.goal is not None
        start, goal = (pose.x, pose.y), (self.goal.x, self.goal.y)
        around = self._with_margin(user, start, goal)
        if either_side:
            self.path = self._best_path(start, goal, around, now)
        else:
            self.path = self.planner.plan(start, goal, around)
        self.status = "blocked" if self.path is None else "driving"
        path_out = self._path_out(start, user)
        if path_out is not None:
            return path_out.line
        if self.path is None:
            return None
        line = self.path.line
        if not self.planner.is_free(start, around):
            slanting = self._slanting(line, around)
            if slanting is None:
                return line
            line = slanting
        if self.mode == "differential":
            return line
        return self._widen(line, now, around)

    def _slanting(self, line: Array, user: Disc | None) -> Array | None:
        """The line out of an inflation that joins its second leg as far on as walls allow.

        The first leg, straight out, would have to be entered from standstill. None: it is longer
        than SLACK, or there is no other way out.
        """
        start, out = (float(line[0, 0]), float(line[0, 1])), (float(line[1, 0]), float(line[1, 1]))
        depth = math.dist(start, out)
        if depth > SLACK or len(line) < 3:
            return None
        join, rest = line[2:3], line[3:]
        while not self.planner.allows(start, (join[0, 0], join[0, 1]), user, EDGE[self.mode]):
            join, rest = 0.5 * (line[1:2] + join), line[2:]
            join[0, 2] = line[1, 2]
            if math.dist(out, join[0, :2]) <= depth:
                return None
        return np.concatenate((line[:1], join, rest))

    def _comes_near(self, pose: Pose2, user: Disc) -> bool:
        """True if the walking user could come too near within HORIZON."""
        speed = math.hypot(*self._user_velocity)
        away = math.dist((pose.x, pose.y), (user.x, user.y)) - user.radius
        return speed > STANDING and away < HORIZON * (speed + self._limits.speed)

    def _least_gap(self, pose: Pose2, now: Twist2, user: Disc, line: Array | None) -> float:
        around = user.grown(self._margin, (pose.x, pose.y))
        walker = (user.x, user.y, around.radius, *self._user_velocity, self._spread)
        gap = math.inf
        along = 0.0 if line is None else _along(line, now)
        if line is None or along < 0.0:  # before turning back the robot has to brake
            gap = float(least_gap_braking(pose.x, pose.y, now.vx, now.vy, walker, self._pace))
        if line is not None:
            gap = min(
                gap,
                float(least_gap_on(line, max(0.0, along), walker, self._pace)),
            )
        return gap

    def _evasion(self, pose: Pose2, now: Twist2, user: Disc, present: _Choice) -> Array | None:
        """The best of: paths around the user's later positions, sidesteps, and waiting.

        Ranked by the least gap, in whole centimetres and capped at 0 (the edge of the disc), then
        by time.
        """
        place, choices = (pose.x, pose.y), [present]
        for time in LOOKS_AHEAD:
            then = predicted_disc(user, self._user_velocity, time, place)
            self._side, self._circle = present.side, present.circle
            line = self._line_around(pose, now, then, either_side=False)
            if line is not None and self.path is not None:
                choices.append(_Choice(self._least_gap(pose, now, user, line), line, self))
        present.restore(self)
        passes = math.dist(place, (user.x, user.y)) / math.hypot(*self._user_velocity)
        room = self._margin + self._spread * min(HORIZON, passes)
        for aside in steps_aside(user, self._user_velocity, place, room):
            if self.planner.is_free(aside) and self.planner.allows(place, aside, user):
                line = Path.of_points((place, aside)).line
                choices.append(_Choice(self._least_gap(pose, now, user, line), line, self))
        choices.append(_Choice(self._least_gap(pose, now, user, None), None, self))
        best = max(choices, key=lambda choice: choice.rank(now, self._rates))
        best.restore(self)
        return best.line

    def _widen(self, line: Array, now: Twist2, user: Disc | None) -> Array:
        """The line with its next bend, or the turn onto it, along the fastest free circle."""
        before, self._circle = self._circle, NO_CIRCLE
        rest, circles, plain = circles_for(line, now.vx, now.vy, self._rates, before)
        refused = math.inf
        for circle in circles:
            turn, _, _, radius, time = circle.tolist()
            if time >= plain:
                break
            if radius >= refused:
                continue
            new = widened(line, rest, turn, circle[1:4])
            if new is not None and self.planner.allows_line(new[: ARC_PARTS + 4], user):
                self._circle = circle[:4]
                return new
            refused = 0.9 * radius
        return line

    def _drive(self, pose: Pose2, now: Twist2, line: Array, dt: float) -> Twist2:
        assert self.goal is not None
        error = wrap(self.goal.yaw - pose.yaw) if self.status == "driving" else 0.0
        return Twist2(*velocity_along(line, (now.vx, now.vy, now.wz), error, self._rates, dt))

    def _turn(self, pose: Pose2, now: Twist2, dt: float, yaw: float) -> float:
        error = wrap(yaw - pose.yaw) if self.status == "driving" else 0.0
        return turn_rate(error, now.wz, self._rates, dt)

    def _steer(self, pose: Pose2, now: Twist2, line: Array, dt: float) -> Twist2:
        """The same for a base that drives only along its heading (R2)."""
        assert self.goal is not None
        ahead = (math.cos(pose.yaw), math.sin(pose.yaw))
        along = ahead[0] * now.vx + ahead[1] * now.vy
        speed, turning = 0.0, self._turn(pose, now, dt, self.goal.yaw)
        if pose.distance_to(self.goal) > 0.5 * self._tolerance.position:
            heading = heading_after(line, now.speed * dt)
            error = abs(wrap(heading - pose.yaw))
            turning = self._turn(pose, now, dt, heading)
            if error < 0.5 * math.pi:
                speed = next_speed(line, max(0.0, along), self._pace, dt) * math.cos(error) ** 4
        # turning at speed is acceleration across: it goes first, what is left changes the speed
        across = min(abs(along * turning), BEND_SHARE * self._limits.acceleration)
        reach = dt * math.sqrt(self._limits.acceleration**2 - across**2)
        speed = max(along - reach, min(along + reach, speed))
        if abs(along * turning) > across:
            turning = math.copysign(across / abs(along), turning)
        look = pose.yaw + 0.5 * (now.wz + turning) * dt
        return Twist2(speed * math.cos(look), speed * math.sin(look), turning)


def _along(line: Array, motion: Twist2) -> float:
    """Component of a velocity along the first direction of a line, m/s."""
    dx, dy = (line[1, :2] - line[0, :2]).tolist()
    length = math.hypot(dx, dy)
    return (dx * motion.vx + dy * motion.vy) / length if length else motion.speed


@compiled
def velocity_along(line: Array, now: Triple, error: float, rates: Array, dt: float) -> Triple:
    """The velocity in the map for the end of this period, on a line from the robot's place.

    `now` is that at its beginning, `error` the turn that is left; `rates` as in `cycle`.
    """
    vx, vy, wz = now
    reach, pace = rates[1] * dt, pace_of(rates)
    heading = heading_after(line, math.hypot(vx, vy) * dt)
    ux, uy = math.cos(heading), math.sin(heading)
    along, across = ux * vx + uy * vy, ux * vy - uy * vx
    speed = next_speed(line, max(0.0, along), pace, dt)
    forward, sideways = speed - along, -across
    if forward > 0.0:
        # return to the line first; what is left of the acceleration changes the speed
        sideways = max(-reach, min(reach, sideways))
        forward = min(forward, math.sqrt(reach * reach - sideways * sideways))
    else:
        # brake first: near the goal corrections of an uncertain direction would use it up
        scale = min(1.0, reach / max(1e-12, math.hypot(forward, sideways)))
        forward, sideways = scale * forward, scale * sideways
    vx, vy = vx + forward * ux - sideways * uy, vy + forward * uy + sideways * ux
    scale = min(1.0, rates[0] / max(1e-9, math.hypot(vx, vy)))
    return vx * scale, vy * scale, turn_rate(error, wz, rates, dt)


class _Choice:
    """A candidate line (None: brake), its gap, and the planner's state that goes with it."""

    def __init__(self, gap: float, line: Array | None, planner: ProfilePlanner) -> None:
        self.gap, self.line = gap, line
        self.side, self.circle = planner._side, planner._circle
        self._path, self._status = planner.path, planner.status

    def rank(self, now: Twist2, rates: Array) -> tuple[float, float]:
        time = math.inf if self.line is None else time_along(self.line, now.vx, now.vy, rates)
        return round(min(0.0, self.gap), 2), -time

    def restore(self, planner: ProfilePlanner) -> None:
        planner._side, planner._circle = self.side, self.circle
        planner.path, planner.status = self._path, self._status


@example
def _example() -> None:
    room = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
    driver = ProfilePlanner(ExactPlanner(room, inflation_radius=0.5), Limits(), Tolerance())
    driver.go_to(Pose2(7.0, 4.0, 1.0))
    for _ in range(2):
        driver.command(Pose2(1.0, 4.1), STILL, Disc(4.0, 4.0, 1.0), 0.05)
    driver.command(Pose2(1.0, 4.1), Twist2(0.0, 1.0), None, 0.05)
    driver.command(Pose2(1.0, 4.1), STILL, Disc(4.0, 4.0, 1.0), 0.05, (-1.0, 0.0))
    driver._braked(STILL, 0.05)
    driver.mode = "differential"
    driver.command(Pose2(1.0, 4.1), STILL, None, 0.05)
