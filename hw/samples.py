"""What parts measure: a sample is a name, a stamp and a value.

| name | value | comes |
|---|---|---|
| `user.pose` | `UserPose` | when tracking has it |
| `base.pose` | `Pose2`, map_from_base | every step (ideal in the reduced simulation) |
| `base.twist` | `Twist2`, base frame | every step |
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

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from hw.geometry import Pose2, Pose3, Twist2

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
    """Can this value be meant? A pose or velocity with NaN or infinity is no measurement.

    Comparisons with NaN are false, so that it would be taken for a user out of danger.
    """
    total = _SUMS.get(type(value))
    return total is None or math.isfinite(total(value))


def _sum_of_user(pose: UserPose) -> float:
    body = pose.body
    return body.x + body.y + body.yaw + pose.head_yaw


_SUMS: dict[type, Callable[[Any], float]] = {
    UserPose: _sum_of_user,
    Pose2: lambda pose: pose.x + pose.y + pose.yaw,
    Twist2: lambda twist: twist.vx + twist.vy + twist.wz,
    Pose3: lambda p: p.x + p.y + p.z + p.qx + p.qy + p.qz + p.qw,
    ArmState: lambda arm: sum(arm.joints) + sum(arm.velocities),
}
