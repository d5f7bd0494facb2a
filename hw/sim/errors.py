"""How far simulated sensors are from the truth; figures of the profile (`plant.sensing`).

The defaults are those of the shipped profiles, from data sheets and measured logs: a safety laser
scanner, Mecanum wheels on linoleum, an industrial IMU, SteamVR tracking with two generations of
base stations in the corners of the tracked area.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from engine.files.units import Angle, AngularSpeed, Duration, Length, Ratio, Speed
from engine.files.values import Range

Share = Annotated[Ratio, Range(0.0, 0.5)]
Spread = Annotated[Length, Range(0.0, 1.0)]
Lag = Annotated[Duration, Range(0.0, 1.0)]
Turned = Annotated[Angle, Range(0.0, 1.0)]


@dataclass(frozen=True, slots=True)
class LidarErrors:
    """Of scanners: standard deviation of a range, share of outliers, time from the last beam on.

    Half of the outliers are lost, half come back from somewhere before the target.
    """

    noise: Spread = 0.02
    outliers: Share = 0.01
    delay: Lag = 0.0


@dataclass(frozen=True, slots=True)
class Slip:
    """How the body lags behind the wheels; these are the figures of linoleum.

    Lost for good are shares of the way ahead (`along`), sideways (`across`; the rollers of Mecanum
    wheels) and of turns (`turning`), each with a spread `patchy` from patch to patch of the floor,
    `patch` m long. A change of velocity dv leaves the body behind by dv times `pulling` s, or
    carries it on by dv times `braking` s, so that it overshoots where it stops (R146).
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
    """Of the wheels' encoders: white noise of speeds, and the time until they are heard."""

    noise: Annotated[Speed, Range(0.0, 1.0)] = 0.005
    turn_noise: Annotated[AngularSpeed, Range(0.0, 1.0)] = 0.005
    delay: Lag = 0.0


@dataclass(frozen=True, slots=True)
class SensorErrors:
    """All of them; `slip` null: a floor on which no wheel slips."""

    lidar: LidarErrors = LidarErrors()
    odometry: OdometryErrors = OdometryErrors()
    slip: Slip | None = Slip()
