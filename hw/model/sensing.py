"""The sensors of a robot: their mounts, ranges and rates.

Measurement errors are not part of a robot file: simulated noise is in the profile (`plant`), that
of real sensors shows in their samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Annotated

from engine.files import Angle, Dimension, Length
from engine.files.declared import Fault, Range
from hw.geometry import AnyAngle, Pose2, Pose3

Frequency = Annotated[float, Dimension("frequency"), Range(0.1, 2000.0)]
Offset = Annotated[Length, Range(-5.0, 5.0)]
_TURN = 2.0 * math.pi


@dataclass(frozen=True, slots=True)
class Mount:
    """The mount of an upright sensor: base_from_sensor, m and rad."""

    x: Offset
    """Ahead of base_link."""
    y: Offset
    """To its left."""
    z: Offset = 0.0
    """Above the floor."""
    yaw: AnyAngle = 0.0
    """Counterclockwise from ahead."""

    @property
    def flat(self) -> Pose2:
        """base_from_sensor seen from above."""
        return Pose2(self.x, self.y, self.yaw)

    @property
    def pose(self) -> Pose3:
        """base_from_sensor."""
        return Pose3.from_yaw(self.x, self.y, self.z, self.yaw)

    def moved(self, by: Pose2) -> Mount:
        """The mount shifted by x and y along the base's axes, and turned on the spot by yaw."""
        return replace(self, x=self.x + by.x, y=self.y + by.y, yaw=self.yaw + by.yaw)


@dataclass(frozen=True, slots=True)
class LidarModel:
    """A scanner with a rotating mirror.

    Beams are taken one after another, counterclockwise, so a scan takes the share
    field_of_view / 2 pi of a revolution.
    """

    mount: Mount
    """Where it is, base_from_sensor."""
    beams: Annotated[int, Range(2, 100_000)]
    """How many a scan has, the middle one ahead."""
    field_of_view: Annotated[Angle, Range(0.01, _TURN + 1e-9)]
    """Between the first and the last beam."""
    rate: Frequency
    """Of the mirror."""
    min_range: Annotated[Length, Range(0.0, 10.0)]
    """What is nearer is not seen."""
    max_range: Annotated[Length, Range(0.1, 1000.0)]
    """What is farther is not seen."""

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        if not self.min_range < self.max_range:
            yield "max_range", f"{self.max_range:g} m is not above min_range, {self.min_range:g} m"

    @property
    def start(self) -> float:
        """Direction of the first beam in the sensor's frame, rad."""
        return -0.5 * self.field_of_view

    @property
    def step(self) -> float:
        """Angle from beam to beam, rad; a full circle does not repeat its first beam."""
        closed = self.field_of_view > _TURN - 1e-6
        return self.field_of_view / (self.beams if closed else self.beams - 1)

    @property
    def beam_time(self) -> float:
        """Time from beam to beam, s."""
        return self.step / (_TURN * self.rate)


@dataclass(frozen=True, slots=True)
class TrackerModel:
    """A tracker of the VR system on the rover (R8)."""

    mount: Mount
    """Where it is, base_from_sensor."""
    rate: Frequency = 90.0
    """Of its samples."""


@dataclass(frozen=True, slots=True)
class OdometryModel:
    """Wheel odometry."""

    rate: Frequency = 50.0
    """Of its samples."""


@dataclass(frozen=True, slots=True)
class ImuModel:
    """An inertial sensor: angular rates and accelerations, in the base frame."""

    rate: Frequency = 100.0
    """Of its samples."""


def _none() -> Mapping[str, LidarModel]:
    return MappingProxyType({})


def _no_trackers() -> Mapping[str, TrackerModel]:
    return MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Sensing:
    """The sensors by which a robot can localize itself; each is optional."""

    lidars: Mapping[str, LidarModel] = field(default_factory=_none)
    """Scanners by name."""
    trackers: Mapping[str, TrackerModel] = field(default_factory=_no_trackers)
    """Trackers of the VR system by name."""
    odometry: OdometryModel | None = None
    """Wheel odometry."""
    imu: ImuModel | None = None
    """Angular rates and accelerations."""

    def moved(self, by: Mapping[str, Pose2]) -> Sensing:
        """The same with scanners elsewhere, by name: see `Mount.moved`."""
        lidars = {
            name: replace(model, mount=model.mount.moved(by[name])) if name in by else model
            for name, model in self.lidars.items()
        }
        return replace(self, lidars=lidars)

    def mount(self, lidar: str) -> Pose2:
        """base_from_sensor of a scanner; base_link for one that the robot file does not name."""
        known = self.lidars.get(lidar)
        return Pose2(0.0, 0.0) if known is None else known.mount.flat
