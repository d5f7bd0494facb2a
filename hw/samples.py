"""What parts measure: a sample is a name, a stamp and a value.

| name | value | comes |
|---|---|---|
| `user.pose` | `UserPose` | when tracking has it |
| `base.pose` | `Pose2`, map_from_base | every step (ideal in the reduced simulation) |
| `base.twist` | `Twist2`, base frame | every step |
| `base.mode` | how the wheels are driven: `omni` or `differential` | on change |
| `base.refusal` | why a base that is to drive does not, as text, or None | on change |
| `base.admitted` | `Twist2`: what the chain leaves of a velocity it cuts, or None | on change |
| `arm.joints` | `ArmState` | every step |
| `vr.haptic_request` | `Pose3` while requested (the DEEP in the map), or None | on change |
| `vr.release` | `True` | an event: the user lets go of a request |
| `vr.restart` | `True` | an event: the user, shown the robot, stood still and is ready |
| `vr.clock` | `ClockState`: the VR application's clock against ours | ten times a second |
| `vr.fault` | what is wrong with the VR link, as text, or None | on change |
| `bumper.hit` | `BumperHit` | an event: the foam was touched |
| `stop.engaged` | the reason as text while the stop line is pulled, or None | on change |
| `operator.acknowledge` | `True` | an event: the operator cleared a fault |
| `base.scan` | `Scan` | per turn of a scanner, stamped at its first beam |
| `base.odometry` | `Odometry` | at the wheels' rate |
| `rover.tracker` | `TrackerPose` | each tracker on the rover by itself, while it is tracked |
| `base.imu` | `ImuReading` | at the sensor's rate |
| `gripper.state`, `wrench.reading` | `GripperState`, `WrenchReading` | at the sensor's rate |

What comes on change also comes once at the start.
"""

from __future__ import annotations

import cmath
import dataclasses
import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from types import MemberDescriptorType
from typing import Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

from hw.geometry import Pose2, Pose3, Twist2

Joints = tuple[float, ...]
TimedJoints = tuple[float, Joints]
"""Where the joints are to be at a time, s from the start of the move."""
SampleCheck = Callable[[Any, int], bool]
"""Is a value finite, looked into so many levels deep?"""
DEEPEST = 16
"""Samples are not nested deeper, and hold no cycles."""


class Sample(NamedTuple):
    """One measured value; stamp_ns counts from the start of the run."""

    name: str
    stamp_ns: int
    value: object


@dataclass(frozen=True, slots=True)
class UserPose:
    """Where a person is, in the map.

    `body` is the tailbone (R13: leaning or crouching hardly moves it), `head_yaw` the direction of
    view in rad. Head and hands (R7, R14) are None where the source knows nothing of them.
    """

    body: Pose2
    head_yaw: float
    head: Pose3 | None = None
    left_hand: Pose3 | None = None
    right_hand: Pose3 | None = None


ArmMode = Literal[
    "normal", "reduced", "recovery", "protective_stop", "safeguard_stop", "emergency_stop", "fault",
    "unknown",
]  # fmt: skip
"""What the arm's own safety system says; it moves in the first three only."""
ARM_MOVES: frozenset[ArmMode] = frozenset(("normal", "reduced", "recovery"))


@dataclass(frozen=True, slots=True)
class ArmState:
    """Joint angles in rad and joint velocities in rad/s, shoulder first; is a move under way?

    `course` is the number of the newest course that was taken or refused (`Arm.follow`), and
    `refused` why it was refused, or why it was broken off; None: it was not. `scaling` is the share
    of its commanded speed at which the arm runs.
    """

    joints: Joints
    velocities: Joints
    moving: bool = False
    course: int = 0
    refused: str | None = None
    mode: ArmMode = "normal"
    scaling: float = 1.0


@dataclass(frozen=True, slots=True)
class BumperHit:
    """A touch of the foam; bearing in the base frame, rad, 0 is ahead."""

    bearing: float


@dataclass(frozen=True, slots=True)
class GripperState:
    """Opening between the fingers in m; is something held?"""

    opening: float
    holding: bool = False


@dataclass(frozen=True, slots=True)
class WrenchReading:
    """Force in N and torque in Nm at the tool flange, in the flange frame."""

    force: tuple[float, float, float]
    torque: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Scan:
    """One turn of a lidar: ranges in m, inf for no return; beam i is at start + i * step, rad.

    Angles are in the frame of the sensor. Beam i was taken i * `beam_time` s after the stamp.
    """

    sensor: str
    start: float
    step: float
    ranges: tuple[float, ...]
    beam_time: float = 0.0


@dataclass(frozen=True, slots=True)
class Odometry:
    """What the wheels say: odom_from_base, which drifts without bound, and the base's velocity.

    The frame `odom` is where the base was when its driver began to count; `twist` is in the base
    frame. `sigma` are the standard deviations of its vx, vy (m/s) and wz (rad/s), of drivers that
    know them.
    """

    pose: Pose2
    twist: Twist2
    sigma: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class TrackerPose:
    """Where a tracker of the VR system is, by its name: vive_from_tracker."""

    tracker: str
    pose: Pose3


@dataclass(frozen=True, slots=True)
class RobotView:
    """What the virtual world is shown of the robot.

    `pose` is map_from_base, `twist` the velocity in the base frame, `joints` the arm's angles, rad;
    each None where nobody knows. `visible`: the robot is drawn; `stop_sign`: with the sign (R18).
    """

    pose: Pose2 | None = None
    twist: Twist2 | None = None
    joints: Joints | None = None
    visible: bool = False
    stop_sign: bool = False


@dataclass(frozen=True, slots=True)
class ClockState:
    """The clock of another machine, s: ours less theirs, by how much that may be wrong.

    `age` is that of the newest data when it came; `round_trips`: the offset comes of answers.
    """

    offset: float
    error: float
    age: float
    round_trips: bool


@dataclass(frozen=True, slots=True)
class PoseSigma:
    """How sure a pose in the plane is: standard deviations, m along its worst axis, and rad."""

    position: float
    yaw: float


EXACT = PoseSigma(0.0, 0.0)
"""A pose that is no estimate."""


@dataclass(frozen=True, slots=True)
class ImuReading:
    """Rates of turn in rad/s and accelerations in m/s2, in the base frame.

    `attitude` is the quaternion (qx, qy, qz, qw) of world_from_base, the world's z upwards, of
    sensors that tell it.
    """

    rates: tuple[float, float, float]
    accelerations: tuple[float, float, float]
    attitude: tuple[float, float, float, float] | None = None


def is_finite(value: object) -> bool:
    """Is every number in this value finite? If not, the sample is to be dropped.

    Comparisons with NaN are false, so that it would be taken for a user out of danger. Looks into
    collections, mappings, arrays, dataclasses and the attributes of other objects; infinity is
    legal in the ranges of a `Scan` only. What cannot be looked at to its end, because it is nested
    deeper than `DEEPEST` or raises, is no measurement either, nor is an integer beyond all floats.
    """
    try:
        return _CHECKS[type(value)](value, DEEPEST)
    except Exception:  # noqa: BLE001  a foreign class may raise anything
        return False


def _finite(value: object, left: int) -> bool:
    return left > 0 and _CHECKS[type(value)](value, left - 1)


class _Checks(dict[type, SampleCheck]):
    """How to look at values of a class; each class is taken apart once."""

    def __missing__(self, kind: type) -> SampleCheck:
        check = self[kind] = _check_of(kind)
        return check


def _check_of(kind: type) -> SampleCheck:
    if dataclasses.is_dataclass(kind):
        return _check_of_fields(kind)
    if issubclass(kind, complex):
        return lambda number, _: cmath.isfinite(number)
    if hasattr(kind, "tolist"):
        return _is_finite_array
    if hasattr(kind, "__float__"):
        return lambda number, _: math.isfinite(number)
    if issubclass(kind, str | bytes | bytearray | range | type):
        return lambda *_: True
    if issubclass(kind, Mapping):
        return lambda pairs, left: _all_finite(pairs, left) and _all_finite(pairs.values(), left)
    if issubclass(kind, Collection):
        return _all_finite
    if issubclass(kind, Enum):
        return lambda member, left: _finite(member.value, left)
    return _check_of_attributes(kind)


def _all_finite(values: Iterable[object], left: int) -> bool:
    return all(_finite(value, left) for value in values)


def _is_finite_array(array: Any, left: int) -> bool:
    """NaN and infinity outlast `abs` and `max`; objects and records are looked at one by one."""
    kind = getattr(getattr(array, "dtype", None), "kind", None)
    if kind is None or kind in "OV":
        return _finite(array.tolist(), left)
    return kind not in "fc" or array.size == 0 or math.isfinite(abs(array).max())


def _check_of_attributes(kind: type) -> SampleCheck:
    slots = [
        name
        for cls in kind.__mro__
        if "__slots__" in vars(cls)
        for name, member in vars(cls).items()
        if isinstance(member, MemberDescriptorType)
    ]

    def check(thing: Any, left: int) -> bool:
        held = [getattr(thing, name, None) for name in slots]
        return _all_finite([*held, *getattr(thing, "__dict__", {}).values()], left)

    return check


def _check_of_fields(kind: type) -> SampleCheck:
    """Fields declared as numbers are added up in one expression; others are looked into.

    A sum is finite only if all its terms are.
    """
    try:
        hints = get_type_hints(kind)
    except Exception:  # noqa: BLE001  a name imported for type checkers only, or no type at all
        hints = {}
    sums, parts = [], []
    for field in dataclasses.fields(kind):
        hint = hints.get(field.name)
        if hint in (float, int):
            sums.append(f"v.{field.name}")
        elif get_origin(hint) is tuple and set(get_args(hint)) <= {float, int, ...}:
            sums.append(f"sum(v.{field.name})")
        elif hint not in (str, bool):
            parts.append(f"(v.{field.name} is None or finite(v.{field.name}, left))")
    terms = [f"isfinite({' + '.join(sums)})"] if sums else []
    expression = " and ".join(terms + parts) or "True"
    names = {"isfinite": math.isfinite, "finite": _finite}
    check: SampleCheck = eval(f"lambda v, left: {expression}", names)
    return check


def _is_scan(scan: Scan, _: int) -> bool:
    """The sum of ranges is NaN if one is, or if there is a -inf beside an inf."""
    return math.isfinite(scan.start + scan.step + scan.beam_time) and -math.inf < sum(scan.ranges)


_CHECKS = _Checks({Scan: _is_scan})
