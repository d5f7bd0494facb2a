"""Mock parts: they follow commands exactly, from the next tick on, and keep a list of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.interfaces import DriveMode
from hw.model import ArmModel, GripperModel, Prop, RobotModel, WrenchModel, check_pace
from hw.people.walking import Person
from hw.safety import CYCLE_NS, GuardedBase, SafetyLimits
from hw.samples import ArmState, GripperState, Joints, Sample, TimedJoints
from hw.scene import Scene
from hw.sim.sim_arm import STOPPED, JointCourse, refusal
from hw.sim.tool import Hand, SimGripper, SimWrench
from hw.sim.world import World


class MockBase:
    """A base that has the commanded velocity at once; its pose follows exact arcs.

    `gate` limits what reaches the wheels; None: no limit.
    """

    signals: tuple[str, ...] = ("base.pose", "base.twist")

    def __init__(self, robot: RobotModel, start: Pose2) -> None:
        self.pose = start
        self.mode: DriveMode = robot.base.modes[0]
        self.twist = STILL
        self.distance_m = 0.0
        self.energy_j = 0.0
        self.braked = False
        self.gate: GuardedBase | None = None
        self.commands: list[Twist2] = []
        self._model = robot.base
        self._timeout_ns = round(robot.base.command_timeout * 1e9)
        self._target = STILL
        self._now = 0
        self._expires = 0
        self._reported = -1

    def use(self, mode: DriveMode) -> None:
        """Change the drive mode; see `Base`."""
        if mode not in self._model.modes:
            raise ValueError(f"base: mode '{mode}' is not one of {', '.join(self._model.modes)}")
        self.mode = mode

    def drive(self, command: Twist2) -> None:
        """Command a velocity; see `Base`."""
        Twist2.checked(command.vx, command.vy, command.wz)
        self.commands.append(command)
        sideways = command.vy if self.mode == "omni" else 0.0
        target = Twist2(command.vx, sideways, command.wz)
        self._target = STILL if target == STILL else target
        self._expires = self._now + self._timeout_ns

    def stop(self) -> None:
        """Stand at once; see `Base`."""
        self.commands.append(STILL)
        self._target = STILL

    def samples(self, now_ns: int) -> list[Sample]:
        """Pose and twist at this instant."""
        if self._reported == now_ns:
            return []
        self._reported = now_ns
        return [Sample("base.pose", now_ns, self.pose), Sample("base.twist", now_ns, self.twist)]

    def block(self, pose: Pose2) -> None:
        """A solid obstacle stops the base at once, at this pose."""
        self.pose, self.twist, self._target = pose, STILL, STILL

    def advance(self, until_ns: int) -> None:
        """Move on to until_ns."""
        if self.braked:
            self._target = STILL
        end = min(until_ns, self._expires)
        if self._target != STILL and end > self._now:
            self._go(end)
        if self._target == STILL or self._expires < until_ns:
            self._target = self.twist = STILL
            if self.gate is not None:
                self.gate.rest(self._now)
        self._now = until_ns

    def _go(self, end_ns: int) -> None:
        """Follow the command to end_ns, as far as the gate admits it, from cycle to cycle.

        Arcs are computed from the last change of velocity, so that rounding does not accumulate.
        """
        begun, start, twist = self._now, self.pose, None
        for now in range(self._now, end_ns, CYCLE_NS):
            admitted = self._admitted(now)
            if admitted != twist:
                begun, start, twist = now, self.pose, admitted
            end = min(now + CYCLE_NS, end_ns)
            self.pose, self.twist = _along(start, admitted, (end - begun) * 1e-9), admitted
            self.distance_m += admitted.speed * (end - now) * 1e-9

    def _admitted(self, now_ns: int) -> Twist2:
        if self.gate is None:
            return self._target
        return self.gate.admit(now_ns, self._target, self.pose, self.twist)


def _along(start: Pose2, twist: Twist2, span: float) -> Pose2:
    """The pose after `span` s at constant velocity: on an arc that turns by wz * span."""
    turn = twist.wz * span
    # chord of the arc: the arc length times sin(a / 2) / (a / 2), rotated by half the angle a
    chord = span if turn == 0.0 else span * math.sin(0.5 * turn) / (0.5 * turn)
    way = twist.rotated(start.yaw + 0.5 * turn)
    return Pose2(start.x + way.vx * chord, start.y + way.vy * chord, wrap(start.yaw + turn))


class MockArm:
    """An arm that follows its trajectory exactly, and stops instantly."""

    signals: tuple[str, ...] = ("arm.joints",)

    def __init__(self, model: ArmModel) -> None:
        self.state = ArmState(model.parked, (0.0,) * len(model.parked))
        self.braked = False
        self.commands: list[Joints] = []
        self._model = model
        self._course: JointCourse | None = None
        self._since, self._share, self._rate = 0, 0.0, 1.0
        self._now = 0
        self._reported = -1

    def follow(self, points: Sequence[TimedJoints]) -> int:
        """Follow a trajectory; see `Arm`."""
        self._model.check_course(points)
        refused = refusal(self.state, points, self.braked)
        self.stop()
        number = self.state.course + 1
        self.state = replace(self.state, course=number, refused=refused)
        if refused is None:
            self.commands.append(points[-1][1])
            self._course, self._since, self._share = JointCourse.of(points), self._now, 0.0
            self._rate = 1.0
        return number

    def pace(self, share: float, separation: float | None = None, needed: float = 0.0) -> None:  # noqa: ARG002  why is for the record
        """Follow the present trajectory at this share of its speed, at once; see `Arm`."""
        check_pace(share)
        self._share, self._since, self._rate = self._progress(self._now), self._now, share

    def stop(self) -> None:
        """Stand at once; see `Arm`."""
        self._course = None

    def samples(self, now_ns: int) -> list[Sample]:
        """The joints at this instant."""
        if self._reported == now_ns:
            return []
        self._reported = now_ns
        return [Sample("arm.joints", now_ns, self.state)]

    def advance(self, until_ns: int) -> None:
        """Move on to until_ns."""
        self._now = until_ns
        if self.braked and self._course is not None:
            self.state = replace(self.state, refused=STOPPED)
            self.stop()
        if self._course is not None:
            share = self._progress(until_ns)
            moving = share < self._course.duration
            scaling = self._rate if moving else 1.0
            self.state = replace(
                self.state, joints=self._course.joints(share), moving=moving, scaling=scaling
            )
        elif self.state.moving:
            self.state = replace(self.state, moving=False, scaling=1.0)
        if not self.state.moving:
            self._course = None

    def _progress(self, now_ns: int) -> float:
        """The planned time reached, s."""
        return self._share + self._rate * (now_ns - self._since) * 1e-9


class MockGripper(SimGripper):
    """Fingers that have the commanded opening at once, or the width of an object if wider."""

    def __init__(self, model: GripperModel) -> None:
        super().__init__(model)
        self.commands: list[float] = []

    def open_to(self, opening: float) -> None:
        """Command an opening; see `Gripper`."""
        super().open_to(opening)
        if not self.braked:
            self.commands.append(opening)

    def advance(self, until_ns: int) -> None:  # noqa: ARG002
        """Move on to until_ns."""
        opening = self.state.opening if self._goal is None or self.braked else self._goal
        self._goal = None
        opening = self._stopped(self.state.opening, opening)
        holding = self.between is not None and opening <= self.between
        if (opening, holding) != (self.state.opening, self.state.holding):
            self.state = GripperState(opening, holding)


class MockWrench(SimWrench):
    """A sensor that reads the applied load less the one at zeroing, not limited to a full scale."""

    def __init__(self) -> None:
        super().__init__(WrenchModel(math.inf, math.inf))


def mock_hand(prop: Prop) -> Hand:
    """The mocked gripper and sensor of a prop."""
    gripper = None if prop.gripper is None else MockGripper(prop.gripper)
    return Hand(gripper, None if prop.wrench is None else MockWrench())


def mock_world(
    scene: Scene | None,
    robot: RobotModel,
    person: Person | None,
    safety: SafetyLimits | None = None,
    operator: bool = True,
) -> World:
    """A world whose robot is the mock; only the safety chain limits its motion."""
    return World(
        scene,
        robot,
        person,
        safety=safety,
        operator=operator,
        base=MockBase(robot, Pose2(0.0, 0.0) if scene is None else scene.robot_start),
        arm=None if robot.arm is None else MockArm(robot.arm),
        hand=None if robot.prop is None else mock_hand(robot.prop),
    )
