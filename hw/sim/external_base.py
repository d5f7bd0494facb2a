"""A base and an arm moved from outside: fakes report their motors, and the bodies follow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from hw.geometry import STILL, Pose2, Twist2, total
from hw.model import BaseModel, MotionLimits, RobotModel
from hw.safety import CYCLE_NS
from hw.samples import ArmState, Joints, Sample, TimedJoints
from hw.sim.sim_base import SimBase
from hw.sim.wheel_cycles import step_once

SILENT_NS = 100_000_000
"""Motors that are silent for longer count as standing, ns."""
MOVING = 1e-3
"""Joint speed above which the arm counts as moving, rad/s."""
WHEELS = 4
"""Front left, front right, rear left, rear right; positive rates drive forwards."""


def twist_of(rates: Sequence[float], base: BaseModel) -> Twist2:
    """The velocity (base frame) of a base with four wheels at these rates, rad/s.

    The least-squares inverse of r w = vx -+ vy -+ (L + W) wz, with the half wheelbase L and the
    half track W; see `hw.drivers.can.mecanum`, with which it deliberately shares no code. Without
    rollers the wheels do not go sideways, and their lever is W.
    """
    left, right, rear_left, rear_right = rates
    share = 0.25 * base.wheel_radius
    return Twist2(
        share * (left + right + rear_left + rear_right),
        share * (right + rear_left - left - rear_right) if base.sideways else 0.0,
        share * (right + rear_right - left - rear_left) / base.lever,
    )


class HostedBase(SimBase):
    """A body driven by reported wheel rates; it slips if the floor is slippery.

    A body held by a solid obstacle stays there as long as the wheels push against it.
    """

    def __init__(self, robot: RobotModel, limits: MotionLimits, start: Pose2) -> None:
        super().__init__(robot, limits, start)
        self._heard: tuple[int, Twist2] = (-SILENT_NS, STILL)
        self._against: tuple[float, float, float] | None = None
        self._corner = robot.base.lever

    @property
    def held(self) -> bool:
        """True while the wheels push against an obstacle."""
        return self._against is not None

    def turn(self, stamp_ns: int, rates: Sequence[float]) -> None:
        """Set the wheel rates, rad/s, from now on.

        Raises:
            ValueError: other than four finite numbers.
        """
        if len(rates) != WHEELS or not all(map(math.isfinite, rates)):
            raise ValueError(f"wheels: {tuple(rates)} are not {WHEELS} finite rates")
        self._heard = stamp_ns, twist_of(rates, self._model)

    def block(self, pose: Pose2) -> None:
        """An obstacle holds the base, or the operator pushes it: it stands at this pose."""
        self._against = self._velocity(self.twist) if self.twist != STILL else None
        super().block(pose)

    def advance(self, until_ns: int) -> None:
        """Advance to until_ns."""
        stamp, twist = self._heard
        if until_ns - stamp > SILENT_NS:
            twist = STILL
        if self._against is not None:
            pushing = total(
                a * b for a, b in zip(self._against, self._velocity(twist), strict=True)
            )
            if pushing > 0.0:
                twist = STILL
            else:
                self._against = None
        instants = [*range(self._now, until_ns, CYCLE_NS), until_ns]
        for since, until in pairwise(instants):
            self._accelerate(twist, since, until)
        self._now = until_ns

    def _accelerate(self, twist: Twist2, since_ns: int, until_ns: int) -> None:
        """Change to this velocity (base frame) evenly until then."""
        if twist == STILL == self.twist:
            if self._tracks is not None:
                self._note(until_ns, *self._tracks)
            return
        h, yaw = (until_ns - since_ns) * 1e-9, float(self._body["place"][0, 2])
        vx, vy, wz = self._body["velocity"][0].tolist()
        turn = 0.5 * (wz + twist.wz) * h
        ahead = twist.rotated(yaw + turn)
        way_x, way_y = 0.5 * (vx + ahead.vx) * h, 0.5 * (vy + ahead.vy) * h
        motion = (way_x, way_y, turn, (ahead.vx, ahead.vy, twist.wz))
        self._take(step_once(self._body, until_ns, motion))
        self.twist = twist

    def _velocity(self, twist: Twist2) -> tuple[float, float, float]:
        """The velocity in the map, with the rotation as the speed of a corner, m/s."""
        there = twist.rotated(self.pose.yaw)
        return there.vx, there.vy, twist.wz * self._corner


class HostedArm:
    """An arm at the joint angles that a controller reports."""

    signals: tuple[str, ...] = ("arm.joints",)

    def __init__(self, joints: Joints) -> None:
        self.state = ArmState(joints, (0.0,) * len(joints))
        self.braked = False
        self._heard: tuple[int, Joints] = (0, joints)

    def on_joints(self, stamp_ns: int, joints: Joints) -> None:
        """Take the controller's joint angles, rad.

        Raises:
            ValueError: wrong number of joints, or not finite.
        """
        if len(joints) != len(self.state.joints) or not all(map(math.isfinite, joints)):
            raise ValueError(f"joints: {joints} are not {len(self.state.joints)} finite angles")
        since, before = self._heard
        if stamp_ns <= since:
            return
        self._heard = stamp_ns, joints
        span = (stamp_ns - since) * 1e-9
        rates = tuple((b - a) / span for a, b in zip(before, joints, strict=True))
        self.state = ArmState(joints, rates, moving=max(map(abs, rates)) > MOVING)

    def advance(self, until_ns: int) -> None:
        """Nothing to do: the reported angles move it."""

    def samples(self, now_ns: int) -> list[Sample]:
        """The joints at this instant."""
        return [Sample("arm.joints", now_ns, self.state)]

    def follow(self, points: Sequence[TimedJoints]) -> int:  # noqa: ARG002
        """Takes no trajectories: the reported angles move it."""
        return 0

    def pace(self, share: float, separation: float | None = None, needed: float = 0.0) -> None:
        """Nothing to do: the reported angles move it."""

    def stop(self) -> None:
        """Nothing to do: the reported angles move it."""
