"""Error models of simulated sensors; the profile has their figures (`plant.sensing`).

The defaults are those of the shipped profiles, from data sheets and measured logs: a safety laser
scanner, Mecanum wheels on linoleum, an industrial IMU, SteamVR tracking with two generations of
base stations in the corners of the tracked area.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated

from engine.files import Acceleration, Angle, AngularSpeed, Duration, Length, Ratio, Speed
from engine.files.declared import Fault, Range
from hw.geometry import Pose2
from hw.places import Pose

Share = Annotated[Ratio, Range(0.0, 0.5)]
Spread = Annotated[Length, Range(0.0, 1.0)]
Lag = Annotated[Duration, Range(0.0, 1.0)]
Rate = Annotated[AngularSpeed, Range(0.0, 1.0)]
Turned = Annotated[Angle, Range(0.0, 1.0)]


_WHERE_IT_WAS = Pose2(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class LidarErrors:
    """Scanners."""

    noise: Spread = 0.02
    """Standard deviation of a range."""
    outliers: Share = 0.01
    """Share of outliers: half are lost, half return from before the target."""
    delay: Lag = 0.0
    """From the last beam to arrival."""


@dataclass(frozen=True, slots=True)
class Slip:
    """How the body slips against the wheels, for good; the defaults are for linoleum."""

    along: Share = 0.01
    """Share of the way ahead that is lost."""
    across: Share = 0.05
    """Share of the way aside that is lost, by the rollers of Mecanum wheels."""
    turning: Share = 0.04
    """Share of rotations that is lost."""
    patchy: Share = 0.1
    """Spread of these shares from patch to patch of the floor."""
    patch: Annotated[Length, Range(0.01, 10.0)] = 0.3
    """Length of a patch."""
    pulling: Annotated[Duration, Range(0.0, 0.5)] = 0.02
    """Speeding up by dv leaves the body behind by dv times this."""
    braking: Annotated[Duration, Range(0.0, 0.5)] = 0.04
    """Slowing by dv carries it on by dv times this, beyond a stop (R146)."""


@dataclass(frozen=True, slots=True)
class OdometryErrors:
    """Wheel encoders."""

    noise: Annotated[Speed, Range(0.0, 1.0)] = 0.005
    """White, of the velocities."""
    turn_noise: Annotated[AngularSpeed, Range(0.0, 1.0)] = 0.005
    """White, of the yaw rate."""
    delay: Lag = 0.0
    """Until they arrive."""


@dataclass(frozen=True, slots=True)
class ImuErrors:
    """An inertial sensor: angular rates and accelerations."""

    rate_noise: Rate = 0.002
    """White, of each rate."""
    rate_bias: Rate = 0.002
    """Of the rates, per run."""
    rate_walk: Rate = 0.0001
    """Of the rates' bias in one second, growing with sqrt(time)."""
    noise: Annotated[Acceleration, Range(0.0, 10.0)] = 0.05
    """White, of each acceleration."""
    bias: Annotated[Acceleration, Range(0.0, 10.0)] = 0.02
    """Of the accelerations, per run."""
    delay: Lag = 0.0
    """Until they arrive."""


@dataclass(frozen=True, slots=True)
class ViveErrors:
    """Trackers, the person's included.

    A scene may say that base stations see the person everywhere. A jump lasts until the device is
    lost again. Poses of the person in the map use the calibration.
    """

    noise: Annotated[Length, Range(0.0, 0.2)] = 0.001
    """White, of positions."""
    turn_noise: Turned = 0.0005
    """White, of angles."""
    stations: Annotated[int, Range(1, 4)] = 2
    """So many base stations have to see a device."""
    station_height: Annotated[Length, Range(0.5, 10.0)] = 2.5
    """They hang this high, in the corners of the tracked area."""
    edge: Annotated[Length, Range(0.01, 5.0)] = 0.7
    """The outermost part of the area, where positions are off."""
    edge_bias: Annotated[Length, Range(0.0, 0.5)] = 0.06
    """By up to so much there."""
    lost_every: Annotated[Duration, Range(1.0, 1e6)] = 60.0
    """Each device is lost about as often."""
    lost_for: Annotated[Duration, Range(0.0, 30.0)] = 0.5
    """For up to so long."""
    jump: tuple[Spread, Spread] = (0.015, 0.047)
    """Found again with no other in view it is off by a length in this range."""
    jump_turn: tuple[Turned, Turned] = (math.radians(1.3), math.radians(1.8))
    """And by an angle in this range."""
    by_headset: Annotated[Length, Range(0.0, 0.5)] = 0.05
    """While only the headset is visible, the body derived from it is off by up to this; 0: no pose
    meanwhile."""
    restart: Pose = _WHERE_IT_WAS
    """The pose of the tracking frame against its calibration, as after a restart."""
    delay: Lag = 0.01
    """Until they arrive."""

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        if self.lost_for >= self.lost_every:
            yield "lost_for", f"{self.lost_for:g} s is not below lost_every, {self.lost_every:g} s"
        for key in ("jump", "jump_turn"):
            least, most = getattr(self, key)
            if least > most:
                yield key, f"the first, {least:g}, is above the second, {most:g}"


@dataclass(frozen=True, slots=True)
class SensorErrors:
    """All error models."""

    lidar: LidarErrors = LidarErrors()
    """Scanners."""
    odometry: OdometryErrors = OdometryErrors()
    """Wheel encoders."""
    imu: ImuErrors = ImuErrors()
    """The inertial sensor."""
    vive: ViveErrors = ViveErrors()
    """Trackers, the person's included."""
    slip: Slip | None = Slip()
    """Of the wheels; null: a floor without slip."""
    mount_error: Mapping[str, Pose] = field(default_factory=dict)
    """By scanner or tracker: the true mount less that of the robot file, or of the calibration; x
    and y along the axes of the base. Only the simulator knows of it."""
