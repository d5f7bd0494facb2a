"""Reach by height and distance: a square per pair, darker the more directions are reached."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from cobodeck.pictures.drawing import Sheet
from engine.draw import GREY, INK

if TYPE_CHECKING:
    from states.arm.planning import ReachTable

CELL_IN = (0.62, 0.32)
REACHED = LinearSegmentedColormap.from_list("reached", ["#ffffff", "#b2dfdb", "#00796b"])
PAPERS_BAND = (0.5, 1.6)
"""Range of heights that the paper names, m (R147)."""


def reach_picture(reach: ReachTable, title: str, line: str) -> Sheet:
    """A grid of squares, heights upwards, distances to the right."""
    rows, columns = reach.share.shape
    width, height = columns * CELL_IN[0], rows * CELL_IN[1]
    size = (max(width + 2.2, 6.2), height + 1.4)
    figure = Figure(figsize=size, facecolor="white")
    place = (0.75 / size[0], 0.55 / size[1], width / size[0], height / size[1])
    axes = figure.add_axes(place)
    axes.imshow(
        reach.share, origin="lower", cmap=REACHED, vmin=0.0, vmax=1.0, aspect="auto",
        interpolation="none",
    )  # fmt: skip
    _number(axes, reach)
    _rule(axes, reach)
    _mark_band(axes, reach)
    style: dict[str, Any] = {"x": 0.15 / size[0], "va": "baseline"}
    figure.text(y=1 - 0.3 / size[1], s=title, fontsize=11, fontweight="bold", color=INK, **style)
    figure.text(y=1 - 0.52 / size[1], s=line, fontsize=8.5, color=GREY, **style)
    return Sheet(figure, axes, CELL_IN[0])


def _number(axes: Any, reach: ReachTable) -> None:
    count = len(reach.angles)
    for (row, column), share in np.ndenumerate(reach.share):
        axes.text(
            column, row, f"{share * count:.0f}/{count}", ha="center", va="center", fontsize=8,
            color="white" if share > 0.7 else INK if share > 0.0 else GREY,
        )  # fmt: skip


def _rule(axes: Any, reach: ReachTable) -> None:
    axes.set_xticks(range(len(reach.distances)), [f"{d:g}" for d in reach.distances])
    axes.set_yticks(range(len(reach.heights)), [f"{h:g}" for h in reach.heights])
    axes.set_xlabel("rover's centre from the DEEP, m", fontsize=8, color=GREY)
    axes.set_ylabel("height of the DEEP, m", fontsize=8, color=GREY)
    axes.tick_params(length=0, labelsize=8, colors=INK)
    for side in axes.spines.values():
        side.set_visible(False)


def _mark_band(axes: Any, reach: ReachTable) -> None:
    """Lines at both ends of the paper's range of heights."""
    for edge in PAPERS_BAND:
        for row, (below, above) in enumerate(pairwise(reach.heights)):
            low = edge == PAPERS_BAND[0]
            if below < edge - 1e-9 <= above if low else below <= edge + 1e-9 < above:
                axes.axhline(row + 0.5, color=INK, lw=1.0, ls=(0, (4, 2.5)))
                words = f"paper: {'from' if low else 'up to'} {edge:g} m"
                axes.annotate(
                    words, (1.0, row + 0.5), (6, 0), xycoords=("axes fraction", "data"),
                    textcoords="offset points", fontsize=8, va="center", color=INK,
                    annotation_clip=False,
                )  # fmt: skip
