"""An arm that moves by physics: its servos follow the trajectory of the reduced arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hw.model import ArmModel
from hw.samples import ArmState, Joints, Sample, TimedJoints
from hw.sim.physics.robot_body import RobotBody
from hw.sim.sim_arm import SimArm

_SETTLED = 1e-3
"""The arm has arrived within so many rad of the end of its course, at less than 10 times as many
rad/s."""
_SAME = 1e-6
"""Angles that differ by less from those told last are not told, rad."""


class PhysicalArm:
    """Servos that follow the course of a `SimArm`, which starts, paces and brakes as ever.

    `state` has the angles of the joints. It is `moving` until they have settled, not again when the
    base shakes them.
    """

    signals: tuple[str, ...] = ("arm.joints",)

    def __init__(self, model: ArmModel, joints: Joints, body: RobotBody) -> None:
        self._course, self._physics = SimArm(model, joints), body
        self._settles = False
        self._reported = -1
        self.state: ArmState = self._course.state

    @property
    def braked(self) -> bool:
        """True while the stop line is pulled."""
        return self._course.braked

    @braked.setter
    def braked(self, braked: bool) -> None:
        self._course.braked = braked

    def follow(self, points: Sequence[TimedJoints]) -> int:
        """Follow a trajectory; see `Arm`."""
        return self._course.follow(points)

    def pace(self, share: float, separation: float | None = None, needed: float = 0.0) -> None:
        """Follow the present trajectory at this share of its speed; see `Arm`."""
        self._course.pace(share, separation, needed)

    def stop(self) -> None:
        """Brake to standstill along the course; see `Arm`."""
        self._course.stop()

    def lead(self, until_ns: int) -> Joints:
        """The angles, rad, that the servos are to have at this instant."""
        self._course.advance(until_ns)
        return self._course.state.joints

    def advance(self, until_ns: int) -> None:  # noqa: ARG002  the base has moved both
        """Take over where the joints are."""
        wanted, (joints, rates) = self._course.state, self._physics.joints
        off = max(abs(a - b) for a, b in zip(joints, wanted.joints, strict=True))
        fastest = max(map(abs, rates))
        self._settles = wanted.moving or (
            self._settles and (off > _SETTLED or fastest > 10.0 * _SETTLED)
        )
        known = self.state
        if max(abs(a - b) for a, b in zip(joints, known.joints, strict=True)) < _SAME:
            joints, rates = known.joints, known.velocities
        state = replace(wanted, joints=joints, velocities=rates, moving=self._settles)
        if state != known:
            self.state = state

    def samples(self, now_ns: int) -> list[Sample]:
        """The joints at this instant."""
        if self._reported == now_ns:
            return []
        self._reported = now_ns
        return [Sample("arm.joints", now_ns, self.state)]
