"""What a parameter of a campaign changes: responses, contacts, failed Escapes and gaps."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cobodeck.pictures.drawing import save_figure
from engine.draw import GREY, INK

PANEL_IN = (3.4, 2.5)
Point = tuple[float, float, float]
"""A value with its bounds; NaN where there is none."""
NONE = (math.nan, math.nan, math.nan)
COLOR = "#1f5fa8"


def draw_parameter(parameter: Mapping[str, Any], path: Path) -> None:
    """Draw a table of a campaign's summary, with bounds of 95 %, to a file.

    Args:
        parameter: its `name`, and its `values` with a tally each.
        path: `X.svg`, `.png` or `.pdf`.

    Raises:
        Problem: there is no such format.
    """
    rows = parameter["values"]
    labels = [str(row["value"]) for row in rows]
    panels: dict[str, Callable[[Mapping[str, Any]], Point]] = {
        "response, s": lambda row: _point(row["response_s"], "mean", 1.0),
        "contacts, % of requests": lambda row: _share(row, "contacts"),
        "by the robot, % of requests": lambda row: _share(row, "contacts_by_robot"),
        "unserved, % of requests": lambda row: _share(row, "unserved"),
        "failed, % of Escapes": lambda row: _share(row, "escape_failures"),
        "least gap, m": lambda row: _gap(row["least_gap_m"]),
    }
    width, height = PANEL_IN
    figure = Figure(figsize=(3 * width, 2 * height), layout="constrained", facecolor="white")
    places = _places(labels)
    for axes, (title, read) in zip(figure.subplots(2, 3).flat, panels.items(), strict=True):
        _draw(axes, places, [read(row) for row in rows])
        axes.set_title(title, fontsize=9, color=INK)
        axes.set_xticks(places, labels)
        axes.set_xlabel(parameter["name"], fontsize=8, color=GREY)
        axes.tick_params(labelsize=8, colors=INK)
    save_figure(figure, path)


def _draw(axes: Axes, places: Sequence[float], points: Sequence[Point]) -> None:
    middles, lows, highs = zip(*points, strict=True)
    axes.vlines(places, lows, highs, color=COLOR, linewidth=1)
    axes.plot(places, lows, "_", places, highs, "_", color=COLOR, markersize=7)
    axes.plot(places, middles, "o", color=COLOR, markersize=4, clip_on=False, zorder=3)
    if all(map(math.isnan, middles)):
        axes.text(0.5, 0.5, "none", transform=axes.transAxes, ha="center", fontsize=9, color=GREY)
        axes.set_yticks([])
    axes.grid(visible=True, axis="y", color=GREY, linewidth=0.3, alpha=0.5)
    if not any(middle < 0.0 for middle in middles):  # gaps in contact
        axes.set_ylim(bottom=0.0)
    margin = 0.3 * min((b - a for a, b in pairwise(places)), default=1.0)
    axes.set_xlim(places[0] - margin, places[-1] + margin)


def _places(labels: Sequence[str]) -> list[float]:
    """Where values stand on the axis: to scale if all are rising numbers, else side by side."""
    with suppress(ValueError):
        numbers = [float(label) for label in labels]
        if all(a < b for a, b in pairwise(numbers)):
            return numbers
    return [float(n) for n in range(len(labels))]


def _gap(found: float | None) -> Point:
    return NONE if found is None else (found, found, found)


def _share(row: Mapping[str, Any], name: str) -> Point:
    return _point(row["shares"][name], "share", 100.0)


def _point(found: Mapping[str, float] | None, name: str, scale: float) -> Point:
    if found is None:
        return NONE
    return scale * found[name], scale * found["low"], scale * found["high"]
