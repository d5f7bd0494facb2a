"""What the physics needs beyond the robot file: drives, tyres and servos, each with its source."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hw.model import BaseModel, RobotModel, Slip

GRAVITY = 9.81
"""m/s2."""
WHEELS = ((1, 1, -1), (1, -1, 1), (-1, 1, 1), (-1, -1, -1))
"""Front left, front right, rear left, rear right: ahead or behind, left or right, and the sign of
the roller on the ground, whose axis is (1, sign) in the base frame for the usual 45 degrees."""


@dataclass(frozen=True, slots=True)
class WheelGeometry:
    """Where the wheels touch the floor, m, and the tangent of their rollers' angle on it.

    That of the robot file, unless shares of the way are lost on this floor (`Slip`): they are lost
    at constant speed, too, without a force, as wheels are pressed flat and rollers touch beside
    their middle. While the wheels turn as for vx, vy, wz by the file's radius r, half wheelbase l
    and half track w, the body goes (1 - along) vx, (1 - across) vy, (1 - turning) wz. By the
    kinematics in `robot_mjcf`, with r', w' and the tangent t' of the rollers' angle on the floor,

        r' / r = 1 - along,  t' (1 - across) = r' / r,  (t' l + w') (1 - turning) = (l + w) r' / r

    The losses on linoleum are 1.3 mm of the radius, 46.2 degrees, and contacts 4 mm further out.
    """

    radius: float
    half_wheelbase: float
    half_track: float
    tangent: float

    @classmethod
    def on(cls, base: BaseModel, slip: Slip | None) -> WheelGeometry:
        """That of a base on a floor; None: one without losses."""
        length, width = base.lever - base.half_track, base.half_track
        if slip is None:
            return cls(base.wheel_radius, length, width, 1.0)
        share = 1.0 - slip.along
        tangent = share / (1.0 - slip.across)
        track = share * (length + width) / (1.0 - slip.turning) - tangent * length
        return cls(share * base.wheel_radius, length, track, tangent)


@dataclass(frozen=True, slots=True)
class Mechanics:
    """Masses in kg, kg m2; the floor; drives and servos.

    Robot files do not have them. None is fitted to runs of the other tiers.
    """

    step: float = 0.002
    """Of the physics, s, nearly: a cycle of the chain has a whole number of steps."""
    friction: float = 0.6
    """Coulomb friction of polyurethane rollers on linoleum: 0.5 to 0.7 in tables of materials. The
    grip of a Mecanum base ahead is friction * g / sqrt(2), here 4.2 m/s2."""
    roller_mass: float = 0.1
    """Of a roller, felt at its rim, kg: an estimate from its size."""
    wheel_inertia: float = 0.07
    """A wheel of 4 kg (0.03) and the rotor of a motor of 500 W, 1e-4 times 20 squared (0.04)."""
    wheel_power: float = 500.0
    """Of each of the four motors, W (Robotnik's data sheet): its torque is power / fastest rate."""
    drive_bandwidth: float = 10.0
    """Of the velocity loop of a drive with its load, Hz: a common tuning, 16 ms of lag."""
    drive_reset: float = 0.08
    """Reset time of its integral part, s: five times the lag, so that it does not overshoot."""
    servo_bandwidth: float = 8.0
    """Of the arm's joints, Hz. UR publishes no gains; an arm that speeds up by a is behind by
    a / (2 pi 8 Hz)^2, 2 mrad at 5 rad/s2."""
    rotor_inertia: float = 0.1
    """Of an arm's motor behind its gear, kg m2, as MuJoCo Menagerie has it for the UR10e."""

    def wheel_torque(self, base: BaseModel) -> float:
        """The greatest torque of a wheel, Nm."""
        return self.wheel_power * base.wheel_radius / base.rim_speed

    def drive_gains(self, robot: RobotModel) -> tuple[float, float]:
        """Proportional and integral gain of a drive, Nm s/rad and Nm/rad.

        Straight ahead a wheel of radius r moves a quarter of the mass m, so that the loop of gain k
        on the inertia J + m r^2 / 4 has the bandwidth k / (2 pi (J + m r^2 / 4)).
        """
        load = self.wheel_inertia + 0.25 * robot.mass * robot.base.wheel_radius**2
        gain = 2.0 * math.pi * self.drive_bandwidth * load
        return gain, gain / self.drive_reset
