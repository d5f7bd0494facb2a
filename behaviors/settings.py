"""Every number and choice of the four behaviours, by name; the values stand in a profile.

Nothing here has a default: a profile is complete, so that no value hides in the code. The wiring
puts one `Settings` as the signal `settings` at time 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from engine.files.units import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Duration,
    Length,
    Speed,
)
from hw.robot import MotionLimits, RobotModel
from hw.safety_limits import SafetyLimits
from hw.sim.sensors import SensorModel


@dataclass(frozen=True, slots=True)
class RobotSettings:
    """What the robot may do; the lower of these and its own limits counts.

    `arm_jerk`: of each joint, rad/s3, None: any. `arm_parked`: the joints of the folded arm, None:
    those of the robot's prop.
    """

    base_acceleration: Acceleration
    base_yaw_acceleration: AngularAcceleration
    base_speed: Speed
    base_yaw_rate: AngularSpeed
    arm_acceleration: AngularAcceleration
    arm_jerk: float | None
    tool_speed: Speed | None
    arm_parked: tuple[Angle, ...] | None

    @property
    def limits(self) -> MotionLimits:
        """The same for `hw`."""
        return MotionLimits(
            base_acceleration=self.base_acceleration,
            base_yaw_acceleration=self.base_yaw_acceleration,
            arm_acceleration=self.arm_acceleration,
            base_speed=self.base_speed,
            base_yaw_rate=self.base_yaw_rate,
            tool_speed=math.inf if self.tool_speed is None else self.tool_speed,
            arm_jerk=math.inf if self.arm_jerk is None else self.arm_jerk,
        )


@dataclass(frozen=True, slots=True)
class SafetySettings:
    """The chain in front of the wheels.

    `governor` switches the separation step; the rest of the chain is always there. `overlap`: with
    no more than this to go the rover may drive to a touch while the arm is not folded (R46); 0:
    never.
    """

    governor: bool
    overlap: Length

    def limits(self, robot: RobotModel, motion: MotionLimits) -> SafetyLimits:
        """The same for `hw`."""
        own = SafetyLimits.of(robot, motion)
        return replace(own, governor=self.governor, overlap=self.overlap)


@dataclass(frozen=True, slots=True)
class PlantSettings:
    """How far a simulated robot and its surroundings are from ideal ones; real parts ignore it.

    `latency`: from a tick to the instant at which the robot hears what it decided, s.
    `tracking_delay`: age of a pose of the person on arrival, s. `tracking_noise` and `pose_noise`:
    standard deviation of each coordinate of the person's and the base's pose, m, and half as much
    of the yaws, in rad.
    """

    latency: Duration
    tracking_delay: Duration
    tracking_noise: Length
    pose_noise: Length

    def sensors(self, seed: int) -> SensorModel:
        """The same for `hw`."""
        return SensorModel(self.tracking_delay, self.tracking_noise, self.pose_noise, seed)


@dataclass(frozen=True, slots=True)
class UserSettings:
    """How the user's motion is estimated; still: slower than both for so long (R89).

    `likely` and `possible` name predictors (`states.signals.prediction`): Escape counts on every
    likely one, making room on the possible ones too.
    """

    window: Duration
    still_speed: Speed
    still_turn: AngularSpeed
    likely: tuple[str, ...]
    possible: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class EscapeSettings:
    """The trigger (R104), the Escape poses (R105-R108) and when the user is safe (R112).

    `moving`: a user slower than this raises nothing; 0 is the literal rule of the paper.
    `reaction` is added to the time that the robot needs to get out of a predicted way.
    `warning`: so long before a touch that cannot be avoided any more the user is warned.
    Poses: every distance with every angle from the direction away from the user.
    """

    view: Literal["head", "body"]
    ahead: Length
    half_view: Angle
    around: Length
    moving: Speed
    hysteresis: Length
    predict: bool
    contact: Length
    reaction: Duration
    warning: Duration
    distances: tuple[Length, ...]
    angles: tuple[Angle, ...]
    order: Literal["given", "earliest"]
    safe_on_the_way: bool


@dataclass(frozen=True, slots=True)
class ChaseSettings:
    """The Chase space (R93-R101) with its margins against the Escape zones (R103).

    `front` and `rear` are the whole angles that are cut out. `margin` widens the Escape zones by a
    length, `margin_angle` by an angle to either side; cells inside are dropped. `weight` names how
    cells are valued (`angle_radius`: highest at `best_angle` and `best_radius`), `pick` how one is
    chosen: the largest weight, those within `tie` by the shortest way, or by chance from `seed`.
    """

    view: Literal["head", "body"]
    inner: Length
    outer: Length
    cell: Length
    front: Angle
    rear: Angle
    margin: Length | None
    margin_angle: Angle | None
    weight: Literal["angle_radius", "time_to_haptic"]
    best_angle: Angle
    best_radius: Length
    pick: Literal["largest", "sample"]
    tie: float
    seed: int


@dataclass(frozen=True, slots=True)
class HapticSettings:
    """The Haptic rover poses (R75-R77): a half circle in front of the DEEP.

    `order`: as given, or ranked by the time until the prop is there. `deep_ahead` and
    `deep_height` say where Chase expects the next request (R132).
    """

    radius: Length
    angles: tuple[Angle, ...]
    order: Literal["given", "time"]
    deep_ahead: Length
    deep_height: Length


@dataclass(frozen=True, slots=True)
class Settings:
    """All of it."""

    user: UserSettings
    escape: EscapeSettings
    chase: ChaseSettings
    haptic: HapticSettings
