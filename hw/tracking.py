"""How the tracking system of the VR side lies in the map, and the rover's trackers on the rover.

Where tracking works, the person, their hands and where they reach are known in its frame alone, so
that this relation decides how near prop and hand come. A restart of the tracking may turn it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from hw.geometry import Pose2, Pose3
from hw.samples import TrackerPose
from hw.sensing import Sensing

_HERE = Pose3(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Tracking:
    """Calibrated poses: `map_from_vive`, and base_from_tracker by the tracker's name."""

    map_from_vive: Pose3 = _HERE
    mounts: Mapping[str, Pose3] = field(default_factory=lambda: MappingProxyType({}))

    @classmethod
    def of(cls, sensing: Sensing) -> Tracking:
        """Trackers as the robot file has them, in a tracking frame that is the map's."""
        return cls(mounts={name: model.mount.pose for name, model in sensing.trackers.items()})

    def base_by(self, seen: TrackerPose) -> Pose2 | None:
        """map_from_base by one tracker; None: nobody knows where it sits."""
        mount = self.mounts.get(seen.tracker)
        if mount is None:
            return None
        return (self.map_from_vive @ seen.pose @ mount.inverse()).flat()
