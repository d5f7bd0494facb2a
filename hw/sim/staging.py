"""Checks that a scene, its robot and its user fit together, before anything runs."""

from __future__ import annotations

from pathlib import Path

from engine.files.declared import Item, gather, load_yaml
from hw.model import load_robot
from hw.people import open_user
from hw.scene import Scene, scene_from
from hw.sim.contact import rectangle_segment_distance


def check_scene(file: Path) -> None:
    """Read a scene with its robot and its user.

    Raises:
        FileError: every mistake in its file and in those it names; the robot would touch a wall, or
            the user leave the floor.
    """
    load_yaml(file, _check)


def _check(item: Item) -> None:
    scene = scene_from(item)
    gather((lambda: _check_robot(item, scene), lambda: _check_user(item, scene)))


def _check_robot(item: Item, scene: Scene) -> None:
    outline = item.inner("robot.file").refer(lambda: load_robot(scene.robot)).footprint
    start = scene.robot_start
    inside = start.inverse().transform
    for x1, y1, x2, y2 in scene.room.segments:
        wall = inside(x1, y1), inside(x2, y2)
        if rectangle_segment_distance(outline.half_length, outline.half_width, *wall) <= 0.0:
            place = f"({start.x:g}, {start.y:g}, {start.yaw:g})"
            raise item.inner("robot.start").error(f"{place}: the robot would touch a wall")


def _check_user(item: Item, scene: Scene) -> None:
    named = scene.user
    if named is not None:
        item.inner("user.source").refer(lambda: open_user(named, scene))
