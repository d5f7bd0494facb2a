"""The robot as MuJoCo moves it: driven wheels on a floor, and an arm by its servos."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from hw.geometry import Pose2, Twist2
from hw.model import BaseModel, RobotModel, Slip
from hw.samples import Joints
from hw.sim.physics.mechanics import WHEELS, Mechanics, WheelGeometry
from hw.sim.physics.robot_mjcf import robot_mjcf

Floats = NDArray[np.float64]
_DRIVES = 2 * len(WHEELS)
"""So many controls are those of the drives, the rest are torques of the arm."""


class RobotBody:
    """A robot at a pose (map_from_base), its arm at these joints; it stands.

    `slip` says how much of the way the floor takes (`WheelGeometry`); what wheels lose in speeding
    up and braking follows from friction, and patches of the floor are left out.
    `model` and `data` are MuJoCo's.
    """

    def __init__(
        self,
        robot: RobotModel,
        start: Pose2,
        joints: Joints = (),
        slip: Slip | None = None,
        mechanics: Mechanics | None = None,
    ) -> None:
        mechanics = mechanics or Mechanics()
        text = robot_mjcf(robot, mechanics, WheelGeometry.on(robot.base, slip))
        self.model = model = mujoco.MjModel.from_xml_string(text)
        self.data = data = mujoco.MjData(model)
        self._base, self._step = robot.base, mechanics.step
        joint = [model.joint(n) for n in range(model.njnt)]
        places = {j.name: (int(j.qposadr[0]), int(j.dofadr[0])) for j in joint}
        count = len(robot.arm.model.joints) if robot.arm is not None else 0
        self._rollers, _ = _indices(places, "roller", len(WHEELS))
        self._hubs, self._hub_rates = _indices(places, "hub", len(WHEELS))
        self._joints, self._joint_rates = _indices(places, "joint", count)
        self._bandwidth = 2.0 * math.pi * mechanics.servo_bandwidth
        self._inertia: Floats = np.zeros((model.nv, model.nv))
        self._led: Floats = np.array(joints)
        data.qpos[self._joints] = joints
        self.place(start)
        mujoco.mj_forward(model, data)

    @property
    def pose(self) -> Pose2:
        """map_from_base."""
        x, y, _, w, i, j, k = self.data.qpos[:7].tolist()
        return Pose2(x, y, math.atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k)))

    @property
    def wheel_angles(self) -> Floats:
        """(4,): front left, front right, rear left, rear right, rad; positive drives forwards."""
        angles: Floats = self.data.qpos[self._hubs]
        return angles

    @property
    def wheel_power(self) -> float:
        """What the drives take or brake now, W."""
        torques, rates = self.data.qfrc_actuator, self.data.qvel
        return float(np.abs(torques[self._hub_rates] * rates[self._hub_rates]).sum())

    @property
    def joints(self) -> tuple[Joints, Joints]:
        """Joint angles, rad, and rates, rad/s."""
        data = self.data
        return tuple(data.qpos[self._joints].tolist()), tuple(data.qvel[self._joint_rates].tolist())

    def place(self, pose: Pose2) -> None:
        """Put the base there; it and its wheels stand."""
        data = self.data
        data.qpos[:3] = pose.x, pose.y, data.qpos[2]
        data.qpos[3:7] = math.cos(0.5 * pose.yaw), 0.0, 0.0, math.sin(0.5 * pose.yaw)
        data.qvel[: self._joint_rates[0] if len(self._joint_rates) else None] = 0.0
        data.act[:] = data.qpos[self._hubs]

    def move(self, twist: Twist2, joints: Joints, span_s: float) -> None:
        """Move on by this time, s, in equal steps of about `Mechanics.step`.

        The drives hold the wheel rates of this velocity (base frame). The servos are led evenly to
        these angles, rad.
        """
        model, data, rollers = self.model, self.data, self._rollers
        steps = max(1, round(span_s / self._step))
        model.opt.timestep = span_s / steps
        wheels = wheel_rates(twist, self._base)
        data.ctrl[:_DRIVES] = wheels + wheels
        wanted, inertia = np.array(joints), self._joint_inertia()
        change = wanted - self._led
        for n in range(steps):
            led = self._led + change * (n / steps)
            data.ctrl[_DRIVES:] = self._torques(led, change / span_s, inertia)
            mujoco.mj_step(model, data)
            data.qpos[rollers] = 0.0
        self._led = wanted

    def _joint_inertia(self) -> Floats:
        """(6, 6): the inertia of the arm in its joints, kg m2."""
        mujoco.mj_fullM(self.model, self.data, self._inertia)
        found: Floats = self._inertia[np.ix_(self._joint_rates, self._joint_rates)]
        return found

    def _torques(self, joints: Floats, rates: Floats, inertia: Floats) -> Floats:
        """What the servos are to apply, Nm, to have these angles, rad, and rates, rad/s.

        Computed torque, as a controller does that knows its arm (Siciliano, Robotics, 8.5.2):
        M (k^2 e + 2 k e') and the torques of gravity and motion, so that errors e die down
        critically with the bandwidth k, whatever the arm's pose.
        """
        data, k = self.data, self._bandwidth
        off, rate = joints - data.qpos[self._joints], rates - data.qvel[self._joint_rates]
        found: Floats = inertia @ (k * k * off + 2.0 * k * rate) + data.qfrc_bias[self._joint_rates]
        return found


def _indices(
    places: dict[str, tuple[int, int]], kind: str, count: int
) -> tuple[list[int], list[int]]:
    """Indices of joints of one kind in positions and velocities."""
    found = [places[f"{kind}_{n}"] for n in range(count)]
    return [position for position, _ in found], [velocity for _, velocity in found]


def wheel_rates(twist: Twist2, base: BaseModel) -> tuple[float, ...]:
    """The rates of the wheels, rad/s, at which the base has this velocity without slip."""
    return tuple(
        (twist.vx + sign * twist.vy - left * base.lever * twist.wz) / base.wheel_radius
        for _, left, sign in WHEELS
    )
