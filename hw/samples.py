"""The samples of parts: a name, a stamp and a value each.

| name | value | comes |
|---|---|---|
| `user.pose` | `UserPose` | when tracked |
| `base.pose` | `Pose2`, map_from_base | every step (ideal in the reduced simulation) |
| `base.twist` | `Twist2`, base frame | every step |
| `base.mode` | drive mode: `omni` or `differential` | on change |
| `base.refusal` | why a commanded base does not drive, as text, or None | on change |
| `base.admitted` | `Twist2` left of a velocity that the safety chain has cut, or None | on change |
| `arm.joints` | `ArmState` | every step |
| `vr.haptic_request` | `Pose3`, the DEEP in the map, while requested, or None | on change |
| `vr.release` | `True` | event: the user lets go of a request |
| `vr.restart` | `True` | event: the user, shown the robot, has stood still and is ready |
| `vr.clock` | `ClockState`: our clock against the VR application's | ten times a second |
| `vr.fault` | fault of the VR link, as text, or None | on change |
| `bumper.hit` | `BumperHit` | event: the foam was touched |
| `stop.engaged` | the reason as text while the stop line is pulled, or None | on change |
| `operator.acknowledge` | `True` | event: the operator cleared a fault |
| `base.scan` | `Scan` | per revolution of a scanner, stamped at its first beam |
| `base.odometry` | `Odometry` | at the wheels' rate |
| `rover.tracker` | `TrackerPose` | for each tracker on the rover while it is tracked |
| `base.imu` | `ImuReading` | at the sensor's rate |
| `gripper.state`, `wrench.reading` | `GripperState`, `WrenchReading` | at the sensor's rate |

Samples given on change are also given once at the start.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from hw.geometry import Pose2, Pose3, Twist2

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

LATE_S, OLD_S = 0.05, 0.15
"""Ages of poses and velocities, s: fully used up to the first, not used beyond the second.

In between the robot gets slower: of data some 100 ms old the paper says that they do harm (R149).
"""
OLD_NS = 150_000_000
"""`OLD_S` in ns."""

Joints = tuple[float, ...]
TimedJoints = tuple[float, Joints]
"""Joint angles, rad, at a time, s from the start of the trajectory."""


class Sample(NamedTuple):
    """One measured value; stamp_ns counts from the start of the run."""

    name: str
    stamp_ns: int
    value: object


USER_RADIUS = 0.5
"""Radius of the cylinder that models a person, m (R23)."""


@dataclass(frozen=True, slots=True)
class UserPose:
    """The measured pose of a person, in the map.

    `body` is the tailbone (R13: leaning or crouching hardly moves it), `head_yaw` the direction of
    view in rad. Head and hands (R7, R14) are None if the source does not measure them.
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
"""State of the arm's own safety system; it moves in the first three only."""
ARM_MOVES: frozenset[ArmMode] = frozenset(("normal", "reduced", "recovery"))


@dataclass(frozen=True, slots=True)
class ArmState:
    """Joint angles in rad and joint velocities in rad/s, shoulder first, and whether it moves.

    `course` is the number of the newest trajectory that was accepted or refused (`Arm.follow`);
    `refused` says why that trajectory was refused or aborted, None if it was not. `scaling` is the
    share of its commanded speed at which the arm runs.
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
    """Opening between the fingers in m, whether they hold an object, and whether they move."""

    opening: float
    holding: bool = False
    moving: bool = False


@dataclass(frozen=True, slots=True)
class WrenchReading:
    """Force in N and torque in Nm at the tool flange, in the flange frame."""

    force: tuple[float, float, float]
    torque: tuple[float, float, float]


class _Ranges:
    """`ranges` of a scan also as `array`: what was not given is made when it is first read."""

    __slots__ = ("array",)

    def __getattr__(self, name: str) -> Any:
        """Called for an attribute that is not set."""
        made: object
        if name == "array":
            import numpy as np  # only who has scans needs it

            made = np.array(array("d", self.ranges))  # refuses texts, which numpy would read
        elif name == "ranges":
            made = tuple(self.array.tolist())
        else:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        object.__setattr__(self, name, made)
        return made


@dataclass(frozen=True, slots=True)
class Scan(_Ranges):
    """One sweep of a lidar: ranges in m, inf for no return; beam i is at start + i * step, rad.

    Angles are in the sensor frame. Beam i was taken i * `beam_time` s after the stamp. `array` has
    the ranges as float64, (n,), not to be written to.
    """

    sensor: str
    start: float
    step: float
    ranges: tuple[float, ...]
    beam_time: float = 0.0

    @classmethod
    def of_array(
        cls, sensor: str, start: float, step: float, ranges: Array, beam_time: float
    ) -> Scan:
        """A scan of an array (n,) of float64, from now on its own; the tuple is made on reading."""
        scan = cls.__new__(cls)
        for name, value in (
            ("sensor", sensor), ("start", start), ("step", step), ("array", ranges),
            ("beam_time", beam_time),
        ):  # fmt: skip
            object.__setattr__(scan, name, value)
        return scan


@dataclass(frozen=True, slots=True)
class Odometry:
    """Wheel odometry: odom_from_base, which drifts without bound, and the base's velocity.

    The frame `odom` is the base's pose when its driver began to count; `twist` is in the base
    frame. `sigma` are the standard deviations of its vx, vy (m/s) and wz (rad/s), if the driver
    knows them.
    """

    pose: Pose2
    twist: Twist2
    sigma: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class TrackerPose:
    """The pose of a tracker of the VR system, by name: vive_from_tracker."""

    tracker: str
    pose: Pose3


@dataclass(frozen=True, slots=True)
class RobotView:
    """The robot as the virtual world shows it.

    `pose` is map_from_base, `twist` the velocity in the base frame, `joints` the arm's angles, rad;
    None if unknown. `visible`: the robot is drawn; `stop_sign`: with the sign (R18).
    """

    pose: Pose2 | None = None
    twist: Twist2 | None = None
    joints: Joints | None = None
    visible: bool = False
    stop_sign: bool = False


@dataclass(frozen=True, slots=True)
class ClockState:
    """The clock of another machine: `offset` is our time minus theirs, `error` its bound, s.

    `age` is that of the newest data on arrival, s. `round_trips` is True if the offset was measured
    by request and answer, False if only from the stamps of received data.
    """

    offset: float
    error: float
    age: float
    round_trips: bool


@dataclass(frozen=True, slots=True)
class PoseSigma:
    """Standard deviations of a planar pose: m along its worst axis, and rad."""

    position: float
    yaw: float


EXACT = PoseSigma(0.0, 0.0)
"""The uncertainty of an ideal pose."""


@dataclass(frozen=True, slots=True)
class ImuReading:
    """Angular rates in rad/s and accelerations in m/s2, in the base frame.

    `attitude` is the quaternion (qx, qy, qz, qw) of world_from_base, the world's z upwards, if the
    sensor gives it.
    """

    rates: tuple[float, float, float]
    accelerations: tuple[float, float, float]
    attitude: tuple[float, float, float, float] | None = None
