"""A shape in the map, and how it is written for the live page."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from typing import Any, Literal, get_args

from hw import Pose2
from hw.scene import Point

Layer = Literal[
    "room", "inflations", "objects", "places", "tracked", "robot", "arm", "user", "zones", "path",
    "goal", "scan", "costmap", "chase", "escape", "haptic", "deep", "trails",
]  # fmt: skip
LAYERS: tuple[Layer, ...] = get_args(Layer)
ShapeKind = Literal["poly", "line", "disc", "dots", "arrow", "text", "cells"]
"""A closed ring; a line; discs about their centres; dots; a line with a head at its end; a text at
a place; squares about their centres."""
Flat = tuple[float, ...]
"""Points as x1, y1, x2, y2, …, m."""


@dataclass(frozen=True, slots=True)
class MapShape:
    """One thing to draw; lengths in m, angles in rad, in the map.

    Attributes:
        style: what it is, such as `wall` or `robot`: each viewer has its own colours for it.
        points: x1, y1, x2, y2, …
        about: what a legend says of all shapes that look like this one.
        text: what is written beside it, or, if it is a text, at its place.
        radius: of discs.
        weights: of cells, 0 to 1, one for each; `cell` is their side, `yaw` turns each of them.
        fill: filled without an outline; otherwise an outline alone.
        alpha: 0 is invisible, 1 opaque.
    """

    layer: Layer
    kind: ShapeKind
    style: str
    points: Flat
    about: str = ""
    text: str = ""
    radius: float | None = None
    weights: Flat = ()
    yaw: float | None = None
    cell: float | None = None
    fill: bool = False
    alpha: float = 1.0

    @property
    def places(self) -> list[Point]:
        """The points as pairs."""
        return list(zip(self.points[::2], self.points[1::2], strict=True))


def wire(shape: MapShape) -> dict[str, Any]:
    """The shape as the page reads it: JSON values under short keys, lengths to the millimetre."""
    optional: dict[str, Any] = {
        "r": shape.radius,
        "s": shape.text or None,
        "w": _rounded(shape.weights) or None,
        "yaw": shape.yaw,
        "cell": shape.cell,
        "fill": shape.fill or None,
        "a": None if shape.alpha == 1.0 else shape.alpha,
    }
    said: dict[str, Any] = {"l": shape.layer, "k": shape.kind, "c": shape.style}
    said["p"] = _rounded(shape.points)
    for key, value in optional.items():
        if value is not None:
            said[key] = round(value, 3) if isinstance(value, float) else value
    return said


def _rounded(values: Flat) -> list[float]:
    import numpy as np  # ten times as fast

    found: list[float] = np.round(values, 3).tolist()
    return found


def flat(points: Iterable[Point]) -> Flat:
    """Points as x1, y1, x2, y2, and so on."""
    return tuple(chain.from_iterable(points))


def box(pose: Pose2, half_length: float, half_width: float) -> list[Point]:
    """The corners of a rectangle about a pose."""
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return [pose.transform(i * half_length, j * half_width) for i, j in signs]


def arc(centre: Pose2, radius: float, low: float, high: float) -> list[Point]:
    """Points of an arc between two bearings from a pose, a few degrees apart."""
    count = max(2, math.ceil((high - low) / math.radians(3.0)) + 1)
    angles = (low + (high - low) * i / (count - 1) for i in range(count))
    return [centre.transform(radius * math.cos(a), radius * math.sin(a)) for a in angles]


def arrow(layer: Layer, style: str, pose: Pose2, length: float, **more: Any) -> MapShape:
    """An arrow along the yaw of a pose, which is its middle."""
    ends = pose.transform(-0.5 * length, 0.0), pose.transform(0.5 * length, 0.0)
    return MapShape(layer, "arrow", style, flat(ends), **more)


def areas(layer: Layer, style: str, area: Any, *, fill: bool, about: str = "") -> list[MapShape]:
    """A shapely area: filled, a ring for each of its parts; else one for each of its borders.

    A filled ring runs to each hole, around it and back.
    """
    import shapely

    found: list[MapShape] = []
    for part in shapely.get_parts(area):
        if part.geom_type != "Polygon" or part.is_empty:
            continue
        oriented = shapely.geometry.polygon.orient(part)
        rings = [list(ring.coords) for ring in (oriented.exterior, *oriented.interiors)]
        if fill:
            back = rings[0][:1]
            rings = [[*rings[0], *chain.from_iterable([*hole, *back] for hole in rings[1:])]]
        found += [MapShape(layer, "poly", style, flat(r), about, fill=fill) for r in rings]
    return found
