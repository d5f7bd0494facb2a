"""The limits of the safety chain, and the separation needed to stop before reaching the user.

The separation is that of ISO/TS 15066, 5.5.4, for a constant deceleration. These are figures only:
nothing here makes a robot fit to work beside people. The robot needs a reaction time T and then
brakes from its closing speed v with the deceleration a, so it covers v T + v^2 / 2a within T + v /
a. Meanwhile the user, last seen `age` ago, comes closer at speed v_h. With a margin C that gives

    S_p = v_h (age + T + v / a) + v T + v^2 / 2a + C

C covers the user's reach and the position errors of both; the part of the base's position error
beyond the share in C is added to S_p (`SafetyLimits.pose_error`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hw.model import Footprint, MotionLimits, RobotModel
from hw.samples import LATE_S, OLD_S

POSE_ERROR_M = 0.075
"""Three standard deviations of the base's position that C covers, m: half of its 0.15 m."""
_NOTHING = 1e-12
"""Less distance than this counts as none, m."""
_STILL = 1e-6
"""A closing speed below this is rounding, m/s."""


@dataclass(frozen=True, slots=True)
class Stopping:
    """The braking of a robot: a in m/s2, T in s, C in m (see the module)."""

    deceleration: float
    reaction: float
    clearance: float

    def __post_init__(self) -> None:
        if not 0.0 < self.deceleration < math.inf:
            raise ValueError(f"stopping: a deceleration of {self.deceleration}; it must be above 0")
        for name in ("reaction", "clearance"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"stopping: a {name} of {getattr(self, name)}; it must be finite")

    def needed(self, closing: float, user_speed: float, age: float) -> float:
        """The separation S_p needed at a closing speed, m; 0 if the robot comes no closer."""
        if closing <= _STILL:
            return 0.0
        stop = closing / self.deceleration
        return (
            user_speed * (age + self.reaction + stop)
            + closing * (self.reaction + 0.5 * stop)
            + self.clearance
        )

    def allowed(self, gap: float, user_speed: float, age: float) -> float:
        """The closing speed that a gap allows, m/s: the largest v with `needed(v)` <= gap.

        S_p is quadratic in v: v (T + v_h / a) + v^2 / 2a = gap - C - v_h (age + T), where v_h / a
        is how long the user walks per unit of v while the robot brakes.
        """
        lag = self.reaction + user_speed / self.deceleration
        return self._speed(gap - self.clearance - user_speed * (age + self.reaction), lag)

    def allowed_above(self, floor: float, gap: float) -> float:
        """The closing speed, m/s, that stops at a gap of `floor`, m; v_h and C are 0."""
        return self._speed(gap - floor, self.reaction)

    def _speed(self, room: float, lag: float) -> float:
        """The v with v lag + v^2 / 2a = room, in a form without cancellation for small rooms."""
        if room <= _NOTHING:
            return 0.0
        return 2.0 * room / (lag + math.sqrt(lag * lag + 2.0 * room / self.deceleration))


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """The limits of the chain; m, s, rad.

    `stopping` has the braking deceleration (a measured figure of the robot) and the reaction time.
    `walking` is the speed assumed of a user whose speed is unknown; otherwise the measured speed
    counts, plus `uncertainty` for what it may grow until the next measurement. A user slower than
    `still` who requests a touch may be approached with `touch_speed` down to the gap of the pose
    that serves the request, less its tolerance `touch_slack`, and never below `touch_gap`. Poses of
    the user count fully up to the age `late`, with falling speed up to `old`, and not at all
    beyond; at `lost` the stop latches. Commands count up to `command_age`, from `command_late` on
    with falling speed. A stamp may be `ahead` of the clock by as much as clocks differ, and by more
    where poses are predicted.

    `governor` switches the separation step and nothing else. `watched` says whether a part tracks
    the user; if not, neither the age of their pose nor the separation can be checked. With at most
    `overlap` left to the goal the rover may drive to a touch before the arm is folded (R46).
    """

    footprint: Footprint
    stopping: Stopping
    speed: float
    yaw_rate: float
    walking: float = 1.6
    uncertainty: float = 0.5
    still: float = 0.1
    touch_speed: float = 0.25
    touch_gap: float = 0.03
    touch_slack: float = 0.05
    command_late: float = 0.04
    command_age: float = 0.08
    late: float = LATE_S
    old: float = OLD_S
    lost: float = 0.5
    ahead: float = 0.02
    overlap: float = 0.0
    governor: bool = True
    watched: bool = True

    def __post_init__(self) -> None:
        for name in self.__slots__[2:]:
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"safety: {name} is {getattr(self, name)}; it must be 0 or more")
        if not self.command_late < self.command_age:
            raise ValueError(
                f"safety: command_late {self.command_late:g} s is not below "
                f"command_age, {self.command_age:g} s"
            )
        if not self.late < self.old <= self.lost:
            raise ValueError(
                f"safety: late {self.late:g} s, old {self.old:g} s, lost {self.lost:g} s; "
                "they must rise in this order"
            )

    def command_share(self, age: float) -> float:
        """Share of the speed limit left at this age of a command: 1 up to `command_late`, s."""
        if age <= self.command_late:
            return 1.0
        return max(0.0, (self.command_age - age) / (self.command_age - self.command_late))

    def pose_error(self, sigma: float) -> float:
        """What the base's position uncertainty (one standard deviation, m) adds to S_p, m."""
        return max(0.0, 3.0 * sigma - POSE_ERROR_M)

    @classmethod
    def of(cls, robot: RobotModel, limits: MotionLimits) -> SafetyLimits:
        """A robot's limits within a profile's; C is 0.2 m of reach and 0.15 m of errors."""
        return cls(
            footprint=robot.footprint,
            stopping=Stopping(
                robot.base.brake_deceleration, robot.base.reaction_time, clearance=0.35
            ),
            speed=min(robot.base.max_speed, limits.base_speed),
            yaw_rate=min(robot.base.max_yaw_rate, limits.base_yaw_rate),
        )
