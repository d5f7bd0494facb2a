"""The room: walls, inflations, tracked area, places, and what stands in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cobodeck.shapes.shape import Shape, areas, flat
from hw import Pose2
from hw.scene import Graspable, Room, Thing
from states import SUBSYSTEMS, Navigation

MOST_LEVELS = 3
"""Inflations beyond so many look like the last one."""
ITEM_M = 0.05
"""Least radius with which items are seen, m."""
PLACE_M, HEADING_M = 0.08, 0.5
"""Radius of the mark of a place, and length of the arrow along its yaw, m."""


def wall_shapes(room: Room) -> list[Shape]:
    """The outer ring, and walls and columns as far as they are inside it."""
    import shapely

    ground = shapely.Polygon(room.outer)
    found = [Shape("room", "poly", "wall", flat(room.outer), "wall, column")]
    for ring in room.obstacles:
        found += areas("room", "wall", shapely.Polygon(ring).intersection(ground), fill=True)
    return found


def inflation_shapes(room: Room, navigation: Navigation) -> list[Shape]:
    """Strips along walls closed to the robot's centre; narrower ones lie over the wider ones."""
    floor, found = room.free_space, []
    for number, (inflation, names) in enumerate(levels(navigation)):
        shut = floor.difference(floor.buffer(-inflation, quad_segs=32))
        style = f"inflation-{min(number, MOST_LEVELS - 1)}"
        about = f"within {inflation:g} m of walls: {names}"
        found += areas("inflations", style, shut, fill=True, about=about)
    return found


def levels(navigation: Navigation) -> list[tuple[float, str]]:
    """Inflations, m, with the subsystems that have them, the widest first."""
    found: dict[float, list[str]] = {}
    for name in sorted(SUBSYSTEMS, key=("haptic", "chase", "escape").index):
        found.setdefault(navigation.named(name).inflation, []).append(name.capitalize())
    return [(inflation, ", ".join(found[inflation])) for inflation in sorted(found, reverse=True)]


def tracked_shapes(room: Room) -> list[Shape]:
    """The outline of the area in which the person is tracked, if it is limited."""
    area = room.tracked_area
    return [] if area is None else [Shape("tracked", "poly", "tracked", flat(area), "tracked area")]


def object_shapes(objects: Sequence[Thing], at_s: float | None = None) -> list[Shape]:
    """Objects that no map contains, and paths of moving ones.

    As they stand `at_s`, absent ones left out; None: all at their first places.
    """
    found = []
    for thing in objects:
        place = thing.at if at_s is None else thing.place(round(at_s * 1e9))
        if thing.walks:
            found.append(Shape("objects", "line", "object", flat((thing.at, *thing.walks))))
        if place is not None:
            about, radius = "not on the map", thing.body.radius
            found.append(Shape("objects", "disc", "object", place, about, radius=radius, fill=True))
    return found


def item_shapes(items: Sequence[Graspable]) -> list[Shape]:
    """Items to pick up, with their names, at their first places."""
    return [
        Shape(
            "objects", "disc", "item", item.at[:2], "item to pick up", item.name,
            radius=max(0.5 * item.width, ITEM_M), fill=True,
        )
        for item in items
    ]  # fmt: skip


def place_shapes(places: Mapping[str, Pose2]) -> list[Shape]:
    """The named places, each with an arrow along its yaw."""
    found = []
    for name, pose in places.items():
        at, ahead = (pose.x, pose.y), pose.transform(HEADING_M, 0.0)
        found += [
            Shape("places", "arrow", "place", flat((at, ahead)), "place, with its yaw"),
            Shape("places", "disc", "place", at, text=name, radius=PLACE_M),
        ]
    return found
