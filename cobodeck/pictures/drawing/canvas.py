"""A sheet to draw a room on; the same picture always gives the same file, byte by byte."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from cobodeck.terminal import Problem
from engine.draw import GREY, INK

FORMS = ("svg", "png", "pdf")
METRE_IN = 0.62
"""Length of a metre on paper, inches; less for rooms that would not fit."""
LARGEST_IN = 9.0
LEGEND_IN = 2.75
NARROWEST_IN, ROOMY_IN = 9.0, 5.5
"""Least width, inches, of a sheet with something below the room, and of a room on such a sheet."""
DPI = 150
MOST_TICKS = 20

_MARGIN_M = 0.35
_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "svg.hashsalt": "cobodeck",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}
_UNDATED: dict[str, dict[str, Any]] = {
    "svg": {"Date": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Producer": None},
}


@dataclass(frozen=True)
class Sheet:
    """Axes in map coordinates, m, and the entries of the legend beside them, in order.

    `scale` is the length of a metre on paper, inches.
    """

    figure: Figure
    axes: Axes
    scale: float
    legend: dict[str, Artist] = field(default_factory=dict)
    handlers: dict[Any, Any] = field(default_factory=dict)

    def explain(self, text: str, sign: Artist, handler: Any = None) -> None:
        """Add an entry to the legend, once; a handler draws signs that matplotlib cannot draw."""
        self.legend.setdefault(text, sign)
        if handler is not None:
            self.handlers[type(sign)] = handler


def sheet(
    bounds: tuple[float, float, float, float],
    title: str,
    lines: Iterable[str],
    below_in: float = 0.0,
) -> Sheet:
    """An empty sheet for a room with these bounds, m, headed by a title and lines of text.

    `below_in`, inches, is left free below the room for drawings over the whole width.
    """
    x_low, y_low, x_high, y_high = bounds
    width, height = x_high - x_low + 2 * _MARGIN_M, y_high - y_low + 2 * _MARGIN_M
    largest = max(METRE_IN, ROOMY_IN / width) if below_in else METRE_IN
    scale = min(largest, LARGEST_IN / max(width, height))
    lines = list(lines)
    left, bottom, head = 0.5, 0.5 + below_in, 0.42 + 0.2 * len(lines)
    room_in = (width * scale, max(height * scale, 2.0))
    size = (
        max(left + room_in[0] + LEGEND_IN, NARROWEST_IN if below_in else 0.0),
        bottom + room_in[1] + head,
    )
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=size, facecolor="white")
        place = (
            left / size[0],
            bottom / size[1],
            room_in[0] / size[0],
            room_in[1] / size[1],
        )
        axes = figure.add_axes(place)
        axes.set_xlim(x_low - _MARGIN_M, x_high + _MARGIN_M)
        axes.set_ylim(y_low - _MARGIN_M, y_high + _MARGIN_M)
        axes.set_aspect("equal", anchor="SW")
        axes.autoscale(enable=False)
        _rule(axes, max(width, height))
        top = size[1] - 0.3
        _write(figure, left, top, title, fontsize=12, fontweight="bold", color=INK)
        for number, line in enumerate(lines):
            _write(figure, left, top - 0.2 * (number + 1), line, fontsize=8.5, color=GREY)
    return Sheet(figure, axes, scale)


def save(drawn: Sheet, path: Path) -> None:
    """Write the picture, in the format of the file's suffix.

    Raises:
        Problem: the suffix is none of `FORMS`.
    """
    with mpl.rc_context(_STYLE):
        if drawn.legend:
            _add_legend(drawn)
    save_figure(drawn.figure, path)


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure in the format of the file's suffix, the same bytes each time.

    Raises:
        Problem: there is no such format.
    """
    form = form_of(path)
    with mpl.rc_context(_STYLE):
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, format=form, dpi=DPI, metadata=_UNDATED[form])


def form_of(path: Path) -> str:
    """The format of a picture file, from its suffix.

    Raises:
        Problem: there is no such format.
    """
    from engine.files import did_you_mean

    form = path.suffix.removeprefix(".")
    if form not in FORMS:
        raise Problem(f"{path}: unknown form; {did_you_mean(form, FORMS)}")
    return form


def _rule(axes: Axes, extent: float) -> None:
    """Draw a scale in metres along two sides, and no frame."""
    for side in ("top", "right", "left", "bottom"):
        axes.spines[side].set_visible(False)
    step = next((step for step in (1, 2, 5, 10, 20, 50) if extent / step <= MOST_TICKS), 100)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(step))
    axes.tick_params(length=2.5, width=0.6, labelsize=7, colors=GREY)
    axes.set_xlabel("x, m", fontsize=7, color=GREY, loc="right", labelpad=2)
    axes.set_ylabel("y, m", fontsize=7, color=GREY, loc="top", labelpad=4)


def _write(figure: Figure, left: float, height: float, text: str, **style: Any) -> None:
    width, tall = figure.get_size_inches()
    figure.text(left / width, height / tall, text, va="baseline", ha="left", **style)


def _add_legend(drawn: Sheet) -> None:
    width = drawn.figure.get_figwidth()
    box = drawn.axes.get_position()
    drawn.figure.legend(
        handles=list(drawn.legend.values()),
        labels=list(drawn.legend),
        handler_map=drawn.handlers,
        loc="upper left",
        bbox_to_anchor=(box.x1 + 0.1 / width, box.y1),
        bbox_transform=drawn.figure.transFigure,
        fontsize=8,
        labelcolor=INK,
        frameon=False,
        handlelength=1.8,
        handleheight=1.1,
        labelspacing=0.75,
        borderaxespad=0.0,
    )
