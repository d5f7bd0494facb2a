"""What a robot is: sizes, masses and the limits its maker built in.

Limits that are a matter of choice (accelerations, the speed caps of each behaviour) are no part of
this file; they come from the profile, as `MotionLimits`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hw.calibration import CalibrationError, load_calibration
from hw.description import Description, description_from
from hw.document import FileError, Item, find_file, read_document
from hw.interfaces import DriveMode
from hw.prop import Placement, Prop, PropError, load_prop
from hw.samples import Joints, TimedJoints

FOLDER = Path(__file__).parent / "robots"


_SPEED_SLACK = 1.0 + 1e-6
"""Speeds between two points are differences of rounded numbers."""


class RobotError(FileError):
    """A robot file is wrong or missing."""


@dataclass(frozen=True, slots=True)
class Footprint:
    """The outline with foam: a rectangle centred on base_link, x ahead, m (R3, R4).

    `enclosing_radius` is the paper's own figure, larger than half the diagonal.
    """

    length: float
    width: float
    foam: float
    enclosing_radius: float

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
    """The wheels; m, s, rad.

    The safety chain counts on `brake_deceleration` and on `reaction_time`, from a new pose of the
    user to braking wheels: figures to measure on the robot, not to wish for.
    """

    modes: tuple[DriveMode, ...]
    max_speed: float
    max_yaw_rate: float
    brake_deceleration: float
    command_timeout: float
    wheel_radius: float
    max_wheel_rate: float
    half_wheelbase: float
    half_track: float
    rolling_resistance: float
    reaction_time: float = 0.1


@dataclass(frozen=True, slots=True)
class ArmModel:
    """The arm, one value per joint from the shoulder on; rad, rad/s.

    `parked` comes with what the arm holds. `calibration` is the measured chain of this one robot,
    each joint's frame in the link before it; None: the nominal one, or that of `urdf`.
    """

    mount_height: float
    lower: Joints
    upper: Joints
    max_speed: Joints
    stop_deceleration: float
    parked: Joints
    calibration: tuple[Placement, ...] | None = None
    urdf: Description | None = None

    def check(self, joints: Joints) -> None:
        """Refuse joint angles no arm of this kind can have.

        Raises:
            ValueError: naming the joint and its limits.
        """
        if len(joints) != len(self.lower):
            raise ValueError(f"arm: {len(joints)} joint angles; it has {len(self.lower)} joints")
        for i, (angle, low, high) in enumerate(zip(joints, self.lower, self.upper, strict=True)):
            if not low <= angle <= high:  # NaN fails too
                raise ValueError(f"arm: joint {i} at {angle} rad; {low:.4g} to {high:.4g} is free")

    def check_course(self, points: Sequence[TimedJoints]) -> None:
        """Refuse timed joint angles that no arm of this kind can follow.

        Raises:
            ValueError: naming the point.
        """
        if not points or points[0][0] != 0.0:
            raise ValueError("arm: a course starts with a point at 0 s")
        before, there = 0.0, points[0][1]
        self.check(there)
        for time, joints in points[1:]:
            if not before < time < math.inf:
                raise ValueError(f"arm: a point at {time} s after one at {before} s; times rise")
            self.check(joints)
            for i, (a, b, fastest) in enumerate(zip(there, joints, self.max_speed, strict=True)):
                if abs(b - a) > _SPEED_SLACK * fastest * (time - before):
                    speed = abs(b - a) / (time - before)
                    raise ValueError(
                        f"arm: joint {i} at {speed:.4g} rad/s until {time} s; {fastest:.4g} is most"
                    )
            before, there = time, joints


@dataclass(frozen=True, slots=True)
class RobotModel:
    """A whole robot; kg, m."""

    name: str
    about: str
    mass: float
    payload: float
    footprint: Footprint
    base: BaseModel
    arm: ArmModel
    prop: Prop


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Limits chosen by the profile.

    Base: speed m/s and acceleration m/s2 as lengths of the vector (R50), yaw rate and acceleration
    in rad/s and rad/s2. Arm: rad/s2 and rad/s3 per joint, and m/s of the prop. The lower of these
    and the robot's own ones counts.
    """

    base_acceleration: float = 0.5
    base_yaw_acceleration: float = 1.0
    arm_acceleration: float = 1.0
    base_speed: float = math.inf
    base_yaw_rate: float = math.inf
    tool_speed: float = math.inf
    arm_jerk: float = math.inf

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if not value > 0.0 or (value == math.inf and name.endswith("acceleration")):
                raise ValueError(f"limits: {name} is {value}; it must be above 0 and finite")


def robot_names() -> tuple[str, ...]:
    """The robots that come with the project."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


def load_robot(name_or_path: str | Path, prop: str | Path | None = None) -> RobotModel:
    """A robot by name or by file, with another prop (by name or by file) than its own if asked for.

    Raises:
        RobotError: with file, line, key and what would be right.
    """
    path = find_file(str(name_or_path), FOLDER, "robot", RobotError)
    content = read_document(path, RobotError).section(
        required=("robot", "mass", "payload", "footprint", "base", "arm", "prop"),
        optional=("about",),
    )
    payload = content["payload"].number(low=0.0)
    held = _held(content["prop"], prop, payload)
    return RobotModel(
        name=content["robot"].text(),
        about=content["about"].text() if "about" in content else "",
        mass=_positive(content["mass"]),
        payload=payload,
        footprint=_footprint(content["footprint"]),
        base=_base(content["base"]),
        arm=_arm(content["arm"], content["prop"], held),
        prop=held,
    )


def _held(item: Item, other: str | Path | None, payload: float) -> Prop:
    """What the arm holds, not heavier than it can."""
    try:
        found = load_prop(item.text() if other is None else other)
    except PropError as failure:
        if other is not None:  # the robot's file is not to blame
            raise RobotError(failure.path, failure.line, failure.message) from None
        raise item.fail(str(failure)) from None
    if found.mass > payload:
        raise item.fail(f"{found.name} weighs {found.mass:g} kg; the payload is {payload:g} kg")
    return found


def _positive(item: Item) -> float:
    value = item.number()
    if value <= 0.0:
        raise item.fail(f"{value:g} is out of range, it must be above 0")
    return value


def _footprint(item: Item) -> Footprint:
    part = item.section(required=("length", "width", "foam", "enclosing_radius"))
    found = Footprint(
        length=_positive(part["length"]),
        width=_positive(part["width"]),
        foam=part["foam"].number(low=0.0),
        enclosing_radius=_positive(part["enclosing_radius"]),
    )
    if 2.0 * found.foam >= min(found.length, found.width):
        raise part["foam"].fail("no robot is left inside the foam; it counts on every side")
    if found.enclosing_radius < found.half_diagonal:
        raise part["enclosing_radius"].fail(
            f"is less than half the diagonal of length and width, {found.half_diagonal:.3f}"
        )
    return found


def _base(item: Item) -> BaseModel:
    numbers = BaseModel.__slots__[1:-1]
    part = item.section(required=("modes", *numbers), optional=("reaction_time",))
    modes = tuple(_mode(mode) for mode in part["modes"].items())
    if not modes:
        raise part["modes"].fail("at least one mode is needed: omni, differential")
    found = BaseModel(modes, *(_positive(part[name]) for name in numbers))
    if "reaction_time" not in part:
        return found
    return dataclasses.replace(found, reaction_time=part["reaction_time"].number(low=0.0))


def _mode(item: Item) -> DriveMode:
    return "omni" if item.text(("omni", "differential")) == "omni" else "differential"


def _arm(item: Item, holding: Item, held: Prop) -> ArmModel:
    lists = ("lower", "upper", "max_speed")
    part = item.section(
        required=("mount_height", "stop_deceleration", *lists), optional=("calibration", "urdf")
    )
    height = part["mount_height"].number(low=0.0)
    lower, upper, max_speed = (part[name].numbers(len(held.parked)) for name in lists)
    for low, high, speed in zip(lower, upper, part["max_speed"].items(), strict=True):
        _positive(speed)
        if not low < high:
            raise part["upper"].fail(f"{high:g} is not above the lower limit {low:g}")
    arm = ArmModel(
        mount_height=height,
        lower=lower,
        upper=upper,
        max_speed=max_speed,
        stop_deceleration=_positive(part["stop_deceleration"]),
        parked=held.parked,
        calibration=_calibration(part.get("calibration")),
        urdf=description_from(part["urdf"], height) if "urdf" in part else None,
    )
    try:
        arm.check(held.parked)
    except ValueError as failure:
        raise holding.fail(f"{held.name}, parked: {failure}") from None
    return arm


def _calibration(item: Item | None) -> tuple[Placement, ...] | None:
    if item is None or item.value is None:
        return None
    try:
        return load_calibration(item.text())
    except CalibrationError as failure:
        raise item.fail(str(failure)) from None
