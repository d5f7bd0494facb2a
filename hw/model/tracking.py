"""The pose of the VR tracking system in the map, and the mounts of trackers on the rover.

Person, hands and DEEP are known in the tracking system's frame only, so this relation decides how
close prop and hand meet. A restart of the tracking system may rotate it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from hw.geometry import Pose2, Pose3
from hw.model.sensing import Sensing
from hw.samples import TrackerPose

_HERE = Pose3(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Tracking:
    """Calibrated poses: `map_from_vive`, and base_from_tracker by the tracker's name."""

    map_from_vive: Pose3 = _HERE
    mounts: Mapping[str, Pose3] = field(default_factory=lambda: MappingProxyType({}))

    @classmethod
    def of(cls, sensing: Sensing) -> Tracking:
        """The trackers of the robot file, in a tracking frame equal to the map."""
        return cls(mounts={name: model.mount.pose for name, model in sensing.trackers.items()})

    def moved(self, by: Mapping[str, Pose2]) -> Tracking:
        """The same with trackers elsewhere, by name: shifted along the base's axes, and turned."""
        mounts = dict(self.mounts)
        for name in mounts.keys() & by.keys():
            at, off = mounts[name], by[name]
            turned = Pose3.from_yaw(0.0, 0.0, 0.0, off.yaw) @ replace(at, x=0.0, y=0.0, z=0.0)
            mounts[name] = replace(turned, x=at.x + off.x, y=at.y + off.y, z=at.z)
        return replace(self, mounts=mounts)

    def base_by(self, seen: TrackerPose) -> Pose2 | None:
        """map_from_base from one tracker; None if its mount is unknown."""
        mount = self.mounts.get(seen.tracker)
        if mount is None:
            return None
        return (self.map_from_vive @ seen.pose @ mount.inverse()).flat()
