"""All parameters of the four behaviours, by name; a profile gives their values.

Nothing here has a default, so that no value hides in the code. Ranges are wide: they exclude
mistakes (36 rad for 36 deg, a negative inflation), not unwise values. The wiring provides one
`Settings` as the constant signal `settings`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

from engine.files import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularJerk,
    AngularSpeed,
    Duration,
    Length,
    Speed,
    did_you_mean,
)
from engine.files.declared import Count, Fault, Item, Range, above_0, reader_of
from hw.model import ANY, MotionLimits, RobotModel, SensorErrors, SensorModel, Six, by_arm
from hw.safety import SafetyLimits
from states.signals import PREDICTORS

_WIDEST = math.radians(120.0) + 1e-9
Behind = Annotated[Angle, Range(-_WIDEST, _WIDEST)]
"""Angle off the direction away from the user, rad; beyond a right angle the pose leads past
them."""


def _predictor(item: Item) -> str:
    name = str(reader_of(str)(item))
    if name not in PREDICTORS:
        raise item.error(f"no predictor {name!r}", did_you_mean(name, PREDICTORS))
    return name


PredictorName = Annotated[str, _predictor]


ApproachLength = Annotated[Length, Range(0.02, 0.3)]
APPROACH = (0.12, 0.08, 0.05)
"""Lengths of the line to a DEEP, m, where a profile does not give any."""


@dataclass(frozen=True, slots=True)
class RobotSettings:
    """Limits of the robot; the lower of these and the robot's own applies.

    `arm_jerk`: of each joint, rad/s3; None: no limit. `tool_speed`: of the prop and of every other
    point of the arm, m/s; None: no limit. `arm_parked`: joint angles of the folded arm, rad, by the
    arm's name, or for any arm; for others, and with None: those of the robot's prop.
    `arm_approach`: lengths of the line on which the prop comes to a DEEP, tried in this order;
    None: it comes straight from anywhere.
    """

    base_acceleration: Annotated[Acceleration, above_0(10.0)]
    base_yaw_acceleration: Annotated[AngularAcceleration, above_0(20.0)]
    base_speed: Annotated[Speed, above_0(5.0)]
    base_yaw_rate: Annotated[AngularSpeed, above_0(10.0)]
    arm_acceleration: Annotated[AngularAcceleration, above_0(50.0)]
    arm_jerk: Annotated[AngularJerk, above_0(10_000.0)] | None
    tool_speed: Annotated[Speed, above_0(10.0)] | None
    arm_parked: Annotated[Mapping[str, Six], by_arm] | None
    arm_approach: Annotated[tuple[ApproachLength, ...], Count(1, 9)] | None = APPROACH

    def parked(self, arm: str) -> Six | None:
        """Joint angles in which this arm is folded; None: those of the robot's prop."""
        poses = self.arm_parked or {}
        return poses.get(arm) or poses.get(ANY)

    @property
    def limits(self) -> MotionLimits:
        """These limits as `hw` takes them."""
        return MotionLimits(
            base_acceleration=self.base_acceleration,
            base_yaw_acceleration=self.base_yaw_acceleration,
            arm_acceleration=self.arm_acceleration,
            base_speed=self.base_speed,
            base_yaw_rate=self.base_yaw_rate,
            tool_speed=math.inf if self.tool_speed is None else self.tool_speed,
            arm_jerk=math.inf if self.arm_jerk is None else self.arm_jerk,
            approach=self.arm_approach or (),
        )


@dataclass(frozen=True, slots=True)
class SafetySettings:
    """The safety chain in front of the wheels.

    `governor` enables the separation step; the rest of the chain is always on. `overlap`: within
    this distance of a touch's pose, m, the rover may drive with the arm unfolded (R46); 0: never.
    """

    governor: bool
    overlap: Annotated[Length, Range(0.0, 0.5)]

    def limits(self, robot: RobotModel, motion: MotionLimits) -> SafetyLimits:
        """The limits of the safety chain for this robot, with these settings."""
        own = SafetyLimits.of(robot, motion)
        return replace(own, governor=self.governor, overlap=self.overlap)


@dataclass(frozen=True, slots=True)
class PlantSettings:
    """Imperfections of the simulated robot and its surroundings; real parts ignore them.

    `latency`: time from a tick until the robot receives its commands, s. `tracking_delay`: age of
    the person's pose on arrival, s. `tracking_noise`, `pose_noise`: standard deviation of each
    coordinate of the person's and the base's pose, m; half that number is the standard deviation of
    the yaws, rad. `sensing`: errors of the sensors that replace the base's pose in the full
    simulation.
    """

    latency: Annotated[Duration, Range(0.0, 1.0)]
    tracking_delay: Annotated[Duration, Range(0.0, 1.0)]
    tracking_noise: Annotated[Length, Range(0.0, 0.2)]
    pose_noise: Annotated[Length, Range(0.0, 0.2)]
    sensing: SensorErrors = field(default_factory=SensorErrors)

    def sensors(self, seed: int) -> SensorModel:
        """The delay and noise as `hw` takes them; `seed` is that of the noise."""
        return SensorModel(self.tracking_delay, self.tracking_noise, self.pose_noise, seed)


@dataclass(frozen=True, slots=True)
class UserSettings:
    """Estimation and prediction of the user's motion.

    `window`: time over which the velocity is estimated, s. A user slower than `still_speed`, m/s,
    and `still_turn`, rad/s, counts as still (R89). `likely` and `possible` name predictors
    (`states.signals.prediction`): Escape uses the likely ones, making room the possible ones too.
    """

    window: Annotated[Duration, above_0(5.0)]
    still_speed: Annotated[Speed, above_0(2.0)]
    still_turn: Annotated[AngularSpeed, above_0(10.0)]
    likely: Annotated[tuple[PredictorName, ...], Count(1)]
    possible: tuple[PredictorName, ...]


@dataclass(frozen=True, slots=True)
class EscapeSettings:
    """The trigger (R104), the Escape poses (R105-R108) and when the user is safe (R112).

    `trigger`: a user who moves within a zone, or only a predicted contact.
    `moving`: a user slower than this, m/s, triggers nothing; 0 is the literal rule of the paper.
    `reaction`, s, is added to the time that the robot needs to move aside. `warning`: the user is
    warned of an unavoidable touch once it is less than this ahead, s. Poses: each of `distances`
    with each of `angles`, off the direction away from the user.
    """

    view: Literal["head", "body"]
    trigger: Literal["zones", "contact"]
    ahead: Annotated[Length, above_0(10.0)]
    half_view: Annotated[Angle, Range(0.0, math.pi)]
    around: Annotated[Length, above_0(10.0)]
    moving: Annotated[Speed, Range(0.0, 5.0)]
    hysteresis: Annotated[Length, Range(0.0, 5.0)]
    predict: bool
    contact: Annotated[Length, above_0(5.0)]
    reaction: Annotated[Duration, Range(0.0, 10.0)]
    warning: Annotated[Duration, Range(0.0, 10.0)]
    distances: Annotated[tuple[Annotated[Length, above_0(10.0)], ...], Count(1)]
    angles: Annotated[tuple[Behind, ...], Count(1)]
    order: Literal["given", "earliest"]
    safe_on_the_way: bool

    def faults(self) -> Iterator[Fault]:
        """Invalid combinations of values, each with its key."""
        if self.trigger == "contact" and not self.predict:
            yield "trigger", "contact needs predict: true; without it nothing would trigger"


@dataclass(frozen=True, slots=True)
class ChaseSettings:
    """The Chase space (R93-R101) with its margins against the Escape zones (R103).

    `front` and `rear` are the full angles of the sectors cut out. Cells in an Escape zone that is
    widened by the length `margin`, and by `margin_angle` to either side, are dropped. `weight`
    names the weighting (`angle_radius`: highest at `best_angle` and `best_radius`), `pick` the
    choice: the largest weight (those within `tie` by the shortest path), or at random from `seed`.
    `risk`: a second that waiting there is expected to cost (`behaviors.prediction.waiting`) counts
    as so many seconds of response; 0: places are weighed by the response alone.
    `stays`: without a free place the robot stays where it is; else Chase fails.
    """

    view: Literal["head", "body"]
    inner: Annotated[Length, above_0(10.0)]
    outer: Annotated[Length, above_0(10.0)]
    cell: Annotated[Length, Range(0.01, 1.0)]
    front: Annotated[Angle, Range(0.0, 2.0 * math.pi)]
    rear: Annotated[Angle, Range(0.0, 2.0 * math.pi)]
    margin: Annotated[Length, Range(0.0, 5.0)] | None
    margin_angle: Annotated[Angle, Range(0.0, math.pi)] | None
    weight: Literal["angle_radius", "time_to_haptic"]
    best_angle: Annotated[Angle, Range(0.0, math.pi)]
    best_radius: Annotated[Length, above_0(10.0)]
    pick: Literal["largest", "sample"]
    tie: Annotated[float, Range(0.0, 1.0)]
    seed: Annotated[int, Range(0, 2**63)]
    risk: Annotated[float, Range(0.0, 1000.0)]
    stays: bool

    def faults(self) -> Iterator[Fault]:
        """Invalid combinations of values, each with its key."""
        if self.inner >= self.outer:
            yield "inner", f"{self.inner:g} is not below outer, {self.outer:g}"
        if self.front + self.rear >= 2.0 * math.pi:
            yield "rear", "front and rear cut out the whole turn; nothing is left of the space"
        if (self.margin is None) != (self.margin_angle is None):
            yield "margin", "margin and margin_angle go together; give both, or null for both"


@dataclass(frozen=True, slots=True)
class CloseSettings:
    """The poses of Haptic's second choice: circles of these radii, m, all round the DEEP.

    Radii lie `step`, m, apart, and the places on a circle `turn`, rad.
    """

    inner: Annotated[Length, above_0(3.0)]
    outer: Annotated[Length, above_0(3.0)]
    step: Annotated[Length, Range(0.01, 1.0)]
    turn: Annotated[Angle, Range(0.01, math.pi)]

    def faults(self) -> Iterator[Fault]:
        """Invalid combinations of values, each with its key."""
        if self.inner > self.outer:
            yield "inner", f"{self.inner:g} is above outer, {self.outer:g}"


@dataclass(frozen=True, slots=True)
class HapticSettings:
    """The Haptic rover poses (R75-R77): a half circle in front of the DEEP.

    `order`: as given, or by the time until the prop is at the DEEP. `close`: the poses to choose
    among if none of these will do, with no more distance from walls and user than Escape keeps;
    None: there is no second choice. `deep_ahead` and `deep_height`: where Chase expects the next
    DEEP, m ahead of the user and above the floor (R132).
    """

    radius: Annotated[Length, above_0(3.0)]
    angles: Annotated[tuple[Annotated[Angle, Range(-math.pi, math.pi)], ...], Count(1)]
    order: Literal["given", "time"]
    close: CloseSettings | None
    deep_ahead: Annotated[Length, Range(0.0, 3.0)]
    deep_height: Annotated[Length, above_0(3.0)]


@dataclass(frozen=True, slots=True)
class Settings:
    """All parameters of the behaviours."""

    user: UserSettings
    escape: EscapeSettings
    chase: ChaseSettings
    haptic: HapticSettings
