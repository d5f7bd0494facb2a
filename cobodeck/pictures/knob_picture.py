"""What many runs come to over several knobs: a column for each knob, a row for each figure."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from cobodeck.pictures.drawing import save_figure
from engine.draw import GREY, INK

Bounded = tuple[float, float, float]
"""A figure with its lower and upper bound; NaN where there is none."""
ReadBounded = Callable[[Mapping[str, Any]], Bounded]
PLACE_IN, MARGIN_IN, ROW_IN = 0.36, 0.4, 1.4
COLOUR, OURS = "#1f5fa8", "#e8edf3"
ROOM = 0.08
"""Share of an axis that stays free at both of its ends."""


def draw_knobs(
    knobs: Sequence[Mapping[str, Any]],
    figures: Mapping[str, ReadBounded],
    note: str,
    path: Path,
    logarithmic: Container[str] = (),
) -> None:
    """Draw every figure of every knob's values, with bounds, to a file; what is ours is shaded.

    Args:
        knobs: each with its `title`, the value that is `ours`, and its `values`, which are read.
        figures: what to read, by the title of the row.
        note: stands above.
        path: `X.svg`, `.png` or `.pdf`.
        logarithmic: titles of rows whose axis is.

    Raises:
        Problem: there is no such format.
    """
    counts = [len(knob["values"]) for knob in knobs]
    size = PLACE_IN * sum(counts) + MARGIN_IN * (len(knobs) + 1), ROW_IN * len(figures) + 1.2
    figure = Figure(figsize=size, layout="constrained", facecolor="white")
    panels = figure.subplots(
        len(figures), len(knobs), sharex="col", sharey="row", squeeze=False, width_ratios=counts
    )
    for column, knob in enumerate(knobs):
        for row, read in enumerate(figures.values()):
            _draw(panels[row, column], knob, read)
            panels[row, column].label_outer(remove_inner_ticks=True)
        panels[0, column].set_title(knob["title"], fontsize=8, color=INK)
        names = [row["value"] for row in knob["values"]]
        panels[-1, column].set_xticks(range(len(names)), names, rotation=60, ha="right",
                                      rotation_mode="anchor", fontsize=7)  # fmt: skip
    for row, title in enumerate(figures):
        panels[row, 0].set_ylabel(title, fontsize=8, color=INK)
        if title in logarithmic:
            panels[row, 0].set_yscale("log")
            panels[row, 0].yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            panels[row, 0].yaxis.set_major_formatter("{x:g}")
            panels[row, 0].yaxis.set_minor_formatter(NullFormatter())
        else:
            for panel in panels[row]:
                panel.axhline(0.0, color=GREY, linewidth=0.6, zorder=1)
    figure.align_ylabels(panels[:, 0])
    figure.suptitle(note, fontsize=8, color=GREY, x=0.01, ha="left")
    save_figure(figure, path)


def _draw(axes: Axes, knob: Mapping[str, Any], read: ReadBounded) -> None:
    points = [read(row) for row in knob["values"]]
    middles = [middle for middle, _, _ in points]
    bounds = ([m - low for m, low, _ in points], [high - m for m, _, high in points])
    for place, row in enumerate(knob["values"]):
        if row["value"] == knob["ours"]:
            axes.axvspan(place - 0.5, place + 0.5, color=OURS, linewidth=0)
    axes.errorbar(
        range(len(points)), middles, yerr=bounds, fmt="o", markersize=3.5, capsize=0,
        linewidth=1.2, color=COLOUR, zorder=3,
    )  # fmt: skip
    axes.grid(visible=True, axis="y", color=GREY, linewidth=0.3, alpha=0.5)
    axes.margins(y=ROOM)
    for spine in axes.spines.values():
        spine.set(color=GREY, linewidth=0.5)
    axes.set_xlim(-0.6, len(points) - 0.4)
    axes.tick_params(labelsize=7, colors=INK, length=2)
    if all(map(math.isnan, middles)):
        axes.text(0.5, 0.5, "none", transform=axes.transAxes, ha="center", fontsize=8, color=GREY)
