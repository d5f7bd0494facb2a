"""Scenes: the room, the starts of robot and person, and places by name.

A scene file gives its room by polygons or by the name of another scene:

    scene: study
    about: what it is good for
    room: lab_a                          # or outer, walls, columns, tracked_area as lists of [x, y]
    robot: {file: rbkairos_ur10, start: {x: 3.0, y: 5.0, yaw: 0.0}}
    user: {source: study, start: {x: 6.0, y: 5.0, yaw: 3.1}}
    places: {kitchen: {x: 2 m, y: 3 m, yaw: 90 deg}}
    parking: {corner: {x: 1.15, y: 1.15, yaw: 0.785}}
    touchable: [{from: [3.0, 4.5], to: [6.0, 4.5], low: 0.0, high: 2.0}]
    tracking: area                       # of the person: only in the room's tracked_area
    calibration: lab.yaml                # of the tracking system, from `cobodeck calibrate`
    objects: [{kind: chair, at: [3.0, 4.0], appears: 12 s}]
    items: [{name: cup, at: [3.0, 4.0, 0.85], width: 6 cm, mass: 0.3 kg}]
    zones:
      keepout: [[[1.0, 1.0], [2.0, 1.0], [2.0, 2.0]]]
      speed: [{area: [[4.0, 1.0], [6.0, 1.0], [5.0, 3.0]], limit: 0.5 m/s}]

Metres and radians unless a unit is given (`780 cm`, `90 deg`). `user.source` is a script of
`hw/users` or a recording, the default of `--user`; paths are relative to the scene's folder.
`places` are poses of the robot that charts name, `parking` those of them where it may wait; a scene
that takes its room from another has places of its own, as it has zones of its own. `touchable` are
surfaces that only the user sees (`people/interaction.py`), `objects` are missing in maps
(`objects.py`), `items` can be picked up (`items.py`), `zones` restrict the robot (`zones.py`).
These, `user`, places and the lists in `room` except `outer` are optional.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

from engine.files import Length, did_you_mean, is_file
from engine.files.declared import (
    YAML,
    Fault,
    Item,
    Name,
    Range,
    Written,
    find_file,
    is_name,
    known_files,
    load_yaml,
    record,
)
from hw.geometry import Pose2
from hw.model import TrackingFile, load_tracking
from hw.places import PlanePoint, Pose
from hw.scene.items import Graspable
from hw.scene.objects import Thing
from hw.scene.room import MIN_WIDTH, Room, contains
from hw.scene.surface import Surface
from hw.scene.zones import NO_ZONES, Zones

FOLDER = Path(__file__).parent.parent / "scenes"

Tracked = Literal["everywhere", "area"]
"""Where the person is tracked: in the whole room, or only in its tracked area (R6)."""


@dataclass(frozen=True)
class Scene:
    """A checked scene; poses are map_from_base of the robot and of the person's body.

    `places` are the robot's poses by name, parking spots among them, in the order of the file.
    `robot` and `user` are names, or paths relative to the working directory; in the file they are
    relative to its `folder`.
    """

    name: str
    about: str
    room: Room
    robot: str
    robot_start: Pose2
    user: str | None = None
    user_start: Pose2 | None = None
    places: Mapping[str, Pose2] = field(default_factory=dict, hash=False)
    touchable: tuple[Surface, ...] = ()
    objects: tuple[Thing, ...] = ()
    items: tuple[Graspable, ...] = ()
    zones: Zones = NO_ZONES
    tracking: Tracked = "everywhere"
    calibration: TrackingFile | None = None
    folder: Path | None = field(default=None, repr=False, compare=False)

    def place(self, name: str) -> Pose2:
        """A place by name.

        Raises:
            KeyError: the scene has no such place; the text says which it has.
        """
        if name not in self.places:
            has = did_you_mean(name, self.places) if self.places else "it has none"
            raise KeyError(f"scene {self.name}: no place '{name}'; {has}")
        return self.places[name]

    @cached_property
    def sha256(self) -> str:
        """Hash of the scene's content, independent of the layout of its file."""
        robot = self.robot.removeprefix(f"{self.folder}/")
        user = self.user and self.user.removeprefix(f"{self.folder}/")
        return hashlib.sha256(repr(replace(self, robot=robot, user=user)).encode()).hexdigest()


def scene_names() -> tuple[str, ...]:
    """Names of the shipped scenes and of the project's own."""
    return tuple(known_files(FOLDER, "scene"))


def load_scene(name_or_path: str | Path) -> Scene:
    """A scene by name or by file.

    Raises:
        FileError: every mistake in it, with file, line, column and a suggestion.
    """
    return load_yaml(find_file(str(name_or_path), FOLDER, "scene"), scene_from)


Named = Annotated[str, Item.target, Written(str)]


@dataclass(frozen=True, slots=True)
class _Robot:
    start: Pose
    """Where it starts."""
    file: Named = "rbkairos_ur10"
    """A robot by name or by file."""


@dataclass(frozen=True, slots=True)
class _User:
    source: Named | None = None
    """A script by name, a recording, or `random`; `--user` overrides it."""
    start: Pose | None = None
    """Where they start; else as the script or recording says."""


@dataclass(frozen=True, slots=True)
class _Surface:
    from_: PlanePoint
    """One end of it, seen from above."""
    to: PlanePoint
    """The other end."""
    low: Annotated[Length, Range(0.0, 100.0)] = 0.0
    """Height of its lower edge."""
    high: Annotated[Length, Range(0.0, 100.0)] = 2.0
    """Height of its upper edge."""

    def faults(self) -> Iterator[Fault]:
        if math.dist(self.from_, self.to) < MIN_WIDTH:
            yield "to", "the surface has no length; 'from' and 'to' must be two places"
        if self.low > self.high:
            yield (
                "low",
                f"reaches from {self.low:g} m up to {self.high:g} m; 'low' must be below 'high'",
            )


def _room(item: Item) -> Room:
    """The room as polygons, or that of another scene."""
    if not isinstance(item.value, str):
        return record(item, Room)
    beside = (item.folder / f"{item.value}{ending}" for ending in YAML)
    named = next((str(file) for file in beside if is_file(file)), None) or item.target()

    def own(other: Item) -> Room:
        if isinstance(other.inner("room").value, str):
            raise item.error("is taken from a scene that takes its own from another; name that one")
        return record(other, SceneFile).room

    return item.refer(lambda: load_yaml(find_file(named, FOLDER, "scene"), own))


def _calibration(item: Item) -> TrackingFile:
    """The tracking system of the room, by name or file."""
    return item.refer(lambda: load_tracking(item.target()))


@dataclass(frozen=True, slots=True)
class SceneFile:
    """A scene: the room, and where robot and person start."""

    scene: Name
    """Its name."""
    room: Annotated[Room, _room, Written(Room | str)]
    """The polygons of the room, or the scene that it is taken from."""
    robot: _Robot
    """The robot, and where it starts."""
    about: str = ""
    """What it is good for."""
    user: _User = _User()
    """The person, and where they start."""
    places: Mapping[str, Pose] = field(default_factory=dict)
    """Poses of the robot by the names that charts use, as in `goal: {place: kitchen}`."""
    parking: Mapping[str, Pose] = field(default_factory=dict)
    """Places where the robot may wait, by name."""
    touchable: tuple[_Surface, ...] = ()
    """Surfaces that only the user sees."""
    objects: tuple[Thing, ...] = ()
    """What is there and in no map: chairs and other people."""
    items: tuple[Graspable, ...] = ()
    """What the robot can pick up."""
    zones: Zones = NO_ZONES
    """Areas that restrict the robot."""
    tracking: Tracked = "everywhere"
    """Where the person is tracked: everywhere, or only in the room's tracked area (R6)."""
    calibration: Annotated[TrackingFile, _calibration, Written(str)] | None = None
    """The tracking system, by name or by the file that `cobodeck calibrate` wrote."""

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        if self.tracking == "area" and self.room.tracked_area is None:
            yield "tracking", "the room has no tracked_area to be tracked in"
        yield from self._wrong_names()
        robot = {"robot.start": self.robot.start}
        robot |= {f"places.{name}": pose for name, pose in self.places.items()}
        robot |= {f"parking.{name}": pose for name, pose in self.parking.items()}
        user = {} if self.user.start is None else {"user.start": self.user.start}
        x_low, y_low, x_high, y_high = self.room.bounds
        for key, pose in (robot | user).items():
            if not self.room.is_free(pose.x, pose.y):
                yield (
                    key,
                    f"({pose.x:g}, {pose.y:g}) is not on the free floor; the room reaches from "
                    f"({x_low:g}, {y_low:g}) to ({x_high:g}, {y_high:g})",
                )
        for key, pose in robot.items():
            if self.zones.keeps_out(pose.x, pose.y):
                yield key, f"({pose.x:g}, {pose.y:g}) is in a zone that the robot keeps out of"
        yield from self._things_off_the_floor()

    def _wrong_names(self) -> Iterator[Fault]:
        wanted = "letters, digits and _, not starting with a digit"
        for section, named in (("places", self.places), ("parking", self.parking)):
            for name in named:
                if not is_name(name):
                    yield f"{section}.{name}", f"{name!r} cannot be a name; wanted: {wanted}"
        for name, pose in self.places.items():
            if self.parking.get(name, pose) != pose:
                yield f"places.{name}", "is a parking spot elsewhere; give one of them another name"

    def _things_off_the_floor(self) -> Iterator[Fault]:
        for n, thing in enumerate(self.objects):
            for x, y in (thing.at, *thing.walks):
                if not self.room.is_free(x, y):
                    yield f"objects.{n}", f"({x:g}, {y:g}) is not on the free floor"
        yield from self._item_faults()

    def _item_faults(self) -> Iterator[Fault]:
        names = [item.name for item in self.items]
        for n, item in enumerate(self.items):
            x, y, _ = item.at  # maybe on a table that is a wall of the map
            if not contains(self.room.outer, x, y):
                yield f"items.{n}.at", f"({x:g}, {y:g}) is not in the room"
            if item.name in names[:n]:
                yield f"items.{n}.name", f"{item.name} is the name of another item; choose another"


def scene_from(item: Item) -> Scene:
    """A scene from a mapping as in its file.

    Raises:
        FileError: every mistake in it.
    """
    read = record(item, SceneFile)
    return Scene(
        name=read.scene,
        about=read.about,
        room=read.room,
        robot=read.robot.file,
        robot_start=read.robot.start,
        user=read.user.source,
        user_start=read.user.start,
        places={**read.places, **read.parking},
        touchable=tuple(Surface(s.from_, s.to, s.low, s.high) for s in read.touchable),
        objects=read.objects,
        items=read.items,
        zones=read.zones,
        tracking=read.tracking,
        calibration=read.calibration,
        folder=item.folder,
    )
