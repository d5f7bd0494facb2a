"""The parts of a robot and of its surroundings, as small interfaces.

Parts take commands through methods and report through samples only (`hw.samples` has the list), so
that simulation, mock and real drivers look alike. Every command returns at once; none waits for
the device, and none raises because the device failed: a lost device shows as samples that stop
coming, and a driver that cannot move any more stops its part and pulls the stop line. A command
that no device could follow (NaN, wrong number of joints) is a bug of the caller: ValueError.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Literal, Protocol

from hw.geometry import Twist2
from hw.samples import Sample, TimedJoints

DriveMode = Literal["omni", "differential"]


class RobotPart(Protocol):
    """Anything that measures."""

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the samples this part can give."""
        ...

    def samples(self, now_ns: int) -> Iterable[Sample]:
        """Samples that arrived since the last call, oldest first; stamps are at most now_ns."""
        ...


class Base(RobotPart, Protocol):
    """Wheels. Gives `base.twist`; `base.pose` where the part knows it.

    Only their `GuardedBase` (`hw.safety.guarded`), which is the part `base` of a run, commands
    them.
    """

    @property
    def mode(self) -> DriveMode:
        """How the wheels are driven; in `differential` the sideways velocity is always 0 (R2)."""
        ...

    def use(self, mode: DriveMode) -> None:
        """Change the way of driving, as soon as the base stands; until then it slows down."""
        ...

    def drive(self, command: Twist2) -> None:
        """Go at this velocity (base frame, m/s and rad/s) as far as the limits allow.

        Holds until the next command, at most for the part's own command time-out: repeat it. In
        `differential` mode vy is ignored. While the stop line is pulled nothing moves, and the
        command is forgotten.

        Raises:
            ValueError: a value is NaN or infinite.
        """
        ...

    def stop(self) -> None:
        """Slow down to standstill within the limits; holds until the next command."""
        ...


class Arm(RobotPart, Protocol):
    """A jointed arm. Gives `arm.joints`."""

    def follow(self, points: Sequence[TimedJoints]) -> int:
        """Be at these angles (rad) at these times, s from now, in straight joint lines between.

        The first point is at time 0, where the arm stands. Gives the number of the course, which
        counts from 1; the samples say by `ArmState.course` and `refused` whether it was taken. An
        arm that moves, that stands more than 0.01 rad from the first point, or that is stopped does
        not follow; if it moves, it brakes. A course that something else than `stop` ends before its
        last point is refused from then on. Whether it arrived is read from `arm.joints`. A driver
        streams the points as they are, so they are to lie close together.

        Raises:
            ValueError: no points; times that do not start at 0 and rise; wrong number of joints,
                not finite, outside the joints' limits, or faster than their speed.
        """
        ...

    def stop(self) -> None:
        """Brake to standstill within 0.2 s (R45), on the way that was commanded."""
        ...


class Gripper(RobotPart, Protocol):
    """Holds the prop. Gives `gripper.state`."""

    def open_to(self, opening: float) -> None:
        """Move the fingers to this opening, m; stops by itself where something is held."""
        ...

    def stop(self) -> None:
        """Keep the fingers where they are."""
        ...


class Wrench(RobotPart, Protocol):
    """Force and torque at the flange. Gives `wrench.reading`."""

    def zero(self) -> None:
        """Take the present reading as no load."""
        ...


class Lidar(RobotPart, Protocol):
    """One or more laser scanners. Gives `base.scan`, stamped at the first beam."""


class Imu(RobotPart, Protocol):
    """Rates and accelerations. Gives `base.imu`."""


class WheelOdometry(RobotPart, Protocol):
    """What the wheels have turned, where it is not the base that tells. Gives `base.odometry`."""


class RoverTrackers(RobotPart, Protocol):
    """Trackers of the VR system on the rover (R8). Gives `rover.tracker` of each that is seen."""


class Trackers(RobotPart, Protocol):
    """Tracking of the person (R7, R13, R14). Gives `user.pose`; nothing while tracking is lost."""


class Vr(RobotPart, Protocol):
    """The virtual world. Gives `vr.haptic_request`, `vr.release`, `vr.restart`.

    When its link is lost a driver ends the request under way: `vr.haptic_request` is None. One that
    has a method `show(stamp_ns)` is called in each tick, after the states: it sends the robot's
    pose, joints and sign as they are at that instant (R114), of which it hears by `hears`.
    """

    def inform(self, show: bool) -> None:
        """Show the robot and the stop sign to the user, or hide them again (R18, R114)."""
        ...


class Bumper(RobotPart, Protocol):
    """Foam with switches (R4). Gives `bumper.hit`; a touch also pulls the stop line (R5)."""


class StopLine(RobotPart, Protocol):
    """The latched software stop in front of all motion (R48, R49). Gives `stop.engaged`.

    It is no safety device: the hardware's own emergency stop is another line (R54).
    """

    def pull(self, reason: str) -> None:
        """Stop base and arm at once and stay so; the first reason is kept."""
        ...

    def reset(self) -> bool:
        """Let the robot move again; False while the cause holds. Only an operator calls it."""
        ...


class RemoteOperator(RobotPart, Protocol):
    """The person with the remote stop (R48). Gives `operator.acknowledge`."""

    def report(self, fault: str) -> None:
        """Tell the operator of a fault that has to be acknowledged."""
        ...


PARTS: Mapping[str, type] = {
    "base": Base, "arm": Arm, "gripper": Gripper, "wrench": Wrench, "lidar": Lidar, "imu": Imu,
    "odometry": WheelOdometry, "rover_trackers": RoverTrackers, "trackers": Trackers, "vr": Vr,
    "bumper": Bumper, "stop_line": StopLine, "operator": RemoteOperator,
}  # fmt: skip
"""The parts a robot and its surroundings may have, by name; each may be missing.

Projects add parts of their own. Any part may have `stop()`, called whenever something new starts on
it, and `wake`, set by a loop in real time: a driver calls it when a sample has come. A part that
needs other parts' samples lists them in `hears` and receives them through `hear(sample, now_ns)`.
`pull`, `reset`, `acknowledge`, and `drive` and `stop` of what moves may be called from other
threads than the rest. A part with an attribute `line` is given the run's stop line there: it pulls
it when it cannot move any more, and does not move while `line.reason` is a text. Where a lost
device can be had again, `acknowledge()` does so by the operator's order, before the line is reset;
it says whether the part can move now, so that the operator asks again where it takes a while.
"""
