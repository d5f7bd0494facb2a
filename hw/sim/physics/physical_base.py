"""A base that moves by physics: the chain's cycles give set points, and its drives follow them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.model import MotionLimits, RobotModel, Slip
from hw.safety import CYCLE_NS
from hw.samples import Sample
from hw.sim.external_base import twist_of
from hw.sim.physics.mechanics import Mechanics
from hw.sim.physics.physical_arm import PhysicalArm
from hw.sim.physics.robot_body import RobotBody
from hw.sim.sim_base import SimBase
from hw.sim.wheel_cycles import Moved

if TYPE_CHECKING:
    from hw.sim.sensors import Track
    from hw.sim.slip import SlipperyFloor

_STANDS = 1e-3
"""A base that is to stand does so once its wheels are slower, m/s and rad/s."""
_SAME = 1e-6
"""Poses, m and rad, that differ by less from the one told last are not told."""
_ENCODER = 1e-4
"""Resolution of the wheels' angles, rad: encoders of 4096 lines behind a gear of 20, or so."""


class PhysicalBase(SimBase):
    """A base whose drives follow, from cycle to cycle, what ramps and chain leave of commands.

    `pose` is the body's; `twist` is that of the wheels, as encoders measure it. The arm moves in
    the same steps, as each reacts on the other.
    """

    shaken = True

    def __init__(
        self, robot: RobotModel, limits: MotionLimits, body: RobotBody, arm: PhysicalArm | None
    ) -> None:
        super().__init__(robot, limits, body.pose)
        self._physics, self._arm = body, arm
        self._followed: tuple[Track, Track] | None = None
        self._rolled, self._angles = body.pose, body.wheel_angles
        self._set_point = STILL

    def watch(self, body: Track, wheels: Track, floor: SlipperyFloor | None) -> None:  # noqa: ARG002
        """Record the poses of body and wheels from now on."""
        self.signals = ("base.twist",)
        self._followed = body, wheels

    def samples(self, now_ns: int) -> list[Sample]:
        """Twist at this instant, and the pose unless sensors measure it."""
        return [sample for sample in super().samples(now_ns) if sample.name in self.signals]

    def block(self, pose: Pose2) -> None:
        """A solid obstacle stops the base at once, at this pose."""
        super().block(pose)
        self._physics.place(pose)

    def _move(self, until_ns: int) -> None:
        for begin in range(self._now, until_ns, CYCLE_NS):
            end = min(begin + CYCLE_NS, until_ns)
            self._body["place"] = self.pose.x, self.pose.y, self.pose.yaw
            self._set_point = STILL
            super()._move(end)
            self._follow(begin, end)

    def _take(self, found: Moved) -> bool:
        """Take over the set point alone: where the body is, physics decides."""
        left, self._stands, _, twist, _, _ = found
        self._set_point = Twist2(*twist)
        return left

    def _follow(self, begin_ns: int, end_ns: int) -> None:
        """Move body and arm on to the end of a cycle."""
        body, arm, span = self._physics, self._arm, (end_ns - begin_ns) * 1e-9
        body.move(self._set_point, () if arm is None else arm.lead(end_ns), span)
        self.energy_j += body.wheel_power * span
        self._roll(span)
        pose = body.pose
        if not pose.is_near(self.pose, _SAME, _SAME):
            self.distance_m += pose.distance_to(self.pose)
            self.pose = pose
        if self._followed is not None:
            followed, wheels = self._followed
            followed.note(end_ns, self.pose)
            if wheels is not followed:
                wheels.note(end_ns, self._rolled)

    def _roll(self, span: float) -> None:
        """Take over how far the wheels have turned within these s."""
        angles = self._physics.wheel_angles
        turned = angles - self._angles
        if float(np.abs(turned).max()) < _ENCODER:
            turned = np.zeros(4)
        else:
            self._angles = angles
        rolled = twist_of(turned.tolist(), self._model)
        ahead = rolled.rotated(self._rolled.yaw + 0.5 * rolled.wz)
        self._rolled = Pose2(
            self._rolled.x + ahead.vx,
            self._rolled.y + ahead.vy,
            wrap(self._rolled.yaw + rolled.wz),
        )
        self.twist = Twist2(rolled.vx / span, rolled.vy / span, rolled.wz / span)
        if max(self.twist.speed, abs(self.twist.wz)) > _STANDS:
            self._stands = False
        elif self._stands:
            self.twist = STILL
        self._body["twist"] = self.twist.vx, self.twist.vy, self.twist.wz


def physical_robot(
    robot: RobotModel,
    limits: MotionLimits,
    start: Pose2,
    slip: Slip | None = None,
    mechanics: Mechanics | None = None,
) -> tuple[PhysicalBase, PhysicalArm | None]:
    """The base and the arm of a robot that stands at this pose (map_from_base), arm folded.

    `slip` and `mechanics`: see `RobotBody`.
    """
    if robot.arm is None or robot.parked is None:
        return PhysicalBase(robot, limits, RobotBody(robot, start, (), slip, mechanics), None), None
    body = RobotBody(robot, start, robot.parked, slip, mechanics)
    arm = PhysicalArm(robot.arm, robot.parked, body)
    return PhysicalBase(robot, limits, body, arm), arm
