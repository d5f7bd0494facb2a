"""What the safety chain goes by: what it takes to stop before the user, and all its other figures.

The separation is that of ISO/TS 15066 5.5.4 with a constant deceleration, as figures only: nothing
here makes a robot fit for people. While the robot reacts for T and then brakes from its closing
speed v with a, the user comes v_h nearer each second and was last seen some age ago:

    S_p = v_h (age + T + v / a) + v T + v^2 / 2a + C

C covers reach and both positions' errors; a pose of the base that is less sure than C takes it for
adds what is more (`SafetyLimits.pose_error`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hw.robot import Footprint, MotionLimits, RobotModel

LATE_S, OLD_S = 0.05, 0.15
"""Poses are used as they are up to the first age, s, with care up to the second (R149)."""
POSE_ERROR_M = 0.075
"""Three standard deviations of the base's position that C covers: half of both positions' share."""
_NOTHING = 1e-12
"""Less room than this, m, is none."""
_STILL = 1e-6
"""A robot that closes the gap slower than this, m/s, by rounding, does not close it."""


@dataclass(frozen=True, slots=True)
class Stopping:
    """What it takes to stop before the user: a in m/s2, T in s, C in m (see the module)."""

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
        """The separation S_p that a closing speed needs, m; 0 for a robot that comes no nearer."""
        if closing <= _STILL:
            return 0.0
        stop = closing / self.deceleration
        return (
            user_speed * (age + self.reaction + stop)
            + closing * (self.reaction + 0.5 * stop)
            + self.clearance
        )

    def allowed(self, gap: float, user_speed: float, age: float) -> float:
        """The closing speed that this gap allows, m/s: the largest v with `needed(v)` <= gap."""
        lag = self.reaction + user_speed / self.deceleration
        return self._speed(gap - self.clearance - user_speed * (age + self.reaction), lag)

    def allowed_above(self, floor: float, gap: float) -> float:
        """The closing speed that stops at a gap of `floor`, m, before a user who stands, m/s."""
        return self._speed(gap - floor, self.reaction)

    def _speed(self, room: float, lag: float) -> float:
        """The speed v with v lag + v^2 / 2a = room."""
        if room <= _NOTHING:
            return 0.0
        return 2.0 * room / (lag + math.sqrt(lag * lag + 2.0 * room / self.deceleration))


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """What the chain goes by; m, s, rad.

    `stopping` holds the braking deceleration (a measured figure of the robot) and the reaction
    time. `walking` is the speed of a user of whom nothing is known; else the measured one counts,
    and `uncertainty` for how it may grow until the next measurement. A user slower than `still` who
    has asked for a touch may be approached with `touch_speed` down to the gap of the pose they are
    served from, less its tolerance `touch_slack`, and never below `touch_gap`. Poses of the user
    are used up to the age `late`, with less and less speed up to `old`, and not at all then; at
    `lost` the stop latches. Commands count up to `command_age`, from `command_late` on with ever
    less speed. A stamp may be `ahead` of the clock by as much as clocks differ, and more where
    poses are predicted.

    `governor` switches the separation step, and nothing else. `watched`: somebody tracks the user
    of this body; if nobody does, ages of their pose and separation cannot be looked at. With no
    more than `overlap` to go the rover may drive to a touch while the arm is not folded (R46).
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
                raise ValueError(f"safety: {name} is {getattr(self, name)}; a number from 0 on")
        if not self.command_late < self.command_age:
            raise ValueError(
                f"safety: command_late {self.command_late:g} s is not below "
                f"command_age, {self.command_age:g} s"
            )
        if not self.late < self.old <= self.lost:
            raise ValueError(
                f"safety: late {self.late:g} s, old {self.old:g} s, lost {self.lost:g} s; "
                "they must come in this order"
            )

    def command_share(self, age: float) -> float:
        """How much of the speed limit a command of this age has: all up to `command_late`."""
        if age <= self.command_late:
            return 1.0
        return max(0.0, (self.command_age - age) / (self.command_age - self.command_late))

    def pose_error(self, sigma: float) -> float:
        """What a pose of the base with this standard deviation adds to the separation, m."""
        return max(0.0, 3.0 * sigma - POSE_ERROR_M)

    @classmethod
    def of(cls, robot: RobotModel, limits: MotionLimits) -> SafetyLimits:
        """A robot's limits with a profile's caps; 0.2 m for reach, 0.15 m for both positions."""
        return cls(
            footprint=robot.footprint,
            stopping=Stopping(
                robot.base.brake_deceleration, robot.base.reaction_time, clearance=0.35
            ),
            speed=min(robot.base.max_speed, limits.base_speed),
            yaw_rate=min(robot.base.max_yaw_rate, limits.base_yaw_rate),
        )
