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
    """Scanners: standard deviation of a range, share of outliers, delay after the last beam.

    Half of the outliers are lost, half return from somewhere before the target.
    """

    noise: Spread = 0.02
    outliers: Share = 0.01
    delay: Lag = 0.0


@dataclass(frozen=True, slots=True)
class Slip:
    """How the body slips against the wheels; the defaults are for linoleum.

    Shares of the distance ahead (`along`), sideways (`across`; the rollers of Mecanum wheels) and
    of rotations (`turning`) are lost for good, each with a spread `patchy` from patch to patch of
    the floor, `patch` m long. A change of velocity dv leaves the body behind by dv times `pulling`
    s when speeding up, or carries it on by dv times `braking` s, so that it overshoots a stop
    (R146).
    """

    along: Share = 0.01
    across: Share = 0.05
    turning: Share = 0.04
    patchy: Share = 0.1
    patch: Annotated[Length, Range(0.01, 10.0)] = 0.3
    pulling: Annotated[Duration, Range(0.0, 0.5)] = 0.02
    braking: Annotated[Duration, Range(0.0, 0.5)] = 0.04


@dataclass(frozen=True, slots=True)
class OdometryErrors:
    """Wheel encoders: white noise of the velocities, and the delay until they arrive."""

    noise: Annotated[Speed, Range(0.0, 1.0)] = 0.005
    turn_noise: Annotated[AngularSpeed, Range(0.0, 1.0)] = 0.005
    delay: Lag = 0.0


@dataclass(frozen=True, slots=True)
class ImuErrors:
    """Angular rates and accelerations: white noise of each sample, and a bias per run.

    The bias of the rates is a random walk of `rate_walk` in one second, growing with sqrt(time).
    """

    rate_noise: Rate = 0.002
    rate_bias: Rate = 0.002
    rate_walk: Rate = 0.0001
    noise: Annotated[Acceleration, Range(0.0, 10.0)] = 0.05
    bias: Annotated[Acceleration, Range(0.0, 10.0)] = 0.02
    delay: Lag = 0.0


@dataclass(frozen=True, slots=True)
class ViveErrors:
    """Trackers, the person's included; `noise` and `turn_noise` are white.

    A device is tracked where at least `stations` of the base stations see it; these hang in the
    corners of the tracked area, or see the person everywhere if the scene says so. In the outermost
    `edge` of the area positions are off by up to `edge_bias`. Each device is lost about every
    `lost_every` for up to `lost_for`. If it is found again while no other is in view, it is off by
    a length and an angle in the ranges `jump` and `jump_turn`, until it is lost again.

    While the person's own tracker is lost and their headset is visible, the VR side derives the
    body from the headset, off by up to `by_headset`; 0: it reports no pose meanwhile.

    `restart`: the pose of the tracking frame relative to its calibration, as after a restart of the
    tracking system; poses of the person in the map use the calibration.
    """

    noise: Annotated[Length, Range(0.0, 0.2)] = 0.001
    turn_noise: Turned = 0.0005
    stations: Annotated[int, Range(1, 4)] = 2
    station_height: Annotated[Length, Range(0.5, 10.0)] = 2.5
    edge: Annotated[Length, Range(0.01, 5.0)] = 0.7
    edge_bias: Annotated[Length, Range(0.0, 0.5)] = 0.06
    lost_every: Annotated[Duration, Range(1.0, 1e6)] = 60.0
    lost_for: Annotated[Duration, Range(0.0, 30.0)] = 0.5
    jump: tuple[Spread, Spread] = (0.015, 0.047)
    jump_turn: tuple[Turned, Turned] = (math.radians(1.3), math.radians(1.8))
    by_headset: Annotated[Length, Range(0.0, 0.5)] = 0.05
    restart: Pose = _WHERE_IT_WAS
    delay: Lag = 0.01

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
    """All error models; `slip` null: a floor without slip.

    `mount_error`: by scanner or tracker, the true mount less that of the robot file, or of the
    calibration: x and y along the axes of the base, and yaw. Only the simulator knows of it.
    """

    lidar: LidarErrors = LidarErrors()
    odometry: OdometryErrors = OdometryErrors()
    imu: ImuErrors = ImuErrors()
    vive: ViveErrors = ViveErrors()
    slip: Slip | None = Slip()
    mount_error: Mapping[str, Pose] = field(default_factory=dict)
