"""The limits of the safety chain, and the braking that it counts on."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hw.model import Footprint, MotionLimits, RobotModel
from hw.samples import LATE_S, OLD_S


@dataclass(frozen=True, slots=True)
class Stopping:
    """The braking of a robot: a in m/s2, T in s, C in m (see `hw.safety.separation`)."""

    deceleration: float
    reaction: float
    clearance: float

    def __post_init__(self) -> None:
        if not 0.0 < self.deceleration < math.inf:
            raise ValueError(f"stopping: a deceleration of {self.deceleration}; it must be above 0")
        for name in ("reaction", "clearance"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"stopping: a {name} of {getattr(self, name)}; it must be finite")


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
