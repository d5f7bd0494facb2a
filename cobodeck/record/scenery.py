"""What stands in a scene, for viewers: walls, and the shapes of robot and person."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from hw.person import RADIUS
from hw.robot import Footprint
from hw.room import Point
from hw.scene import Scene

LOOP = 1
"""A line of foxglove.LinePrimitive that is closed."""
WALL_M, PERSON_M, ROVER_M = 0.05, 1.8, 0.7
"""Thickness of drawn walls, heights of person and rover, m."""
INK, AMBER, BLUE = (0.1, 0.12, 0.15, 1.0), (0.96, 0.64, 0.13, 0.8), (0.07, 0.25, 0.55, 0.6)
NOW = {"sec": 0, "nsec": 0}


def scene_update(scene: Scene, footprint: Footprint) -> str:
    """A foxglove.SceneUpdate with all that a viewer needs besides the transforms."""
    room = scene.room
    walls = [_loop(ring) for ring in (room.outer, *room.obstacles)]
    size = {"x": 2 * footprint.half_length, "y": 2 * footprint.half_width, "z": ROVER_M}
    rover = {"pose": _above(ROVER_M / 2), "size": size, "color": _colour(AMBER)}
    round_ = {"x": 2 * RADIUS, "y": 2 * RADIUS, "z": PERSON_M}
    person = {
        "pose": _above(PERSON_M / 2),
        "size": round_,
        "bottom_scale": 1.0,
        "top_scale": 1.0,
        "color": _colour(BLUE),
    }
    entities = [
        _entity("room", "map", lines=walls),
        _entity("rover", "base_link", cubes=[rover]),
        _entity("person", "user", cylinders=[person]),
    ]
    return json.dumps({"deletions": [], "entities": entities}, separators=(",", ":"))


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


def _above(height: float) -> dict[str, Any]:
    turned = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    return {"position": {"x": 0.0, "y": 0.0, "z": height}, "orientation": turned}


def _colour(colour: Sequence[float]) -> dict[str, float]:
    return dict(zip("rgba", colour, strict=True))
