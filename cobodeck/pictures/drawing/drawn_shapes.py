"""Draws shapes on a sheet: all kinds by one function, by the looks of their styles."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.colors import to_rgb
from matplotlib.legend_handler import HandlerBase
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Patch, PathPatch, Rectangle
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Affine2D

from cobodeck.pictures.drawing.canvas import Sheet
from cobodeck.pictures.drawing.labels import Labels
from cobodeck.pictures.drawing.looks import COSTS, LETTERS, LOOKS, ArtistValues
from cobodeck.shapes import MapShape
from hw.scene import Point

BEST_FIRST = mpl.colormaps["rainbow_r"]
"""Purple for the highest weight, red for the lowest (R95)."""
NUMBER_PT = 12.0
"""Room left for text that is on the sheet already, points."""


def draw(
    on: Sheet, shapes: Iterable[MapShape], keep_off: Sequence[Sequence[Point]] = (), **changed: Any
) -> None:
    """Draw shapes, with what is written beside them where there is room, and explain them.

    Nothing is written over the rectangles around the points of `keep_off`, m, if there is room
    elsewhere. `changed` are values of matplotlib in place of those of the looks.
    """
    labels = Labels(on, always=True)
    for points in keep_off:
        labels.keep_off(points)
    for text in on.axes.texts:
        labels.mark(text.get_position(), NUMBER_PT, "", "", 0.0)
    explained: dict[str, str] = {}
    for shape in shapes:
        name = look_of(shape)
        values = {**LOOKS[name].drawn, **changed}
        if shape.alpha < 1.0:
            values["alpha"] = shape.alpha
        _DRAWN[shape.kind](on, shape, values)
        _reserve(labels, shape)
        if shape.about:
            explained.setdefault(name, shape.about)
    labels.write()
    for name in filter(explained.__contains__, LOOKS):
        _explain(on, name, explained[name])


def look_of(shape: MapShape) -> str:
    """The name of a shape's look."""
    outlined = shape.kind in ("poly", "disc") and not shape.fill
    return f"{shape.style} {'outline' if outlined else shape.kind}"


# ----------------------------------------------------------------- kinds


def ring_of(points: Sequence[Point]) -> Path:
    """A closed outline through these points."""
    codes = [Path.MOVETO, *[Path.LINETO] * (len(points) - 1), Path.CLOSEPOLY]
    return Path(np.asarray([*points, points[0]]), codes)


def _poly(on: Sheet, shape: MapShape, values: ArtistValues) -> None:
    on.axes.add_patch(PathPatch(ring_of(shape.places), **values))


def _disc(on: Sheet, shape: MapShape, values: ArtistValues) -> None:
    for place in shape.places:
        on.axes.add_patch(Circle(place, shape.radius or 0.0, **values))


def _line(on: Sheet, shape: MapShape, values: ArtistValues) -> None:
    xs, ys = zip(*shape.places, strict=True)
    on.axes.plot(xs, ys, **values)


def _arrow(on: Sheet, shape: MapShape, values: ArtistValues) -> None:
    start, end = shape.places
    head = {"mutation_scale": 5.0 + 4.0 * values["lw"], **values}
    on.axes.add_patch(FancyArrowPatch(start, end, arrowstyle="-|>", shrinkA=0, shrinkB=0, **head))


def _text(on: Sheet, shape: MapShape, values: ArtistValues) -> None:  # noqa: ARG001
    colour, size = LETTERS[shape.style]
    text = on.axes.text(
        *shape.places[0], shape.text, color=colour, fontsize=size, ha="center", va="center",
        fontweight="bold", zorder=8.6, clip_on=True,
    )  # fmt: skip
    text.set_path_effects([withStroke(linewidth=1.6, foreground="white")])


def _cells(on: Sheet, shape: MapShape, values: ArtistValues) -> None:
    """The cells as the pixels of an image that is turned with them."""
    assert shape.cell is not None
    yaw, side = shape.yaw or 0.0, shape.cell
    c, s = math.cos(yaw), math.sin(yaw)
    places = np.asarray(shape.places) @ np.array([[c, -s], [s, c]])
    low = places.min(axis=0)
    column, row = np.rint((places - low) / side).astype(int).T
    image = np.zeros((row.max() + 1, column.max() + 1, 4))
    image[row, column] = _colours(shape)
    (x, y), (rows, columns) = low - 0.5 * side, image.shape[:2]
    on.axes.imshow(
        image, extent=(x, x + columns * side, y, y + rows * side), origin="lower",
        interpolation="none", transform=Affine2D().rotate(yaw) + on.axes.transData,
        aspect=on.axes.get_aspect(), clip_on=True, **values,
    )  # fmt: skip


def _colours(shape: MapShape) -> Any:
    """RGBA colours (n, 4): Chase cells from red to purple, costs the darker the higher."""
    weights = np.asarray(shape.weights)
    if shape.style == "chase":
        return BEST_FIRST(weights)
    return np.column_stack((np.tile(to_rgb(COSTS), (len(weights), 1)), 0.8 * weights))


_DRAWN: dict[str, Callable[[Sheet, MapShape, ArtistValues], None]] = {
    "poly": _poly,
    "disc": _disc,
    "line": _line,
    "dots": _line,
    "arrow": _arrow,
    "text": _text,
    "cells": _cells,
}


# ----------------------------------------------------------------- labels and legend


def _reserve(labels: Labels, shape: MapShape) -> None:
    """Request the label of a shape beside it, or keep labels off an arrow."""
    if shape.text and shape.kind != "text":
        places = np.asarray(shape.places)
        x, y = places.mean(axis=0).tolist()
        extent = 2.0 * shape.radius if shape.radius else 0.55 * math.dist(places[0], places[-1])
        labels.mark((x, y), 72.0 * labels.on.scale * extent, shape.text, *LETTERS[shape.style])
    elif shape.kind == "arrow":
        labels.keep_off(shape.places)


def _explain(on: Sheet, name: str, about: str) -> None:
    look, kind = LOOKS[name], name.rpartition(" ")[2]
    if name == "chase cells":
        on.explain(about, Rainbow(), RainbowHandler())
        return
    own = {key: value for key, value in look.drawn.items() if key not in _NO_SIGN}
    lines = kind in ("line", "arrow", "dots")
    values = {**own, **look.sign} if lines else look.sign or own
    on.explain(about, Patch(**values) if "fc" in values else Line2D([], [], **values))


_NO_SIGN = ("zorder", "mutation_scale", "path_effects")


class Rainbow(Patch):
    """The legend's sign for the colours of all cells."""


class RainbowHandler(HandlerBase):
    """Draws a `Rainbow` in a legend."""

    def create_artists(  # noqa: PLR0913
        self,
        legend: Any,  # noqa: ARG002  matplotlib passes it
        orig_handle: Any,  # noqa: ARG002
        xdescent: float,
        ydescent: float,
        width: float,
        height: float,
        fontsize: float,  # noqa: ARG002
        trans: Any,
    ) -> list[Artist]:
        """The strips of the sign, side by side."""
        count = 24
        strip = width / count
        return [
            Rectangle(
                (i * strip - xdescent, -ydescent), 1.05 * strip, height,
                facecolor=BEST_FIRST(i / (count - 1)), lw=0, transform=trans,
            )
            for i in range(count)
        ]  # fmt: skip
