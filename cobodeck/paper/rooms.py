"""The spatial table of section 5.1: what an inflation leaves of the room and of two ideal ones."""

from __future__ import annotations

import math
from typing import Any

from cobodeck.paper.published import FREE_M2, ROUND_M2, SQUARE_M2, USABLE_M2
from hw.scene import Room, load_scene
from states.floors import RoomFloor, measure

INFLATION = 1.0
COLUMN = (0.30, 0.50)
"""Sides of the column whose 184 by 204 cm are excluded at an inflation of 77 cm (5.1), m."""
CORNERS = 720
"""Of the polygon that stands for the round room; its area is exact."""


def rooms(scene: str) -> list[dict[str, Any]]:
    """A row per room: free and usable floor, m2, and what the paper prints."""
    return [
        _row(scene, load_scene(scene).room, USABLE_M2),
        _row("round, a column in the middle", _round(FREE_M2), ROUND_M2),
        _row("square, a column in the middle", _square(FREE_M2), SQUARE_M2),
    ]


def _row(name: str, room: Room, printed: float) -> dict[str, Any]:
    space = measure(RoomFloor(room, "round"), INFLATION)
    areas = {"free_m2": space.free_m2, "usable_m2": space.usable_m2}
    return {"room": name, **areas, "paper_usable_m2": printed}


def _column() -> tuple[tuple[float, float], ...]:
    x, y = 0.5 * COLUMN[0], 0.5 * COLUMN[1]
    return (-x, -y), (x, -y), (x, y), (-x, y)


def _square(free: float) -> Room:
    half = 0.5 * math.sqrt(free)
    return Room(((-half, -half), (half, -half), (half, half), (-half, half)), columns=(_column(),))


def _round(free: float) -> Room:
    step = 2.0 * math.pi / CORNERS
    radius = math.sqrt(free / (0.5 * CORNERS * math.sin(step)))
    ring = ((radius * math.cos(k * step), radius * math.sin(k * step)) for k in range(CORNERS))
    return Room(tuple(ring), columns=(_column(),))
