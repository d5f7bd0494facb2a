"""Mock parts: the simulated ones without ramps, which do exactly as told from the next tick on."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.interfaces import DriveMode
from hw.model import MotionLimits, Prop, RobotModel, WrenchModel, check_pace
from hw.people.walking import Person
from hw.safety import CYCLE_NS, SafetyLimits
from hw.scene import Scene
from hw.sim.hand import Hand, SimGripper, SimWrench
from hw.sim.sim_arm import SimArm
from hw.sim.sim_base import SimBase
from hw.sim.world import World

if TYPE_CHECKING:
    from hw.sim.sensors import Track
    from hw.sim.slip import SlipperyFloor


class MockBase(SimBase):
    """A base that has the commanded velocity and mode at once; its pose follows exact arcs.

    It has no limits but those of the safety chain, and uses no energy.
    """

    def __init__(self, robot: RobotModel, start: Pose2) -> None:
        super().__init__(robot, MotionLimits(), start)

    def watch(self, body: Track, wheels: Track, floor: SlipperyFloor | None) -> None:  # noqa: ARG002
        """Refuse sensors: they measure how wheels and body differ, and these do not."""
        raise TypeError("sensing needs a SimBase, not a MockBase")

    def use(self, mode: DriveMode) -> None:
        """Change the drive mode; see `Base`."""
        super().use(mode)
        self.mode = mode

    def _limited(self, command: Twist2) -> Twist2:
        return command if self.mode == "omni" else Twist2(command.vx, 0.0, command.wz)

    def _move(self, until_ns: int) -> None:
        """Follow the command, as far as the chain admits it, from cycle to cycle.

        Arcs are computed from the last change of velocity, so that rounding does not accumulate.
        """
        since, self._now = self._now, until_ns
        if self._target == STILL:
            self.twist = STILL
            if self.chain is not None:
                self.chain.rest(since)
            return
        begun, start, twist = since, self.pose, None
        for now in range(since, until_ns, CYCLE_NS):
            admitted = self._admitted(now)
            if admitted != twist:
                begun, start, twist = now, self.pose, admitted
            end = min(now + CYCLE_NS, until_ns)
            self.pose, self.twist = _along(start, admitted, (end - begun) * 1e-9), admitted
            self.distance_m += admitted.speed * (end - now) * 1e-9

    def _admitted(self, now_ns: int) -> Twist2:
        if self.chain is None:
            return self._target
        return self.chain.admit(now_ns, self._target, self.pose, self.twist, self.mode)


def _along(start: Pose2, twist: Twist2, span: float) -> Pose2:
    """The pose after `span` s at constant velocity: on an arc that turns by wz * span."""
    turn = twist.wz * span
    # chord of the arc: the arc length times sin(a / 2) / (a / 2), rotated by half the angle a
    chord = span if turn == 0.0 else span * math.sin(0.5 * turn) / (0.5 * turn)
    way = twist.rotated(start.yaw + 0.5 * turn)
    return Pose2(start.x + way.vx * chord, start.y + way.vy * chord, wrap(start.yaw + turn))


class MockArm(SimArm):
    """An arm that changes its pace, and stops, at once."""

    def pace(self, share: float, separation: float | None = None, needed: float = 0.0) -> None:  # noqa: ARG002  why is for the record
        """Follow the present trajectory at this share of its speed, at once; see `Arm`."""
        check_pace(share)
        self._jump_to(share)

    def stop(self) -> None:
        """Stand at once; see `Arm`."""
        self._jump_to(0.0)

    def _jump_to(self, rate: float) -> None:
        course = self._course
        if course is not None and course.rate > 0.0:
            share, _ = course.at(self._now)
            self._course = replace(course, since_ns=self._now, share=share, before=rate, rate=rate)


class MockGripper(SimGripper):
    """Fingers that have the commanded opening at once, or the width of an object if wider."""

    def advance(self, until_ns: int) -> None:  # noqa: ARG002
        """Move on to until_ns."""
        opening = self.state.opening if self._goal is None or self.braked else self._goal
        self._goal = None
        self._tell(self._stopped(self.state.opening, opening))


def mock_hand(prop: Prop) -> Hand:
    """The mocked gripper and sensor of a prop; the sensor has no full scale."""
    gripper = None if prop.gripper is None else MockGripper(prop.gripper)
    unlimited = WrenchModel(math.inf, math.inf)
    return Hand(gripper, None if prop.wrench is None else SimWrench(unlimited))


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
        arm=_arm_of(robot),
        hand=None if robot.prop is None else mock_hand(robot.prop),
    )


def _arm_of(robot: RobotModel) -> MockArm | None:
    arm, parked = robot.arm, robot.parked
    return None if arm is None or parked is None else MockArm(arm, parked)
