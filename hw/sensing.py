"""What a robot senses with: where its sensors sit, how far they see and how often they speak.

How far measurements are from the truth is no part of a robot file: simulated noise stands in the
profile (`plant`), that of real sensors shows in their samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Annotated

from engine.files.item import Fault
from engine.files.units import Angle, Dimension, Length
from engine.files.values import Range
from hw.geometry import Pose2, Pose3
from hw.places import AnyAngle

Frequency = Annotated[float, Dimension("frequency"), Range(0.1, 2000.0)]
Offset = Annotated[Length, Range(-5.0, 5.0)]
_TURN = 2.0 * math.pi


@dataclass(frozen=True, slots=True)
class Mount:
    """Where an upright sensor sits: base_from_sensor, m and rad."""

    x: Offset
    y: Offset
    z: Offset = 0.0
    yaw: AnyAngle = 0.0

    @property
    def flat(self) -> Pose2:
        """base_from_sensor seen from above."""
        return Pose2(self.x, self.y, self.yaw)

    @property
    def pose(self) -> Pose3:
        """base_from_sensor."""
        return Pose3.from_yaw(self.x, self.y, self.z, self.yaw)


@dataclass(frozen=True, slots=True)
class LidarModel:
    """A scanner with a turning mirror: `beams` over `field_of_view`, the middle one straight ahead.

    `rate` is that of its mirror. Beams are taken one after another, counterclockwise, so that a
    scan takes the share of a turn that its field of view is.
    """

    mount: Mount
    beams: Annotated[int, Range(2, 100_000)]
    field_of_view: Annotated[Angle, Range(0.01, _TURN + 1e-9)]
    rate: Frequency
    min_range: Annotated[Length, Range(0.0, 10.0)]
    max_range: Annotated[Length, Range(0.1, 1000.0)]

    def faults(self) -> Iterator[Fault]:
        """What does not go together, by key."""
        if not self.min_range < self.max_range:
            yield "max_range", f"{self.max_range:g} m is not above min_range, {self.min_range:g} m"

    @property
    def start(self) -> float:
        """Direction of the first beam in the sensor's frame, rad."""
        return -0.5 * self.field_of_view

    @property
    def step(self) -> float:
        """From beam to beam, rad; a full turn does not end where it began."""
        closed = self.field_of_view > _TURN - 1e-6
        return self.field_of_view / (self.beams if closed else self.beams - 1)

    @property
    def beam_time(self) -> float:
        """From beam to beam, s."""
        return self.step / (_TURN * self.rate)


@dataclass(frozen=True, slots=True)
class TrackerModel:
    """A tracker of the VR system on the rover (R8)."""

    mount: Mount
    rate: Frequency = 90.0


@dataclass(frozen=True, slots=True)
class OdometryModel:
    """Way and velocity as the wheels measure them."""

    rate: Frequency = 50.0


@dataclass(frozen=True, slots=True)
class ImuModel:
    """Rates of turn and accelerations, in the base frame."""

    rate: Frequency = 100.0


def _none() -> Mapping[str, LidarModel]:
    return MappingProxyType({})


def _no_trackers() -> Mapping[str, TrackerModel]:
    return MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Sensing:
    """All sensors of a robot by which it can find out where it is; each may be missing."""

    lidars: Mapping[str, LidarModel] = field(default_factory=_none)
    trackers: Mapping[str, TrackerModel] = field(default_factory=_no_trackers)
    odometry: OdometryModel | None = None
    imu: ImuModel | None = None

    def turned(self, yaws: Mapping[str, float]) -> Sensing:
        """The same with scanners turned by so much against their mounts, rad, by their names."""
        lidars = {
            name: replace(model, mount=replace(model.mount, yaw=model.mount.yaw + yaws[name]))
            if name in yaws
            else model
            for name, model in self.lidars.items()
        }
        return replace(self, lidars=lidars)

    def mount(self, lidar: str) -> Pose2:
        """base_from_sensor of a scanner; one that the robot file does not name is in base_link."""
        known = self.lidars.get(lidar)
        return Pose2(0.0, 0.0) if known is None else known.mount.flat
