"""What parts measure: a sample is a name, a stamp and a value.

| name | value | comes |
|---|---|---|
| `user.pose` | `UserPose` | when tracking has it |
| `base.pose` | `Pose2`, map_from_base | every step (ideal in the reduced simulation) |
| `base.twist` | `Twist2`, base frame | every step |
| `base.mode` | how the wheels are driven: `omni` or `differential` | on change |
| `base.refusal` | why a base that is to drive does not, as text, or None | on change |
| `arm.joints` | `ArmState` | every step |
| `vr.haptic_request` | `Pose3` while requested (the DEEP in the map), or None | on change |
| `vr.release` | `True` | an event: the user lets go of a request |
| `vr.restart` | `True` | an event: the user, shown the robot, stood still and is ready |
| `bumper.hit` | `BumperHit` | an event: the foam was touched |
| `stop.engaged` | the reason as text while the stop line is pulled, or None | on change |
| `operator.acknowledge` | `True` | an event: the operator cleared a fault |
| `base.scan` | `Scan` | per turn of a scanner |
| `base.imu` | `ImuReading` | at the sensor's rate |
| `gripper.state`, `wrench.reading` | `GripperState`, `WrenchReading` | at the sensor's rate |

What comes on change also comes once at the start.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

from hw.geometry import Pose2, Pose3

Joints = tuple[float, ...]
TimedJoints = tuple[float, Joints]
"""Where the joints are to be at a time, s from the start of the move."""


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


@dataclass(frozen=True, slots=True)
class ArmState:
    """Joint angles in rad and joint velocities in rad/s, shoulder first; is a move under way?"""

    joints: Joints
    velocities: Joints
    moving: bool = False


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
    """One turn of a lidar: ranges in m, inf for no return; beam i is at start + i * step, rad."""

    sensor: str
    start: float
    step: float
    ranges: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ImuReading:
    """Rates of turn in rad/s and accelerations in m/s2, in the base frame."""

    rates: tuple[float, float, float]
    accelerations: tuple[float, float, float]


def is_finite(value: object) -> bool:
    """Is every number in this value finite? If not, the sample is to be dropped.

    Comparisons with NaN are false, so that it would be taken for a user out of danger. Looks into
    dataclasses, tuples, lists and arrays; infinity is legal in the ranges of a `Scan` only.
    """
    kind = type(value)
    check = _CHECKS.get(kind)
    if check is None:
        check = _CHECKS[kind] = _check_of(kind)
    try:
        return check(value)
    except TypeError:  # a text where the class declares a number
        return False


def _check_of(kind: type) -> Callable[[Any], bool]:
    """How to look at values of a class; each class is taken apart once."""
    if dataclasses.is_dataclass(kind):
        return _check_of_fields(kind)
    if issubclass(kind, tuple | list):
        return lambda values: all(map(is_finite, values))
    if issubclass(kind, float | int):
        return math.isfinite
    if hasattr(kind, "dtype"):
        return lambda array: array.dtype.kind != "f" or math.isfinite(array.sum())
    return lambda _: True


def _check_of_fields(kind: type) -> Callable[[Any], bool]:
    """Fields declared as numbers are added up in one expression; others are looked into.

    A sum is finite only if all its terms are.
    """
    try:
        hints = get_type_hints(kind)
    except NameError:  # imported for type checkers only
        hints = {}
    sums, parts = [], []
    for field in dataclasses.fields(kind):
        hint = hints.get(field.name)
        if hint in (float, int):
            sums.append(f"v.{field.name}")
        elif get_origin(hint) is tuple and set(get_args(hint)) <= {float, int, ...}:
            sums.append(f"sum(v.{field.name})")
        elif hint not in (str, bool):
            parts.append(f"(v.{field.name} is None or finite(v.{field.name}))")
    terms = [f"isfinite({' + '.join(sums)})"] if sums else []
    expression = " and ".join(terms + parts) or "True"
    names = {"isfinite": math.isfinite, "finite": is_finite}
    check: Callable[[Any], bool] = eval(f"lambda v: {expression}", names)
    return check


def _is_scan(scan: Scan) -> bool:
    """The sum of ranges is NaN if one is, or if there is a -inf beside an inf."""
    return math.isfinite(scan.start + scan.step) and -math.inf < sum(scan.ranges)


_CHECKS: dict[type, Callable[[Any], bool]] = {Scan: _is_scan}
