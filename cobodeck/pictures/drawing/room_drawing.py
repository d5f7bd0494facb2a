"""The room: floor, walls, inflations, tracked area, objects, items, places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import shapely
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Patch, PathPatch
from matplotlib.path import Path

from cobodeck.pictures.drawing.canvas import Sheet
from cobodeck.pictures.drawing.labels import Labels
from engine.draw import INK
from hw import Pose2
from hw.scene import Disc, Graspable, Point, Room, Thing

FLOOR = "#ffffff"
INFLATIONS = ("#e6e9ed", "#cdd3da", "#b4bcc6")
"""Colours of inflations, from the widest to the narrowest."""
TRACKED = "#8a94a0"
OBJECT = "#b39b7d"
ITEM, ITEM_M = "#e3a008", 0.05
"""Colour of items, and the least radius with which they are seen, m."""
PLACE = "#9c2f7f"
PLACE_M, HEADING_M = 0.08, 0.5
"""Radius of the mark of a place, and length of the arrow along its yaw, m."""
NUMBER_PT = 12.0
"""Room left for a number that is on the sheet already, points."""


def draw_room(on: Sheet, room: Room) -> None:
    """The floor, and black walls, columns and outer ring."""
    add_area(on, room.free_space, facecolor=FLOOR, linewidth=0, zorder=1.0)
    ground = shapely.Polygon(room.outer)
    for ring in room.obstacles:
        obstacle = shapely.Polygon(ring).intersection(ground)
        add_area(on, obstacle, facecolor=INK, edgecolor=INK, linewidth=0.8, zorder=5.0)
    add_area(on, ground, fill=False, edgecolor=INK, linewidth=3.0, zorder=5.0)
    on.explain("wall, column", Patch(facecolor=INK))


def draw_inflations(on: Sheet, room: Room, levels: Sequence[tuple[float, str]]) -> None:
    """Strips along walls closed to the robot's centre; `levels`: (width, m, name), widest first."""
    floor = room.free_space
    for number, (inflation, name) in enumerate(levels):
        left = floor.buffer(-inflation, quad_segs=32)
        colour = INFLATIONS[min(number, len(INFLATIONS) - 1)]
        # narrower ones lie over the wider ones
        add_area(on, floor.difference(left), facecolor=colour, linewidth=0, zorder=1.1 + number / 9)
        on.explain(f"within {inflation:g} m of walls: {name}", Patch(facecolor=colour))


def draw_tracked_area(on: Sheet, room: Room) -> None:
    """The outline of the area in which the person is tracked, if it is limited."""
    if room.tracked_area is None:
        return
    xs, ys = zip(*room.tracked_area, room.tracked_area[0], strict=True)
    style: dict[str, Any] = {"color": TRACKED, "linewidth": 0.8, "linestyle": (0, (1, 2))}
    on.axes.plot(xs, ys, zorder=1.9, **style)
    on.explain("tracked area", Line2D([], [], **style))


def draw_objects(on: Sheet, objects: Sequence[Thing], at_s: float | None = None) -> None:
    """Objects that no map contains, and paths of moving ones.

    As they stand `at_s`, absent ones left out; None: all at their first places.
    """
    style: dict[str, Any] = {"facecolor": OBJECT, "edgecolor": INK, "linewidth": 0.6}
    for thing in objects:
        place = thing.at if at_s is None else thing.place(round(at_s * 1e9))
        if place is not None:
            on.axes.add_patch(Circle(place, thing.body.radius, zorder=4.0, **style))
        if thing.walks:
            xs, ys = zip(thing.at, *thing.walks, strict=True)
            on.axes.plot(xs, ys, color=OBJECT, linewidth=1.2, zorder=3.9)
    if objects:
        on.explain("not on the map", Patch(**style))


def draw_items(on: Sheet, items: Sequence[Graspable]) -> None:
    """Items to pick up, with their names, at their first places."""
    labels = Labels(on, always=True)
    style: dict[str, Any] = {"facecolor": ITEM, "edgecolor": INK, "linewidth": 0.6}
    for item in items:
        at, radius = item.at[:2], max(0.5 * item.width, ITEM_M)
        on.axes.add_patch(Circle(at, radius, zorder=8.5, **style))
        labels.mark(at, 144.0 * on.scale * radius, item.name, INK, 7.5)
    labels.write()
    if items:
        on.explain("item to pick up", Patch(**style))


def draw_places(on: Sheet, places: Mapping[str, Pose2], robot: Disc) -> None:
    """The named places, each with an arrow along its yaw.

    Names are written over neither the robot nor other text, if there is room beside them.
    """
    labels, r = Labels(on, always=True), robot.radius
    labels.keep_off(((robot.x - r, robot.y - r), (robot.x + r, robot.y + r)))
    for text in on.axes.texts:
        labels.mark(text.get_position(), NUMBER_PT, "", PLACE, 0.0)
    for name, pose in places.items():
        at, ahead = (pose.x, pose.y), pose.transform(HEADING_M, 0.0)
        arrow = FancyArrowPatch(
            at, ahead, color=PLACE, lw=1.4, arrowstyle="-|>", mutation_scale=9.0,
            shrinkA=0, shrinkB=0, zorder=8.6,
        )  # fmt: skip
        on.axes.add_patch(arrow)
        on.axes.add_patch(Circle(at, PLACE_M, fc="white", ec=PLACE, lw=1.4, zorder=8.7))
        labels.keep_off((at, ahead))
        labels.mark(at, 144.0 * on.scale * PLACE_M, name, PLACE, 7.5)
    labels.write()
    if places:
        sign = Line2D([], [], color=PLACE, lw=1.4, marker="o", mfc="white", markevery=[0], ms=6)
        on.explain("place, with its yaw", sign)


def add_area(on: Sheet, area: Any, **style: Any) -> None:
    """A shapely Polygon or MultiPolygon with its holes."""
    parts = [p for p in shapely.get_parts(area) if p.geom_type == "Polygon" and not p.is_empty]
    if parts:
        on.axes.add_patch(PathPatch(_outline(parts), **style))


def _outline(polygons: Sequence[Any]) -> Path:
    rings = [ring for part in polygons for ring in (part.exterior, *part.interiors)]
    corners = [np.asarray(ring.coords) for ring in rings]
    codes = [[Path.MOVETO, *[Path.LINETO] * (len(ring) - 2), Path.CLOSEPOLY] for ring in corners]
    return Path(np.concatenate(corners), np.concatenate(codes))


def ring_of(points: Sequence[Point]) -> Path:
    """A closed outline through these points."""
    codes = [Path.MOVETO, *[Path.LINETO] * (len(points) - 1), Path.CLOSEPOLY]
    return Path(np.asarray([*points, points[0]]), codes)
