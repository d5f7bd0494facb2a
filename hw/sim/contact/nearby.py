"""What is next to the robot's outline: walls, things, people."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from hw.geometry import Pose2
from hw.model import Footprint
from hw.samples import USER_RADIUS
from hw.scene import Room, Scene, Segment, foot, named
from hw.sim.contact.contact import gap, rectangle_segment_distance
from hw.truth import USER, Truth

WALL = "wall"
BESIDE_M = 1.5
"""A thing or person at this gap may be what a robot brakes for: 1.5 m/s take 1.1 m at 1 m/s2, m."""


class Nearby(NamedTuple):
    """Something at this `gap` from the outline, m; its name, and its place in the map.

    The place is the middle of a person or thing, and of a wall the point next to the base, m.
    """

    gap: float
    what: str
    x: float
    y: float


def nearest(
    scene: Scene, footprint: Footprint, truth: Truth, now_ns: int, within: float = BESIDE_M
) -> Nearby | None:
    """What is next to the robot's outline; None if the robot's pose is not known.

    A thing or person within this gap, m, comes before walls, around which a path was planned.
    """
    if truth.base is None:
        return None
    bodies = [*_bodies(scene, footprint, truth.base, truth, now_ns)]
    beside = [body for body in bodies if body.gap <= within]
    return min(beside or [nearest_wall(scene.room, footprint, truth.base), *bodies])


def nearest_wall(room: Room, footprint: Footprint, robot: Pose2) -> Nearby:
    """The wall next to the robot's outline."""
    length, width = footprint.half_length, footprint.half_width
    base_from_map = robot.inverse()

    def distance(wall: Segment) -> float:
        start, end = base_from_map.transform(*wall[:2]), base_from_map.transform(*wall[2:])
        return rectangle_segment_distance(length, width, start, end)

    away, wall = min((distance(wall), wall) for wall in room.segments)
    return Nearby(away, WALL, *foot(robot.x, robot.y, wall))


def _bodies(
    scene: Scene, footprint: Footprint, robot: Pose2, truth: Truth, now_ns: int
) -> Iterable[Nearby]:
    if truth.body is not None:
        x, y = truth.body.x, truth.body.y
        yield Nearby(gap(footprint, robot, x, y, USER_RADIUS), USER, x, y)
    for what, thing in named(scene.objects):
        place = thing.place(now_ns)
        if place is not None:
            yield Nearby(gap(footprint, robot, *place, thing.body.radius), what, *place)
