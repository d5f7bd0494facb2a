"""All parameters of the four behaviours, by name; a profile gives their values.

No value hides in the code: nothing has a default. Ranges are wide: they exclude mistakes (36 rad
for 36 deg, a negative inflation), not unwise values. The wiring provides one `Settings` as the
constant signal `settings`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal, get_args

from behaviors.profile.person_settings import MarginSettings, RoomSettings, WalkSettings
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
from engine.files.declared import Count, Fault, Item, Range, Written, above_0, reader_of
from hw import Joints
from hw.model import ANY, ByArm, MotionLimits, RobotModel, SensorErrors, SensorModel
from hw.safety import SafetyLimits
from states.signals import PREDICTORS

Policy = Literal["tuned", "paper"]
"""Whose decisions: state classes of one policy alone name it as their attribute `policy`."""
POLICIES: tuple[Policy, ...] = get_args(Policy)
"""The first is that of profiles that name none."""
_WIDEST = math.radians(120.0) + 1e-9
Behind = Annotated[Angle, Range(-_WIDEST, _WIDEST)]
"""Angle off the direction away from the user, rad; beyond a right angle the pose leads past
them."""


def _predictor(item: Item) -> str:
    name = str(reader_of(str)(item))
    if name not in PREDICTORS:
        raise item.error(f"no predictor {name!r}", did_you_mean(name, PREDICTORS))
    return name


PredictorName = Annotated[str, _predictor, Written({"enum": list(PREDICTORS)})]


ApproachLength = Annotated[Length, Range(0.02, 0.3)]


@dataclass(frozen=True, slots=True)
class RobotSettings:
    """Limits of the robot; the lower of these and the robot's own applies."""

    base_acceleration: Annotated[Acceleration, above_0(10.0)]
    """Of the base, as the norm of the vector."""
    base_yaw_acceleration: Annotated[AngularAcceleration, above_0(20.0)]
    """Of the base."""
    base_speed: Annotated[Speed, above_0(5.0)]
    """Of the base, as the norm of the vector."""
    base_yaw_rate: Annotated[AngularSpeed, above_0(10.0)]
    """Of the base."""
    arm_acceleration: Annotated[AngularAcceleration, above_0(50.0)]
    """Of each joint."""
    arm_jerk: Annotated[AngularJerk, above_0(10_000.0)] | None
    """Of each joint; null: no limit."""
    tool_speed: Annotated[Speed, above_0(10.0)] | None
    """Of the prop and of every other point of the arm; null: no limit."""
    arm_parked: ByArm | None
    """Joint angles of the folded arm, by the arm's name, or for any arm; for others, and with null:
    those of the robot's prop."""
    arm_approach: Annotated[tuple[ApproachLength, ...], Count(1, 9)] | None
    """Lengths of the line on which the prop comes to a DEEP, tried in this order; null: it comes
    straight from anywhere."""
    arm_parking: Annotated[Duration, above_0(600.0)]
    """Charts give up parking the arm after this long."""

    def parked(self, arm: str) -> Joints | None:
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
    """The safety chain in front of the wheels."""

    governor: bool
    """Whether the separation step is on; the rest of the chain always is."""
    overlap: Annotated[Length, Range(0.0, 0.5)]
    """Within this distance of a touch's pose the rover may drive with the arm unfolded (R46); 0:
    never."""

    def limits(self, robot: RobotModel, motion: MotionLimits) -> SafetyLimits:
        """The limits of the safety chain for this robot, with these settings."""
        own = SafetyLimits.of(robot, motion)
        return replace(own, governor=self.governor, overlap=self.overlap)


@dataclass(frozen=True, slots=True)
class PlantSettings:
    """Imperfections of the simulated robot and its surroundings; real parts ignore them."""

    latency: Annotated[Duration, Range(0.0, 1.0)]
    """From a tick until the robot receives its commands."""
    tracking_delay: Annotated[Duration, Range(0.0, 1.0)]
    """Age of the person's pose on arrival."""
    tracking_noise: Annotated[Length, Range(0.0, 0.5)]
    """Standard deviation of each coordinate of the person's pose; half that number, in rad, that of
    the yaw."""
    pose_noise: Annotated[Length, Range(0.0, 0.2)]
    """The same of the base's pose."""
    sensing: SensorErrors = field(default_factory=SensorErrors)
    """Errors of the sensors that replace the base's pose in the full simulation."""

    def sensors(self, seed: int) -> SensorModel:
        """The delay and noise as `hw` takes them; `seed` is that of the noise."""
        return SensorModel(self.tracking_delay, self.tracking_noise, self.pose_noise, seed)


@dataclass(frozen=True, slots=True)
class UserSettings:
    """Estimation and prediction of the user's motion; see `states.signals.prediction`."""

    window: Annotated[Duration, above_0(5.0)]
    """Time over which the velocity is estimated."""
    still_speed: Annotated[Speed, above_0(2.0)]
    """A user slower than this, and turning slower than `still_turn`, is still (R89)."""
    still_turn: Annotated[AngularSpeed, above_0(10.0)]
    """See `still_speed`."""
    likely: Annotated[tuple[PredictorName, ...], Count(1)]
    """Predictors that Escape uses."""
    possible: tuple[PredictorName, ...]
    """Predictors that making room uses too."""
    walks: WalkSettings
    """Where somebody may walk who stands, turns or bends."""
    margins: MarginSettings
    """How much time to get out of the way is enough."""
    beside: RoomSettings
    """Choice of a place beside a user who walks."""


@dataclass(frozen=True, slots=True)
class EscapeSettings:
    """The trigger (R104), the Escape poses (R105-R108) and when the user is safe (R112)."""

    ahead: Annotated[Length, above_0(10.0)]
    """Radius of the zone that the user sees."""
    half_view: Annotated[Angle, Range(0.0, math.pi)]
    """How far the user sees to either side."""
    around: Annotated[Length, above_0(10.0)]
    """Radius of the zone all round the user."""
    moving: Annotated[Speed, Range(0.0, 5.0)]
    """A slower user triggers nothing; 0 is the literal rule of the paper."""
    hysteresis: Annotated[Length, Range(0.0, 5.0)]
    """How much farther the user has to be for the zones to be left."""
    contact: Annotated[Length, above_0(5.0)]
    """A predicted distance below this is a contact."""
    reaction: Annotated[Duration, Range(0.0, 10.0)]
    """Added to the time that the robot needs to move aside."""
    warning: Annotated[Duration, Range(0.0, 10.0)]
    """The user is warned of an unavoidable touch once it is less than this ahead."""
    distances: Annotated[tuple[Annotated[Length, above_0(10.0)], ...], Count(1)]
    """Of the poses from the user; each with each of `angles`."""
    angles: Annotated[tuple[Behind, ...], Count(1)]
    """Of the poses, off the direction away from the user."""
    earlier_by: Annotated[Duration, Range(0.0, 10.0)]
    """Another pose is taken on the way if the user is safe earlier by this."""
    wider_by: Annotated[Length, Range(0.0, 5.0)]
    """… or, where every drive ends in a contact, if its gap is wider by this."""


@dataclass(frozen=True, slots=True)
class LeaveSettings:
    """How Chase leaves a place where it cannot wait, in the user's sight or to a refuge."""

    speed: Annotated[Speed, above_0(5.0)]
    """Of a robot that leaves the zones of a user who stands."""
    circles: Annotated[tuple[Annotated[Length, above_0(20.0)], ...], Count(1)]
    """Around the user, on which places to go to lie …"""
    directions: Annotated[int, Range(1, 360)]
    """… so many on each."""
    farthest: Annotated[Length, above_0(100.0)]
    """The longest path to one of them."""
    worth: Annotated[Duration, Range(0.0, 60.0)]
    """By how much a place has to be better for a robot that is outside the zones already."""
    look_again: Annotated[Duration, above_0(60.0)]
    """After so long a robot looks again for a way out, or for a better place."""
    near: Annotated[Length, above_0(10.0)]
    """A user who stands nearer than this to a robot without a way out could not be warned in time,
    should they set off towards it at 1 m/s …"""
    near_for: Annotated[Duration, above_0(600.0)]
    """… so that they are shown it after so long."""
    moved: Annotated[Length, Range(0.0, 5.0)]
    """A user to whom it was shown has gone elsewhere once they are this far from there …"""
    walking: Annotated[Speed, above_0(5.0)]
    """… or walk faster than this."""


@dataclass(frozen=True, slots=True)
class ChaseSettings:
    """The Chase space (R93-R101) with its margins against the Escape zones (R103)."""

    inner: Annotated[Length, above_0(10.0)]
    """Inner radius of the space."""
    outer: Annotated[Length, above_0(10.0)]
    """Outer radius of the space."""
    cell: Annotated[Length, Range(0.01, 1.0)]
    """Size of its cells."""
    front: Annotated[Angle, Range(0.0, 2.0 * math.pi)]
    """Full angle of the sector cut out ahead of the user."""
    rear: Annotated[Angle, Range(0.0, 2.0 * math.pi)]
    """Full angle of the sector cut out behind the user."""
    margin: Annotated[Length, Range(0.0, 5.0)]
    """Escape zones are widened by this for the choice of our policy."""
    margin_angle: Annotated[Angle, Range(0.0, math.pi)]
    """Escape zones are widened by this to either side, likewise."""
    best_angle: Annotated[Angle, Range(0.0, math.pi)]
    """Off the user's view, where the weight of the paper's cells is highest."""
    best_radius: Annotated[Length, above_0(10.0)]
    """Where the weight of the paper's cells is highest; nearer to the user ours cost more."""
    cells: Annotated[int, Range(1, 100_000)]
    """Of about so many the risk is computed: the work of a choice."""
    tie: Annotated[float, Range(0.0, 1.0)]
    """Places of which one over the cost, 1/s, differs by less are equal: the shortest path
    decides."""
    tries: Annotated[int, Range(1, 1000)]
    """Of places without a way there so many are tried, best first: the most work of a choice."""
    risk: Annotated[float, Range(0.0, 1000.0)]
    """A second that waiting there is expected to cost (`behaviors.person.waiting`) counts as so
    many of response."""
    leave: LeaveSettings
    """How a place is left where the robot cannot wait."""
    room: Annotated[Length, above_0(10.0)]
    """The chart keeps this far from a walking user."""
    band: Annotated[Length, above_0(10.0)]
    """… but no farther than this."""
    near: Annotated[Length, above_0(10.0)]
    """A user who is followed has been caught up with at this distance."""
    ahead: Annotated[Duration, Range(0.0, 10.0)]
    """The user is followed by where they will be after so long."""
    cornered: Annotated[Duration, above_0(600.0)]
    """Chase ends when the robot has been in a zone without a way out for so long."""

    def faults(self) -> Iterator[Fault]:
        """Invalid combinations of values, each with its key."""
        if self.inner >= self.outer:
            yield "inner", f"{self.inner:g} is not below outer, {self.outer:g}"
        if self.front + self.rear >= 2.0 * math.pi:
            yield "rear", "front and rear cut out the whole turn; nothing is left of the space"


@dataclass(frozen=True, slots=True)
class CloseSettings:
    """The poses of Haptic's second choice: circles all round the DEEP."""

    inner: Annotated[Length, above_0(3.0)]
    """Radius of the innermost circle."""
    outer: Annotated[Length, above_0(3.0)]
    """Radius of the outermost circle."""
    step: Annotated[Length, Range(0.01, 1.0)]
    """From circle to circle."""
    turn: Annotated[Angle, Range(0.01, math.pi)]
    """From place to place on a circle."""
    at_once: Annotated[int, Range(1, 1000)]
    """In one tick the arm is asked about so many, those with the shortest drives first."""

    def faults(self) -> Iterator[Fault]:
        """Invalid combinations of values, each with its key."""
        if self.inner > self.outer:
            yield "inner", f"{self.inner:g} is above outer, {self.outer:g}"


@dataclass(frozen=True, slots=True)
class HapticSettings:
    """The Haptic rover poses (R75-R77): a half circle in front of the DEEP."""

    radius: Annotated[Length, above_0(3.0)]
    """Of the half circle."""
    angles: Annotated[tuple[Annotated[Angle, Range(-math.pi, math.pi)], ...], Count(1)]
    """Of the poses on it."""
    close: CloseSettings
    """The poses to choose among if none of these will do, with no more distance from walls and user
    than Escape keeps."""
    deep_ahead: Annotated[Length, Range(0.0, 3.0)]
    """Where Chase expects the next DEEP, ahead of the user (R132)."""
    deep_height: Annotated[Length, above_0(3.0)]
    """The same, above the floor."""


@dataclass(frozen=True, slots=True)
class InformSettings:
    """How long the robot is shown to the user."""

    least: Annotated[Duration, Range(0.0, 600.0)]
    """So long at least."""
    cornered: Annotated[Duration, Range(0.0, 600.0)]
    """So long at least if it could not drive off when that began."""
    sign: Annotated[Duration, Range(0.0, 600.0)]
    """The stop sign stays for so long at least, whatever hides it before."""
    until_clear: bool
    """And until both zones are clear, or there is a way out of them."""
    moment: Annotated[Duration, Range(0.0, 600.0)]
    """It ends at once if the user, lost when it began, is tracked again within so long."""


@dataclass(frozen=True, slots=True)
class Settings:
    """All parameters of the behaviours."""

    user: UserSettings
    escape: EscapeSettings
    chase: ChaseSettings
    haptic: HapticSettings
    inform: InformSettings
    policy: Policy
    """Whose decisions they are for; pictures draw these."""
