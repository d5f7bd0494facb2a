"""A scene for viewers: walls, objects, and the shapes of robot and person."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from hw import USER_RADIUS, Pose3
from hw.model import Footprint, Sensing
from hw.scene import Point, Scene

LOOP = 1
"""The type of a closed line in foxglove.LinePrimitive (LINE_LOOP)."""
WALL_M, PERSON_M, ROVER_M = 0.05, 1.8, 0.7
"""Thickness of drawn walls, heights of person and rover, m."""
INK, AMBER, BLUE = (0.1, 0.12, 0.15, 1.0), (0.96, 0.64, 0.13, 0.8), (0.07, 0.25, 0.55, 0.6)
GREY = (0.5, 0.5, 0.5, 0.6)
NOW = {"sec": 0, "nsec": 0}


def scene_update(scene: Scene, footprint: Footprint) -> str:
    """A foxglove.SceneUpdate with everything that a viewer needs besides the transforms.

    Objects are drawn at their initial places.
    """
    room = scene.room
    walls = [_loop(ring) for ring in (room.outer, *room.obstacles)]
    size = {"x": 2 * footprint.half_length, "y": 2 * footprint.half_width, "z": ROVER_M}
    rover = {"pose": _above(ROVER_M / 2), "size": size, "color": _colour(AMBER)}
    person = _cylinder(USER_RADIUS, PERSON_M, BLUE)
    things = [_cylinder(*thing.body[:2], GREY, thing.at) for thing in scene.objects]
    entities = [
        _entity("room", "map", lines=walls),
        _entity("objects", "map", cylinders=things),
        _entity("rover", "base_link", cubes=[rover]),
        _entity("person", "user", cylinders=[person]),
    ]
    return json.dumps({"deletions": [], "entities": entities}, separators=(",", ":"))


def fixed_frames(sensing: Sensing) -> str | None:
    """A foxglove.FrameTransforms with where the scanners are on the robot; None without any."""
    found = [_transform(name, model.mount.pose) for name, model in sensing.lidars.items()]
    return json.dumps({"transforms": found}, separators=(",", ":")) if found else None


def _transform(name: str, at: Pose3) -> dict[str, Any]:
    return {
        "timestamp": NOW,
        "parent_frame_id": "base_link",
        "child_frame_id": name,
        "translation": {"x": at.x, "y": at.y, "z": at.z},
        "rotation": {"x": at.qx, "y": at.qy, "z": at.qz, "w": at.qw},
    }


def _entity(name: str, frame: str, **primitives: list[Any]) -> dict[str, Any]:
    lists = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
    return {
        "timestamp": NOW,
        "frame_id": frame,
        "id": name,
        "lifetime": NOW,
        "frame_locked": True,
        "metadata": [],
    } | {name: primitives.get(name, []) for name in lists}


def _loop(ring: Sequence[Point]) -> dict[str, Any]:
    return {
        "type": LOOP,
        "pose": _above(0.0),
        "thickness": WALL_M,
        "scale_invariant": False,
        "points": [{"x": x, "y": y, "z": 0.0} for x, y in ring],
        "color": _colour(INK),
        "colors": [],
        "indices": [],
    }


def _cylinder(
    radius: float, height: float, colour: Sequence[float], at: Point = (0.0, 0.0)
) -> dict[str, Any]:
    return {
        "pose": _above(height / 2, *at),
        "size": {"x": 2 * radius, "y": 2 * radius, "z": height},
        "bottom_scale": 1.0,
        "top_scale": 1.0,
        "color": _colour(colour),
    }


def _above(height: float, x: float = 0.0, y: float = 0.0) -> dict[str, Any]:
    turned = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    return {"position": {"x": x, "y": y, "z": height}, "orientation": turned}


def _colour(colour: Sequence[float]) -> dict[str, float]:
    return dict(zip("rgba", colour, strict=True))
