"""A localization run: map, path and beam ends; below them distances over time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.lines import Line2D

from cobodeck.logs import NEAR, scans_of
from cobodeck.pictures.drawing import Sheet, sheet
from engine.draw import GREY, INK
from states.localization.slam import points_in
from states.maps import FREE, UNKNOWN

if TYPE_CHECKING:
    from cobodeck.logs import Localized

PATH, BEAMS, TRUE = "#c62828", "#1565c0", "#2e7d32"
BELOW_IN = 2.2
_MOST_BEAMS = 60_000
_MARGIN_M = 1.0
_FARTHEST_M = 15.0
"""Distance from the path up to which the map is drawn, m."""


def localized_picture(found: Localized) -> Sheet:
    """The map with the path, and below it the distances from beam ends to walls over time."""
    places = [step.pose for step in found.steps if step.pose is not None]
    title = f"{found.log.path.name}: {found.log.form}"
    drawn = sheet(_bounds(found), title, [f"map: {found.ground.source}"], BELOW_IN)
    _draw_map(drawn, found)
    _draw_beams(drawn, found)
    axes = drawn.axes
    true = [step.true for step in found.steps if step.true is not None]
    if true:
        (line,) = axes.plot([p.x for p in true], [p.y for p in true], color=TRUE, lw=2.0, alpha=0.6)
        drawn.explain("corrected poses", line)
    (line,) = axes.plot([p.x for p in places], [p.y for p in places], color=PATH, lw=0.9)
    drawn.explain("estimated path", line)
    if places:
        axes.plot(places[0].x, places[0].y, "o", color=PATH, ms=4)
    _draw_distances(drawn, found)
    return drawn


def _bounds(found: Localized) -> tuple[float, float, float, float]:
    """Bounds of the map near the path, m."""
    low, high = _ground_bounds(found)
    places = np.array([[s.pose.x, s.pose.y] for s in found.steps if s.pose is not None])
    if len(places):
        low = np.maximum(low, places.min(axis=0) - _FARTHEST_M)
        high = np.minimum(high, places.max(axis=0) + _FARTHEST_M)
    return (*low.tolist(), *high.tolist())


def _ground_bounds(found: Localized) -> tuple[Any, Any]:
    map_, room = found.ground.map, found.ground.room
    if map_ is None:
        assert room is not None
        x_low, y_low, x_high, y_high = room.bounds
        margin = _MARGIN_M
        return np.array([x_low, y_low]) - margin, np.array([x_high, y_high]) + margin
    rows, columns = map_.values.shape
    width, height = columns * map_.resolution, rows * map_.resolution
    at = map_.map_from_corner
    corners = [at.transform(x, y) for x in (0.0, width) for y in (0.0, height)]
    return np.min(corners, axis=0), np.max(corners, axis=0)


def _draw_map(drawn: Sheet, found: Localized) -> None:
    map_, room = found.ground.map, found.ground.room
    if room is not None:
        for x1, y1, x2, y2 in room.segments:
            drawn.axes.plot([x1, x2], [y1, y2], color=INK, lw=1.2)
        return
    assert map_ is not None
    shades = np.where(map_.values == UNKNOWN, 0.88, np.where(map_.values == FREE, 1.0, 0.25))
    rows, columns = map_.values.shape
    at = map_.map_from_corner
    turned = mpl.transforms.Affine2D().rotate(at.yaw).translate(at.x, at.y)
    drawn.axes.imshow(
        shades, cmap="gray", vmin=0.0, vmax=1.0, origin="lower", interpolation="nearest",
        extent=(0.0, columns * map_.resolution, 0.0, rows * map_.resolution),
        transform=turned + drawn.axes.transData, zorder=0, aspect="equal",
    )  # fmt: skip


def _draw_beams(drawn: Sheet, found: Localized) -> None:
    """End points of the scored scans' beams, thinned to what is visible."""
    scans = scans_of(found.log)
    scored = [scans[number] for number in sorted(found.ground.scored)]
    ends = [
        points_in(step.pose, seen.points)
        for step, seen in zip(found.steps, scored, strict=True)
        if step.pose is not None
    ]
    if not ends:
        return
    points = np.concatenate(ends)
    points = points[:: math.ceil(len(points) / _MOST_BEAMS)]
    drawn.axes.plot(
        points[:, 0], points[:, 1], ",", color=BEAMS, alpha=0.5, rasterized=True, zorder=1
    )
    sign = Line2D([], [], color=BEAMS, marker=".", ls="", ms=4)
    drawn.explain("ends of beams", sign)


def _draw_distances(drawn: Sheet, found: Localized) -> None:
    figure = drawn.figure
    width, height = figure.get_size_inches()
    place = (0.6 / width, 0.45 / height, 1.0 - 1.0 / width, (BELOW_IN - 0.75) / height)
    axes = figure.add_axes(place)
    rows = [(step.stamp_ns / 1e9, step.wall) for step in found.steps if step.wall is not None]
    if rows:
        times, walls = zip(*rows, strict=True)
        (line,) = axes.plot(times, [1e2 * w for w in walls], color=BEAMS, lw=0.8)
        drawn.explain("beams to walls, median", line)
    errors = [(s.stamp_ns / 1e9, s.error[0]) for s in found.steps if s.error is not None]
    if errors:
        times, metres = zip(*errors, strict=True)
        (line,) = axes.plot(times, [1e2 * m for m in metres], color=TRUE, lw=0.8)
        drawn.explain("error of position", line)
    for step in found.steps:
        if step.pose is None:
            axes.axvline(step.stamp_ns / 1e9, color=PATH, lw=0.6, alpha=0.4)
    axes.axhline(1e2 * NEAR, color=GREY, lw=0.6, ls=(0, (4, 3)))
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("s", fontsize=7, color=GREY, loc="right", labelpad=1)
    axes.set_ylabel("cm", fontsize=7, color=GREY)
    axes.tick_params(length=2.5, width=0.6, labelsize=7, colors=GREY)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
