"""Items that a robot can pick up, as a scene lists them.

    items:
      - {name: cup, at: [3.0, 4.0, 0.85], width: 6 cm, height: 10 cm, mass: 0.3 kg}

`at` is the centre, where the fingers take it. Each stands upright on a level surface that reaches
`SURFACE` m about its place: a table that is told by nothing else. Where there is none is the floor.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Annotated

from engine.files import Length, Mass
from engine.files.declared import Fault, Name, above_0
from hw.geometry import Coordinate

SURFACE = 0.5
"""Radius of the surface that an item stands on at first, about its place, m."""
PRESSED_IN = 0.05
"""A surface higher than a point by more than this, m, is not the one under it."""

SpacePoint = tuple[Coordinate, Coordinate, Coordinate]


@dataclass(frozen=True, slots=True)
class Graspable:
    """A checked item of a scene; m, kg."""

    name: Name
    """Its name; no other item has it."""
    at: SpacePoint
    """Its centre, x, y, z in the map."""
    width: Annotated[Length, above_0(1.0)]
    """Between the fingers."""
    mass: Annotated[Mass, above_0(100.0)]
    """What the arm carries with it."""
    height: Annotated[Length, above_0(3.0)] | None = None
    """From bottom to top; without it as high as wide."""

    @property
    def half_height(self) -> float:
        """From the bottom to the centre, m."""
        return 0.5 * (self.height or self.width)

    @property
    def surface(self) -> float:
        """Height of the surface that it stands on at first, m."""
        return self.at[2] - self.half_height

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        if self.surface < -1e-9:
            yield "at", f"its bottom is at {self.surface:g} m, below the floor; `at` is its centre"


def surface_under(items: Iterable[Graspable], x: float, y: float, z: float) -> float:
    """Height of the surface under a point, or that it is pressed into, m; 0: the floor."""
    there = [
        item.surface
        for item in items
        if math.hypot(x - item.at[0], y - item.at[1]) <= SURFACE and item.surface <= z + PRESSED_IN
    ]
    return max(there, default=0.0)
