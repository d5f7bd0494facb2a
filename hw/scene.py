"""Scenes: the room, where robot and person start, and where the robot may park.

A scene file names its room either by its polygons or by another scene that has it:

    scene: study
    about: what it is good for
    room: lab_a                          # or outer, walls, columns, tracked_area as lists of [x, y]
    robot: {file: rbkairos_ur10, start: {x: 3.0, y: 5.0, yaw: 0.0}}
    user: {source: study, start: {x: 6.0, y: 5.0, yaw: 3.1}}
    parking: {corner: {x: 1.15, y: 1.15, yaw: 0.785}}
    touchable: [{from: [3.0, 4.5], to: [6.0, 4.5], low: 0.0, high: 2.0}]

Metres and radians. `user.source` is a script of `hw/users` or a recording, the default of
`--user`; `touchable` are surfaces that only the user sees (`interaction.py`). `user`, `parking`,
`touchable` and the lists in `room` except `outer` may be left out.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from hw.document import FAR, FileError, Item, find_file, read_document
from hw.geometry import Pose2
from hw.interaction import Surface
from hw.room import MIN_WIDTH, Ring, Room, ring_fault

FOLDER = Path(__file__).parent / "scenes"


class SceneError(FileError):
    """A scene file is wrong or missing."""


@dataclass(frozen=True)
class Scene:
    """A checked scene; poses are map_from_base of the robot and of the person's body."""

    name: str
    about: str
    room: Room
    robot: str
    robot_start: Pose2
    user: str | None = None
    user_start: Pose2 | None = None
    parking: tuple[tuple[str, Pose2], ...] = ()
    touchable: tuple[Surface, ...] = ()

    def parking_spot(self, name: str) -> Pose2:
        """A parking spot by name.

        Raises:
            KeyError: the scene has no such spot; the text names those it has.
        """
        spots = dict(self.parking)
        if name not in spots:
            raise KeyError(f"scene {self.name}: no parking spot '{name}'; has {', '.join(spots)}")
        return spots[name]

    @cached_property
    def sha256(self) -> str:
        """Hash of what the scene says, whatever the layout of its file."""
        return hashlib.sha256(repr(self).encode()).hexdigest()


def scene_names() -> tuple[str, ...]:
    """The scenes that come with the project."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


def load_scene(name_or_path: str | Path) -> Scene:
    """A scene by name or by file.

    Raises:
        SceneError: with file, line, key and what would be right.
    """
    return _load(_find(str(name_or_path)), depth=0)


def _find(name: str, beside: Path | None = None) -> Path:
    if beside is None:
        return find_file(name, FOLDER, "scene", SceneError)
    if (beside / f"{name}.yaml").is_file():
        return beside / f"{name}.yaml"
    return beside / find_file(name, FOLDER, "scene", SceneError)  # FOLDER is absolute


def _load(path: Path, depth: int) -> Scene:
    document = read_document(path, SceneError)
    content = document.section(
        required=("scene", "room", "robot"), optional=("about", "user", "parking", "touchable")
    )
    robot = content["robot"].section(required=("start",), optional=("file",))
    user = content["user"].section(optional=("source", "start")) if "user" in content else {}
    parking = content["parking"].mapping() if "parking" in content else {}
    room = _room(content["room"], path, depth)
    return Scene(
        name=content["scene"].text(),
        about=content["about"].text() if "about" in content else "",
        room=room,
        robot=robot["file"].text() if "file" in robot else "rbkairos_ur10",
        robot_start=_free_pose(robot["start"], room),
        user=user["source"].text() if "source" in user else None,
        user_start=_free_pose(user["start"], room) if "start" in user else None,
        parking=tuple((name, _free_pose(spot, room)) for name, spot in parking.items()),
        touchable=tuple(_surface(item) for item in _items(content.get("touchable"))),
    )


def _room(item: Item, path: Path, depth: int) -> Room:
    if isinstance(item.value, str):
        if depth > 0:
            raise item.fail("is taken from a scene that takes its own from another; name that one")
        try:
            other = _find(item.value, path.parent)
        except SceneError as failure:
            raise item.fail(failure.message) from None
        return _load(other, depth + 1).room
    content = item.section(required=("outer",), optional=("walls", "columns", "tracked_area"))
    room = Room(
        outer=_ring(content["outer"]),
        walls=_rings(content.get("walls")),
        columns=_rings(content.get("columns")),
        tracked_area=_ring(content["tracked_area"]) if "tracked_area" in content else None,
    )
    for key in ("walls", "columns"):
        for ring_item, ring in zip(_items(content.get(key)), getattr(room, key), strict=True):
            if not _overlaps(ring, room):
                raise ring_item.fail("lies outside the room's outer ring")
    return room


def _items(item: Item | None) -> list[Item]:
    return [] if item is None else item.items()


def _rings(item: Item | None) -> tuple[Ring, ...]:
    return tuple(_ring(each) for each in _items(item))


def _ring(item: Item) -> Ring:
    ring = tuple(corner.point() for corner in item.items())
    if len(ring) > 1 and ring[0] == ring[-1]:
        ring = ring[:-1]  # the closed form of GeoJSON is meant well
    fault = ring_fault(ring)
    if fault:
        raise item.fail(fault)
    return ring


def _overlaps(ring: Ring, room: Room) -> bool:
    x_low, y_low, x_high, y_high = room.bounds
    crosses_x = any(x > x_low for x, _ in ring) and any(x < x_high for x, _ in ring)
    return crosses_x and any(y > y_low for _, y in ring) and any(y < y_high for _, y in ring)


def _surface(item: Item) -> Surface:
    part = item.section(required=("from", "to"), optional=("low", "high"))
    start, end = part["from"].point(), part["to"].point()
    if math.dist(start, end) < MIN_WIDTH:
        raise item.fail("has no length; 'from' and 'to' must be two places")
    low = part["low"].number(0.0, FAR) if "low" in part else 0.0
    high = part["high"].number(0.0, FAR) if "high" in part else 2.0
    if low > high:
        raise item.fail(f"reaches from {low:g} m up to {high:g} m; 'low' must be below 'high'")
    return Surface(start, end, low, high)


def _free_pose(item: Item, room: Room) -> Pose2:
    pose = item.pose()
    if not room.is_free(pose.x, pose.y):
        x_low, y_low, x_high, y_high = room.bounds
        raise item.fail(
            f"({pose.x:g}, {pose.y:g}) is not on the free floor; the room reaches from "
            f"({x_low:g}, {y_low:g}) to ({x_high:g}, {y_high:g})"
        )
    return pose
