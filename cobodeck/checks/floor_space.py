"""What `space` and `doctor --scene` report of a room or map with a profile's values (R126)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cobodeck.terminal import Problem

if TYPE_CHECKING:
    from behaviors.profile import Profile
    from states.floors import MapFloor, RoomFloor, Space, Untouchable


@dataclass(frozen=True)
class FloorReport:
    """A measured room or map.

    `untouchable` considers only Haptic poses that Haptic can drive to. `wall_ahead`: for each
    Haptic pose, by its angle in whole degrees, the distance that a user facing a wall must keep
    from it, m. `shortcoming` says why the floor is too small for all behaviours; None: it is large
    enough.
    """

    name: str
    floor: RoomFloor | MapFloor
    corners: str
    space: Space
    untouchable: Untouchable
    wall_ahead: Mapping[int, float]
    shortcoming: str | None
    remarks: tuple[str, ...] = ()


def floor_report(
    place: str, profile: Profile, *, inflation: float | None = None, corners: str = "round"
) -> FloorReport:
    """Measure a scene or map.

    Args:
        place: name or file.
        profile: gives Haptic poses, tolerance and inflation.
        inflation: distance kept from walls, m; None: that of the profile's Haptic subsystem.
        corners: how a room is inflated around corners, "round" or "square".

    Raises:
        Problem: square corners are requested for a map.
        FileError: the scene or map is wrong.
    """
    from states.floors import measure, room_ahead, shortcoming, without_haptic_pose

    drive, haptic = profile.navigation.haptic, profile.settings.haptic
    name, floor, remarks = _floor(place, corners)
    kept = drive.inflation if inflation is None else inflation
    poses = haptic_places(profile)
    # drives keep out of the disc around the user, so poses inside it cannot be reached
    drivable = [pose for pose in poses if math.hypot(*pose) >= drive.user_radius]
    return FloorReport(
        name,
        floor,
        corners,
        measure(floor, kept),
        without_haptic_pose(floor, drivable, kept),
        {
            round(math.degrees(abs(angle))): room_ahead(pose, kept, drive.tolerance)
            for angle, pose in zip(haptic.angles, poses, strict=True)
        },
        shortcoming(floor, kept),
        remarks,
    )


def haptic_places(profile: Profile) -> list[tuple[float, float]]:
    """Positions of the Haptic rover poses in the user's frame, x ahead and y left, m."""
    from behaviors import all_poses
    from hw import Pose3

    haptic = profile.settings.haptic
    deep = Pose3.from_yaw(haptic.deep_ahead, 0.0, haptic.deep_height, 0.0)
    return [(pose.x, pose.y) for pose in all_poses(haptic, deep)]


def _floor(place: str, corners: str) -> tuple[str, RoomFloor | MapFloor, tuple[str, ...]]:
    from cobodeck.setup import is_map
    from hw.scene import load_scene
    from states.floors import RoomFloor

    if not is_map(place):
        scene = load_scene(place)
        return scene.name, RoomFloor(scene.room, "square" if corners == "square" else "round"), ()
    if corners == "square":
        raise Problem(f"{place}: a map is inflated cell by cell, with round corners only")
    from states.floors import MapFloor
    from states.maps import load_floor

    map_ = load_floor(place)
    return Path(place).stem, MapFloor(map_), map_.remarks
