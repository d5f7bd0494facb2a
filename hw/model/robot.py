"""The model of a robot: sizes, masses and the limits of its hardware.

Limits that are a matter of choice (accelerations, the speed caps of each behaviour) are not part of
this file; they come from the profile, as `MotionLimits`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from engine.files import (
    Acceleration,
    AngularAcceleration,
    AngularSpeed,
    Duration,
    Length,
    Mass,
    Momentum,
    Power,
    Ratio,
    Speed,
)
from engine.files.declared import (
    Count,
    Fault,
    Item,
    Name,
    Range,
    Written,
    above_0,
    find_file,
    known_files,
    load_yaml,
    record,
)
from hw.interfaces import DriveMode
from hw.model.arm import ArmShape, arms_of, load_arm
from hw.model.calibration import load_calibration
from hw.model.description import UrdfDescription
from hw.model.prop import Placement, Point3, Prop, SpatialPose, load_prop
from hw.model.sensing import Sensing
from hw.samples import Joints, TimedJoints

FOLDER = Path(__file__).parent.parent / "robots"


_SPEED_SLACK = 1.0 + 1e-6
"""Tolerance of joint speeds, which are differences of rounded numbers."""
_ROUNDED = 1.0 + 1e-3
"""Tolerance of wheel rates, which robot files round."""


@dataclass(frozen=True, slots=True)
class Footprint:
    """The outline with foam: a rectangle centred on base_link, x ahead, m (R3, R4)."""

    length: Annotated[Length, Range(0.3, 3.0)]
    """With foam, along x."""
    width: Annotated[Length, Range(0.3, 3.0)]
    """With foam, along y."""
    foam: Annotated[Length, Range(0.0, 0.5)]
    """How thick the foam is, on every side."""
    enclosing_radius: Annotated[Length, Range(0.1, 5.0)]
    """Of a circle around all of it; the paper's own figure is larger than half the diagonal."""

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        if 2.0 * self.foam >= min(self.length, self.width):
            yield "foam", "no robot is left inside the foam; it counts on every side"
        if self.enclosing_radius < self.half_diagonal:
            yield (
                "enclosing_radius",
                f"is less than half the diagonal of length and width, {self.half_diagonal:.3f} m",
            )

    @property
    def half_length(self) -> float:
        """Reach of the foam ahead and behind, m."""
        return 0.5 * self.length

    @property
    def half_width(self) -> float:
        """Reach of the foam to either side, m."""
        return 0.5 * self.width

    @property
    def half_diagonal(self) -> float:
        """Distance of the corners from base_link, m."""
        return math.hypot(self.half_length, self.half_width)


@dataclass(frozen=True, slots=True)
class BaseModel:
    """The wheels; m, s, rad."""

    modes: Annotated[tuple[DriveMode, ...], Count(1, 2)]
    """How it drives, the usual way first."""
    max_speed: Annotated[Speed, Range(0.05, 10.0)]
    """In any direction."""
    max_yaw_rate: Annotated[AngularSpeed, Range(0.05, 20.0)]
    """On the spot."""
    brake_deceleration: Annotated[Acceleration, Range(0.5, 10.0)]
    """Of a software stop; measure it on the robot, the safety chain relies on it."""
    command_timeout: Annotated[Duration, Range(0.02, 2.0)]
    """Without a new command the wheels stop by themselves after this time."""
    wheel_radius: Annotated[Length, Range(0.01, 0.5)]
    """Of the driven wheels."""
    half_track: Annotated[Length, Range(0.01, 1.5)]
    """From base_link aside to the driven wheels."""
    rolling_resistance: Annotated[Ratio, Range(0.0001, 0.5)]
    """As a share of the weight."""
    half_wheelbase: Annotated[Length, Range(0.01, 1.5)] | None = None
    """From base_link ahead to the axle of Mecanum wheels; only the mode omni needs it."""
    max_wheel_rate: Annotated[AngularSpeed, Range(0.1, 1000.0)] | None = None
    """How fast the wheels turn; only the mode omni needs it. Without it max_speed and max_yaw_rate
    alone are the limits."""
    reaction_time: Annotated[Duration, Range(0.02, 1.0)] = 0.1
    """From a new pose of the user to braking wheels; measure it too."""

    def faults(self) -> Iterator[Fault]:
        """Figures that the mode omni lacks, and speeds beyond the wheels' rates, by key."""
        if self.sideways:
            for key in ("half_wheelbase", "max_wheel_rate"):
                if getattr(self, key) is None:
                    yield "modes", f"omni drives Mecanum wheels; the key '{key}' is missing"
                    return
        rim = self.rim_speed
        if self.max_speed > _ROUNDED * rim:
            yield "max_speed", f"{self.max_speed:g} m/s; the wheels turn to {rim:.4g} m/s at most"
        lever = self.lever
        if self.max_yaw_rate * lever > _ROUNDED * rim:
            fastest = rim / lever
            yield (
                "max_yaw_rate",
                f"{self.max_yaw_rate:g} rad/s; the wheels turn it by {fastest:.4g} rad/s at most",
            )

    @property
    def sideways(self) -> bool:
        """Whether it can drive sideways."""
        return "omni" in self.modes

    @property
    def own_mode(self) -> DriveMode:
        """How it drives if nothing else is asked for: the first of its modes."""
        return self.modes[0]

    @property
    def lever(self) -> float:
        """By how much, m/s, the rims move faster for each rad/s of the base, m.

        Half the track for a differential base; half the wheelbase is added for Mecanum wheels, the
        rims of which move at up to |vx| + |vy| + lever |wz|.
        """
        ahead = self.half_wheelbase if self.sideways else None
        return self.half_track if ahead is None else ahead + self.half_track

    @property
    def rim_speed(self) -> float:
        """The greatest speed of a wheel's rim, m/s; infinite if it is not known."""
        rate = self.max_wheel_rate
        return math.inf if rate is None else rate * self.wheel_radius


@dataclass(frozen=True, slots=True)
class ChassisBox:
    """A part of the rover that the arm must not touch: corners in the rover frame, m."""

    name: str
    """What it is."""
    low: Point3
    """The lowest corner."""
    high: Point3
    """The highest corner."""

    def faults(self) -> Iterator[Fault]:
        """Values that contradict each other, by key."""
        if not all(a < b for a, b in zip(self.low, self.high, strict=True)):
            yield "high", f"{self.high} must be above {self.low} in all three"


@dataclass(frozen=True, slots=True)
class Installation:
    """Limits of the safety installation of the arm's controller, W and kg m/s.

    The defaults are those with which a UR controller is delivered.
    """

    power: Annotated[Power, above_0(10_000.0)] = 300.0
    """The greatest power."""
    momentum: Annotated[Momentum, above_0(1_000.0)] = 25.0
    """The greatest momentum."""


def _calibration(item: Item) -> tuple[Placement, ...]:
    return item.refer(lambda: load_calibration(item.target()))


def _model(item: Item) -> ArmShape:
    return item.refer(lambda: load_arm(item.target()))


@dataclass(frozen=True, slots=True)
class ArmModel:
    """The arm on this robot, as the robot file describes it; rad/s2.

    `calibration` has each joint's frame in the link before it; None: the nominal chain, or that of
    `urdf`.
    """

    model: Annotated[ArmShape, _model, Written(str)]
    """An arm by name or by file: lengths, limits, shape."""
    mount: SpatialPose
    """Where the base of the arm's controller is on the rover, rover_from_base."""
    stop_deceleration: Annotated[AngularAcceleration, Range(0.1, 1000.0)]
    """Of each joint, when it is stopped."""
    calibration: Annotated[tuple[Placement, ...], _calibration, Written(str)] | None = None
    """The measured chain of this one arm, by name or by file; null: the nominal one."""
    urdf: UrdfDescription | None = None
    """A URDF that describes the arm."""
    installation: Installation = field(default_factory=Installation)
    """Limits of the controller's safety installation."""

    def faults(self) -> Iterator[Fault]:
        """The fault of a calibration that is another arm's, by key."""
        if self.model.dh is None:
            for key in ("calibration", "urdf"):
                if getattr(self, key) is not None:
                    yield key, f"is for UR arms; {self.model.name} is described by its own URDF"
            return
        if self.calibration is None:
            return
        off = self.model.dh.misfit(self.calibration)
        if off is not None:
            whose = " or ".join(arms_of(self.calibration)) or "no known arm"
            yield "calibration", f"is that of {whose}, not of {self.model.name}: {off}"

    @property
    def lower(self) -> Joints:
        """Lower limits of the joint angles."""
        return self.model.lower

    @property
    def upper(self) -> Joints:
        """Upper limits of the joint angles."""
        return self.model.upper

    @property
    def max_speed(self) -> Joints:
        """Limits of the joint speeds."""
        return self.model.max_speed

    def check(self, joints: Joints) -> None:
        """Refuse joint angles beyond the limits.

        Raises:
            ValueError: naming the joint and its limits.
        """
        lower, upper = self.model.lower, self.model.upper
        if len(joints) != len(lower):
            raise ValueError(f"arm: {len(joints)} joint angles; it has {len(lower)} joints")
        for i, (angle, low, high) in enumerate(zip(joints, lower, upper, strict=True)):
            if not low <= angle <= high:  # NaN fails too
                raise ValueError(f"arm: joint {i} at {angle} rad; {low:.4g} to {high:.4g} is free")

    def check_course(self, points: Sequence[TimedJoints]) -> None:
        """Refuse a trajectory beyond the limits on joint angles and speeds.

        Raises:
            ValueError: naming the point; also if times do not start at 0 and rise.
        """
        if not points or points[0][0] != 0.0:
            raise ValueError("arm: a course starts with a point at 0 s")
        _, angles = zip(*points, strict=True)
        limits = tuple(zip(self.lower, self.upper, self.max_speed, strict=True))
        if {*map(len, angles)} != {len(limits)}:
            for joints in angles:
                self.check(joints)
        before, there = 0.0, points[0][1]
        self.check(there)
        for time, joints in points[1:]:
            if not before < time < math.inf:
                raise ValueError(f"arm: a point at {time} s after one at {before} s; times rise")
            for i, (a, b, (low, high, fastest)) in enumerate(
                zip(there, joints, limits, strict=True)
            ):
                if not low <= b <= high:  # NaN fails too
                    self.check(joints)
                most = _SPEED_SLACK * fastest * (time - before)
                if not -most <= b - a <= most:
                    speed = abs(b - a) / (time - before)
                    raise ValueError(
                        f"arm: joint {i} at {speed:.4g} rad/s until {time} s; {fastest:.4g} is most"
                    )
            before, there = time, joints


def check_pace(share: float) -> None:
    """Refuse a pace that is none.

    Raises:
        ValueError: it is not between 0 and 1.
    """
    if not 0.0 <= share <= 1.0:
        raise ValueError(f"arm: a pace of {share}; it must be between 0 and 1")


@dataclass(frozen=True, slots=True)
class RobotModel:
    """A whole robot; kg, m. A robot without an arm has no prop either.

    `parked` are the joints of the folded arm, rad, which come with its prop. `chassis` is
    what of the rover the arm must not touch.
    """

    name: str
    about: str
    mass: float
    payload: float
    footprint: Footprint
    base: BaseModel
    arm: ArmModel | None = None
    prop: Prop | None = None
    parked: Joints | None = None
    chassis: tuple[ChassisBox, ...] = ()
    sensing: Sensing = field(default_factory=Sensing)

    def faults(self) -> Iterator[Fault]:
        """Faults of the prop on this arm, by key."""
        held = self.prop
        if held is None or self.arm is None:
            return
        if held.mass > self.payload:
            weighs = f"{held.name} weighs {held.mass:g} kg"
            yield "prop", f"{weighs}; the payload is {self.payload:g} kg"
        if not held.parked:  # such a pose is only looked for
            return
        try:
            self.arm.check(held.parked)
        except ValueError as refused:
            yield "prop", f"{held.name}, parked: {refused}"


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Limits chosen by the profile.

    Base: speed, m/s, and acceleration, m/s2, as the norm of the vector (R50), yaw rate and
    acceleration in rad/s and rad/s2. Arm: rad/s2 and rad/s3 per joint, and m/s of the prop. The
    lower of these and the robot's own limits applies.
    """

    base_acceleration: float = 0.5
    base_yaw_acceleration: float = 1.0
    arm_acceleration: float = 1.0
    base_speed: float = math.inf
    base_yaw_rate: float = math.inf
    tool_speed: float = math.inf
    arm_jerk: float = math.inf
    approach: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for name in self.__slots__[:-1]:
            value = getattr(self, name)
            if not value > 0.0 or (value == math.inf and name.endswith("acceleration")):
                raise ValueError(f"limits: {name} is {value}; it must be above 0 and finite")
        if not all(0.0 < length < math.inf for length in self.approach):
            raise ValueError(f"limits: approach is {self.approach}; lengths above 0 are needed")


def robot_names() -> tuple[str, ...]:
    """Names of the shipped robots and of the project's own."""
    return tuple(known_files(FOLDER, "robot"))


def load_robot(name_or_path: str | Path, prop: str | Path | Prop | None = None) -> RobotModel:
    """A robot by name or by file, with another prop (or its name or file) than its own if given.

    Raises:
        FileError: every mistake in it, with file, line, column and a suggestion.
    """
    path = find_file(str(name_or_path), FOLDER, "robot")
    held = prop if prop is None or isinstance(prop, Prop) else load_prop(prop)
    return load_yaml(path, lambda item: robot_from(item, held))


def _held(item: Item) -> Prop:
    return item.refer(lambda: load_prop(item.target()))


@dataclass(frozen=True, slots=True)
class RobotFile:
    """The body of a robot."""

    robot: Name
    """Its name."""
    mass: Annotated[Mass, Range(1.0, 5000.0)]
    """Of the whole robot."""
    payload: Annotated[Mass, Range(0.0, 500.0)]
    """The greatest mass that the arm holds."""
    footprint: Footprint
    """The outline with foam."""
    base: BaseModel
    """The wheels."""
    arm: ArmModel | None = None
    """The arm, if there is one; it needs a `prop`."""
    prop: Annotated[Prop, _held, Written(str)] | None = None
    """What the arm holds, by name or by file; it says how the arm is folded."""
    chassis: tuple[ChassisBox, ...] = ()
    """What of the rover the arm must not touch."""
    sensing: Sensing = field(default_factory=Sensing)
    """Its sensors."""
    about: str = ""
    """Which robot it is."""

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        if self.arm is not None and self.prop is None:
            yield "arm", "needs a prop, which says how the arm is folded; the key 'prop' is missing"
        if self.arm is None and self.prop is not None:
            yield "prop", "there is no arm to hold it; the key 'arm' is missing"


def robot_from(item: Item, other: Prop | None = None) -> RobotModel:
    """A robot from a mapping as in its file, with another prop than its own if given.

    Raises:
        FileError: every mistake in it, with file, line, column and a suggestion.
    """
    read = record(item, RobotFile)
    arm, held = read.arm, other or read.prop
    if arm is None:
        held = None
    elif held is not None:
        held = held.also(arm.model.name, arm.model.parked)
        item.require(_unparked(held, arm.model.name))
        held = held.on(arm.model.name)
    made = RobotModel(
        name=read.robot,
        about=read.about,
        mass=read.mass,
        payload=read.payload,
        footprint=read.footprint,
        base=read.base,
        arm=arm,
        prop=held,
        parked=None if held is None else held.parked,
        chassis=read.chassis,
        sensing=read.sensing,
    )
    item.require(made.faults())
    return made


def _unparked(held: Prop, arm: str) -> Iterator[Fault]:
    """The fault of a prop that does not say how this arm is folded."""
    if not held.suits(arm):
        yield (
            "prop",
            f"{held.name} does not say how an arm {arm} is folded with it; "
            f"`cobodeck reach --tool {held.name} --park` finds poses for its key 'parked'",
        )
