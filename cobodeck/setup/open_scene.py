"""Where something is run: a scene by name or file, or a map in map_server's format.

A map becomes a scene without a person: its room is the map's outline, cleaned up; the robot starts
in an open place, or at the pose given as `FILE@x,y,yaw` (m, rad).
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from behaviors.profile import Profile
from cobodeck.terminal import Problem
from engine.files import read_file
from hw import Pose2
from hw.model import RobotModel
from hw.scene import Room, Scene, load_scene
from states.environment import Environment

if TYPE_CHECKING:
    from states.maps import OccupancyMap

EXACT_CORNERS = 1200
"""Largest number of corners for which the planner `exact` is built within a second (0.2 s for a
scanned office of 861, 0.5 s for a hall of 1004)."""
ROBOT = "rbkairos_ur10"


class RunPlace(NamedTuple):
    """A scene, and the map that it was made from, if any."""

    scene: Scene
    map: OccupancyMap | None = None

    @property
    def remarks(self) -> tuple[str, ...]:
        """What users should know before they run something here."""
        told = () if self.map is None else self.map.remarks
        corners = len(self.scene.room.segments)
        if corners > EXACT_CORNERS:
            told += (f"{corners} corners are too many for the planner exact; theta_star is used",)
        return tuple(f"{self.scene.name}: {remark}" for remark in told)


def open_place(name: str) -> RunPlace:
    """A scene, or a map turned into one.

    Raises:
        Problem: the start is not on a map's floor.
        FileError: a file is wrong, or a map has no free floor.
    """
    file, _, start = name.partition("@")
    if not is_map(file):
        return RunPlace(load_scene(name))
    from states.maps import load_floor, room_of, start_in

    map_ = load_floor(file)
    room = room_of(map_)
    pose = _start(name, start, room) if start else start_in(map_)
    about = f"the map {Path(file).name}"
    scene = Scene(Path(file).stem, about, room, ROBOT, pose, folder=Path(file).parent)
    return RunPlace(scene, map_)


def is_map(file: str) -> bool:
    """Whether a YAML file is a map, that is, has the key `image`; False if there is no file."""
    if not Path(file).is_file():
        return False
    source = read_file(Path(file))
    return isinstance(source.value, dict) and "image" in source.value


def environment_at(place: RunPlace, profile: Profile, robot: RobotModel) -> Environment:
    """The states' environment; above `EXACT_CORNERS` its planners work on cells."""
    environment = profile.environment(place.scene.room, robot)
    if len(place.scene.room.segments) > EXACT_CORNERS:
        environment = replace(environment, navigation=environment.navigation.on_cells())
    return replace(environment, map=place.map, zones=place.scene.zones)


def _start(name: str, text: str, room: Room) -> Pose2:
    try:
        x, y, yaw = (float(part) for part in (*text.split(","), "0")[:3])
    except ValueError:
        raise Problem(f"{name}: after @ the start is needed as x,y or x,y,yaw (m, rad)") from None
    if not (math.isfinite(x + y + yaw) and room.is_free(x, y)):
        raise Problem(f"{name}: ({x:g}, {y:g}) is not on the free floor of the map")
    return Pose2(x, y, yaw)
