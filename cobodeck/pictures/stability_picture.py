"""Errors and condition numbers of `bench stability` over what they depend on, a plot for each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from cobodeck.pictures.drawing import save_figure
from engine.draw import GREY, INK

COLUMNS, WIDTH_IN, HEIGHT_IN = 2, 6.0, 3.2
NONE = 1e-17
"""Where no error at all is drawn."""
ABOUT = {
    "offset_m": "distance of the origin, m",
    "stamp_s": "time since the clock began, s",
    "steps": "steps",
    "from_singular_rad": "distance from the singularity, rad",
    "angle_rad": "angle between the walls, rad",
    "variance_ratio": "ratio of the variances of two directions",
}
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f")


def draw_stability(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Draw one plot per knob and unit, with logarithmic axes; an error of 0 at `NONE`.

    Raises:
        Problem: the file's format is unknown.
    """
    plots: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        plots.setdefault((row["knob"], row["error_unit"]), []).append(row)
    height = math.ceil(len(plots) / COLUMNS)
    figure = Figure(figsize=(COLUMNS * WIDTH_IN, height * HEIGHT_IN), layout="constrained")
    places = figure.subplots(height, COLUMNS, squeeze=False).flat
    for axes, ((knob, unit), own) in zip(places, plots.items(), strict=False):
        own.sort(key=lambda row: (row["name"], row["variant"], row["value"]))
        lines = groupby(own, key=lambda row: (row["name"], row["variant"]))
        for colour, ((name, variant), line) in zip(COLOURS, lines, strict=False):
            points = [(row["value"], max(NONE, row["error"])) for row in line]
            label = name if variant == "cobodeck" else f"{name}, {variant}"
            axes.plot(
                *zip(*points, strict=True), "o-" if variant == "cobodeck" else "x--",
                color=colour, markersize=3.5, linewidth=1.0, label=label,
            )  # fmt: skip
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel(ABOUT[knob], color=INK, fontsize=8)
        axes.set_ylabel("condition number" if unit == "condition" else f"error, {unit}",
                        color=INK, fontsize=8)  # fmt: skip
        axes.tick_params(labelsize=7, colors=INK)
        axes.grid(visible=True, color=GREY, linewidth=0.3, alpha=0.5)
        axes.legend(frameon=False, fontsize=7, labelcolor=INK)
    for axes in places:
        axes.set_axis_off()
    save_figure(figure, path)
