"""The parts of a robot and of its surroundings, as small interfaces.

Parts take commands by methods and report by samples only (`hw.samples` has the list), so that
simulation, mock and real drivers look alike. Every command returns at once: none waits for the
device, and none raises because the device failed. A lost device shows as samples that stop coming;
a driver that can no longer move its device stops it and pulls the stop line. A command that no
device could follow (NaN, wrong number of joints) is a bug of the caller: ValueError.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Literal, Protocol

from hw.geometry import Twist2
from hw.samples import Sample, TimedJoints

DriveMode = Literal["omni", "differential"]


class RobotPart(Protocol):
    """Any part: it gives samples."""

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the samples this part can give."""
        ...

    def samples(self, now_ns: int) -> Iterable[Sample]:
        """Samples that arrived since the last call, oldest first; stamps are at most now_ns."""
        ...


class Base(RobotPart, Protocol):
    """Wheels. Gives `base.twist`, and `base.pose` if the part measures it.

    Only the `GuardedBase` around it (`hw.safety.guarded`), which is the part `base` of a run,
    commands it; see there for wheels with ramps of their own, which have an attribute `chain`.
    """

    @property
    def mode(self) -> DriveMode:
        """The drive mode; in `differential` the sideways velocity is always 0 (R2)."""
        ...

    def use(self, mode: DriveMode) -> None:
        """Change the drive mode once the base stands; until then it slows down."""
        ...

    def drive(self, command: Twist2) -> None:
        """Drive at this velocity (base frame, m/s and rad/s) as far as the limits allow.

        Holds until the next command, at most for the part's own command time-out: repeat it. While
        the stop line is pulled nothing moves, and the command is dropped.

        Raises:
            ValueError: a value is NaN or infinite, or it goes sideways, and the base cannot.
        """
        ...

    def stop(self) -> None:
        """Slow down to standstill within the limits; holds until the next command."""
        ...


class Arm(RobotPart, Protocol):
    """A jointed arm. Gives `arm.joints`."""

    def follow(self, points: Sequence[TimedJoints]) -> int:
        """Follow a trajectory: these angles (rad) at these times, s from now, linear in between.

        The first point is at time 0, at the arm's present angles. Returns the number of the
        trajectory, counted from 1; samples tell by `ArmState.course` and `refused` whether it was
        accepted. An arm that moves, that is more than 0.01 rad from the first point, or that is
        stopped refuses it; if it moves, it brakes. A trajectory that anything but `stop` ends early
        counts as refused from then on. Arrival is read from `arm.joints`. A driver streams the
        points as they are, so they should be closely spaced.

            ValueError: no points; times that do not start at 0 and rise; wrong number of joints,
                not finite, outside the joints' limits, or faster than their speed.
        """
        ...

    def pace(self, share: float, separation: float | None = None, needed: float = 0.0) -> None:
        """Follow the present trajectory at this share of its speed from now on, 0 to 1.

        The arm changes over no faster than it brakes; a new trajectory begins with a share of 1.
        `separation` and `needed`, m, say why, for whoever records it: the gap to the person, and
        the one needed to stop before it is used up.

        Raises:
            ValueError: the share is not between 0 and 1.
        """
        ...

    def stop(self) -> None:
        """Brake to standstill within 0.2 s (R45), along the commanded path."""
        ...


class Gripper(RobotPart, Protocol):
    """Two fingers. Gives `gripper.state`."""

    def open_to(self, opening: float | None) -> None:
        """Move the fingers to this opening, m; None: as wide as they go.

        They stop by themselves at an object. From the next sample on `moving` tells whether they
        are still on their way.

        Raises:
            ValueError: they cannot be opened so far.
        """
        ...

    def stop(self) -> None:
        """Hold the fingers at their present opening."""
        ...


class Wrench(RobotPart, Protocol):
    """Force and torque at the flange. Gives `wrench.reading`."""

    def zero(self) -> None:
        """Tare: take the present reading as zero load."""
        ...


class Lidar(RobotPart, Protocol):
    """One or more laser scanners. Gives `base.scan`, stamped at the first beam."""


class Imu(RobotPart, Protocol):
    """Inertial sensor: angular rates and accelerations. Gives `base.imu`."""


class WheelOdometry(RobotPart, Protocol):
    """Wheel odometry, if it does not come from the base. Gives `base.odometry`."""


class RoverTrackers(RobotPart, Protocol):
    """Trackers of the VR system on the rover (R8). Gives `rover.tracker` for each one visible."""


class Trackers(RobotPart, Protocol):
    """Tracking of the person (R7, R13, R14). Gives `user.pose`; nothing while tracking is lost."""


class Vr(RobotPart, Protocol):
    """The virtual world. Gives `vr.haptic_request`, `vr.release`, `vr.restart`.

    When its link is lost a driver ends the current request: `vr.haptic_request` is None. A part
    with a method `show(stamp_ns)` has it called in each tick, after the states: it sends the
    robot's pose, joints and stop sign of that instant (R114), which it has received by `hear`.
    """

    def inform(self, show: bool, sign: bool = True, least: float = 0.0) -> None:
        """Show the robot to the user, or hide it again (R18, R114).

        With the stop sign beside it, which stays for `least`, s, even if it is hidden before, so
        that a person can take it in and stop; or, for a robot that leaves in their sight, without.
        """
        ...


class Bumper(RobotPart, Protocol):
    """Foam with switches (R4). Gives `bumper.hit`; a touch also pulls the stop line (R5)."""


class StopLine(RobotPart, Protocol):
    """The latched software stop in front of all motion (R48, R49). Gives `stop.engaged`.

    It is not a safety device: the hardware's own emergency stop is a separate line (R54).
    """

    def pull(self, reason: str) -> None:
        """Stop base and arm at once, until the reset; the first reason is kept."""
        ...

    def reset(self) -> bool:
        """Let the robot move again; False while the cause persists. Only an operator calls it."""
        ...


class RemoteOperator(RobotPart, Protocol):
    """The person with the remote stop (R48). Gives `operator.acknowledge`."""

    def report(self, fault: str) -> None:
        """Report a fault that has to be acknowledged."""
        ...


PARTS: Mapping[str, type] = {
    "base": Base, "arm": Arm, "gripper": Gripper, "wrench": Wrench, "lidar": Lidar, "imu": Imu,
    "odometry": WheelOdometry, "rover_trackers": RoverTrackers, "trackers": Trackers, "vr": Vr,
    "bumper": Bumper, "stop_line": StopLine, "operator": RemoteOperator,
}  # fmt: skip
"""The parts of a robot and its surroundings, by name; each is optional.

Projects add parts of their own. Any part may have `stop()`, called whenever a new state starts to
use it, and `wake`, set by a loop in real time: a driver calls it when a sample has arrived. A part
that needs other parts' samples lists them in `hears` and receives them by `hear(sample, now_ns)`.
`pull`, `reset`, `acknowledge`, and `drive` and `stop` of moving parts may be called from other
threads than the rest. If a part has an attribute `line`, it is set to the run's stop line: the part
pulls it when it can no longer move, and does not move while `line.reason` is not None. A part, link
or peer may have `fault`, why it does nothing now, or None, and `child`, the process that it needs:
a fault of either stops the robot, and a reset is refused until it is over. If a lost
device can be recovered, `acknowledge()` does so on the operator's order, before the line is reset;
it returns whether the part can move now, so that the operator can retry if recovery takes a while.
"""
